// The view in the page's address, so that a view can be shared: #view=x,y,z,yaw,pitch,fovy (metres, degrees).
import type {View} from './camera.js';
import {kNarrowest, kSteepest, kWidest, tidy} from './camera.js';

const kDegree = Math.PI / 180;
const kFarthest = 1e9;

// Nine digits: micrometres in a scene of a few metres, a millimetre in one of hundreds of kilometres.
function number(value: number, digits: number): string {
  return String(Number(value.toPrecision(digits)));
}

export function toHash(view: View): string {
  const values = [...view.position.map((p) => number(p, 9)), ...[view.yaw, view.pitch, view.fovy].map(
    (angle) => number(angle / kDegree, 7))];
  return `#view=${values.join(',')}`;
}

/** It names a view, but not one that can be drawn. */
export function isBroken(hash: string): boolean {
  return hash.startsWith('#view=') && fromHash(hash) === null;
}

/** Null: there is no view in it, or one that cannot be drawn. */
export function fromHash(hash: string): View | null {
  // Programs that pass links on write commas in another way, and add words of their own.
  const match = /^#view=([^&]*)/.exec(hash);
  if (match === null) return null;
  const parts = match[1]!.replaceAll(/%2c/gi, ',').split(',');
  const values = parts.map((part) => (/^-?\d{1,12}(\.\d{1,16})?(e-?\d{1,2})?$/.test(part) ? Number(part) : NaN));
  if (values.length !== 6 || !values.every(Number.isFinite)) return null;
  const [x, y, z, yaw, pitch, fovy] = values as [number, number, number, number, number, number];
  if (Math.hypot(x, y, z) > kFarthest) return null;
  if (Math.abs(pitch) > 90 || fovy * kDegree < kNarrowest * 0.999 || fovy * kDegree > kWidest * 1.001) return null;
  return tidy({position: [x, y, z], yaw: yaw * kDegree,
    pitch: Math.max(-kSteepest, Math.min(kSteepest, pitch * kDegree)), fovy: fovy * kDegree});
}
