// Takes the lag of an answered camera apart by the stamps of the server's clock and of this one.
import type {Stamps} from '../gen/darm_pb.js';
import type {Answer} from '../shared/messages.js';

/** Null: the frame answers no camera. Times are microseconds; a step without a stamp took no time. */
export function answerOf(stamps: Stamps | undefined, receivedUs: number, decodedUs: number): Answer | null {
  const sentUs = Number(stamps?.clientSent ?? 0n);
  if (stamps === undefined || sentUs <= 0 || stamps.cameraReceived <= 0n || stamps.sent <= 0n) return null;
  let before = Number(stamps.cameraReceived);
  const until = (stamp: bigint): number => {
    const at = stamp > 0n ? Number(stamp) : before;
    const took = (at - before) / 1000;
    before = at;
    return took;
  };
  const stages = {
    network: (receivedUs - sentUs - Number(stamps.sent - stamps.cameraReceived)) / 1000,
    wait: until(stamps.viewStarted),
    visibility: until(stamps.viewReady),
    shading: until(stamps.encodeStarted),
    encode: until(stamps.encoded),
    queue: until(stamps.sent),
    decode: (decodedUs - receivedUs) / 1000,
  };
  return {sentUs, decodedUs, stages};
}
