/** The session behind an anywidget model in a notebook. */
import { UNQUEUED, Emitter } from './socket_host.js';
import { VERSION, bufferInfo, pictureOf } from './message_frames.js';
import { t } from '../language/language.js';

/** @import { Host } from './socket_host.js' */
/** @import { Arrays, Message } from './message_frames.js' */
/** @import { Picture } from '../../../viewer/drawing/lattice.js' */

/** The part of anywidget's model that is used.
 * @typedef {{get: (name: string) => unknown,
 *   on: (event: string, listener: (...values: any[]) => void) => void,
 *   off: (event: string, listener: (...values: any[]) => void) => void,
 *   send: (content: unknown, callbacks?: unknown, buffers?: (ArrayBuffer | ArrayBufferView)[]) =>
 *   void}} Model */

/** Message numbers of this page; other pages of the same model use others. */
const MESSAGES_PER_PAGE = 2 ** 32;

/** Milliseconds without an answer before the page reports it. */
const SILENCE_MS = 10_000;

const ENDED_TEXT = t('The kernel has ended. Run the cell again to continue.');

/** @implements {Host} */
export class ModelHost extends Emitter {
  /** @param {Model} model */
  constructor(model) {
    super();
    this.model = model;
    this.page = 1 + Math.floor(Math.random() * (2 ** 20 - 1));
    this.seq = this.page * MESSAGES_PER_PAGE;
    /** @type {Map<number, {resolve: (message: Message) => void, reject: (error: Error) => void}>} */
    this.requests = new Map();
    /** @type {(content: any, buffers: DataView[]) => void} */
    this.onContent = (content, buffers) => this.receive(content, buffers);
    model.on('msg:custom', this.onContent);
    // A comm is open from the start and can only close, for example when the kernel restarts. Later
    // messages are lost.
    this.onEnd = () => this.handleEnd();
    model.on('comm_live_update', this.onEnd);
    this.isOver = false;
    this.isSilent = false;
    this.isAnswered = false;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
  }

  /** Request the whole state. */
  open() {
    this.send('hello', { version: VERSION }).catch(() => {});
  }

  /** @param {any} content @param {DataView[]} buffers */
  receive(content, buffers) {
    // A model may have several views, and each receives all messages.
    if (content.page !== this.page) return;
    /** @type {Arrays} */
    const arrays = {};
    content.buffers.forEach(
      (/** @type {any} */ { name, dtype, shape }, /** @type {number} */ k) => {
        const { buffer, byteOffset, byteLength } = buffers[k];
        // Copied, since the buffer may not be aligned for a typed array.
        arrays[name] = pictureOf(
          dtype,
          shape,
          /** @type {ArrayBuffer} */ (buffer.slice(byteOffset, byteOffset + byteLength)),
        );
      },
    );
    const message = /** @type {Message} */ ({ ...content, arrays });
    this.isAnswered = true;
    this.setSilent(false);
    this.emit(message.kind, message);
    if (message.kind === 'state') this.emit('connection', { kind: 'connection', state: 'open' });
    if (message.reply === undefined) return;
    this.requests.get(message.reply)?.resolve(message);
    this.requests.delete(message.reply);
    this.awaitAnswer(message.reply);
  }

  /** Wait for the next answer, if one is pending. A busy kernel answers late; one that has ended
   * never answers, and the model may not learn of it. A message older than an answered one may have
   * been lost, which says nothing about the kernel.
   * @param {number} answeredSeq */
  awaitAnswer(answeredSeq) {
    clearTimeout(this.timer);
    const isWaiting = [...this.requests.keys()].some((seq) => seq > answeredSeq);
    this.timer = isWaiting ? setTimeout(() => this.setSilent(true), SILENCE_MS) : undefined;
  }

  /** @param {boolean} isSilent */
  setSilent(isSilent) {
    if (isSilent !== this.isSilent) this.emit('silence', { kind: 'silence', isSilent });
    this.isSilent = isSilent;
  }

  /** Handle the end of the kernel. */
  handleEnd() {
    this.rejectAll(ENDED_TEXT);
    this.setSilent(false);
    this.emit('closed', { kind: 'closed', reason: 'ended', text: ENDED_TEXT });
  }

  /** Reject pending and later requests. @param {string} reason */
  rejectAll(reason) {
    this.isOver = true;
    clearTimeout(this.timer);
    for (const { reject } of this.requests.values()) reject(new Error(reason));
    this.requests.clear();
  }

  /** @template {keyof import("./messages.js").Requests} K @param {K} kind
   * @param {import("./messages.js").Requests[K]} [fields] @param {Arrays} [arrays]
   * @returns {Promise<Message>} */
  async send(kind, fields, arrays = {}) {
    if (!UNQUEUED.includes(kind)) await this.gate();
    return new Promise((resolve, reject) => {
      if (this.isOver) return reject(new Error(ENDED_TEXT));
      const seq = ++this.seq;
      this.requests.set(seq, { resolve, reject });
      if (this.timer === undefined) this.awaitAnswer(seq - 1);
      const content = { kind, seq, ...fields, buffers: bufferInfo(arrays) };
      // Copied, since painting continues in these arrays.
      const bytes = Object.values(arrays).map(({ data }) =>
        data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength),
      );
      this.model.send(content, undefined, /** @type {ArrayBuffer[]} */ (bytes));
    });
  }

  /** @param {string} name @returns {Promise<Picture>} */
  async fetch(name) {
    const message = await this.send('fetch', { name });
    // A view that has just lost the session gets a notice instead of a picture.
    if (message.kind !== 'fetched') throw new Error(`${name}: ${message.text}`);
    return message.arrays.data;
  }

  close() {
    this.model.off('msg:custom', this.onContent);
    this.model.off('comm_live_update', this.onEnd);
    this.rejectAll(t('the painter is closed'));
  }
}
