/** Drafts of the pictures of dragged lights, which wait for their answer to be drawn with it. */
import { repeatPixels } from './message_frames.js';

/** @typedef {import("./message_frames.js").Picture} Picture */
/** @typedef {import("./picture_loader.js").PictureLoader} PictureLoader */

export class LightDrafts {
  /** @type {Map<string, {resources: Record<string, number>, picture: Picture}>} */
  waiting = new Map();

  /** @param {import("./messages.js").Events["dragged"]} draft
   * @param {[height: number, width: number]} size of its view */
  add({ light, step, resources, arrays }, size) {
    const data = repeatPixels(arrays.data, step, size);
    this.waiting.set(`plane ${light}`, { resources, picture: { ...arrays.data, data } });
  }

  /** Show the drafts that wait. @param {PictureLoader} loader */
  show(loader) {
    for (const [slot, { resources, picture }] of this.waiting)
      loader.take(slot, resources, picture);
    this.waiting.clear();
  }
}
