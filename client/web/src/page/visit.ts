// One visit: ties the stream, the renderer, the camera and the page's few buttons together.
import type {Answer, FromWorker, LagStages, OutReason, Pose, ToWorker, Traffic, ViewErrors} from '../shared/messages.js';
import type {Chunk, FrameUpdate, Planes, SceneShape, StreamShape} from '../shared/scene.js';
import type {ButtonsOwner} from './buttons.js';
import {Buttons} from './buttons.js';
import type {View} from './camera.js';
import {forward, fromPose, right, toPose, up} from './camera.js';
import {DrawTimer} from './draw_timer.js';
import type {Gl} from './gl_resources.js';
import {Help} from './help.js';
import type {InputOwner} from './input.js';
import {Input} from './input.js';
import {fromHash, isBroken, toHash} from './link.js';
import {kBrokenLink, kWalkingIn} from './notices.js';
import type {Notices} from './notices.js';
import {Panel} from './panel.js';
import {pick} from './pick.js';
import type {PresenceOwner} from './presence.js';
import {watchPresence} from './presence.js';
import {FrameGuard, kUnknownDevice} from './quality.js';
import {Renderer} from './renderer.js';
import type {Residency} from './residency.js';
import {ResidencyCounter} from './residency.js';
import {Rig, minus, plus, scaled} from './rig.js';

const kLostLine = 'Connection lost; the picture stays. Trying again…';
const kStillAfterMs = 150;
const kLinkAfterMs = 400;
/** Seconds that a hand moves the view in one step: the first after a rest, and at most. */
const kFirstStep = 0.016;
const kLongestStep = 0.25;
const kPanelEveryMs = 500;
/** A graphics driver that was reset is back by then, or not at all. */
const kRestoreMs = 15_000;

/** For scripts and tests: `window.darm.status()`. */
export interface Status {
  firstPictureMs: number | null;
  bytesToFirstPicture: number | null;
  /** The same by kind; the rest is the protocol's. */
  firstPictureBytes: {geometry: number; coarse: number; stream: number} | null;
  framesDrawn: number;
  streamFrames: number;
  finest: boolean;
  joined: boolean;
  joins: number;
  mode: string;
  view: View | null;
  error: number | null;
  resolutionError: number;
  omittedError: number;
  lagMs: number | null;
  /** What it is made of. */
  lagStages: (LagStages & {display: number}) | null;
  residency: Residency | null;
  /** Bytes of messages so far. */
  received: number;
  /** Milliseconds of the newest picture and of the newest frame of the stream; `level` is the frame-rate guard's. */
  cost: Cost;
}

export interface Cost {
  drawMs: number;
  decodeMs: number;
  /** Until the GL had copied planes, slots and table rows; what it then does with them is in the next `drawMs`. */
  uploadMs: number;
  level: number;
}

export class Visit implements InputOwner, ButtonsOwner, PresenceOwner {
  rig: Rig;
  private readonly input: Input;
  private readonly panel: Panel;
  private readonly buttons: Buttons;
  private readonly guard = new FrameGuard();
  private readonly timer: DrawTimer;
  private counter: ResidencyCounter;
  private renderer: Renderer | null = null;
  private scene: SceneShape | null = null;
  private start: Pose | null = null;  // where the server's scene is entered
  private shape: StreamShape = {size: 0, viewSize: 0};
  private shapeNew = false;
  private chunks: Chunk[] = [];
  private chunksInView = 0;
  private coarse: Planes | null = null;
  private away = false;  // of its own accord: nothing is lost
  private placedView: boolean;  // by the link or by hand: the server's start does not move it
  private loop = 0;
  private dirty = true;
  private refined = false;
  private movedAt = -Infinity;
  private lastTick = 0;
  private rested = true;
  private cameraAt = -Infinity;
  private cameraDirty = true;
  private cameraEveryMs = 50;
  private answer: Answer | null = null;  // the newest camera whose picture is not on the screen yet
  private panelAt = 0;
  private streamBytes: {at: number; bytes: number}[] = [];
  private traffic: Traffic = {received: 0, stream: 0, geometry: 0, coarse: 0, decodeMs: 0,
    framesLost: 0};
  private residency: Residency | null = null;
  private status: Status = {firstPictureMs: null, bytesToFirstPicture: null, firstPictureBytes: null, framesDrawn: 0, streamFrames: 0,
    finest: false, joined: false, joins: 0, mode: 'walk', view: null, error: null, resolutionError: 0, omittedError: 0, lagMs: null, lagStages: null, residency: null,
    received: 0, cost: {drawMs: 0, decodeMs: 0, uploadMs: 0, level: 0}};
  private uploadMs = 0;
  private restoreTimer = 0;
  private shownFrame = 0;
  private linkTimer = 0;
  private readonly linkBroken = isBroken(location.hash);  // said once there is a picture

