// The page's first script, small: says what is missing, starts the worker, and has the rest loaded meanwhile.
import {kStreamPath} from '../shared/limits.js';
import type {FromWorker, Pose, ToWorker} from '../shared/messages.js';
import {fromHash} from './link.js';
import {toPose} from './camera.js';
import {kWalkingIn, Notices} from './notices.js';
import {whatIsMissing} from './requirements.js';
import {askHttpsPort} from './secure_way.js';

declare const WORKER_NAME: string;  // the worker's file, by tools/build.mjs

function element(id: string): HTMLElement {
  const found = document.getElementById(id);
  if (found === null) throw new Error(`the page has no element ${id}`);
  return found;
}

// 4:4:4 keeps saturated detail; whether a decoder takes it is known by asking.
async function takes444(): Promise<boolean> {
  try {
    return (await VideoDecoder.isConfigSupported({codec: 'avc1.f40033', optimizeForLatency: true})).supported === true;
  } catch {
    return false;
  }
}

function devicePixels(): {width: number; height: number} {
  const ratio = window.devicePixelRatio || 1;
  return {width: Math.max(1, Math.round(window.innerWidth * ratio)),
    height: Math.max(1, Math.round(window.innerHeight * ratio))};
}

async function start(): Promise<void> {
  const notices = new Notices(element('notice'), element('alert'));
  const canvas = element('scene') as HTMLCanvasElement;
  const gl = canvas.getContext('webgl2', {alpha: false, antialias: false, depth: false, stencil: false,
    powerPreference: 'high-performance'});
  const secure = window.isSecureContext;
  const missing = whatIsMissing({secure, webCodecs: 'VideoDecoder' in window, webGl2: gl !== null,
    webAssembly: typeof WebAssembly === 'object', href: location.href,
    httpsPort: secure ? null : await askHttpsPort(location.href)});
  if (missing !== null || gl === null) {
    element('stage').hidden = true;  // nothing in it can be used
    if (missing !== null) notices.alert(missing);
    return;
  }
  notices.quiet(kWalkingIn);
  const linked = fromHash(location.hash);
  const {width, height} = devicePixels();
  const pose: Pose | null = linked ? toPose(linked, width, height) : null;
  const worker = new Worker(new URL(WORKER_NAME, import.meta.url), {type: 'module', name: 'darm stream'});
  worker.onerror = () => notices.alert({text: "The page's stream could not start: please reload it.", reload: true});
  // What comes before the rest of the page is there waits here.
  const early: FromWorker[] = [];
  worker.onmessage = (event: MessageEvent<FromWorker>) => early.push(event.data);
  const url = new URL(kStreamPath, location.href);
  url.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:';
  url.hash = '';
  const open = (chroma444: boolean): void => worker.postMessage(
    {type: 'open', url: url.href, name: 'darm-web 0.1.0', chroma444, pose} satisfies ToWorker);
  const [{Visit}] = await Promise.all([import('./visit.js'), takes444().then(open)]);
  new Visit(canvas, gl, worker, notices, linked, early);
}

start().catch((error: unknown) => {
  element('stage').hidden = true;
  const alert = element('alert');
  alert.textContent = `The page could not start (${String(error)}): please reload it.`;
  alert.hidden = false;
});
