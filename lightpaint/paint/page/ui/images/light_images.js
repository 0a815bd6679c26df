/** Lights that are images: their texels, their mean, and how they are exposed. */

import { luminance } from '../../../../viewer/drawing/colour.js';

/** @import { Light, RGB, Ui } from '../ui_state.js' */
/** @import { ImageInfo } from '../../engine/messages.js' */

/** A light that is an image. lights: indices of its texels, each once, row by row.
 * @typedef {ImageInfo & {lights: number[]}} LightImage */

/** Part of the texels that a map may show too bright to tell. */
const CLIPPED_SHARE = 0.02;

/** @type {WeakMap<LightImage[], Map<number, LightImage>>} */
const owners = new WeakMap();

/** Return images with the list of their lights; in a symmetric one two texels are one light. @param {ImageInfo[]} infos
 * @returns {LightImage[]} */
export const withLights = (infos) =>
  infos.map((info) => ({
    ...info,
    lights: [...new Set(info.places.flat().filter((k) => k >= 0))],
  }));

/** Return the image that a light is a texel of. @param {LightImage[]} images @param {number} light
 * @returns {LightImage | undefined} */
export function imageOf(images, light) {
  let owner = owners.get(images);
  if (!owner) {
    owner = new Map(images.flatMap((image) => image.lights.map((k) => [k, image])));
    owners.set(images, owner);
  }
  return owner.get(light);
}

/** @type {WeakMap<number[][], Map<number, number>>} */
const sums = new WeakMap();

/** Return the part of an image that each of its lights covers: the sum over its places, of
 * which there are many where some texels are finer. @param {LightImage} image
 * @returns {Map<number, number>} */
export function coverage({ places, shares }) {
  let sum = sums.get(places);
  if (!sum) {
    sum = new Map();
    for (const [y, row] of places.entries())
      for (const [x, k] of row.entries())
        if (k >= 0) sum.set(k, (sum.get(k) ?? 0) + shares[y][x]);
    sums.set(places, sum);
  }
  return sum;
}

/** Return the mean of an image, each texel by the part that it covers.
 * @param {LightImage} image @param {(light: number) => RGB} radiance @returns {RGB} */
export function meanOf(image, radiance) {
  const sum = [0, 0, 0];
  let total = 0;
  for (const [k, share] of coverage(image)) {
    total += share;
    radiance(k).forEach((value, c) => (sum[c] += share * value));
  }
  return /** @type {RGB} */ (sum.map((value) => value / (total || 1)));
}

/** The places that a texel covers: those next to each other, from a row and a column.
 * @typedef {{row: number, column: number, rows: number, columns: number}} Block */

/** Return the places around one that are the same texel: one, or more where others are finer.
 * @param {LightImage} image @param {[row: number, column: number]} place @returns {Block} */
export function blockAt({ places }, [row, column]) {
  const k = places[row][column];
  let [top, bottom, left, right] = [row, row, column, column];
  if (k >= 0) {
    while (places[row][left - 1] === k) left -= 1;
    while (places[row][right + 1] === k) right += 1;
    while (places[top - 1]?.[column] === k) top -= 1;
    while (places[bottom + 1]?.[column] === k) bottom += 1;
  }
  return { row: top, column: left, rows: bottom - top + 1, columns: right - left + 1 };
}

/** Return the first place of each texel, row by row: two in a symmetric image.
 * @param {LightImage} image @returns {[row: number, column: number][]} */
export function firstPlaces({ places }) {
  /** @type {[number, number][]} */
  const firsts = [];
  places.forEach((row, y) => {
    for (let x = 0, end = 0; x < row.length; x = end) {
      for (end = x + 1; row[end] === row[x]; ) end += 1;
      if (!places[y - 1]?.slice(x, end).includes(row[x])) firsts.push([y, x]);
    }
  });
  return firsts;
}

/** Return an image as one light, for what shows the level of a light. @param {LightImage} image
 * @param {Light[]} lights @returns {Light} */
export function wholeLight(image, lights) {
  const present = meanOf(image, (k) => lights[k].present);
  return { ...lights[image.lights[0]], name: image.name, label: image.name, present };
}

/** Return the exposure at which the map of an image is shown: the one that is kept, or one that fits.
 * @param {Ui} ui @param {LightImage} image */
export const exposureOf = ({ mapExposures, weights }, image) =>
  mapExposures[image.name] ?? mapStops(image, weights);

/** Return the exposure in stops that shows an image, all but its brightest texels.
 * @param {LightImage} image @param {RGB[]} weights */
export function mapStops({ lights }, weights) {
  const levels = lights.map((k) => luminance(weights[k] ?? [0, 0, 0])).sort((a, b) => a - b);
  const place = (1 - CLIPPED_SHARE) * (levels.length - 1);
  const [low, high] = [levels[Math.floor(place)], levels[Math.ceil(place)]];
  const level = low + (high - low) * (place - Math.floor(place));
  return level > 0 ? -Math.log2(level) : 0;
}
