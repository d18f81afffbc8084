// The page's first script, small: says what is missing, starts the worker, and has the rest loaded meanwhile.
import {kStreamPath} from '../shared/limits.js';
import type {FromWorker, ToWorker} from '../shared/messages.js';
import {fromHash} from './link.js';
import {toPose, type View} from './camera.js';
import {kWalkingIn, Notices} from './notices.js';
import {whatIsMissing} from './requirements.js';
import {askHttpsPort} from './secure_way.js';

const kNoStream = "The page's stream could not start: please reload it.";

declare const WORKER_NAME: string;  // the worker's file, by tools/build.mjs

function element(id: string): HTMLElement {
  const found = document.getElementById(id);
  if (found === null) throw new Error(`the page has no element ${id}`);
  return found;
}

function devicePixels(): {width: number; height: number} {
  const ratio = window.devicePixelRatio || 1;
  return {width: Math.max(1, Math.round(window.innerWidth * ratio)),
    height: Math.max(1, Math.round(window.innerHeight * ratio))};
}

function streamUrl(): string {
  const url = new URL(kStreamPath, location.href);
  url.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:';
  url.hash = '';
  return url.href;
}

function startWorker(linked: View | null, early: FromWorker[]): Worker {
  const worker = new Worker(new URL(WORKER_NAME, import.meta.url), {type: 'module', name: 'darm stream'});
  worker.onmessage = (event: MessageEvent<FromWorker>) => early.push(event.data);
  const {width, height} = devicePixels();
  const pose = linked ? toPose(linked, width, height) : null;
  worker.postMessage({type: 'open', url: streamUrl(), name: 'darm-web 0.1.0', pose} satisfies ToWorker);
  return worker;
}

async function start(): Promise<void> {
  const notices = new Notices(element('notice'), element('alert'));
  const secure = window.isSecureContext;
  const webCodecs = 'VideoDecoder' in window;
  const linked = fromHash(location.hash);
  const early: FromWorker[] = [];  // what comes before the rest of the page is there
  // Making WebGL ready can block for a quarter of a second: the worker, which needs only the decoder, starts beside it.
  const worker = webCodecs ? startWorker(linked, early) : null;
  if (worker) worker.onerror = () => notices.alert({text: kNoStream, reload: true});
  const canvas = element('scene') as HTMLCanvasElement;
  const gl = canvas.getContext('webgl2', {alpha: false, antialias: false, depth: false, stencil: false,
    powerPreference: 'high-performance'});
  const missing = whatIsMissing({secure, webCodecs, webGl2: gl !== null, webAssembly: typeof WebAssembly === 'object',
    href: location.href, httpsPort: secure ? null : await askHttpsPort(location.href)});
  if (missing !== null || gl === null || worker === null) {
    worker?.terminate();
    element('stage').hidden = true;  // nothing in it can be used
    if (missing !== null) notices.alert(missing);
    return;
  }
  notices.quiet(kWalkingIn);
  const {Visit} = await import('./visit.js');
  new Visit(canvas, gl, worker, notices, linked, early);
}

start().catch((error: unknown) => {
  element('stage').hidden = true;
  const alert = element('alert');
  alert.textContent = `The page could not start (${String(error)}): please reload it.`;
  alert.hidden = false;
});
