// How the camera moves: walking and orbiting, at speeds that suit a scene of 7 mm and one of 3 km. Pure.
import type {View} from './camera.js';
import {clamp, forward, kSteepest, right, tidy, up} from './camera.js';
import type {Vec3} from '../shared/scene.js';

export type Mode = 'walk' | 'orbit';

/**
 * Walking speed in metres a second in a scene whose box has this diagonal: a person's pace (1.6 m/s) at 20 m; below, the
 * same share of the scene; above, growing with its square root, so that 3 km are crossed in minutes.
 */
export function walkSpeed(diagonal: number): number {
  return diagonal < 20 ? 0.08 * diagonal : 1.6 * Math.sqrt(diagonal / 20);
}

const kHurry = 4;
/** Seconds after which speed has come two thirds of the way to what is asked for. */
const kEase = 0.09;

export interface Bounds {
  low: Vec3;
  high: Vec3;
}

export class Rig {
  mode: Mode = 'walk';
  /** What an orbit turns around, file coordinates. */
  pivot: Vec3 = [0, 0, 0];
  private velocity: Vec3 = [0, 0, 0];

  constructor(public view: View, private bounds: Bounds, public easing: boolean) {
    this.setBounds(bounds);
  }

  /** Of the scene, file coordinates. An eye outside of it looks at an object, one inside walks through rooms. */
  setBounds(bounds: Bounds): void {
    this.bounds = bounds;
    const inside = this.view.position.every((p, i) => p >= bounds.low[i]! && p <= bounds.high[i]!);
    this.mode = inside ? 'walk' : 'orbit';
    this.pivot = [0, 1, 2].map((i) => (bounds.low[i]! + bounds.high[i]!) / 2) as Vec3;
  }

  get diagonal(): number {
    const {low, high} = this.bounds;
    return Math.max(1e-6, Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]));
  }

  /** True while it still moves by itself. */
  get moving(): boolean {
    return Math.hypot(...this.velocity) > 0.005 * walkSpeed(this.diagonal);
  }

  /** Turns the head, radians. */
  look(yaw: number, pitch: number): void {
    this.view = tidy({...this.view, yaw: this.view.yaw + yaw, pitch: this.view.pitch + pitch});
  }

  /** Turns around the pivot, radians; the pivot keeps its place on the screen. */
  orbit(yaw: number, pitch: number): void {
    const before = this.view;
    const after = tidy({...before, yaw: before.yaw + yaw, pitch: clamp(before.pitch + pitch, -kSteepest, kSteepest)});
    const arm = minus(this.pivot, before.position);
    const local = [right, up, forward].map((axis) => dot(arm, axis(before)));
    const [r, u, f] = [right(after), up(after), forward(after)];
    const offset = plus(plus(scaled(r, local[0]!), scaled(u, local[1]!)), scaled(f, local[2]!));
    after.position = minus(this.pivot, offset);
    this.view = after;
  }

  /** Towards the pivot (steps > 0) or away: each step an eighth of the distance, never past it. */
  dolly(steps: number): void {
    const arm = minus(this.pivot, this.view.position);
    const distance = Math.hypot(...arm);
    const nearest = this.diagonal * 1e-4;
    const wanted = clamp(distance * 0.875 ** steps, nearest, this.diagonal * 20);
    if (distance < nearest * 0.5) return;
    this.shift(scaled(arm, 1 - wanted / distance));
  }

  /** Eye and pivot move across the screen, in shares of its height: what is at the pivot follows the finger. */
  pan(x: number, y: number): void {
    const depth = Math.max(this.diagonal * 1e-3, dot(minus(this.pivot, this.view.position), forward(this.view)));
    const height = 2 * depth * Math.tan(this.view.fovy / 2);
    const by = plus(scaled(right(this.view), -x * height), scaled(up(this.view), y * height));
    this.shift(by);
    this.pivot = plus(this.pivot, by);
  }

  /** One step of walking ahead by a turn of a wheel or a pinch: a fifth of a second's way each. */
  stride(steps: number): void {
    this.shift(scaled(forward(this.view), steps * 0.2 * walkSpeed(this.diagonal)));
  }

  /**
   * Walks for `seconds`: `wish` is right, up, ahead, each in [-1, 1]; ahead is level, so that looking down does not
   * sink. The speed eases in and out unless `easing` is off.
   */
  walk(wish: Vec3, hurry: boolean, seconds: number): void {
    const length = Math.max(1, Math.hypot(...wish));
    const speed = (walkSpeed(this.diagonal) * (hurry ? kHurry : 1)) / length;
    const level: Vec3 = [-Math.sin(this.view.yaw), 0, -Math.cos(this.view.yaw)];
    const target = plus(plus(scaled(right(this.view), wish[0] * speed), [0, wish[1] * speed, 0]),
                        scaled(level, wish[2] * speed));
    const keep = this.easing ? Math.exp(-seconds / kEase) : 0;
    this.velocity = plus(scaled(this.velocity, keep), scaled(target, 1 - keep));
    if (!this.moving) this.velocity = [0, 0, 0];
    const by = scaled(this.velocity, seconds);
    this.shift(by);
    if (this.mode === 'orbit') this.pivot = plus(this.pivot, by);
  }

  stop(): void {
    this.velocity = [0, 0, 0];
  }

  private shift(by: Vec3): void {
    this.view = tidy({...this.view, position: plus(this.view.position, by)});
  }
}

export function plus(a: Vec3, b: Vec3): Vec3 {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

export function minus(a: Vec3, b: Vec3): Vec3 {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

export function scaled(a: Vec3, by: number): Vec3 {
  return [a[0] * by, a[1] * by, a[2] * by];
}

export function dot(a: Vec3, b: Vec3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
