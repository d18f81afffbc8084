// One page's session: says Hello, takes what comes in order, and hands it to the page ready to upload.
import {create} from '@bufbuild/protobuf';

import {CameraUpdateSchema, FeedbackSchema, HelloSchema, PoseSchema} from '../gen/darm_pb.js';
import type {CoarseTexture, SceneManifest, StreamFrame, Welcome} from '../gen/darm_pb.js';
import {kMaxPhysTex, kMaxViewPhysTex, kProtocolVersion} from '../shared/limits.js';
import type {FromWorker, OutReason, Pose, Traffic, ViewErrors} from '../shared/messages.js';
import type {Planes, SceneShape, StreamShape} from '../shared/scene.js';
import {BufferPool} from './buffer_pool.js';
import {answerOf} from './lag.js';
import {ChunkReader, readManifest, Refused} from './scene_reader.js';
import {StreamPlayer} from './stream_player.js';
import type {Body, SocketOwner} from './stream_socket.js';
import {StreamSocket} from './stream_socket.js';
import {NoDecoder, PictureDecoder} from './video_decoder.js';

const kKeyRequestEveryMs = 500;
const kMostFramesWaiting = 16;
const kTrafficEveryMs = 500;

export type Post = (message: FromWorker, transfer?: Transferable[]) => void;

function toWirePose(pose: Pose): ReturnType<typeof create<typeof PoseSchema>> {
  const [x, y, z] = pose.position;
  const [qx, qy, qz, qw] = pose.orientation;
  return create(PoseSchema, {position: {x, y, z}, qw, qx, qy, qz, fovy: pose.fovy, width: pose.width,
    height: pose.height});
}

function errorsOf(m: {error: number; resolutionError: number; omittedError: number}): ViewErrors {
  return {light: m.error, resolution: m.resolutionError, omitted: m.omittedError};
}

export class Session implements SocketOwner {
  private readonly socket: StreamSocket;
  private readonly buffers = new BufferPool();
  private readonly coarseDecoder = new PictureDecoder((bytes) => new ArrayBuffer(bytes), true);
  private work: Promise<void>;
  private framesWaiting = 0;
  private epoch = 0;  // counts sessions: what was queued for an older one is dropped
  private shape: StreamShape = {size: 0, viewSize: 0};
  private scene: SceneShape | null = null;
  private sceneTag = 0n;
  private chunks: ChunkReader | null = null;
  private chunksInView = 0;  // still to come
  private player: StreamPlayer | null = null;
  private viewPlayer: StreamPlayer | null = null;
  private sequence = 0n;
  private pose: Pose | null;
  private lastKeyRequest = 0;
  private decodeUs = 0;
  private readonly traffic: Traffic = {received: 0, stream: 0, geometry: 0, coarse: 0, decodeMs: 0,
    framesLost: 0};

  /** Nothing that comes is looked at before `ready`. */
  constructor(url: string, private readonly name: string, private readonly chroma444: boolean, pose: Pose | null,
              private readonly post: Post, ready: Promise<void> = Promise.resolve()) {
    this.pose = pose;
    this.work = ready.catch((error: unknown) => this.stop(error));
    this.socket = new StreamSocket(url, this);
    this.socket.open();
    self.setInterval(() => this.tellTraffic(), kTrafficEveryMs);
  }

  hello(): Body {
    ++this.epoch;
    const known = this.chunks?.complete === true ? this.sceneTag : 0n;
    return {case: 'hello', value: create(HelloSchema, {
      version: kProtocolVersion, client: this.name, maxPhystex: kMaxPhysTex, maxViewPhystex: kMaxViewPhysTex,
      chroma444: this.chroma444, knownScene: known, ...(this.pose ? {pose: toWirePose(this.pose)} : {}),
    })};
  }

