/** Enlarges small pictures that come with answers to paint, which need few bytes, to drafts. */
import { MAX_HALF, toFloats } from '../../../viewer/drawing/half_floats.js';

/** Averages over blocks of pixels. size: rows and columns of blocks. halves: (rows, columns, 3).
 * @typedef {{halves: Uint16Array, size: [rows: number, columns: number]}} SmallPicture */

/** The edges and textures of the current look, which drafts get back: joint upsampling. */
export class DraftDetail {
  /** @param {Uint16Array} halves (h, w, 3), the current look over its own averages, stretched
   * @param {[height: number, width: number]} size @param {number} step between the pixels and rows
   * of drafts */
  constructor(halves, [height, width], step) {
    this.step = step;
    this.size = [Math.ceil(height / step), Math.ceil(width / step)];
    this.wholeSize = [height, width];
    const [rows, columns] = this.size;
    const chosen = new Uint16Array(3 * rows * columns);
    for (let y = 0, to = 0; y < rows; y++)
      for (let x = 0; x < columns; x++, to += 3) {
        const from = 3 * (step * y * width + step * x);
        chosen.set(halves.subarray(from, from + 3), to);
      }
    this.factors = toFloats(chosen);
    this.light = new Float32Array(chosen.length);
    /** Where columns lie in the last small picture. @type {Places | null} */
    this.across = null;
  }

  /** Return a small picture, stretched by interpolation, times the details: every step-th pixel of
   * every step-th row, in halves. @param {SmallPicture} small */
  enlarge({ halves, size: [smallRows, smallColumns] }) {
    const [[rows, columns], [height, width]] = [this.size, this.wholeSize];
    const { factors, light, step } = this;
    const down = placesOf(rows, step, height, smallRows);
    if (this.across?.count !== smallColumns)
      this.across = placesOf(columns, step, width, smallColumns);
    const { first: left, share: shareAcross } = this.across;
    const values = toFloats(halves);
    const rowLength = 3 * smallColumns;
    const row = new Float32Array(rowLength + 3); // the last column has a right neighbour, of share 0
    for (let y = 0, at = 0; y < rows; y++) {
      const above = rowLength * down.first[y];
      const below = Math.min(above + rowLength, values.length - rowLength);
      const t = down.share[y];
      for (let i = 0; i < rowLength; i++)
        row[i] = values[above + i] + t * (values[below + i] - values[above + i]);
      for (let x = 0; x < columns; x++, at += 3) {
        const i = 3 * left[x];
        const s = shareAcross[x];
        light[at] = (row[i] + s * (row[i + 3] - row[i])) * factors[at];
        light[at + 1] = (row[i + 1] + s * (row[i + 4] - row[i + 1])) * factors[at + 1];
        light[at + 2] = (row[i + 2] + s * (row[i + 5] - row[i + 2])) * factors[at + 2];
      }
    }
    return writeHalves(light, new Uint16Array(light.length));
  }
}

/** Places among the blocks of a side. count: of blocks. first: the block before each place. share: of
 * the block after it.
 * @typedef {{count: number, first: Int32Array, share: Float32Array}} Places */

/** Return where pixels lie between the middles of blocks. @param {number} pixels @param {number} step
 * between them @param {number} length of the side in pixels @param {number} count of blocks along it
 * @returns {Places} */
function placesOf(pixels, step, length, count) {
  const [first, share] = [new Int32Array(pixels), new Float32Array(pixels)];
  for (let k = 0; k < pixels; k++) {
    const place = ((step * k + 0.5) * count) / length - 0.5;
    const clamped = Math.min(Math.max(place, 0), count - 1);
    first[k] = Math.floor(clamped);
    share[k] = clamped - first[k];
  }
  return { count, first, share };
}

/** Write light, not below 0, as the nearest halves; the array of these. Light above the largest half
 * becomes that, and less than 0 black.
 * @param {Float32Array} light @param {Uint16Array} halves */
export function writeHalves(light, halves) {
  const bits = new Uint32Array(light.buffer, light.byteOffset, light.length);
  for (let i = 0; i < light.length; i++) {
    const value = light[i];
    // Below the smallest normal half they are multiples of 2^-24. Above it the exponent counts from
    // 15 instead of 127, and 13 bits fewer are kept.
    if (value < 2 ** -14) halves[i] = value > 0 ? Math.round(value * 2 ** 24) : 0;
    else halves[i] = value < MAX_HALF ? (bits[i] - 0x38000000 + 0x1000) >>> 13 : 0x7bff;
  }
  return halves;
}
