/** Sessions that are none, for tests of what is sent. */
import { Emitter } from "/engine/socket_host.js";

/** Keeps requests until a test answers them. */
export class SlowHost extends Emitter {
  requests = [];
  isOpen = true;

  send(kind, fields = {}, arrays = {}) {
    if (!this.isOpen) return Promise.reject(new Error("lost"));
    return new Promise((resolve, reject) => {
      this.requests.push({ kind, fields, arrays, resolve, reject });
    });
  }

  /** How many messages are on their way. */
  get inFlight() {
    return this.requests.filter((one) => !one.isDone).length;
  }

  /** Answer the first that is not. */
  async answer(kind = "answer", more = {}) {
    const next = this.requests.find((one) => !one.isDone);
    next.isDone = true;
    this.emit(kind, { kind, arrays: {}, ...more });
    next.resolve({ kind, arrays: {}, ...more });
    await settle();
  }

  async lose() {
    this.isOpen = false;
    for (const one of this.requests.filter((x) => !x.isDone)) {
      one.isDone = true;
      one.reject(new Error("lost"));
    }
    this.emit("connection", { kind: "connection", state: "lost" });
    await settle();
  }

  async find(stroke = 0) {
    this.isOpen = true;
    this.emit("state", { kind: "state", stroke, arrays: {} });
    this.emit("connection", { kind: "connection", state: "open" });
    await settle();
  }

  /** The requests, without pixels. */
  get told() {
    return this.requests.map(({ kind, fields, arrays }) => ({
      kind,
      ...fields,
      shapes: Object.fromEntries(Object.entries(arrays).map(([k, v]) => [k, v.shape])),
    }));
  }
}

/** Let promises that are settled be heard. */
export const settle = () => new Promise((done) => setTimeout(done, 0));

/** A socket whose other end is the test. */
export class FakeSocket {
  static OPEN = 1;
  static made = [];
  readyState = 0;
  sent = [];

  constructor(url) {
    this.url = String(url);
    FakeSocket.made.push(this);
  }

  send(data) {
    this.sent.push(data);
  }

  open() {
    this.readyState = 1;
    this.onopen?.({});
  }

  receive(data) {
    this.onmessage?.({ data });
  }

  close() {
    this.readyState = 3;
    this.onclose?.({});
  }
}
