// The worker: network, decoding and checking, away from the page's frames.
import {MeshoptDecoder} from 'three/examples/jsm/libs/meshopt_decoder.module.js';

import type {FromWorker, ToWorker} from '../shared/messages.js';
import {Session} from './session.js';

let session: Session | null = null;

const post = (message: FromWorker, transfer: Transferable[] = []): void => self.postMessage(message, {transfer});

self.onmessage = (event: MessageEvent<ToWorker>) => {
  const m = event.data;
  if (m.type === 'open') {
    session = new Session(m.url, m.name, m.chroma444, m.pose, post, MeshoptDecoder.ready);
  } else if (session === null) {
    return;
  } else if (m.type === 'camera') {
    session.camera(m.pose, m.atUs);
  } else if (m.type === 'shown') {
    session.shown(m.frame, m.drawUs);
  } else if (m.type === 'key frames') {
    session.askForKeys();
  } else if (m.type === 'recycle') {
    session.recycle(m.buffer);
  } else if (m.type === 'resume') {
    session.resume();
  } else {
    session.close();
  }
};
