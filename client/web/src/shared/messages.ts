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
  | {type: 'close'};

/** Why there is no stream. `lost`: it is tried again by itself, as is `full`; the others are final. */
export type OutReason = 'lost' | 'full' | 'version' | 'refused' | 'fault' | 'decoder';

export interface Traffic {
  /** Bytes of messages so far, all sessions of this page. */
  received: number;
  /** Of frames and coarse textures alone. */
  stream: number;
  decodeMs: number;
  framesLost: number;
}

export type FromWorker =
  | {type: 'joined'; start: Pose; shape: StreamShape; updatesPerSecond: number; server: string; sceneKnown: boolean}
  | {type: 'scene'; scene: SceneShape}
  | {type: 'chunk'; chunk: Chunk}
  | {type: 'coarse'; picture: Planes}
  | {type: 'frame'; update: FrameUpdate; answersUs: number; error: number}
  | {type: 'answer'; answersUs: number; error: number}
  | {type: 'traffic'; traffic: Traffic}
  | {type: 'out'; reason: OutReason; text: string; retryMs: number};
