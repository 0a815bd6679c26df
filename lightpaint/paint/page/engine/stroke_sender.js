/**
 * Sends the changed pixels of strokes to the session, one message at a time.
 *
 * Changes in the meantime go with the next message. A finished stroke is kept until the session
 * confirms it, and sent again as a whole after a lost connection.
 */
import { union } from '../../../viewer/drawing/cpu_picture.js';

/** @typedef {import("./message_frames.js").Region} Region */
/** @typedef {import("./message_frames.js").Arrays} Arrays */
/** @typedef {import("./message_frames.js").Message} Message */
/** @typedef {import("./paint_canvas.js").PaintCanvas} PaintCanvas */

/** The stroke in progress. dirty: region not sent yet. whole: region of the stroke.
 * @typedef {{stroke: number, view: number, dirty: Region | null, whole: Region | null,
 *   isKnown: boolean}} CurrentStroke */
/** A finished or cancelled stroke without an answer yet. cut: region to send.
 * @typedef {{stroke: number, view: number, cut: Region, whole: Region, arrays: Arrays,
 *   label: string} | {stroke: number, isDropped: true}} PendingStroke */

export class StrokeSender {
  /** @param {import("./socket_host.js").Host} host
   * @param {() => void} [refused] hears that the session has not taken a stroke
   * @param {(count: number, isStale: boolean) => void} [onLoss] hears how many strokes are not sent
   * any more, since another page had the session in between; stale: since it is there no more */
  constructor(host, refused = () => {}, onLoss = () => {}) {
    this.host = host;
    /** @type {PaintCanvas | null} */
    this.canvas = null;
    this.view = 0;
    this.refused = refused;
    this.lost = onLoss;
    this.count = 0;
    /** @type {CurrentStroke | null} */
    this.live = null;
    /** @type {PendingStroke[]} */
    this.left = [];
    this.isBusy = false;
    this.isOpen = true;
    this.isOver = false;
    /** Whether painting is impossible: another page has the session, or it has ended. */
    this.isTaken = false;
    /** @type {(() => void)[]} */
    this.waiting = [];
    /** Whether the next patch belongs to a stroke that the canvas has cancelled already. */
    this.isDropping = false;
    this.leave = () => this.hurry();
    addEventListener('pagehide', this.leave);
    host.gate = () => this.settled();
    host.on('connection', ({ state }) => {
      this.connected(state === 'open');
      if (state === 'stale') {
        this.isTaken = true;
        this.forget(true);
      }
    });
    // Pause: another page has the session.
    host.on('closed', () => {
      this.isTaken = true;
      this.connected(false);
    });
    host.on('state', ({ is_back: isBack }) => {
      this.isTaken = false;
      if (isBack === false) this.forget();
    });
    host.on('state', ({ stroke }) => {
      this.count = Math.max(this.count, Number(stroke) || 0);
    });
  }

  /** StrokeSender are of this picture from now on. @param {PaintCanvas} canvas @param {number} view */
  paintOn(canvas, view) {
    this.canvas = canvas;
    this.view = view;
  }

  /** Drop unsent strokes: they would overwrite what another page has painted meanwhile, or nobody
   * would receive them. */
  forget(isStale = false) {
    const count =
      this.left.filter((stroke) => !('isDropped' in stroke)).length + (this.live?.whole ? 1 : 0);
    this.left = [];
    this.live = null;
    this.resolveWaiting();
    if (count) this.lost(count, isStale);
  }

  /** Stop sending. */
  close() {
    this.isOver = true;
    this.left = [];
    removeEventListener('pagehide', this.leave);
    this.resolveWaiting();
  }

  /** The page closes: send finished strokes now, without waiting for answers. */
  hurry() {
    if (!this.isOpen || this.isOver) return;
    for (const pending of this.left) {
      if ('isDropped' in pending) continue;
      const { stroke, view, cut, label } = pending;
      const fields = { stroke, view, region: cut, is_final: true, label };
      // Earlier messages have arrived already.
      this.host.send('paint', fields, cutOf(pending)).catch(() => {});
    }
  }

  /** Return whether parts of a stroke are pending. */
  get isPending() {
    return this.isBusy || this.left.length > 0 || this.live !== null;
  }

