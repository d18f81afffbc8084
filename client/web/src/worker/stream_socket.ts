// The WebSocket: one binary message is one Envelope. Opens again by itself after a loss, later each time.
import {create, fromBinary, toBinary} from '@bufbuild/protobuf';

import type {Envelope} from '../gen/darm_pb.js';
import {EnvelopeSchema, Goodbye_Reason, GoodbyeSchema, PingSchema, PongSchema} from '../gen/darm_pb.js';
import {kProtocolVersion, kSubprotocol} from '../shared/limits.js';
import type {OutReason} from '../shared/messages.js';

const kFirstRetryMs = 300;
const kLongestRetryMs = 5000;
const kFullRetryMs = 10_000;
const kPingEveryMs = 4000;
const kSilenceMs = 12_000;
const kConnectMs = 10_000;

export type Body = Envelope['body'];

export interface SocketOwner {
  /** The socket is open: say Hello. */
  hello(): Body;
  /** Any message but Ping, Pong and Goodbye. */
  message(body: Body, bytes: number): void;
  /** The stream is gone; `retryMs` < 0: for good. */
  out(reason: OutReason, text: string, retryMs: number): void;
}

/** Milliseconds until try number `n` (0, 1, ...): twice as long each time, a fifth at random so that clients spread. */
export function retryDelay(n: number, random: number): number {
  return Math.min(kLongestRetryMs, kFirstRetryMs * 2 ** Math.min(n, 10)) * (0.9 + 0.2 * random);
}

/** What a goodbye means for the person at the screen. `lost` is tried again as after any loss, later each time. */
export function meaningOf(reason: Goodbye_Reason, text: string): {reason: OutReason; text: string; retryMs: number} {
  switch (reason) {
    case Goodbye_Reason.SERVER_FULL:
      return {reason: 'full', text: 'The server has as many visitors as it may have.', retryMs: kFullRetryMs};
    case Goodbye_Reason.VERSION_UNSUPPORTED:
      return {reason: 'version', text, retryMs: -1};
    case Goodbye_Reason.FORMAT_REFUSED:
      return {reason: 'refused', text, retryMs: -1};
    case Goodbye_Reason.PROTOCOL_ERROR:
      return {reason: 'fault', text, retryMs: -1};
    default:
      return {reason: 'lost', text: text || 'The connection is gone.', retryMs: kFirstRetryMs};
  }
}

export class StreamSocket {
  private socket: WebSocket | null = null;
  private tries = 0;
  private timer = 0;
  private pinger = 0;
  private heard = 0;
  private watchedAt = 0;
  private stopped = false;  // for good
  private away = false;     // until resume()

  constructor(private readonly url: string, private readonly owner: SocketOwner) {
    self.addEventListener('online', () => this.retryNow());
  }

  open(): void {
    const socket = new WebSocket(this.url, kSubprotocol);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    this.heard = this.watchedAt = performance.now();
    let opened = false;
    socket.onopen = () => {
      opened = true;
      this.heard = performance.now();
      this.send(this.owner.hello());
    };
    socket.onmessage = (event: MessageEvent<ArrayBuffer | string>) => this.received(event.data);
    socket.onclose = () => {
      if (this.socket !== socket) return;
      this.socket = null;
      clearInterval(this.pinger);
      if (opened) this.lost('The connection is gone.');
      else void this.explainRefusal();
    };
    clearInterval(this.pinger);
    this.pinger = self.setInterval(() => this.watch(opened), kPingEveryMs / 2);
  }

  /** The session is agreed on: the next loss is a new one. */
  joined(): void {
    this.tries = 0;
  }

  send(body: Body): void {
    if (this.socket?.readyState !== WebSocket.OPEN) return;
    this.socket.send(toBinary(EnvelopeSchema, create(EnvelopeSchema, {body})));
  }

  /** The server is not to be trusted any more. */
  fail(text: string): void {
    this.end('fault', text, -1);
  }

