// Buffers that go to the page with a picture and come back: a few megabytes each, ten times a second.

const kMostKept = 4;

export class BufferPool {
  private readonly kept: ArrayBuffer[] = [];

  /** A buffer of exactly `bytes`. */
  take(bytes: number): ArrayBuffer {
    const found = this.kept.findIndex((buffer) => buffer.byteLength === bytes);
    return found < 0 ? new ArrayBuffer(bytes) : this.kept.splice(found, 1)[0]!;
  }

  give(buffer: ArrayBuffer): void {
    if (buffer.byteLength === 0) return;
    this.kept.push(buffer);
    if (this.kept.length > kMostKept) this.kept.shift();
  }
}
