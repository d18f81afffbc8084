// The panel of measurements. Its texts are made here, pure; the element shows them.
import type {LagStages, Traffic} from '../shared/messages.js';
import type {Residency} from './residency.js';

export interface Measured {
  /** Pictures drawn a second while something moves; null: nothing moves. */
  framesPerSecond: number | null;
  drawMs: number;
  /** Of the frame-rate guard: 0 is the finest. */
  level: number;
  bitsPerSecond: number;
  traffic: Traffic;
  /** From a camera sent until a picture made for it was drawn; null: none yet. */
  lagMs: number | null;
  lagStages: (LagStages & {display: number}) | null;
  residency: Residency | null;
  /** Estimated RMS display error of the light, 0..1; null: none yet. */
  error: number | null;
  /** Beside it: for want of finer texels than the atlas has. */
  resolutionError: number;
  /** Beside both: of reflections where they are not streamed. */
  omittedError: number;
  seconds: number;
}

function bytes(count: number): string {
  if (count < 1e6) return `${(count / 1e3).toFixed(0)} kB`;
  return count < 1e9 ? `${(count / 1e6).toFixed(1)} MB` : `${(count / 1e9).toFixed(2)} GB`;
}

function rate(bits: number): string {
  return bits < 1e6 ? `${(bits / 1e3).toFixed(0)} kbit/s` : `${(bits / 1e6).toFixed(1)} Mbit/s`;
}

function percent(share: number): string {
  return `${(share * 100).toFixed(share < 0.0995 ? 1 : 0)} %`;
}

function parts(stages: LagStages & {display: number}): string {
  return Object.entries(stages).map(([name, ms]) => `${name} ${ms.toFixed(0)}`).join(', ');
}

// PSNR = -20 log10 of the RMS error.
function errorText(error: number): string {
  return `${(error * 255).toFixed(2)} of 255${error > 0 ? ` (${(-20 * Math.log10(error)).toFixed(1)} dB)` : ''}`;
}

/** Label and value of each line, by the name of its place in the page. */
export function lines(m: Measured): Record<string, string> {
  const fallback = m.residency === null ? null : m.residency.coarser + m.residency.coarseTex + m.residency.undefined;
  const perHour = m.seconds > 5 ? ` (${bytes((m.traffic.received / m.seconds) * 3600)} an hour)` : '';
  return {
    frames: m.framesPerSecond === null ? 'still' : `${m.framesPerSecond.toFixed(0)}${m.level > 0 ? ', coarser' : ''}`,
    stream: rate(m.bitsPerSecond),
    lag: m.lagMs === null ? '–' : `${m.lagMs.toFixed(0)} ms${m.lagStages === null ? '' : `: ${parts(m.lagStages)}`}`,
    fallback: fallback === null ? '–' : percent(fallback),
    error: m.error === null || m.error < 0 ? '–' : errorText(m.error),
    resolution: errorText(m.resolutionError),
    omitted: errorText(m.omittedError),
    cost: `${bytes(m.traffic.received)}${perHour}, decoding ${m.traffic.decodeMs.toFixed(0)} ms, ` +
          `drawing ${m.drawMs.toFixed(0)} ms`,
  };
}

export class Panel {
  constructor(private readonly root: HTMLElement, private readonly button: HTMLElement) {
    this.show(false);
    window.addEventListener('resize', () => this.fit());
  }

  get open(): boolean {
    return !this.root.hidden;
  }

  show(open: boolean): void {
    this.root.hidden = !open;
    this.button.setAttribute('aria-expanded', String(open));
    this.fit();
  }

  update(measured: Measured): void {
    for (const [name, text] of Object.entries(lines(measured))) {
      const place = this.root.querySelector(`[data-line="${name}"]`);
      if (place !== null && place.textContent !== text) place.textContent = text;
    }
    this.fit();
  }

  // A stop for the keyboard only where there is something to scroll.
  private fit(): void {
    if (this.root.scrollHeight > this.root.clientHeight) this.root.tabIndex = 0;
    else if (document.activeElement !== this.root) this.root.removeAttribute('tabindex');
  }
}
