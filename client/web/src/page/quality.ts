// The frame-rate guard: draws as finely as the device can at a rate that feels direct, and finest when nothing moves.

/**
 * How one picture is drawn. `samples`: on an axis, shaded each; `multisample`: of edges alone; `scale`: of the device's
 * pixels.
 */
export interface Quality {
  samples: 1 | 2;
  multisample: number;
  scale: number;
}

export const kLadder: readonly Quality[] = [
  {samples: 2, multisample: 0, scale: 1},
  {samples: 1, multisample: 4, scale: 1},
  {samples: 1, multisample: 4, scale: 0.7},
  {samples: 1, multisample: 0, scale: 0.7},
  {samples: 1, multisample: 0, scale: 0.5},
  {samples: 1, multisample: 0, scale: 0.35},
];

/** While nothing is known of the device yet: an eighth of the finest one's samples. */
export const kUnknownDevice: Quality = kLadder[3]!;

/** Milliseconds a picture may take while something moves; a level with this much to spare is left for a finer one. */
const kBudgetMs = 33;
const kSpareMs = 9;
const kSlowInARow = 2;
const kQuickInARow = 45;
/** Share of time that pictures of a still view may take: the machine may be drawing for others, or lighting the scene. */
const kStillShare = 0.35;

/** Times are in milliseconds and come from the caller: pure. */
export class FrameGuard {
  private step = 0;
  private slow = 0;
  private quick = 0;
  private finestMs = 0;
  private finestEnd = -Infinity;

  /** What to draw with while the view moves. */
  get moving(): Quality {
    return kLadder[this.step]!;
  }

  get finest(): Quality {
    return kLadder[0]!;
  }

  get level(): number {
    return this.step;
  }

  /** True when a still view may be drawn at its finest again. */
  mayRefine(now: number): boolean {
    return now - this.finestEnd >= this.finestMs * (1 / kStillShare - 1);
  }

  /** A picture took `ms`, from the first command until the GPU was done at `now`. */
  note(quality: Quality, ms: number, now: number): void {
    if (quality === this.finest) {
      this.finestMs = ms;
      this.finestEnd = now;
    }
    if (quality !== this.moving) return;
    if (ms > kBudgetMs) {
      this.quick = 0;
      if (++this.slow < kSlowInARow) return;
      // One step about halves the work; far over the budget several are taken at once.
      const steps = clampStep(Math.ceil(Math.log2(ms / kBudgetMs)));
      this.step = Math.min(kLadder.length - 1, this.step + steps);
      this.slow = 0;
    } else {
      this.slow = 0;
      this.quick = ms < kSpareMs ? this.quick + 1 : 0;
      if (this.quick < kQuickInARow || this.step === 0) return;
      --this.step;
      this.quick = 0;
    }
  }
}

function clampStep(steps: number): number {
  return Math.max(1, Math.min(4, steps));
}