  message(body: Body, bytes: number): void {
    this.traffic.received += bytes;
    const frame = body.case === 'frame' || body.case === 'viewFrame';
    if (body.case === 'geometry' || body.case === 'manifest') this.traffic.geometry += bytes;
    if (body.case === 'coarse') this.traffic.coarse += bytes;
    if (frame || body.case === 'coarse' || body.case === 'noChange') this.traffic.stream += bytes;
    // Left out: a gap, for which a key frame will be asked.
    if (frame && this.framesWaiting >= kMostFramesWaiting && !body.value.key) return;
    if (frame) ++this.framesWaiting;
    const epoch = this.epoch;
    const receivedUs = sharedNowUs();
    this.work = this.work.then(async () => {
      if (frame) --this.framesWaiting;
      if (epoch !== this.epoch) return;
      try {
        await this.take(body, receivedUs);
      } catch (error) {
        this.stop(error);
      }
    });
  }

  out(reason: OutReason, text: string, retryMs: number): void {
    ++this.epoch;
    this.post({type: 'out', reason, text, retryMs});
  }

  camera(pose: Pose, atUs: number): void {
    this.pose = pose;
    this.socket.send({case: 'camera', value: create(CameraUpdateSchema, {
      sequence: ++this.sequence, clientTimeUs: BigInt(Math.round(atUs)), pose: toWirePose(pose)})});
  }

  shown(frame: number, drawUs: number): void {
    this.feedback(frame, drawUs, false, false);
  }

  askForKeys(): void {
    this.feedback(this.player?.lastFrame ?? 0, 0, true, this.viewPlayer !== null);
  }

  recycle(buffer: ArrayBuffer): void {
    this.buffers.give(buffer);
  }

  close(): void {
    this.socket.close();
  }

  resume(): void {
    this.socket.resume();
  }

  private tellTraffic(): void {
    this.post({type: 'traffic', traffic: {...this.traffic}});
  }

  private stop(error: unknown): void {
    if (error instanceof NoDecoder) {
      this.socket.stop();
      this.post({type: 'out', reason: 'decoder', text: error.message, retryMs: -1});
    } else {
      this.socket.fail(error instanceof Refused ? `The server contradicts itself: ${error.message}.`
                                                : `This page failed: ${String(error)}.`);
    }
  }

  private async take(body: Body, receivedUs: number): Promise<void> {
    switch (body.case) {
      case 'welcome': return this.join(body.value);
      case 'manifest': return this.begin(body.value);
      case 'geometry': {
        if (this.chunks === null) throw new Refused('geometry before the manifest');
        const chunk = this.chunks.read(body.value);
        if (this.chunks.complete || --this.chunksInView === 0) this.tellTraffic();
        return this.post({type: 'chunk', chunk}, [chunk.vertices.buffer, chunk.indices.buffer]);
      }
      case 'coarse': return this.takeCoarse(body.value);
      case 'frame': return this.takeFrame(this.player, body.value, true, receivedUs);
      case 'viewFrame': return this.takeFrame(this.viewPlayer, body.value, false, receivedUs);
      case 'noChange':
        return this.post({type: 'answer', errors: errorsOf(body.value)});
      default:  // a newer server may say more
    }
  }

  private join(welcome: Welcome): void {
    if (welcome.version !== kProtocolVersion) throw new Refused(`it speaks version ${welcome.version}`);
    const multiple = welcome.phystexSize >= 32 && welcome.phystexSize % 32 === 0;
    if (!multiple || welcome.phystexSize > kMaxPhysTex || welcome.viewPhystex > kMaxViewPhysTex || welcome.lossless) {
      throw new Refused(`a PhysTex of ${welcome.phystexSize} pixels was not asked for`);
    }
    this.socket.joined();
    this.shape = {size: welcome.phystexSize, viewSize: welcome.viewPhystex};
    const p = welcome.start;
    const start: Pose = {
      position: [p?.position?.x ?? 0, p?.position?.y ?? 0, p?.position?.z ?? 0],
      orientation: p ? [p.qx, p.qy, p.qz, p.qw] : [0, 0, 0, 1], fovy: p?.fovy ?? 0.8, width: 0, height: 0,
    };
    this.post({type: 'joined', start, shape: this.shape, updatesPerSecond: welcome.updatesPerSecond,
      server: welcome.server, sceneKnown: welcome.sceneKnown, chunksInView: welcome.chunksInView});
    this.chunksInView = welcome.chunksInView;
    if (welcome.sceneKnown && this.scene !== null) this.makePlayers(this.scene);
    if (this.pose !== null) this.camera(this.pose, sharedNowUs());
  }