  constructor(private readonly canvas: HTMLCanvasElement, private readonly gl: Gl, private readonly worker: Worker,
              private readonly notices: Notices, linked: View | null, early: FromWorker[]) {
    this.placedView = linked !== null;
    const calm = matchMedia('(prefers-reduced-motion: reduce)');
    this.rig = new Rig(linked ?? {position: [0, 0, 0], yaw: 0, pitch: 0, fovy: 0.87},
                       {low: [-1, -1, -1], high: [1, 1, 1]}, !calm.matches);
    calm.addEventListener('change', () => (this.rig.easing = !calm.matches));
    this.timer = new DrawTimer(gl);
    this.counter = new ResidencyCounter(gl);
    this.input = new Input(canvas, this);
    this.panel = new Panel(document.getElementById('panel')!, document.getElementById('show-panel')!);
    const help = new Help(document.getElementById('help') as HTMLDialogElement, document.getElementById('show-help')!);
    this.buttons = new Buttons(this, help, notices);
    window.addEventListener('resize', () => this.redraw());
    window.addEventListener('hashchange', () => this.followLink());
    watchPresence(this);
    canvas.addEventListener('webglcontextlost', (e) => {
      e.preventDefault();
      this.loseGraphics();
    });
    canvas.addEventListener('webglcontextrestored', () => this.restore());
    Object.assign(window, {darm: {status: (): Status => ({...this.status, view: this.rig.view, mode: this.rig.mode,
      residency: this.residency, received: this.traffic.received, cost: this.cost()})}});
    for (const message of early) this.take(message);
    worker.onmessage = (event: MessageEvent<FromWorker>) => this.take(event.data);
    this.wake();
  }

  moved(): void {
    this.movedAt = performance.now();
    if (this.status.joins > 0) this.placedView = true;  // whoever cannot wait begins at the start all the same
    this.cameraDirty = true;
    this.redraw();
  }

  pickPivot(x: number, y: number): void {
    if (this.renderer === null || this.scene === null) return;
    const {view} = this.rig;
    const half = Math.tan(view.fovy / 2);
    const height = this.canvas.clientHeight || 1;
    const nx = ((2 * x - this.canvas.clientWidth) / height) * half;
    const ny = (1 - (2 * y) / height) * half;
    const ray = plus(plus(forward(view), scaled(right(view), nx)), scaled(up(view), ny));
    const unit = scaled(ray, 1 / Math.hypot(...ray));
    const distance = pick(this.renderer.placed, minus(view.position, this.scene.origin), unit);
    if (distance !== null) this.rig.pivot = plus(view.position, scaled(unit, distance));
  }

  // ---- coming and going ----------------------------------------------------------------------------------------------

  sceneIsHere(): boolean {
    return this.scene !== null && this.chunks.length >= this.scene.chunkCount;
  }

  leave(): void {
    this.away = true;
    this.status.joined = false;
    this.say({type: 'close'});
  }

  comeBack(): void {
    this.say({type: 'resume'});
    this.redraw();
  }

  private say(message: ToWorker, transfer: Transferable[] = []): void {
    this.worker.postMessage(message, transfer);
  }

  // ---- what the stream brings ----------------------------------------------------------------------------------------

  private take(m: FromWorker): void {
    switch (m.type) {
      case 'joined': return this.join(m);
      case 'scene': return this.beginScene(m.scene);
      case 'chunk':
        this.chunks.push(m.chunk);
        this.renderer?.addChunk(m.chunk);
        return this.redraw();
      case 'coarse':
        this.coarse = m.picture;
        this.renderer?.putCoarse(m.picture);
        return this.redraw();
      case 'frame':
        this.noteErrors(m.errors);
        return this.takeFrame(m.update, m.answer);
      case 'answer':
        return this.noteErrors(m.errors);
      case 'traffic': return this.noteTraffic(m.traffic);
      case 'out': return this.out(m.reason, m.text, m.retryMs);
    }
  }

