/** The tint that makes what is painted around a place neutral. */
import { luminance } from '../../../viewer/drawing/colour.js';

/** @import { Point } from './brush.js' */
/** @import { RGB } from '../../../viewer/drawing/colour.js' */

/** Diameter of the sampled disc, as a part of the height of the picture, and its least in pixels. */
const [SAMPLE_SHARE, MIN_DIAMETER] = [0.02, 3];

/** Largest ratio of two channels of a tint: what is more saturated has no light to be neutral with. */
const MAX_RATIO = 50;

/** Steps towards a tint, of which each takes away most of the colour that is left. */
const STEPS = 24;

/** Return the light of the pixels around a place. @param {ArrayLike<number>} image (h, w, 3)
 * @param {[height: number, width: number]} size @param {Point} point @returns {RGB[]} */
export function pixelsAround(image, [height, width], { x, y }) {
  const radius = Math.max(MIN_DIAMETER, SAMPLE_SHARE * height) / 2;
  /** @type {RGB[]} */
  const pixels = [];
  for (let row = Math.max(0, Math.floor(y - radius)); row < Math.min(height, y + radius); row++)
    for (let column = Math.max(0, Math.floor(x - radius)); column < Math.min(width, x + radius); column++) {
      if (Math.hypot(column + 0.5 - x, row + 0.5 - y) > radius) continue;
      const start = 3 * (row * width + column);
      pixels.push([image[start], image[start + 1], image[start + 2]]);
    }
  return pixels;
}

/** Return the tint of an adjustment that makes the mean of pixels neutral. The adjustment keeps the
 * luminance of each pixel, so that of an uneven area the tint is found in steps.
 * @param {RGB[]} pixels linear light @returns {RGB | null} of luminance 1; null where the light is
 * black, or of fewer than three channels */
export function neutralTint(pixels) {
  /** @type {RGB} */
  let tint = [1, 1, 1];
  for (let step = 0; step < STEPS; step++) {
    const sum = [0, 0, 0];
    for (const pixel of pixels) {
      const tinted = pixel.map((value, c) => Math.max(0, value) * tint[c]);
      const level = luminance(tinted);
      const factor = level > 0 ? luminance(pixel) / level : 0;
      tinted.forEach((value, c) => (sum[c] += factor * value));
    }
    const level = luminance(sum);
    if (!(Math.min(...sum) > 0)) return null;
    const next = tint.map((value, c) => (value * level) / sum[c]);
    const scale = luminance(next);
    tint = /** @type {RGB} */ (next.map((value) => value / scale));
    if (Math.max(...tint) > MAX_RATIO * Math.min(...tint)) return null;
  }
  return tint;
}