  /** Resolve once all finished strokes are answered. @returns {Promise<void>} */
  settled() {
    return new Promise((resolve) => {
      this.waiting.push(resolve);
      this.resolveWaiting();
    });
  }

  resolveWaiting() {
    if (!this.left.length) for (const resolve of this.waiting.splice(0)) resolve();
  }

  begin() {
    const { view } = this;
    this.live = { stroke: ++this.count, view, dirty: null, whole: null, isKnown: false };
  }

  /** Queue changed pixels of the stroke. @param {Region} region */
  touch(region) {
    if (!this.live || region[0] >= region[1] || region[2] >= region[3]) return;
    this.live.dirty = union(this.live.dirty, region);
    this.live.whole = union(this.live.whole, region);
    this.pump();
  }

  /** Finish the stroke. @param {string} label what undo calls it */
  end(label) {
    const { live } = this;
    this.live = null;
    if (live?.whole && this.canvas) {
      const { stroke, view, whole } = live;
      const cut = live.dirty ?? /** @type {Region} */ ([whole[0], whole[0], whole[2], whole[2]]);
      this.left.push({ stroke, view, cut, whole, arrays: this.canvas.copy(whole), label });
    }
    this.pump();
  }

  /** Cancel the stroke; the canvas has done so already. */
  drop() {
    const { live } = this;
    this.live = null;
    if (live?.isKnown) this.left.push({ stroke: live.stroke, isDropped: true });
    this.pump();
  }

  /** @param {boolean} isOpen */
  connected(isOpen) {
    this.isOpen = isOpen;
    if (!isOpen) {
      // It is unknown which of them arrived.
      for (const stroke of this.left) if (!('isDropped' in stroke)) stroke.cut = stroke.whole;
      if (this.live) this.live.dirty = this.live.whole;
    }
    this.pump();
  }

  /** Send the next message, unless one is pending. */
  pump() {
    if (this.isBusy || !this.isOpen || this.isOver) return;
    const [next] = this.left;
    if (next && 'isDropped' in next) this.send('drop_stroke', { stroke: next.stroke }, {}, next);
    else if (next) {
      const { stroke, view, cut, label } = next;
      this.send('paint', { stroke, view, region: cut, is_final: true, label }, cutOf(next), next);
    } else if (this.live?.dirty && this.canvas) {
      const { stroke, view, dirty } = this.live;
      this.live.dirty = null;
      this.live.isKnown = true;
      const fields = { stroke, view, region: dirty, is_final: false };
      this.send('paint', fields, this.canvas.copy(dirty), null);
    }
  }

  /** @template {"paint" | "drop_stroke"} K @param {K} kind
   * @param {import("./messages.js").Requests[K]} fields @param {Arrays} arrays
   * @param {PendingStroke | null} pending what is answered with it */
  async send(kind, fields, arrays, pending) {
    this.isBusy = true;
    this.isDropping = kind === 'drop_stroke';
    try {
      const reply = await this.host.send(kind, fields, arrays);
      if (pending && reply.kind !== 'closed')
        this.left = this.left.filter((stroke) => stroke !== pending);
      if (pending && reply.kind === 'failed') this.refused();
    } catch {
      // Pause after a lost connection, until `connected` is called.
      this.isOpen = false;
    }
    this.isBusy = false;
    this.isDropping = false;
    this.resolveWaiting();
    this.pump();
  }
}

/** Return the pixels of a finished stroke that have to be sent.
 * @param {{cut: Region, whole: Region, arrays: Arrays}} left @returns {Arrays} */
function cutOf({ cut, whole, arrays }) {
  const [height, width] = [cut[1] - cut[0], cut[3] - cut[2]];
  if (cut === whole) return arrays;
  const rowLength = whole[3] - whole[2];
  /** @type {Arrays} */
  const parts = {};
  for (const [name, { data, shape }] of Object.entries(arrays)) {
    const depth = shape[2] ?? 1;
    const part = new Float32Array(height * width * depth);
    for (let y = 0; y < height; y++) {
      const start = ((cut[0] - whole[0] + y) * rowLength + cut[2] - whole[2]) * depth;
      part.set(data.subarray(start, start + width * depth), y * width * depth);
    }
    parts[name] = { data: part, shape: [height, width, ...shape.slice(2)] };
  }
  return parts;
}
