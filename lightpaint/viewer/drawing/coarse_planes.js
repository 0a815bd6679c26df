/** Planes that hold every step-th pixel of every step-th row. */

/** @import { Plane } from './mix.js' */

/** Return the least step, a multiple of the steps of all planes that shine, of at least `step`.
 * @param {ArrayLike<number>} weights (n, 3) @param {Plane[]} planes @param {number} step */
export function stepFor(weights, planes, step) {
  const isOn = (/** @type {number} */ k) =>
    weights[3 * k] || weights[3 * k + 1] || weights[3 * k + 2];
  const own = planes.reduce((most, plane, k) => (isOn(k) ? Math.max(most, plane.step) : most), 1);
  return own * Math.ceil(step / own);
}

/** Return halves with every pixel repeated as a square, cut to the size of a picture.
 * @param {Uint16Array} halves of every step-th pixel of every step-th row, three each
 * @param {number} step @param {[height: number, width: number]} size */
export function repeatPixels(halves, step, [height, width]) {
  if (step === 1) return halves;
  const rowLength = 3 * Math.ceil(width / step);
  const whole = new Uint16Array(3 * width * height);
  for (let y = 0; y < height; y += step) {
    const start = 3 * width * y;
    const end = start + 3 * width;
    for (let to = start, from = (y / step) * rowLength; to < end; from += 3) {
      const [r, g, b] = [halves[from], halves[from + 1], halves[from + 2]];
      for (let k = 0; k < step && to < end; k++, to += 3) {
        whole[to] = r;
        whole[to + 1] = g;
        whole[to + 2] = b;
      }
    }
    for (let k = 1; k < step && y + k < height; k++)
      whole.copyWithin(start + 3 * width * k, start, end);
  }
  return whole;
}
