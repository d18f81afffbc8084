// Mouse, touch, keyboard and gamepad, turned into what the rig understands.
import type {Vec3} from '../shared/scene.js';
import type {Rig} from './rig.js';

/** Keys by their place on the keyboard, so that they lie together whatever it is labelled. */
const kKeys: Record<string, Vec3> = {
  KeyW: [0, 0, 1], ArrowUp: [0, 0, 1], KeyS: [0, 0, -1], ArrowDown: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0],
  KeyE: [0, 1, 0], PageUp: [0, 1, 0], KeyQ: [0, -1, 0], PageDown: [0, -1, 0],
};
const kTurnKeys: Record<string, number> = {ArrowLeft: 1, ArrowRight: -1};
const kLookKeys: Record<string, number> = {KeyR: 1, KeyF: -1};
/** Where the focus is in something that scrolls, these scroll it. */
const kScrollKeys = new Set(['ArrowUp', 'ArrowDown', 'ArrowLeft', 'ArrowRight', 'PageUp', 'PageDown']);
const kTurnSpeed = 1.2;        // radians a second, by key
const kStickTurnSpeed = 2.2;   // radians a second, stick fully over
const kDeadZone = 0.15;
const kWheelStep = 100;        // CSS pixels of scrolling in one step

/** A stick's axis without its centre's wobble, in [-1, 1]. NaN is 0. */
export function axisOf(value: number | undefined): number {
  const v = value !== undefined && Number.isFinite(value) ? value : 0;
  const beyond = Math.max(0, Math.abs(v) - kDeadZone) / (1 - kDeadZone);
  return Math.sign(v) * Math.min(1, beyond);
}

function sheetIsOpen(): boolean {
  return document.querySelector('dialog[open]') !== null;
}

// A sheet over the picture has all keys.
function goesElsewhere(e: KeyboardEvent): boolean {
  if (sheetIsOpen()) return true;
  return kScrollKeys.has(e.code) && e.target instanceof Element && e.target.closest('[data-scrolls]') !== null;
}

export interface InputOwner {
  readonly rig: Rig;
  /** Something moves: draw. */
  moved(): void;
  /** An orbit begins at this place of the canvas (CSS pixels): what lies there becomes its pivot. */
  pickPivot(x: number, y: number): void;
}

export class Input {
  private readonly held = new Set<string>();
  private readonly pointers = new Map<number, {x: number; y: number}>();

  constructor(private readonly canvas: HTMLCanvasElement, private readonly owner: InputOwner) {
    canvas.addEventListener('pointerdown', (e) => this.down(e));
    canvas.addEventListener('pointermove', (e) => this.move(e));
    for (const end of ['pointerup', 'pointercancel'] as const) {
      canvas.addEventListener(end, (e) => this.pointers.delete(e.pointerId));
    }
    canvas.addEventListener('contextmenu', (e) => e.preventDefault());
    canvas.addEventListener('wheel', (e) => this.wheel(e), {passive: false});
    window.addEventListener('keydown', (e) => this.key(e));
    window.addEventListener('keyup', (e) => this.held.delete(e.code));
    window.addEventListener('blur', () => this.held.clear());
    window.addEventListener('gamepadconnected', () => owner.moved());
  }

  /** Moves the rig by what is held for `seconds`; true while something is. */
  advance(seconds: number): boolean {
    const wish: Vec3 = [0, 0, 0];
    let turn = 0;
    let tilt = 0;
    if (sheetIsOpen()) this.held.clear();  // what was held does not go on behind it
    for (const code of this.held) {
      kKeys[code]?.forEach((v, i) => (wish[i]! += v));
      turn += (kTurnKeys[code] ?? 0) * kTurnSpeed * seconds;
      tilt += (kLookKeys[code] ?? 0) * kTurnSpeed * seconds;
    }
    let hurry = this.held.has('ShiftLeft') || this.held.has('ShiftRight');
    const pads = navigator.getGamepads?.() ?? [];
    for (const pad of pads) {
      if (pad === null || pad.mapping !== 'standard') continue;
      wish[0] += axisOf(pad.axes[0]);
      wish[2] -= axisOf(pad.axes[1]);
      wish[1] += (pad.buttons[7]?.value ?? 0) - (pad.buttons[6]?.value ?? 0);
      turn -= axisOf(pad.axes[2]) * kStickTurnSpeed * seconds;
      tilt -= axisOf(pad.axes[3]) * kStickTurnSpeed * seconds;
      hurry ||= pad.buttons[10]?.pressed === true || pad.buttons[5]?.pressed === true;
    }
    const {rig} = this.owner;
    const asked = wish.some((v) => v !== 0) || turn !== 0 || tilt !== 0;
    if (!asked && !rig.moving) return false;
    if (turn !== 0 || tilt !== 0) this.turn(turn, tilt);
    rig.walk(wish, hurry, seconds);
    return true;
  }