  /** The page is put away, perhaps for a while only. */
  close(): void {
    this.send({case: 'goodbye', value: create(GoodbyeSchema, {reason: Goodbye_Reason.CLIENT_LEAVES})});
    this.drop();
    clearTimeout(this.timer);
    this.timer = 0;
    this.away = true;
  }

  /** It is back. */
  resume(): void {
    if (!this.away || this.stopped) return;
    this.away = false;
    this.open();
  }

  /** There is no way on with this server. */
  stop(): void {
    this.close();
    this.stopped = true;
  }

  retryNow(): void {
    if (this.socket !== null || this.timer === 0) return;
    clearTimeout(this.timer);
    this.timer = 0;
    this.open();
  }

  private received(data: ArrayBuffer | string): void {
    this.heard = performance.now();
    if (typeof data === 'string') return this.fail('The server sent a text, which is no message of this protocol.');
    let envelope: Envelope;
    try {
      envelope = fromBinary(EnvelopeSchema, new Uint8Array(data));
    } catch {
      return this.fail('The server sent a message that cannot be read.');
    }
    const body = envelope.body;
    if (body.case === 'ping') return this.send({case: 'pong', value: create(PongSchema, {timeUs: body.value.timeUs})});
    if (body.case === 'pong') return;
    if (body.case === 'goodbye') {
      const meaning = meaningOf(body.value.reason, body.value.text.slice(0, 512));
      return meaning.reason === 'lost' ? this.lost(meaning.text) : this.end(meaning.reason, meaning.text, meaning.retryMs);
    }
    this.owner.message(body, data.byteLength);
  }

  private watch(opened: boolean): void {
    // A page that slept has not listened either.
    const now = performance.now();
    if (now - this.watchedAt > 2 * kPingEveryMs) this.heard = now;
    this.watchedAt = now;
    const silence = performance.now() - this.heard;
    if (silence > (opened ? kSilenceMs : kConnectMs)) return this.lost('The server does not answer.');
    if (silence > kPingEveryMs) {
      this.send({case: 'ping', value: create(PingSchema, {timeUs: BigInt(Math.round(performance.now() * 1000))})});
    }
  }

  private lost(text: string): void {
    this.end('lost', text, retryDelay(this.tries++, Math.random()));
  }

  // Somebody else has decided meanwhile how it goes on.
  private get busy(): boolean {
    return this.away || this.stopped || this.socket !== null || this.timer !== 0;
  }

  // A browser does not say why an upgrade was refused; /healthz does.
  private async explainRefusal(): Promise<void> {
    let text = 'The server does not answer.';
    const health = new URL('/healthz', this.url.replace(/^ws/, 'http'));
    try {
      const reply = await fetch(health, {signal: AbortSignal.timeout(2000), cache: 'no-store'});
      const told = await reply.json() as {protocol?: number};
      if (this.busy) return;
      if (typeof told.protocol === 'number' && told.protocol !== kProtocolVersion) {
        return this.end('version', `The server speaks version ${told.protocol}, this page ${kProtocolVersion}.`, -1);
      }
      if (reply.ok && typeof told.protocol === 'number') {
        text = 'The server is there, but its stream does not come through: what lies between must let WebSockets pass ' +
               'and keep the name of the host.';
      }
    } catch {
      // no server at all: it is tried again
    }
    if (!this.busy) this.lost(text);
  }

  private end(reason: OutReason, text: string, retryMs: number): void {
    this.drop();
    if (retryMs < 0) this.stopped = true;
    if (!this.stopped) {
      clearTimeout(this.timer);
      this.timer = self.setTimeout(() => {
        this.timer = 0;
        this.open();
      }, retryMs);
    }
    this.owner.out(reason, text, retryMs);
  }

  private drop(): void {
    clearInterval(this.pinger);
    const socket = this.socket;
    this.socket = null;
    socket?.close();
  }
}
