// What page and worker say to each other.
import type {Chunk, FrameUpdate, Planes, SceneShape, StreamShape} from './scene.js';

/** A pinhole camera, file coordinates, metres; looks along -Z of its orientation (x, y, z, w), +Y up; radians. */
export interface Pose {
  position: [number, number, number];
  orientation: [number, number, number, number];
  fovy: number;
  width: number;
  height: number;
}

export type ToWorker =
  | {type: 'open'; url: string; name: string; chroma444: boolean; pose: Pose | null}
  | {type: 'camera'; pose: Pose; atUs: number}
  | {type: 'shown'; frame: number; drawUs: number}
  | {type: 'key frames'}
  | {type: 'recycle'; buffer: ArrayBuffer}
  | {type: 'close'}
  | {type: 'resume'};

/** Why there is no stream. `lost`: it is tried again by itself, as is `full`; the others are final. */
export type OutReason = 'lost' | 'full' | 'version' | 'refused' | 'fault' | 'decoder';

/** Where the time from a camera to the picture made for it went, milliseconds; what is drawn adds the display. */
export interface LagStages {
  /** Up and down: all that no stamp of either end covers. */
  network: number;
  /** Until the scheduler took the view up. */
  wait: number;
  visibility: number;
  /** Until a frame was begun. */
  shading: number;
  /** Composed and encoded. */
  encode: number;
  /** In the session's send queue. */
  queue: number;
  /** Decoded, and waiting for that. */
  decode: number;
}

/** The camera that a picture answers. */
export interface Answer {
  /** When it was sent and when the picture was decoded: microseconds since 1970 by the clock that page and worker share. */
  sentUs: number;
  decodedUs: number;
  stages: LagStages;
}

export interface Traffic {
  /** Bytes of messages so far, all sessions of this page. */
  received: number;
  /** Of frames and coarse textures alone. */
  stream: number;
  /** Of manifest and geometry alone. */
  geometry: number;
  coarse: number;
  decodeMs: number;
  framesLost: number;
}

/** Estimated RMS display errors of the view, 0..1. */
export interface ViewErrors {
  /** Of the light, and of reflections where they are streamed: more time mends it. */
  light: number;
  /** Beside it: for want of finer texels than the atlas has. */
  resolution: number;
  /** Beside both: of reflections where they are not streamed. */
  omitted: number;
}

export type FromWorker =
  | {type: 'joined'; start: Pose; shape: StreamShape; updatesPerSecond: number; server: string; sceneKnown: boolean;
    /** The first so many chunks hold all that the first view can see. */
    chunksInView: number}
  | {type: 'scene'; scene: SceneShape}
  | {type: 'chunk'; chunk: Chunk}
  | {type: 'coarse'; picture: Planes}
  /** `errors`: null with a frame of the private layer, which says nothing of them. */
  | {type: 'frame'; update: FrameUpdate; answer: Answer | null; errors: ViewErrors | null}
  | {type: 'answer'; errors: ViewErrors}
  | {type: 'traffic'; traffic: Traffic}
  | {type: 'out'; reason: OutReason; text: string; retryMs: number};
