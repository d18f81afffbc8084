// What a server has packed with DEFLATE (zlib), unpacked within a bound.
import {unzlibSync} from 'three/examples/jsm/libs/fflate.module.js';

/**
 * Null if `packed` is damaged or holds more than `atMost` bytes. The output has room for one more from the start: nothing
 * larger is ever unpacked, and what is larger fills it.
 */
export function inflate(packed: Uint8Array, atMost: number): Uint8Array | null {
  try {
    const out = unzlibSync(packed, {out: new Uint8Array(atMost + 1)});
    return out.length <= atMost ? out : null;
  } catch {
    return null;
  }
}
