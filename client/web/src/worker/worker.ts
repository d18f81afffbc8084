// The worker: network, decoding and checking, away from the page's frames.
import {MeshoptDecoder} from 'three/examples/jsm/libs/meshopt_decoder.module.js';

import type {FromWorker, ToWorker} from '../shared/messages.js';
import {Session} from './session.js';

const post = (message: FromWorker, transfer: Transferable[] = []): void => self.postMessage(message, {transfer});

// 4:4:4 keeps saturated detail; whether a decoder takes it is known by asking. Here: the page is making its own ready.
async function takes444(): Promise<boolean> {
  try {
    return (await VideoDecoder.isConfigSupported({codec: 'avc1.f40033', optimizeForLatency: true})).supported === true;
  } catch {
    return false;
  }
}

const chroma444 = takes444();
let session: Promise<Session> | null = null;

function take(to: Session, m: Exclude<ToWorker, {type: 'open'}>): void {
  if (m.type === 'camera') {
    to.camera(m.pose, m.atUs);
  } else if (m.type === 'shown') {
    to.shown(m.frame, m.drawUs);
  } else if (m.type === 'key frames') {
    to.askForKeys();
  } else if (m.type === 'recycle') {
    to.recycle(m.buffer);
  } else if (m.type === 'resume') {
    to.resume();
  } else {
    to.close();
  }
}

self.onmessage = (event: MessageEvent<ToWorker>) => {
  const m = event.data;
  if (m.type === 'open') {
    session = chroma444.then((can) => new Session(m.url, m.name, can, m.pose, post, MeshoptDecoder.ready));
  } else {
    void session?.then((to) => take(to, m));
  }
};
