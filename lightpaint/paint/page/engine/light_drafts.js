/** Drafts of the pictures of dragged lights, which wait for their answer to be drawn with it. */
import { repeatPixels } from '../../../viewer/drawing/half_floats.js';

/** @typedef {import("./message_frames.js").Picture} Picture */
/** @typedef {import("./picture_loader.js").PictureLoader} PictureLoader */

export class LightDrafts {
  /** Drafts by slot. @type {Map<string, {name: string, picture: Picture}>} */
  waiting = new Map();

  /** @param {PictureLoader} loader */
  constructor(loader) {
    this.loader = loader;
  }

  /** Keep a draft until its answer. The message about all new pictures comes before that: nothing
   * is fetched that is here.
   * @param {import("./messages.js").Events["dragged"]} draft
   * @param {[height: number, width: number]} size of the planes */
  add({ light, step, resources, arrays }, size) {
    const slot = `plane ${light}`;
    const name = this.loader.notePicture(slot, resources);
    if (name === null) return;
    const halves = /** @type {Uint16Array} */ (arrays.data.data);
    const data = repeatPixels(halves, step, size);
    this.waiting.set(slot, { name, picture: { ...arrays.data, data } });
  }

  /** Show the drafts that wait. */
  show() {
    for (const [slot, { name, picture }] of this.waiting)
      this.loader.use(slot, name, picture, true);
    this.waiting.clear();
  }

  /** Drop the drafts that wait, since all pictures are listed anew. */
  clear() {
    this.loader.forget((slot) => this.waiting.has(slot));
    this.waiting.clear();
  }
}