  /** True if a gamepad has to be asked each frame: it has no events. */
  get polls(): boolean {
    return (navigator.getGamepads?.() ?? []).some((pad) => pad?.mapping === 'standard');
  }

  private turn(yaw: number, pitch: number): void {
    if (this.owner.rig.mode === 'orbit') this.owner.rig.orbit(yaw, pitch);
    else this.owner.rig.look(yaw, pitch);
  }

  private key(e: KeyboardEvent): void {
    if (e.ctrlKey || e.metaKey || e.altKey || goesElsewhere(e)) return;
    // A button that was pressed keeps Enter and Space; none of these means anything to it.
    if (!(e.code in kKeys) && !(e.code in kTurnKeys) && !(e.code in kLookKeys) && !e.code.startsWith('Shift')) return;
    this.held.add(e.code);
    if (!e.code.startsWith('Shift')) {
      e.preventDefault();
      this.owner.moved();
    }
  }

  private down(e: PointerEvent): void {
    this.canvas.focus({preventScroll: true});
    this.canvas.setPointerCapture(e.pointerId);
    this.pointers.set(e.pointerId, {x: e.offsetX, y: e.offsetY});
    this.owner.rig.stop();
    if (this.owner.rig.mode === 'orbit' && this.pointers.size === 1) this.owner.pickPivot(e.offsetX, e.offsetY);
  }

  private move(e: PointerEvent): void {
    const before = this.pointers.get(e.pointerId);
    if (before === undefined) return;
    const now = {x: e.offsetX, y: e.offsetY};
    if (this.pointers.size >= 2) this.pinch(e.pointerId, before, now);
    else this.drag(now.x - before.x, now.y - before.y, e.buttons !== 1 || e.shiftKey);
    this.pointers.set(e.pointerId, now);
    this.owner.moved();
  }

  // One finger or button: a drag across the whole height turns by the field of view when walking (the scene sticks to
  // the finger), by half a turn when orbiting.
  private drag(dx: number, dy: number, second: boolean): void {
    const {rig} = this.owner;
    const height = this.canvas.clientHeight || 1;
    if (rig.mode === 'orbit') {
      if (second) rig.pan(dx / height, dy / height);
      else rig.orbit((-dx / height) * Math.PI, (-dy / height) * Math.PI);
    } else if (second) {
      rig.stride((-dy / height) * 20);
    } else {
      rig.look((dx / height) * rig.view.fovy, (dy / height) * rig.view.fovy);
    }
  }

  // Two fingers: closer together or further apart is nearer or farther, together they move across.
  private pinch(id: number, before: {x: number; y: number}, now: {x: number; y: number}): void {
    const other = [...this.pointers].find(([key]) => key !== id)?.[1];
    if (other === undefined) return;
    const {rig} = this.owner;
    const height = this.canvas.clientHeight || 1;
    const apart = (p: {x: number; y: number}): number => Math.max(1, Math.hypot(p.x - other.x, p.y - other.y));
    if (rig.mode === 'orbit') {
      rig.dolly(Math.log(apart(now) / apart(before)) / Math.log(1 / 0.875));
      rig.pan((now.x - before.x) / 2 / height, (now.y - before.y) / 2 / height);
    } else {
      rig.stride(((apart(now) - apart(before)) / height) * 20 - ((now.y - before.y) / 2 / height) * 20);
      rig.look(((now.x - before.x) / 2 / height) * rig.view.fovy, 0);
    }
  }

  private wheel(e: WheelEvent): void {
    e.preventDefault();
    const lines = e.deltaMode === WheelEvent.DOM_DELTA_LINE ? 33 : e.deltaMode === WheelEvent.DOM_DELTA_PAGE ? 400 : 1;
    const steps = Math.max(-5, Math.min(5, (-e.deltaY * lines) / kWheelStep));
    const {rig} = this.owner;
    if (rig.mode === 'orbit') rig.dolly(steps);
    else rig.stride(steps);
    this.owner.moved();
  }
}