  private join(m: Extract<FromWorker, {type: 'joined'}>): void {
    this.notices.quiet(this.status.firstPictureMs === null ? kWalkingIn : '');
    if (this.status.joins > 0 && !this.away) this.notices.quiet('Connected again.', 3);
    this.notices.calm();
    this.away = false;
    ++this.status.joins;
    this.status.joined = true;
    this.shapeNew = m.shape.size !== this.shape.size || m.shape.viewSize !== this.shape.viewSize;
    this.shape = m.shape;
    this.chunksInView = m.chunksInView;
    this.cameraEveryMs = 1000 / Math.min(60, Math.max(5, 2 * m.updatesPerSecond));
    this.start = m.start;
    if (!this.placedView) this.rig.view = fromPose(m.start);
    this.answer = null;
    this.cameraDirty = true;
    this.redraw();
    // The same scene with slots of another size: the renderer is made anew, the geometry is here.
    if (m.sceneKnown && this.shapeNew && this.scene !== null) this.makeRenderer(this.scene);
  }

  private beginScene(scene: SceneShape): void {
    const other = this.scene !== null && this.scene.name !== scene.name;
    this.scene = scene;
    this.chunks = [];
    this.coarse = null;
    this.status.finest = false;  // there is no picture of it to keep
    document.title = scene.name ? `${scene.name} – DARM` : 'DARM';
    const {mode, pivot} = this.rig;
    const bounds = {low: plus(scene.low, scene.origin), high: plus(scene.high, scene.origin)};
    this.rig.setBounds(bounds);
    if (other && this.start !== null) {
      // Where the visitor stood is a place of the scene before.
      this.goToStart();
      this.rig.setBounds(bounds);
      this.notices.quiet('Another scene is shown here now.', 5);
    } else if (this.status.joins > 1) {
      Object.assign(this.rig, {mode, pivot});
    }
    this.buttons.showMode(this.rig.mode);
    this.makeRenderer(scene);
  }

  private makeRenderer(scene: SceneShape): void {
    if (this.gl.isContextLost()) return;  // restore() does it
    try {
      this.renderer = new Renderer(this.gl, scene, this.shape);
      for (const chunk of this.chunks) this.renderer.addChunk(chunk);
      if (this.coarse) this.renderer.putCoarse(this.coarse);
      this.buttons.offer(true);
    } catch (error) {
      this.failToDraw(error);
    }
    this.redraw();
  }

  private failToDraw(error: unknown): void {
    this.renderer = null;
    this.buttons.offer(false);
    const why = error instanceof Error ? error.message : String(error);
    this.notices.alert({text: `The scene cannot be drawn here (${why}): please try another browser or device.`});
  }

  private loseGraphics(): void {
    this.renderer = null;
    this.notices.quiet('The graphics driver was reset; the picture comes back by itself.');
    this.restoreTimer = window.setTimeout(
      () => this.notices.alert({text: 'The graphics driver does not come back: please reload the page.', reload: true}),
      kRestoreMs);
  }

  private restore(): void {
    clearTimeout(this.restoreTimer);
    this.timer.forget();
    this.counter = new ResidencyCounter(this.gl);
    if (this.scene !== null) this.makeRenderer(this.scene);
    this.say({type: 'key frames'});
    this.notices.calm();
    this.notices.quiet(this.status.joined || this.away ? '' : kLostLine);
  }

  private noteErrors(errors: ViewErrors | null): void {
    if (errors === null) return;
    Object.assign(this.status, {error: errors.light, resolutionError: errors.resolution, omittedError: errors.omitted});
  }

  private takeFrame(update: FrameUpdate, answer: Answer | null): void {
    const before = performance.now();
    this.renderer?.apply(update);
    this.uploadMs = performance.now() - before;
    if (update.picture !== null) this.say({type: 'recycle', buffer: update.picture.buffer}, [update.picture.buffer]);
    if (update.layer === 'shared') this.shownFrame = update.frame;
    ++this.status.streamFrames;
    if (answer !== null) this.answer = answer;
    this.redraw();
  }

