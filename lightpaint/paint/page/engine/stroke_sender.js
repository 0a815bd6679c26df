/**
 * Sends the changed pixels of strokes to the session, one message at a time.
 *
 * What changes in the meantime is sent together with the next one. A stroke that is done is kept
 * until the session has said that it has it, and sent again, whole, after a lost connection.
 */
import { union } from '../../../viewer/drawing/layer.js';

/** @typedef {import("./message_frames.js").Region} Region */
/** @typedef {import("./message_frames.js").Arrays} Arrays */
/** @typedef {import("./message_frames.js").Message} Message */
/** @typedef {import("./paint_canvas.js").PaintCanvas} PaintCanvas */

/** The stroke in progress. dirty: what is not sent. whole: where it has been.
 * @typedef {{stroke: number, view: number, dirty: Region | null, whole: Region | null,
 *   isKnown: boolean}} CurrentStroke */
/** A stroke that is done, or dropped, and not yet answered. cut: what of it has to be sent.
 * @typedef {{stroke: number, view: number, cut: Region, whole: Region, arrays: Arrays,
 *   label: string} | {stroke: number, isDropped: true}} PendingStroke */

export class StrokeSender {
  /** @param {import("./socket_host.js").Host} host
   * @param {() => void} [refused] hears that the session has not taken a stroke
   * @param {(count: number, isStale: boolean) => void} [lost] hears how many strokes are not sent
   * any more, since another page had the session in between; stale: since it is there no more */
  constructor(host, refused = () => {}, lost = () => {}) {
    this.host = host;
    /** @type {PaintCanvas | null} */
    this.canvas = null;
    this.view = 0;
    this.refused = refused;
    this.lost = lost;
    this.count = 0;
    /** @type {CurrentStroke | null} */
    this.live = null;
    /** @type {PendingStroke[]} */
    this.left = [];
    this.isBusy = false;
    this.isOpen = true;
    this.isOver = false;
    /** Whether nothing can be painted: another page has the session, or it is there no more. */
    this.isTaken = false;
    /** @type {(() => void)[]} */
    this.waiting = [];
    /** Whether the next patch is of a stroke that the canvas has dropped already. */
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
    // Another page has the session: nothing is said to it.
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

  /** Another page has painted meanwhile, and what the session has not heard would lie over that;
   * or nobody is there who would hear it. */
  forget(isStale = false) {
    const count =
      this.left.filter((one) => !('isDropped' in one)).length + (this.live?.whole ? 1 : 0);
    this.left = [];
    this.live = null;
    this.resolveWaiting();
    if (count) this.lost(count, isStale);
  }

  /** Say nothing any more. */
  close() {
    this.isOver = true;
    this.left = [];
    removeEventListener('pagehide', this.leave);
    this.resolveWaiting();
  }

  /** The page goes away: what is done is said now, and nobody waits for the answers. */
  hurry() {
    if (!this.isOpen || this.isOver) return;
    for (const one of this.left) {
      if ('isDropped' in one) continue;
      const { stroke, view, cut, label } = one;
      const fields = { stroke, view, region: cut, done: true, label };
      // What has been said already is there already.
      this.host.send('paint', fields, cutOf(one)).catch(() => {});
    }
  }

  /** Whether anything of a stroke is on its way, or will be. */
  get isPending() {
    return this.isBusy || this.left.length > 0 || this.live !== null;
  }

  /** Once all strokes that are done are answered. @returns {Promise<void>} */
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

  /** Pixels of the stroke have changed. @param {Region} region */
  touch(region) {
    if (!this.live || region[0] >= region[1] || region[2] >= region[3]) return;
    this.live.dirty = union(this.live.dirty, region);
    this.live.whole = union(this.live.whole, region);
    this.pump();
  }

  /** The stroke is done. @param {string} label what undo calls it */
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

  /** The stroke has never been; the canvas knows already. */
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
      // What of them was heard nobody knows.
      for (const one of this.left) if (!('isDropped' in one)) one.cut = one.whole;
      if (this.live) this.live.dirty = this.live.whole;
    }
    this.pump();
  }

  /** Send the next thing, if nothing is on its way. */
  pump() {
    if (this.isBusy || !this.isOpen || this.isOver) return;
    const [next] = this.left;
    if (next && 'isDropped' in next) this.send('drop', { stroke: next.stroke }, {}, next);
    else if (next) {
      const { stroke, view, cut, label } = next;
      this.send('paint', { stroke, view, region: cut, done: true, label }, cutOf(next), next);
    } else if (this.live?.dirty && this.canvas) {
      const { stroke, view, dirty } = this.live;
      this.live.dirty = null;
      this.live.isKnown = true;
      const fields = { stroke, view, region: dirty, done: false };
      this.send('paint', fields, this.canvas.copy(dirty), null);
    }
  }

  /** @template {"paint" | "drop"} K @param {K} kind
   * @param {import("./messages.js").Requests[K]} fields @param {Arrays} arrays
   * @param {PendingStroke | null} left what is answered with it */
  async send(kind, fields, arrays, left) {
    this.isBusy = true;
    this.isDropping = kind === 'drop';
    try {
      const reply = await this.host.send(kind, fields, arrays);
      if (left && reply.kind !== 'closed') this.left = this.left.filter((one) => one !== left);
      if (left && reply.kind === 'failed') this.refused();
    } catch {
      // The connection is lost; `connected` says when it is there again.
      this.isOpen = false;
    }
    this.isBusy = false;
    this.isDropping = false;
    this.resolveWaiting();
    this.pump();
  }
}

/** Of a stroke that is done, the pixels that have to be sent.
 * @param {{cut: Region, whole: Region, arrays: Arrays}} left @returns {Arrays} */
function cutOf({ cut, whole, arrays }) {
  const [height, width] = [cut[1] - cut[0], cut[3] - cut[2]];
  if (cut === whole) return arrays;
  const across = whole[3] - whole[2];
  /** @type {Arrays} */
  const made = {};
  for (const [name, { data, shape }] of Object.entries(arrays)) {
    const depth = shape[2] ?? 1;
    const part = new Float32Array(height * width * depth);
    for (let y = 0; y < height; y++) {
      const from = ((cut[0] - whole[0] + y) * across + cut[2] - whole[2]) * depth;
      part.set(data.subarray(from, from + width * depth), y * width * depth);
    }
    made[name] = { data: part, shape: [height, width, ...shape.slice(2)] };
  }
  return made;
}