  private begin(manifest: SceneManifest): void {
    const scene = readManifest(manifest);
    this.scene = scene;
    this.sceneTag = manifest.tag;
    this.chunks = new ChunkReader(scene);
    this.makePlayers(scene);
    this.post({type: 'scene', scene});
  }

  private makePlayers(scene: SceneShape): void {
    this.player = this.makePlayer('shared', scene, this.shape.size);
    this.viewPlayer = this.shape.viewSize > 0 ? this.makePlayer('view', scene, this.shape.viewSize) : null;
  }

  private makePlayer(layer: 'shared' | 'view', scene: SceneShape, size: number): StreamPlayer {
    return new StreamPlayer(layer, scene, size, new PictureDecoder((bytes) => this.buffers.take(bytes)));
  }

  private async takeCoarse(coarse: CoarseTexture): Promise<void> {
    const last = this.scene?.levels.at(-1);
    if (last === undefined) throw new Refused('CoarseTex before the manifest');
    if (coarse.width !== last.width || coarse.height !== last.height) {
      throw new Refused('CoarseTex: its size differs from the manifest');
    }
    const picture = await this.decodeCoarse(coarse);
    if (picture.width !== last.width || picture.height !== last.height) {
      throw new Refused('CoarseTex: its picture has another size');
    }
    this.tellTraffic();
    this.post({type: 'coarse', picture}, [picture.buffer]);
  }

  // A still needs no other picture: what fails once (a decoder that was taken away, or is changed) is tried again.
  private async decodeCoarse({h264, version}: CoarseTexture): Promise<Planes> {
    try {
      return await this.coarseDecoder.decode(h264, true, version);
    } catch (error) {
      if (error instanceof NoDecoder) throw error;
      this.coarseDecoder.reset();
      return this.coarseDecoder.decode(h264, true, version);
    }
  }

  private async takeFrame(player: StreamPlayer | null, frame: StreamFrame, shared: boolean,
                          receivedUs: number): Promise<void> {
    if (player === null) throw new Refused('a frame of a stream that was not agreed on');
    const before = performance.now();
    const update = await player.apply(frame);
    if (update !== null) {
      const took = performance.now() - before;
      this.decodeUs = Math.round(took * 1000);
      this.traffic.decodeMs = took;
      const transfer: Transferable[] = update.pages.map((rows) => rows.slots.buffer);
      if (update.picture) transfer.push(update.picture.buffer);
      const answer = shared ? answerOf(frame.stamps, receivedUs, sharedNowUs()) : null;
      this.post({type: 'frame', update, answer, errors: shared ? errorsOf(frame) : null}, transfer);
    }
    this.traffic.framesLost = (this.player?.framesLost ?? 0) + (this.viewPlayer?.framesLost ?? 0);
    this.repair();
  }

  // Asks for key frames where track was lost; not where the first one is still on its way.
  private repair(): void {
    const wants = (player: StreamPlayer | null): boolean => player !== null && player.keyWanted && player.framesLost > 0;
    const shared = wants(this.player);
    const view = wants(this.viewPlayer);
    if ((!shared && !view) || performance.now() - this.lastKeyRequest < kKeyRequestEveryMs) return;
    this.lastKeyRequest = performance.now();
    this.feedback(this.player?.lastFrame ?? 0, 0, shared, view);
  }

  private feedback(frame: number, drawUs: number, key: boolean, viewKey: boolean): void {
    this.socket.send({case: 'feedback', value: create(FeedbackSchema, {
      frameShown: BigInt(frame), framesLost: BigInt(this.player?.framesLost ?? 0), keyFrameWanted: key,
      viewKeyFrameWanted: viewKey, clientTimeUs: BigInt(Math.round(performance.now() * 1000)),
      decodeUs: BigInt(this.decodeUs), drawUs: BigInt(Math.round(drawUs))})});
  }
}

// The clock that page and worker share, microseconds.
function sharedNowUs(): number {
  return (performance.timeOrigin + performance.now()) * 1000;
}
