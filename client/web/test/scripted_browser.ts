// What the worker needs of a browser, scripted: a clock that stands until it is moved, WebSockets that a test plays the
// server of, and /healthz.
import {create, fromBinary, toBinary} from '@bufbuild/protobuf';

import type {Envelope} from '../src/gen/darm_pb.js';
import {EnvelopeSchema} from '../src/gen/darm_pb.js';
import type {Body} from '../src/worker/stream_socket.js';

interface Alarm {
  id: number;
  at: number;
  every: number;  // 0: once
  ring: () => void;
}

/** The server's end of one connection. */
export class Line {
  static readonly OPEN = 1;
  static readonly made: Line[] = [];
  readyState = 0;
  binaryType = '';
  closed = false;
  readonly said: Envelope['body'][] = [];
  onopen: (() => void) | null = null;
  onclose: (() => void) | null = null;
  onmessage: ((event: {data: ArrayBuffer | string}) => void) | null = null;

  constructor(readonly url: string, readonly protocol: string) {
    Line.made.push(this);
  }

  send(bytes: Uint8Array): void {
    this.said.push(fromBinary(EnvelopeSchema, bytes).body);
  }

  /** By the page. */
  close(): void {
    this.readyState = 2;
    this.closed = true;
  }

  accept(): void {
    this.readyState = Line.OPEN;
    this.onopen?.();
  }

  /** Cut, or refused if it was not accepted. */
  cut(): void {
    if (this.readyState === 3) return;
    this.readyState = 3;
    this.onclose?.();
  }

  say(body: Body): void {
    const bytes = toBinary(EnvelopeSchema, create(EnvelopeSchema, {body}));
    this.raw(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength) as ArrayBuffer);
  }

  raw(data: ArrayBuffer | string): void {
    if (this.readyState === Line.OPEN) this.onmessage?.({data});
  }

  heard(kind: NonNullable<Body['case']>): number {
    return this.said.filter((body) => body.case === kind).length;
  }
}

export class ScriptedBrowser {
  now = 1000;
  /** What /healthz says; null: nobody answers. */
  health: {status: number; body: string} | null = null;
  private alarms: Alarm[] = [];
  private nextId = 1;
  private readonly listeners = new Map<string, (() => void)[]>();

  /** Takes the place of the globals: one a test file. */
  constructor() {
    const add = (ring: () => void, ms: number, every: number): number => {
      this.alarms.push({id: this.nextId, at: this.now + ms, every, ring});
      return this.nextId++;
    };
    const remove = (id: number): void => void (this.alarms = this.alarms.filter((alarm) => alarm.id !== id));
    const put = (name: string, value: unknown): void =>
      void Object.defineProperty(globalThis, name, {value, configurable: true, writable: true});
    const timers = {
      setTimeout: (ring: () => void, ms: number) => add(ring, ms, 0),
      setInterval: (ring: () => void, ms: number) => add(ring, ms, ms),
      clearTimeout: remove, clearInterval: remove,
    };
    for (const [name, timer] of Object.entries(timers)) put(name, timer);
    put('self', {...timers, addEventListener: (type: string, listener: () => void) =>
      void this.listeners.set(type, [...(this.listeners.get(type) ?? []), listener])});
    put('performance', {now: () => this.now, timeOrigin: 0});
    put('WebSocket', Line);
    put('fetch', async () => {
      if (this.health === null) throw new TypeError('Failed to fetch');
      return new Response(this.health.body, {status: this.health.status});
    });
  }

  get line(): Line {
    return Line.made.at(-1)!;
  }

  get lines(): number {
    return Line.made.length;
  }

  fire(event: string): void {
    for (const listener of this.listeners.get(event) ?? []) listener();
  }

  /** Lets all run that waits for nothing but its turn. */
  async settle(): Promise<void> {
    for (let i = 0; i < 50; ++i) await Promise.resolve();
    await new Promise((resolve) => setImmediate(resolve));
    for (let i = 0; i < 50; ++i) await Promise.resolve();
  }

  /** Time passes, with all that is due in it. */
  async pass(ms: number): Promise<void> {
    const end = this.now + ms;
    for (;;) {
      await this.settle();
      const next = this.alarms.filter((alarm) => alarm.at <= end).sort((a, b) => a.at - b.at)[0];
      if (next === undefined) break;
      this.now = Math.max(this.now, next.at);
      if (next.every > 0) next.at += next.every;
      else this.alarms = this.alarms.filter((alarm) => alarm !== next);
      next.ring();
    }
    this.now = end;
    await this.settle();
  }

  /** The machine sleeps: time passes and nothing runs; then what was due runs once. */
  async sleep(ms: number): Promise<void> {
    this.now += ms;
    for (const alarm of this.alarms) alarm.at = Math.max(alarm.at, this.now);
    await this.settle();
  }
}
