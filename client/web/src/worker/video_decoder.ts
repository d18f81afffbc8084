// H.264 in, planes out, by WebCodecs.
import type {Planes} from '../shared/scene.js';

/** No decoder, or one that gives no planes: the page can only say so. */
export class NoDecoder extends Error {}

/** "avc1.PPCCLL" of the first sequence parameter set of an Annex B stream; null: it has none. */
export function codecOf(h264: Uint8Array): string | null {
  for (let i = 0; i + 6 < h264.length; ++i) {
    if (h264[i] !== 0 || h264[i + 1] !== 0 || h264[i + 2] !== 1) continue;
    if ((h264[i + 3]! & 31) !== 7) continue;
    const hex = (byte: number): string => byte.toString(16).padStart(2, '0');
    return `avc1.${hex(h264[i + 4]!)}${hex(h264[i + 5]!)}${hex(h264[i + 6]!)}`;
  }
  return null;
}

/** Splits interleaved chroma (NV12) into two planes. */
export function splitChroma(interleaved: Uint8Array, cb: Uint8Array, cr: Uint8Array): void {
  for (let i = 0, j = 0; i < cb.length; ++i, j += 2) {
    cb[i] = interleaved[j]!;
    cr[i] = interleaved[j + 1]!;
  }
}

/**
 * A picture that is not out by then is held back by the decoder, which waits for more: none would ever come. Long, because
 * fourteen pages on two cores take seconds too. Stills are flushed, and cannot be held back.
 */
const kHeldBackMs = 10_000;

type Waiting = {timestamp: number; resolve: (frame: VideoFrame) => void; reject: (error: Error) => void};

/**
 * One stream of pictures. Pictures are decoded one at a time, each before the next is given. A failure loses track: the
 * next picture must be a key frame.
 */
export class PictureDecoder {
  private decoder: VideoDecoder | null = null;
  private waiting: Waiting | null = null;
  private configured = '';
  private preference: HardwareAcceleration = 'no-preference';
  private heldBack = 0;  // in a row

  /** `take` gives a buffer of at least so many bytes. `still`: each picture is a stream of its own. */
  constructor(private readonly take: (bytes: number) => ArrayBuffer, private readonly still = false) {}

  async decode(h264: Uint8Array, key: boolean, timestamp: number): Promise<Planes> {
    if (key) this.configure(h264);
    const decoder = this.decoder;
    if (decoder === null) throw new Error('no key frame yet');
    let late: ReturnType<typeof setTimeout> | undefined;
    const frame = await new Promise<VideoFrame>((resolve, reject) => {
      this.waiting = {timestamp, resolve, reject};
      if (!this.still) late = setTimeout(() => this.giveUpWaiting(), kHeldBackMs);
      decoder.decode(new EncodedVideoChunk({type: key ? 'key' : 'delta', timestamp, data: h264}));
      if (this.still) decoder.flush().catch(reject);
    }).finally(() => clearTimeout(late));
    this.heldBack = 0;
    try {
      return await this.planesOf(frame);
    } finally {
      frame.close();
    }
  }

  reset(): void {
    const decoder = this.decoder;
    this.decoder = null;
    this.configured = '';
    if (decoder !== null && decoder.state !== 'closed') decoder.close();
    this.waiting?.reject(new Error('the decoder was reset'));
    this.waiting = null;
  }

  // Once may be a machine that slept; a decoder that does it again is a kind that does.
  private giveUpWaiting(): void {
    if (++this.heldBack > 1) this.preference = 'prefer-software';
    this.reset();
  }

  private configure(h264: Uint8Array): void {
    const codec = codecOf(h264);
    if (codec === null) throw new Error('a key frame without parameters');
    if (this.decoder?.state === 'configured' && this.configured === codec) return;
    this.reset();
    this.decoder = new VideoDecoder({
      output: (frame) => {
        const waiting = this.waiting;
        if (waiting === null || frame.timestamp !== waiting.timestamp) return frame.close();
        this.waiting = null;
        waiting.resolve(frame);
      },
      error: (error) => {
        this.decoder = null;
        this.configured = '';
        this.waiting?.reject(error.name === 'NotSupportedError' ? new NoDecoder(error.message) : error);
        this.waiting = null;
      },
    });
    this.decoder.configure({codec, optimizeForLatency: true, hardwareAcceleration: this.preference});
    this.configured = codec;
  }

  private async planesOf(frame: VideoFrame): Promise<Planes> {
    const rect = frame.visibleRect;
    const format = frame.format;
    if (rect === null || format === null || !['I420', 'I444', 'NV12'].includes(format)) {
      // Some hardware keeps its pictures to itself; software does not.
      if (this.preference === 'prefer-software') throw new NoDecoder(`pictures come as ${format ?? 'nothing readable'}`);
      this.preference = 'prefer-software';
      this.reset();
      throw new Error('the decoder is changed');
    }
    const {width, height} = rect;
    const chroma444 = format === 'I444';
    const cw = chroma444 ? width : (width + 1) >> 1;
    const ch = chroma444 ? height : (height + 1) >> 1;
    const cb = width * height;
    const cr = cb + cw * ch;
    const nv12 = format === 'NV12';
    const total = cr + cw * ch;
    const buffer = this.take(nv12 ? total + 2 * cw * ch : total);
    const layout = nv12 ? [{offset: 0, stride: width}, {offset: total, stride: 2 * cw}]
                        : [{offset: 0, stride: width}, {offset: cb, stride: cw}, {offset: cr, stride: cw}];
    await frame.copyTo(buffer, {rect, layout});
    if (nv12) {
      splitChroma(new Uint8Array(buffer, total, 2 * cw * ch), new Uint8Array(buffer, cb, cw * ch),
                  new Uint8Array(buffer, cr, cw * ch));
    }
    return {width, height, chroma444, buffer, y: 0, cb, cr};
  }
}
