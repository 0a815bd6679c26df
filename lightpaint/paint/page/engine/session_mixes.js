/**
 * Pictures of lightings that the session mixes, where the lights are too many for a page to hold
 * their planes.
 *
 * Each slot of the view's planes shows one lighting. Drafts come at once, with the answer to paint or
 * one in flight for each slot; the exact picture comes after a pause without changes.
 */
import { DraftDetail } from './draft_detail.js';
import { nameInView } from './message_frames.js';
import { repeatPixels } from '../../../viewer/drawing/coarse_planes.js';
import { toFloats } from '../../../viewer/drawing/half_floats.js';
import { COMPARED_COUNT } from './picture_slots.js';

/** @import { Message } from './message_frames.js' */
/** @import { Screen } from './picture_canvas.js' */
/** @import { Host } from './socket_host.js' */
/** @import { SmallPicture } from './draft_detail.js' */
/** number: of the last lighting; shown: of the lighting whose picture is here. isBusy: whether a draft
 * is in flight; isNew: whether the next has been asked for. halves: the picture, of every step-th
 * pixel of every step-th row.
 * @typedef {{weights: Float64Array, number: number, shown: number, isBusy: boolean, isNew: boolean,
 *   step: number, halves: Uint16Array | null, timer?: ReturnType<typeof setTimeout>}} Slot */

/** Slots of the two pictures, the first of the slots of looks that are side by side, and their
 * number. */
export const SOLUTION_SLOT = 0;
export const OTHER_SLOT = 1;
export const WALL_SLOT = 2;
export const MIX_SLOTS = WALL_SLOT + COMPARED_COUNT;

/** Milliseconds without changes before the exact picture is asked for. */
const PAUSE_MS = 180;

/** Number of pixels beyond which drafts have every second one. */
const MAX_DRAFT_PIXELS = 2 ** 18;

export class SessionMixes {
  /** @param {Host} host @param {Screen} screen */
  constructor(host, screen) {
    this.host = host;
    this.screen = screen;
    this.view = 0;
    this.isClean = true;
    /** @type {Map<number, Slot>} */
    this.slots = new Map();
    this.number = 0;
    /** The details of drafts that come with answers; null before they are here.
     * @type {DraftDetail | null} */
    this.detail = null;
    /** The last that `lightsAt` has fetched. @type {{name: string, values: Float32Array} | null} */
    this.lights = null;
    this.isFetching = false;
    host.on('mixed', (message) => this.take(message));
  }

  /** Show a lighting in a slot. @param {number} index @param {Float64Array} weights (n, 3)
   * @param {SmallPicture | null} [draft] of it, if it is here */
  show(index, weights, draft = null) {
    const known = this.slots.get(index);
    if (known && isSame(known.weights, weights)) return;
    const picture = { number: 0, shown: 0, step: 1, halves: null };
    const slot = known ?? { weights, isBusy: false, isNew: true, ...picture };
    this.slots.set(index, slot);
    slot.weights = weights;
    if (draft) this.showDraft(index, slot, draft);
    else this.ask(index, slot);
  }

  /** Show the draft that has come with a lighting, unless the details have gone meanwhile.
   * @param {number} index @param {Slot} slot @param {SmallPicture} draft */
  showDraft(index, slot, draft) {
    if (!this.detail) return this.ask(index, slot);
    slot.isNew = false;
    this.note(index, slot);
    this.setPicture(index, slot, this.detail.enlarge(draft), this.detail.step, slot.number);
  }

  /** Take the details of drafts; null where these are of another view.
   * @param {Uint16Array | null} halves of all pixels */
  setDetail(halves) {
    this.detail = halves && new DraftDetail(halves, this.screen.planeSize, this.draftStep);
  }

  /** Ask for the pictures of all slots again, since planes have changed. */
  renew() {
    for (const [index, slot] of this.slots) this.ask(index, slot);
  }

  /** Show a view of the session. @param {number} view @param {boolean} isClean */
  follow(view, isClean) {
    if (view === this.view && isClean === this.isClean) return;
    Object.assign(this, { view, isClean });
    this.renew();
  }

  /** Forget all lightings, whose pictures the view has lost. */
  forget() {
    for (const { timer } of this.slots.values()) clearTimeout(timer);
    this.slots.clear();
  }

