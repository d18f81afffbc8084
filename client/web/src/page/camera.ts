// Where the visitor looks from, and the matrices that follow from it. Double precision until the last step.
import {Matrix4} from 'three/src/math/Matrix4.js';
import {Quaternion} from 'three/src/math/Quaternion.js';
import {Vector3} from 'three/src/math/Vector3.js';

import type {Pose} from '../shared/messages.js';
import type {SceneShape, Vec3} from '../shared/scene.js';

/** Upright camera: file coordinates in metres, angles in radians. Yaw 0 looks along -Z, positive turns left. */
export interface View {
  position: Vec3;
  yaw: number;
  /** In [-kSteepest, kSteepest], positive looks up. */
  pitch: number;
  fovy: number;
}

export const kSteepest = Math.PI / 2 - 1e-3;
export const kNarrowest = Math.PI / 180;
export const kWidest = (150 / 180) * Math.PI;

export function clamp(value: number, low: number, high: number): number {
  return Math.min(high, Math.max(low, value));
}

/** On each axis, metres: what lies beyond, a server does not take. */
const kFarthest = 5e8;

/** Any input gives a view that can be drawn: all is held within bounds, what is not finite becomes 0 (fovy 50 deg). */
export function tidy(view: View): View {
  const finite = (value: number): number => (Number.isFinite(value) ? clamp(value, -kFarthest, kFarthest) : 0);
  const yaw = finite(view.yaw);
  return {
    position: [finite(view.position[0]), finite(view.position[1]), finite(view.position[2])],
    yaw: yaw - 2 * Math.PI * Math.round(yaw / (2 * Math.PI)),
    pitch: clamp(finite(view.pitch), -kSteepest, kSteepest),
    fovy: clamp(Number.isFinite(view.fovy) ? view.fovy : (50 / 180) * Math.PI, kNarrowest, kWidest),
  };
}

export function forward(view: View): Vec3 {
  const flat = Math.cos(view.pitch);
  return [-Math.sin(view.yaw) * flat, Math.sin(view.pitch), -Math.cos(view.yaw) * flat];
}

export function right(view: View): Vec3 {
  return [Math.cos(view.yaw), 0, -Math.sin(view.yaw)];
}

export function up(view: View): Vec3 {
  const [rx, , rz] = right(view);
  const [fx, fy, fz] = forward(view);
  return [-rz * fy, rz * fx - rx * fz, rx * fy];
}

export function orientation(view: View): Quaternion {
  const turn = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), view.yaw);
  return turn.multiply(new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), view.pitch));
}

/** The upright view that looks along (x, y, z), which need not be unit. */
export function viewAlong(position: Vec3, [x, y, z]: Vec3, fovy: number): View {
  const flat = Math.hypot(x, z);
  return tidy({position, yaw: flat > 1e-12 ? Math.atan2(-x, -z) : 0, pitch: Math.atan2(y, flat), fovy});
}

/** The server's pose as an upright view: its roll is given up. */
export function fromPose(pose: Pose): View {
  const q = new Quaternion(...pose.orientation).normalize();
  const f = new Vector3(0, 0, -1).applyQuaternion(q);
  return viewAlong(pose.position, [f.x, f.y, f.z], pose.fovy);
}

export function toPose(view: View, width: number, height: number): Pose {
  const q = orientation(view);
  return {position: [...view.position], orientation: [q.x, q.y, q.z, q.w], fovy: view.fovy, width, height};
}

/** World (recentred by the scene's origin) to camera space. */
export function viewMatrix(view: View, origin: Vec3): Matrix4 {
  const m = new Matrix4().makeRotationFromQuaternion(orientation(view)).transpose();
  const p = new Vector3(origin[0] - view.position[0], origin[1] - view.position[1], origin[2] - view.position[2]);
  return m.setPosition(p.applyMatrix4(new Matrix4().copy(m)));
}

/**
 * Camera space to clip space. `reversed`: near is depth 1, infinity 0 (EXT_clip_control); otherwise GL's convention
 * between `near` and `far`. 0 < near < far.
 */
export function projectionMatrix(fovy: number, aspect: number, near: number, far: number, reversed: boolean): Matrix4 {
  const f = 1 / Math.tan(fovy / 2);
  const [a, b] = reversed ? [0, near] : [(far + near) / (near - far), (2 * far * near) / (near - far)];
  return new Matrix4().set(f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, a, b, 0, 0, -1, 0);
}

export function diagonalOf(scene: SceneShape): number {
  return Math.max(1e-6, Math.hypot(scene.high[0] - scene.low[0], scene.high[1] - scene.low[1],
                                   scene.high[2] - scene.low[2]));
}

export function worldToClip(view: View, scene: SceneShape, aspect: number, reversed: boolean): Matrix4 {
  const diagonal = diagonalOf(scene);
  let farthest = 0;
  for (let axis = 0; axis < 3; ++axis) {
    const eye = view.position[axis]! - scene.origin[axis]!;
    farthest += Math.max(Math.abs(eye - scene.low[axis]!), Math.abs(eye - scene.high[axis]!)) ** 2;
  }
  const near = reversed ? diagonal * 1e-5 : diagonal / 5000;
  const far = Math.max(near * 2, Math.sqrt(farthest) * 1.01);
  return projectionMatrix(view.fovy, aspect, near, far, reversed).multiply(viewMatrix(view, scene.origin));
}