  private noteTraffic(traffic: Traffic): void {
    this.traffic = traffic;
    const at = performance.now();
    this.streamBytes.push({at, bytes: traffic.stream});
    while (this.streamBytes.length > 2 && at - this.streamBytes[0]!.at > 4000) this.streamBytes.shift();
    if (this.panel.open) this.wake();
  }

  private out(reason: OutReason, text: string, retryMs: number): void {
    this.status.joined = false;
    this.away = false;
    if (retryMs < 0) this.buttons.offer(this.status.firstPictureMs !== null && this.renderer !== null);
    if (reason === 'lost') {
      this.notices.calm();
      this.notices.quiet(this.renderer === null ? `${text} Trying again…` : kLostLine);
    } else if (reason === 'full') {
      const again = ` It is tried again in ${Math.round(retryMs / 1000)} s: please wait, or come back later.`;
      if (this.renderer === null) this.notices.alert({text: text + again});
      else this.notices.quiet(text + again);
    } else if (reason === 'version') {
      this.notices.alert({text: `${text} Please reload the page.`, reload: true});
    } else if (reason === 'decoder') {
      const out = 'please use another browser';
      this.notices.alert({text: `This browser's decoder does not take the picture (${text}): ${out}.`});
    } else {
      this.notices.alert({text: `${text} Please reload the page.`, reload: true});
    }
  }

  // ---- drawing -------------------------------------------------------------------------------------------------------

  private redraw(): void {
    this.dirty = true;
    this.refined = false;
    this.wake();
  }

  private wake(): void {
    if (this.loop === 0) this.loop = requestAnimationFrame((now) => this.tick(now));
  }

  private tick(now: number): void {
    this.loop = 0;
    // After a rest the time since the last tick says nothing; a slow device walks no slower than a quick one.
    const seconds = this.rested ? kFirstStep : Math.min(kLongestStep, Math.max(0, (now - this.lastTick) / 1000));
    this.lastTick = now;
    if (this.input.advance(seconds)) this.moved();
    const moving = performance.now() - this.movedAt < kStillAfterMs;
    const done = this.timer.poll();
    if (done !== null) {
      this.guard.note(done.quality, done.ms, performance.now());
      this.noteDrawn();
    }
    this.sendCamera();
    if (this.renderer !== null && !this.timer.busy) this.drawIfDue(moving);
    this.countIfDue();
    this.updatePanel(now, moving);
    if (this.dirty || !this.refined || moving || this.timer.busy || this.cameraDirty || this.counter.busy ||
        this.input.polls || this.rig.moving) this.wake();
    this.rested = this.loop === 0;
  }

  private drawIfDue(moving: boolean): void {
    const renderer = this.renderer!;
    const {width, height} = this.fitCanvas();
    const finest = !moving && this.guard.mayRefine(performance.now());
    // How fast the device is shows with the first pictures: those until the scene is whole are cheap on any.
    const whole = this.status.firstPictureMs !== null;
    const quality = !whole ? kUnknownDevice : finest ? this.guard.finest : this.guard.moving;
    if (!this.dirty && (this.refined || quality !== this.guard.finest)) return;
    // A still view that cannot be refined yet keeps its finest picture rather than fall back to a coarser one.
    if (!moving && !finest && this.status.finest && this.guard.level > 0) return;
    this.timer.start(quality);
    try {
      renderer.draw(this.rig.view, width, height, quality);
    } catch (error) {
      return this.failToDraw(error);
    }
    this.timer.end();
    this.dirty = false;
    this.refined = quality === this.guard.finest;
    this.status.finest = this.refined;
    ++this.status.framesDrawn;
    this.noteFirst(renderer);
  }