  /** @param {number} index @param {Slot} slot */
  ask(index, slot) {
    slot.isNew = true;
    this.note(index, slot);
    if (!slot.isBusy) void this.askForDrafts(index, slot);
  }

  /** Note another lighting of a slot, whose exact picture is to follow. @param {number} index
   * @param {Slot} slot */
  note(index, slot) {
    slot.number = ++this.number;
    clearTimeout(slot.timer);
    slot.timer = setTimeout(() => this.askForExact(index, slot), PAUSE_MS);
  }

  /** @param {number} index @param {Slot} slot */
  async askForDrafts(index, slot) {
    slot.isBusy = true;
    while (slot.isNew && this.slots.get(index) === slot) {
      slot.isNew = false;
      await this.send(index, slot, true).catch(() => {});
    }
    slot.isBusy = false;
  }

  /** Ask for the exact picture, once no brush is down. @param {number} index @param {Slot} slot */
  askForExact(index, slot) {
    if (this.slots.get(index) !== slot) return;
    if (this.screen.isBrushDown || this.screen.draftStep !== null)
      slot.timer = setTimeout(() => this.askForExact(index, slot), PAUSE_MS);
    else this.send(index, slot, false).catch(() => {});
  }

  /** @param {number} index @param {Slot} slot @param {boolean} isLive */
  send(index, { weights, number }, isLive) {
    const { view, isClean } = this;
    const step = isLive ? this.draftStep : 1;
    const fields = { slot: index, number, view, is_clean: isClean, is_live: isLive, step };
    return this.host.send('mix', fields, {
      weights: { data: weights, shape: [weights.length / 3, 3] },
    });
  }

  /** The step between the pixels and rows of drafts. */
  get draftStep() {
    const [height, width] = this.screen.planeSize;
    return height * width > MAX_DRAFT_PIXELS ? 2 : 1;
  }

  /** @param {Message} message */
  take({ view, slot: index, number, step, is_exact: isExact, arrays }) {
    const slot = this.slots.get(index);
    const isWanted = slot && view === this.view && index < this.screen.count;
    // A draft of a moment ago is better than none; an exact picture is of the present lighting.
    if (!isWanted || number < slot.shown || (isExact && number !== slot.number)) return;
    this.setPicture(index, slot, /** @type {Uint16Array} */ (arrays.data.data), step, number);
    this.screen.requestDraw(!isExact);
  }

  /** @param {number} index @param {Slot} slot @param {Uint16Array} halves @param {number} step
   * @param {number} shown */
  setPicture(index, slot, halves, step, shown) {
    Object.assign(slot, { halves, step, shown });
    this.screen.view?.setPlane(index, halves, 1, step);
  }

  /** Return the light of the picture in a slot, (h, w, 3) of the view's size, by the nearest pixel;
   * null if there is none yet. @param {number} index */
  lightOf(index) {
    const slot = this.slots.get(index);
    if (!slot?.halves) return null;
    const halves = repeatPixels(slot.halves, slot.step, this.screen.planeSize);
    const [[height, width], [rows, columns]] = [this.screen.size, this.screen.planeSize];
    if (rows === height && columns === width) return toFloats(halves);
    const light = new Float32Array(3 * height * width);
    const small = toFloats(halves);
    for (let p = 0; p < height * width; p++) {
      const row = Math.floor((Math.floor(p / width) * rows) / height);
      const at = 3 * (row * columns + Math.floor(((p % width) * columns) / width));
      light.set(small.subarray(at, at + 3), 3 * p);
    }
    return light;
  }

  /** Return the light of each lamp around a pixel, (n, 3); null until it is here, when `onArrival`
   * is called. @param {number} x @param {number} y @param {() => void} onArrival */
  lightsAt(x, y, onArrival) {
    const name = nameInView(`lights_at/${y},${x}`, this.view);
    if (this.lights?.name === name) return this.lights.values;
    if (!this.isFetching) {
      this.isFetching = true;
      void this.host
        .fetch(name)
        .then(({ data }) => (this.lights = { name, values: /** @type {Float32Array} */ (data) }))
        .catch(() => null)
        .then((lights) => {
          this.isFetching = false;
          if (lights) onArrival();
        });
    }
    return null;
  }
}

/** @param {Float64Array} a @param {Float64Array} b */
function isSame(a, b) {
  return a.length === b.length && a.every((x, k) => x === b[k]);
}
