// Which slot of PhysTex holds which tile: one linear table over all levels, kept as rows of a 2048-wide texture. Pure.
import {kAbsent, kTableWidth} from '../shared/limits.js';
import type {PageRows} from '../shared/scene.js';

export class PageTable {
  readonly rows: number;
  private readonly slots: Uint16Array;
  private readonly dirty: Uint8Array;
  private residentTiles = 0;

  /** `tiles` entries, all absent. */
  constructor(tiles: number) {
    this.rows = Math.max(1, Math.ceil(tiles / kTableWidth));
    this.slots = new Uint16Array(this.rows * kTableWidth).fill(kAbsent);
    this.dirty = new Uint8Array(this.rows).fill(1);
  }

  slot(entry: number): number {
    return this.slots[entry] ?? kAbsent;
  }

  /** `entry` < number of tiles. */
  set(entry: number, slot: number): void {
    const before = this.slots[entry];
    if (before === slot || before === undefined) return;
    if (before === kAbsent) ++this.residentTiles;
    if (slot === kAbsent) --this.residentTiles;
    this.slots[entry] = slot;
    this.dirty[Math.floor(entry / kTableWidth)] = 1;
  }

  /** Every tile absent: what a key frame starts from. */
  clear(): void {
    for (let row = 0; row < this.rows; ++row) {
      const values = this.slots.subarray(row * kTableWidth, (row + 1) * kTableWidth);
      if (values.some((slot) => slot !== kAbsent)) this.dirty[row] = 1;
    }
    this.slots.fill(kAbsent);
    this.residentTiles = 0;
  }

  get resident(): number {
    return this.residentTiles;
  }

  /** Copies of the rows changed since the last call (all of them at first), in order, joined where adjacent. */
  takeDirtyRows(): PageRows[] {
    const ranges: PageRows[] = [];
    for (let row = 0; row < this.rows; ++row) {
      if (this.dirty[row] === 0) continue;
      let end = row;
      while (end < this.rows && this.dirty[end] === 1) this.dirty[end++] = 0;
      ranges.push({first: row, count: end - row, slots: this.slots.slice(row * kTableWidth, end * kTableWidth)});
      row = end;
    }
    return ranges;
  }
}