  private fitCanvas(): {width: number; height: number} {
    const ratio = window.devicePixelRatio || 1;
    const width = Math.max(1, Math.min(16384, Math.round(this.canvas.clientWidth * ratio)));
    const height = Math.max(1, Math.min(16384, Math.round(this.canvas.clientHeight * ratio)));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
      this.cameraDirty = true;
      this.dirty = true;
    }
    return {width, height};
  }

  private noteFirst(renderer: Renderer): void {
    if (this.status.firstPictureMs !== null || !renderer.textures.hasCoarse) return;
    if (this.chunks.length < Math.min(this.scene?.chunkCount ?? Infinity, this.chunksInView)) return;
    const {geometry, coarse, stream} = this.traffic;
    this.status.firstPictureMs = performance.now();
    this.status.bytesToFirstPicture = this.traffic.received;
    this.status.firstPictureBytes = {geometry, coarse, stream: stream - coarse};
    performance.mark('darm first picture');
    if (this.status.joined) this.notices.quiet('');
    if (this.linkBroken) this.notices.quiet(kBrokenLink, 8);
  }

  private noteDrawn(): void {
    this.noteLag();
    if (this.shownFrame > 0 && this.status.joined) {
      this.say({type: 'shown', frame: this.shownFrame, drawUs: this.timer.lastMs * 1000});
      this.shownFrame = 0;
    }
  }

  private cost(): Cost {
    return {drawMs: this.timer.lastMs, decodeMs: this.traffic.decodeMs, uploadMs: this.uploadMs, level: this.guard.level};
  }

  private noteLag(): void {
    if (this.answer === null) return;
    const now = performance.timeOrigin + performance.now();
    this.status.lagMs = now - this.answer.sentUs / 1000;
    this.status.lagStages = {...this.answer.stages, display: now - this.answer.decodedUs / 1000};
    this.answer = null;
  }

  private sendCamera(): void {
    const now = performance.now();
    if (!this.cameraDirty || !this.status.joined || now - this.cameraAt < this.cameraEveryMs) return;
    const {width, height} = this.fitCanvas();
    this.cameraAt = now;
    this.cameraDirty = false;
    this.say({type: 'camera', pose: toPose(this.rig.view, width, height), atUs: (performance.timeOrigin + now) * 1000});
    clearTimeout(this.linkTimer);
    if (this.placedView) this.linkTimer = window.setTimeout(() => this.writeLink(), kLinkAfterMs);
  }

  private countIfDue(): void {
    const counted = this.counter.take();
    if (counted !== null) this.residency = counted;
  }

  private updatePanel(now: number, moving: boolean): void {
    if (!this.panel.open || now - this.panelAt < kPanelEveryMs) return;
    this.panelAt = now;
    if (this.renderer !== null && !this.counter.busy && !this.timer.busy) {
      const {width, height} = this.fitCanvas();
      this.counter.start(this.renderer, this.rig.view, width, height);
    }
    const first = this.streamBytes[0];
    const last = this.streamBytes.at(-1);
    const span = first && last ? last.at - first.at : 0;
    this.panel.update({
      framesPerSecond: moving ? this.timer.framesPerSecond : null, drawMs: this.timer.lastMs, level: this.guard.level,
      bitsPerSecond: span > 0 ? ((last!.bytes - first!.bytes) * 8000) / span : 0, traffic: this.traffic,
      lagMs: this.status.lagMs, lagStages: this.status.lagStages, residency: this.residency, error: this.status.error,
      resolutionError: this.status.resolutionError, omittedError: this.status.omittedError, seconds: now / 1000});
  }

  // ---- what buttons and keys ask for ---------------------------------------------------------------------------------

  togglePanel(): void {
    this.panel.show(!this.panel.open);
    this.panelAt = 0;
    this.wake();
  }

  toggleMode(): void {
    this.rig.mode = this.rig.mode === 'walk' ? 'orbit' : 'walk';
    if (this.rig.mode === 'orbit') this.pickPivot(this.canvas.clientWidth / 2, this.canvas.clientHeight / 2);
    this.buttons.showMode(this.rig.mode);
  }

  /** Back to where the scene is entered. */
  goToStart(): void {
    if (this.start === null) return;
    this.rig.stop();
    this.rig.view = fromPose(this.start);
    this.moved();
  }

  writeLink(): void {
    history.replaceState(null, '', toHash(this.rig.view));
  }

  private followLink(): void {
    const view = fromHash(location.hash);
    if (view === null) return isBroken(location.hash) ? this.notices.quiet(kBrokenLink, 8) : undefined;
    this.rig.stop();
    this.rig.view = view;
    this.placedView = true;
    this.moved();
  }
}

