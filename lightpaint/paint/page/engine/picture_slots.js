/** The pictures of the session that a page needs, and the slot of its view that each fills. */
import { inView } from './message_frames.js';

/** @typedef {import("./message_frames.js").Message} Message */
/** @typedef {import("./message_frames.js").RGB} RGB */

/**
 * Settings of the display. gains: the lights to show, null for all. instead, other: weights with
 * which to show the solution and the other mix.
 * @typedef {Omit<import("../../../viewer/drawing/view.js").Params, 'live'> & {transform: string, clean: boolean,
 *   gains: boolean[] | null, instead: RGB[] | null, other: RGB[] | null}} Show
 */

/** Pictures that a page always shows or uses, by name. */
const COMMON = ['present', 'albedo', 'objects', 'verified', 'beyond'];

/**
 * Return the name of the picture for each slot, null for none: clean planes where there are any and
 * they are shown, else raw ones.
 * @param {number} count of lights @param {Show | null} show @param {number} view
 * @param {Record<string, number>} resources
 * @returns {[slot: string, name: string | null][]}
 */
export function wantedPictures(count, show, view, resources) {
  const isClean = show?.clean ?? true;
  /** @type {[slot: string, name: string | null][]} */
  const names = COMMON.map((name) => [name, inView(name, view)]);
  for (let k = 0; k < count; k++) {
    const clean = inView(`clean/${k}`, view);
    const isThere = isClean && clean in resources;
    names.push([`plane ${k}`, isThere ? clean : inView(`plane/${k}`, view)]);
  }
  const transform = show?.transform ?? 'srgb';
  names.push(['lut', transform === 'srgb' ? null : `lut/${transform}`]);
  return names;
}

/** Return the size of each view, as text to compare. @param {Message} state */
export function sizes({ size, views = [{ size }] }) {
  return String(views.map((/** @type {any} */ view) => view.size));
}

/** Return whether the current look is among the pictures shown. @param {Show | null} show */
export function showsPresent(show) {
  return show?.left === 'present' || show?.right === 'present';
}
