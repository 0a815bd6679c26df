/** The session behind an anywidget model in a notebook. */
import { UNQUEUED, Emitter } from './socket_host.js';
import { VERSION, bufferInfo, pictureOf } from './message_frames.js';

/** @typedef {import("./socket_host.js").Host} Host */
/** @typedef {import("./message_frames.js").Arrays} Arrays */
/** @typedef {import("./message_frames.js").Message} Message */
/** @typedef {import("./message_frames.js").Picture} Picture */

/** What anywidget has of a model.
 * @typedef {{get: (name: string) => unknown,
 *   on: (event: string, listener: (...values: any[]) => void) => void,
 *   off: (event: string, listener: (...values: any[]) => void) => void,
 *   send: (content: unknown, callbacks?: unknown, buffers?: (ArrayBuffer | ArrayBufferView)[]) =>
 *   void}} Model */

/** Numbers of one page's messages: other pages of the same model have others. */
const MESSAGES = 2 ** 32;

/** Milliseconds without an answer after which that is said. */
const SILENCE_MS = 10_000;

const ENDED_TEXT = 'The kernel has ended. Run the cell again to continue.';

/** @implements {Host} */
export class ModelHost extends Emitter {
  /** @param {Model} model */
  constructor(model) {
    super();
    this.model = model;
    this.page = 1 + Math.floor(Math.random() * (2 ** 20 - 1));
    this.seq = this.page * MESSAGES;
    /** @type {Map<number, {resolve: (message: Message) => void, reject: (error: Error) => void}>} */
    this.asked = new Map();
    /** @type {(content: any, buffers: DataView[]) => void} */
    this.onContent = (content, buffers) => this.receive(content, buffers);
    model.on('msg:custom', this.onContent);
    // A comm lives from its beginning, and what changes is that it ends: with a kernel that is
    // started again, for one. What is sent to it then reaches nobody.
    this.end = () => this.ended();
    model.on('comm_live_update', this.end);
    this.isOver = false;
    this.isSilent = false;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
  }

  /** Ask for all there is. */
  open() {
    this.send('hello', { version: VERSION }).catch(() => {});
  }

  /** @param {any} content @param {DataView[]} buffers */
  receive(content, buffers) {
    // One model may be shown at several places, each of which hears all.
    if (content.page !== this.page) return;
    /** @type {Arrays} */
    const arrays = {};
    content.buffers.forEach(
      (/** @type {any} */ { name, dtype, shape }, /** @type {number} */ k) => {
        const { buffer, byteOffset, byteLength } = buffers[k];
        // A copy, since numbers need not begin where an array of them could.
        arrays[name] = pictureOf(
          dtype,
          shape,
          /** @type {ArrayBuffer} */ (buffer.slice(byteOffset, byteOffset + byteLength)),
        );
      },
    );
    const message = /** @type {Message} */ ({ ...content, arrays });
    this.hush(false);
    this.emit(message.kind, message);
    if (message.kind === 'state') this.emit('connection', { kind: 'connection', state: 'open' });
    if (message.reply === undefined) return;
    this.asked.get(message.reply)?.resolve(message);
    this.asked.delete(message.reply);
    this.listen(message.reply);
  }

  /** Wait for the next answer, if there is one to come: a kernel that is busy answers late, and one
   * that has ended never does, of which a model may not be told. What was said before something
   * that is answered may have been lost on its way, and says nothing of the kernel.
   * @param {number} answered */
  listen(answered) {
    clearTimeout(this.timer);
    const isWaiting = [...this.asked.keys()].some((seq) => seq > answered);
    this.timer = isWaiting ? setTimeout(() => this.hush(true), SILENCE_MS) : undefined;
  }

  /** @param {boolean} isSilent */
  hush(isSilent) {
    if (isSilent !== this.isSilent) this.emit('silence', { kind: 'silence', isSilent });
    this.isSilent = isSilent;
  }

  /** Nobody is there any more. */
  ended() {
    this.leave(ENDED_TEXT);
    this.hush(false);
    this.emit('closed', { kind: 'closed', reason: 'ended', text: ENDED_TEXT });
  }

  /** Nothing is asked or answered any more. @param {string} why */
  leave(why) {
    this.isOver = true;
    clearTimeout(this.timer);
    for (const { reject } of this.asked.values()) reject(new Error(why));
    this.asked.clear();
  }

  /** @template {keyof import("./messages.js").Requests} K @param {K} kind
   * @param {import("./messages.js").Requests[K]} [fields] @param {Arrays} [arrays]
   * @returns {Promise<Message>} */
  async send(kind, fields, arrays = {}) {
    if (!UNQUEUED.includes(kind)) await this.gate();
    return new Promise((resolve, reject) => {
      if (this.isOver) return reject(new Error(ENDED_TEXT));
      const seq = ++this.seq;
      this.asked.set(seq, { resolve, reject });
      if (this.timer === undefined) this.listen(seq - 1);
      const content = { kind, seq, ...fields, buffers: bufferInfo(arrays) };
      // Copies: what is painted on meanwhile is of another message.
      const bytes = Object.values(arrays).map(({ data }) =>
        data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength),
      );
      this.model.send(content, undefined, /** @type {ArrayBuffer[]} */ (bytes));
    });
  }

  /** @param {string} name @returns {Promise<Picture>} */
  async fetch(name) {
    const message = await this.send('fetch', { name });
    // A place that has just lost the painter is told that, and is given no picture.
    if (message.kind !== 'fetched') throw new Error(`${name}: ${message.text}`);
    return message.arrays.data;
  }

  close() {
    this.model.off('msg:custom', this.onContent);
    this.model.off('comm_live_update', this.end);
    this.leave('the painter is closed');
  }
}
