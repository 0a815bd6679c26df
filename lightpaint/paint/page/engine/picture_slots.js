/** The pictures of the session that a page needs, and the slot of its view that each fills. */
import { nameInView } from './message_frames.js';

/** @import { Message } from './message_frames.js' */
/** @import { RGB } from '../../../viewer/drawing/colour.js' */

/** Settings of the display. visibleLights: those that solo and mute leave; null for all. solutionWeights,
 * otherWeights: weights for "solution" and "other", of the lights and maybe of two looks; null for the
 * answer's. lookPictures: ids of these looks, if their lights hang elsewhere. lookMixes: weights of each of
 * the looks that are side by side. master: factor of the answer's weights, but for fixed lights.
 * @typedef {Omit<import("../../../viewer/drawing/view.js").Params, 'live'> & {transform: string, clean: boolean,
 *   visibleLights: boolean[] | null, solutionWeights: RGB[] | null, otherWeights: RGB[] | null,
 *   lookPictures: (number | null)[] | null, lookMixes?: RGB[][] | null, master?: number}} Display */

/** Number of looks that are compared at a time. Their pictures are planes behind the lights' planes. */
export const COMPARED_COUNT = 4;

/** Pictures that a page always shows or uses, by name. */
const SHARED_PICTURES = ['present', 'albedo', 'objects', 'verified', 'beyond'];

/** Return the name of the picture for each slot, null for none: clean planes where there are any and
 * they are shown, else raw ones.
 * @param {number} count of lights @param {Display | null} display @param {number} view
 * @param {Record<string, number>} resources
 * @returns {[slot: string, name: string | null][]} */
export function wantedPictures(count, display, view, resources) {
  const isClean = display?.clean ?? true;
  /** @type {[slot: string, name: string | null][]} */
  const names = SHARED_PICTURES.map((name) => [name, nameInView(name, view)]);
  for (let k = 0; k < count; k++) {
    const clean = nameInView(`clean/${k}`, view);
    const hasClean = isClean && clean in resources;
    names.push([`plane ${k}`, hasClean ? clean : nameInView(`plane/${k}`, view)]);
  }
  for (let k = 0; k < COMPARED_COUNT; k++) {
    const look = display?.lookPictures?.[k] ?? null;
    const name = `look_${isClean ? 'clean' : 'plane'}/${look}`;
    names.push([`look ${k}`, look === null ? null : nameInView(name, view)]);
  }
  const transform = display?.transform ?? 'srgb';
  names.push(['lut', transform === 'srgb' ? null : `lut/${transform}`]);
  return names;
}

/** Return the size of each view, as text to compare. @param {Message} state */
export function sizesText({ size, views = [{ size }] }) {
  return String(views.map((/** @type {any} */ view) => view.size));
}

/** Return whether the current look is among the pictures shown. @param {Display | null} display */
export function showsPresent(display) {
  return display?.left === 'present' || display?.right === 'present';
}
