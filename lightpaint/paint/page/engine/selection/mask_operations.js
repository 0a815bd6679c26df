/** Operations on masks, (h, w) bytes: together, inverted, softer, larger, smaller. */
import { FULL } from './polygon_mask.js';

/** @import { Region } from '../../../../viewer/drawing/view.js' */
/** @import { Size } from './polygon_mask.js' */
/** How a new part joins what is selected.
 * @typedef {'replace' | 'add' | 'subtract' | 'intersect'} Mode */

/** Passes of a box filter, which together are nearly a Gaussian. */
const PASSES = 3;

/** Join a part with what is selected; where nothing is, everything can be painted, so that a part
 * is subtracted from all of it. @param {Uint8Array | null} before null for no selection
 * @param {Uint8Array} part @param {Mode} mode @returns {Uint8Array} */
export function joined(before, part, mode) {
  if (mode === 'subtract') {
    const rest = before ?? new Uint8Array(part.length).fill(FULL);
    return part.map((x, p) => Math.min(rest[p], FULL - x));
  }
  if (!before || mode === 'replace') return part;
  if (mode === 'add') return part.map((x, p) => Math.max(before[p], x));
  return part.map((x, p) => Math.min(before[p], x));
}

/** @param {Uint8Array} mask @returns {Uint8Array} */
export const inverted = (mask) => mask.map((x) => FULL - x);

/** Return the smallest region with all that is selected; null for nothing. @param {Uint8Array} mask
 * @param {Size} size @returns {Region | null} */
export function boundsOf(mask, [height, width]) {
  const isEmptyRow = (/** @type {number} */ y) =>
    mask.subarray(y * width, (y + 1) * width).every((x) => x === 0);
  let [top, bottom] = [0, height];
  while (top < bottom && isEmptyRow(top)) top += 1;
  if (top === bottom) return null;
  while (isEmptyRow(bottom - 1)) bottom -= 1;
  let [left, right] = [width, 0];
  for (let y = top; y < bottom; y++) {
    const row = y * width;
    for (let x = 0; x < left; x++) if (mask[row + x]) left = x;
    for (let x = width - 1; x >= right; x--) if (mask[row + x]) right = x + 1;
  }
  return [top, bottom, left, right];
}

/** Return the mask in a region. @param {Uint8Array} mask @param {Size} size @param {Region} region
 * @returns {Uint8Array} */
export function cropped(mask, [, width], [top, bottom, left, right]) {
  const part = new Uint8Array((bottom - top) * (right - left));
  for (let y = top, to = 0; y < bottom; y++, to += right - left)
    part.set(mask.subarray(y * width + left, y * width + right), to);
  return part;
}

/** Return a mask whose edges fade over about so many pixels on each side. At the edge of the picture
 * nothing fades. @param {Uint8Array} mask @param {Size} size @param {number} pixels 0 for the same
 * mask @returns {Uint8Array} */
export function feathered(mask, [height, width], pixels) {
  if (!(pixels > 0)) return mask;
  const radii = boxRadii(pixels / 2);
  /** @type {Float32Array} */
  let soft = Float32Array.from(mask);
  for (const radius of radii) soft = boxFiltered(soft, width, radius);
  soft = transposed(soft, width);
  for (const radius of radii) soft = boxFiltered(soft, height, radius);
  return Uint8Array.from(transposed(soft, height), Math.round);
}

/** Return the radii of boxes that together are nearly a Gaussian. @param {number} deviation
 * @returns {number[]} */
function boxRadii(deviation) {
  // Boxes of two widths, since only their squares add up to it.
  const width = 2 * Math.floor((Math.sqrt((12 * deviation ** 2) / PASSES + 1) - 1) / 2) + 1;
  const excess = 12 * deviation ** 2 - PASSES * (width ** 2 - 1);
  const wide = Math.min(PASSES, Math.max(width > 1 ? 0 : 1, Math.round(excess / (4 * width + 4))));
  const radius = (width - 1) / 2;
  return Array.from({ length: PASSES }, (_, k) => (k < wide ? radius + 1 : radius));
}

/** Return the mean of each pixel's neighbours in its row. @param {Float32Array} values
 * @param {number} width of a row @param {number} radius @returns {Float32Array} */
function boxFiltered(values, width, radius) {
  const means = new Float32Array(values.length);
  for (let row = 0; row < values.length; row += width) {
    const at = (/** @type {number} */ x) => values[row + Math.min(width - 1, Math.max(0, x))];
    let sum = 0;
    for (let x = -radius; x <= radius; x++) sum += at(x);
    for (let x = 0; x < width; x++) {
      means[row + x] = sum / (2 * radius + 1);
      sum += at(x + radius + 1) - at(x - radius);
    }
  }
  return means;
}

/** @param {Float32Array} values @param {number} width of a row @returns {Float32Array} */
function transposed(values, width) {
  const height = values.length / width;
  const turned = new Float32Array(values.length);
  for (let y = 0, p = 0; y < height; y++)
    for (let x = 0; x < width; x++, p++) turned[x * height + y] = values[p];
  return turned;
}

/** Return a mask that reaches so many pixels farther, in a circle; less for a negative number.
 * @param {Uint8Array} mask @param {Size} size @param {number} pixels a whole number
 * @returns {Uint8Array} */
export function grown(mask, size, pixels) {
  if (pixels < 0) return inverted(grown(inverted(mask), size, -pixels));
  const bounds = pixels ? boundsOf(mask, size) : null;
  if (!bounds) return mask;
  const [height, width] = size;
  const reach = new Uint8Array(mask.length);
  const row = new Uint8Array(width);
  for (let y = bounds[0]; y < bounds[1]; y++) {
    const source = mask.subarray(y * width, (y + 1) * width);
    for (let dy = 0, last = -1; dy <= pixels; dy++) {
      const radius = Math.floor(Math.sqrt((pixels + 0.5) ** 2 - dy * dy));
      if (radius !== last) slidingMaximum(source, row, radius);
      last = radius;
      for (const other of dy ? [y - dy, y + dy] : [y]) {
        if (other < 0 || other >= height) continue;
        const start = other * width;
        for (let x = 0; x < width; x++) if (row[x] > reach[start + x]) reach[start + x] = row[x];
      }
    }
  }
  return reach;
}

/** Write the greatest of each pixel's neighbours in a row. @param {Uint8Array} values
 * @param {Uint8Array} maxima @param {number} radius */
function slidingMaximum(values, maxima, radius) {
  // Indices of candidates, their values decreasing from the first on.
  const queue = new Int32Array(values.length);
  let [first, end] = [0, 0];
  for (let x = 0, next = 0; x < values.length; x++) {
    for (; next < values.length && next <= x + radius; next++) {
      while (end > first && values[queue[end - 1]] <= values[next]) end -= 1;
      queue[end++] = next;
    }
    while (queue[first] < x - radius) first += 1;
    maxima[x] = values[queue[first]];
  }
}
