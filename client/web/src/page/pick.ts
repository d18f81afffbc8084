// What lies under a point of the screen: a ray against the geometry that has come.
import {Matrix4} from 'three/src/math/Matrix4.js';
import {Vector3} from 'three/src/math/Vector3.js';

import type {Chunk, InstanceShape, Vec3} from '../shared/scene.js';

export interface Placed {
  chunk: Chunk;
  instance: InstanceShape;
}

/** Distances at which the ray enters and leaves the box; entry > exit: it misses. */
function boxSpan(origin: Vector3, direction: Vector3, low: Vec3, high: Vec3): [number, number] {
  let enter = 0;
  let leave = Infinity;
  const o = [origin.x, origin.y, origin.z];
  const d = [direction.x, direction.y, direction.z];
  for (let i = 0; i < 3; ++i) {
    const a = (low[i]! - o[i]!) / d[i]!;
    const b = (high[i]! - o[i]!) / d[i]!;
    if (Number.isNaN(a) || Number.isNaN(b)) continue;  // parallel and on the plane
    enter = Math.max(enter, Math.min(a, b));
    leave = Math.min(leave, Math.max(a, b));
  }
  return [enter, leave];
}

/** Moeller and Trumbore, "Fast, Minimum Storage Ray-Triangle Intersection" (1997). */
function nearestTriangle(chunk: Chunk, o: Vector3, d: Vector3, limit: number): number {
  const floats = new Float32Array(chunk.vertices.buffer, chunk.vertices.byteOffset, chunk.vertices.byteLength / 4);
  let nearest = limit;
  for (let i = 0; i < chunk.indices.length; i += 3) {
    const a = chunk.indices[i]! * 6;
    const b = chunk.indices[i + 1]! * 6;
    const c = chunk.indices[i + 2]! * 6;
    const ax = floats[a]!, ay = floats[a + 1]!, az = floats[a + 2]!;
    const e1x = floats[b]! - ax, e1y = floats[b + 1]! - ay, e1z = floats[b + 2]! - az;
    const e2x = floats[c]! - ax, e2y = floats[c + 1]! - ay, e2z = floats[c + 2]! - az;
    const px = d.y * e2z - d.z * e2y, py = d.z * e2x - d.x * e2z, pz = d.x * e2y - d.y * e2x;
    const determinant = e1x * px + e1y * py + e1z * pz;
    if (determinant === 0) continue;
    const tx = o.x - ax, ty = o.y - ay, tz = o.z - az;
    const u = (tx * px + ty * py + tz * pz) / determinant;
    if (!(u >= 0 && u <= 1)) continue;
    const qx = ty * e1z - tz * e1y, qy = tz * e1x - tx * e1z, qz = tx * e1y - ty * e1x;
    const v = (d.x * qx + d.y * qy + d.z * qz) / determinant;
    if (!(v >= 0 && u + v <= 1)) continue;
    const t = (e2x * qx + e2y * qy + e2z * qz) / determinant;
    if (t > 0 && t < nearest) nearest = t;
  }
  return nearest;
}

/** Distance along `direction` (unit) from `origin`, both recentred; null: nothing is hit. */
export function pick(placed: Iterable<Placed>, origin: Vec3, direction: Vec3): number | null {
  let nearest = Infinity;
  for (const {chunk, instance} of placed) {
    const inverse = new Matrix4().fromArray(instance.toWorld).invert();
    // The parameter along the ray is the same in node space, whatever the node's scale.
    const o = new Vector3(...origin).applyMatrix4(inverse);
    const d = new Vector3(origin[0] + direction[0], origin[1] + direction[1], origin[2] + direction[2])
      .applyMatrix4(inverse).sub(o);
    const [enter, leave] = boxSpan(o, d, chunk.low, chunk.high);
    if (enter > leave || enter >= nearest) continue;
    nearest = nearestTriangle(chunk, o, d, nearest);
  }
  return Number.isFinite(nearest) ? nearest : null;
}
