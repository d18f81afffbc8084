// Keeps picture and page table of one stream in step: both of a frame, or neither (DESIGN section 4, "Frames").
import type {StreamFrame} from '../gen/darm_pb.js';
import {kAbsent, kMaxPageEditsPerSlot, kSlotTexels} from '../shared/limits.js';
import type {FrameUpdate, Planes, SceneShape, SlotBytes} from '../shared/scene.js';
import {slotCount} from '../shared/scene.js';
import {inflate} from './inflate.js';
import {PageTable} from './page_table.js';
import {pageEntry, Refused} from './scene_reader.js';
import {NoDecoder} from './video_decoder.js';

/** What decodes the pictures; PictureDecoder, or a script in a test. */
export interface Decoder {
  decode(h264: Uint8Array, key: boolean, timestamp: number): Promise<Planes>;
  reset(): void;
}

interface Edit {
  entry: number;
  slot: number;
  coverage: Uint8Array | null;
  through: Uint8Array | null;
}

const kNoTile = -1;

// Exactly `bytes` of one slot.
function inflateSlot(packed: Uint8Array, bytes: number, what: string): Uint8Array | null {
  if (packed.length === 0) return null;
  const out = inflate(packed, bytes);
  if (out?.length !== bytes) throw new Refused(`${what} is not of a slot's size`);
  return out;
}

/**
 * A gap in the frame numbers or a picture that does not decode skips frames until the next key frame (`keyWanted`); a
 * message that contradicts the manifest throws Refused: the server is not to be trusted. The server may go over to
 * another of its streams: with a key frame, which replaces what there was; until it is there the picture stays.
 */
export class StreamPlayer {
  keyWanted = true;
  framesLost = 0;
  lastFrame = 0;
  private fresh = true;
  private stream = 0n;  // of the last frame
  private readonly pages: PageTable;
  private readonly slots: number;
  private readonly slotTile: Int32Array;  // whose coverage lies in the slot
  private readonly slotMasked: Uint8Array;
  private readonly slotClear: Uint8Array;

  constructor(private readonly layer: 'shared' | 'view', private readonly scene: SceneShape,
              private readonly size: number, private readonly decoder: Decoder) {
    this.pages = new PageTable(scene.tileCount);
    this.slots = slotCount(size);
    this.slotTile = new Int32Array(this.slots).fill(kNoTile);
    this.slotMasked = new Uint8Array(this.slots);
    this.slotClear = new Uint8Array(this.slots);
  }

  get resident(): number {
    return this.pages.resident;
  }

  /** Calls must not overlap. Null: skipped. */
  async apply(frame: StreamFrame): Promise<FrameUpdate | null> {
    const number = Number(frame.frame);
    const follows = frame.stream === this.stream && number === this.lastFrame + 1;
    if (!frame.key && (this.keyWanted || !follows)) return this.loseTrack();
    const edits = this.readEdits(frame, number);
    if (frame.pixels.length > 0) throw new Refused(`frame ${number}: bare pixels on a coded stream`);
    let picture: Planes | null = null;
    if (frame.key || frame.h264.length > 0) {
      try {
        picture = await this.decoder.decode(frame.h264, frame.key, number);
      } catch (error) {
        if (error instanceof NoDecoder) throw error;
        this.decoder.reset();
        return this.loseTrack();
      }
      if (picture.width !== this.size || picture.height !== this.size) {
        throw new Refused(`frame ${number}: picture is ${picture.width}x${picture.height}, not the size agreed`);
      }
    }
    this.stream = frame.stream;
    return this.commit(frame.key, number, edits, picture);
  }

  private loseTrack(): null {
    ++this.framesLost;
    this.keyWanted = true;
    return null;
  }

  private readEdits(frame: StreamFrame, number: number): Edit[] {
    if (frame.pageEdits.length > kMaxPageEditsPerSlot * this.slots) {
      throw new Refused(`frame ${number}: ${frame.pageEdits.length} page edits`);
    }
    return frame.pageEdits.map((info) => {
      const entry = pageEntry(this.scene.levels, info.tile);
      if (entry < 0) throw new Refused(`frame ${number}: no such tile ${info.tile}`);
      if (info.slot !== kAbsent && info.slot >= this.slots) {
        throw new Refused(`frame ${number}: no such slot ${info.slot}`);
      }
      return {
        entry,
        slot: info.slot,
        coverage: inflateSlot(info.coverage, kSlotTexels, `frame ${number}: coverage of a tile`),
        through: inflateSlot(info.through, kSlotTexels * 3, `frame ${number}: through of a tile`),
      };
    });
  }

  private commit(key: boolean, number: number, edits: Edit[], picture: Planes | null): FrameUpdate {
    if (key) this.pages.clear();
    const coverage = new Map<number, Uint8Array>();
    const through = new Map<number, Uint8Array>();
    for (const edit of edits) {
      this.pages.set(edit.entry, edit.slot);
      if (edit.slot === kAbsent) continue;
      // What is sent once stays with its tile; another tile in the slot starts from opaque.
      const sameTile = this.slotTile[edit.slot] === edit.entry;
      this.slotTile[edit.slot] = edit.entry;
      keep(through, this.slotClear, edit.slot, edit.through, sameTile, () => new Uint8Array(kSlotTexels * 3));
      keep(coverage, this.slotMasked, edit.slot, edit.coverage, sameTile, () => new Uint8Array(kSlotTexels).fill(255));
    }
    this.lastFrame = number;
    this.keyWanted = false;
    const update: FrameUpdate = {
      layer: this.layer, frame: number, fresh: this.fresh, picture, pages: this.pages.takeDirtyRows(),
      coverage: listed(coverage), through: listed(through),
    };
    this.fresh = false;
    return update;
  }
}

function keep(changed: Map<number, Uint8Array>, special: Uint8Array, slot: number, bytes: Uint8Array | null,
              sameTile: boolean, plain: () => Uint8Array): void {
  if (bytes !== null) {
    changed.set(slot, bytes);
    special[slot] = 1;
  } else if (!sameTile && special[slot] === 1) {
    changed.set(slot, plain());
    special[slot] = 0;
  }
}

function listed(changed: Map<number, Uint8Array>): SlotBytes[] {
  return [...changed].map(([slot, bytes]) => ({slot, bytes}));
}
