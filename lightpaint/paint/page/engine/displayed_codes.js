/** Codes of a picture as it is displayed, at reduced size, for scopes. */
import { VALUES } from '../../../viewer/drawing/half_floats.js';

/** Light of a picture: values of pixels, row by row, each of some channels; `isHalf`: by the table of
 * halves. @typedef {{data: ArrayLike<number>, width: number, height: number, channels: number,
 *   isHalf?: boolean}} LightSource */

/** Largest number of columns that are looked at. */
export const MAX_COLUMNS = 384;

/** Return the light of every so manieth pixel of every so manieth row. @param {LightSource} source
 * @param {number} [maxColumns] @returns {{light: Float32Array, width: number, height: number}} */
export function sampledLight({ data, width, height, channels, isHalf }, maxColumns = MAX_COLUMNS) {
  const step = Math.max(1, Math.ceil(width / maxColumns));
  const size = [Math.ceil(width / step), Math.ceil(height / step)];
  const light = new Float32Array(3 * size[0] * size[1]);
  let target = 0;
  for (let y = 0; y < height; y += step)
    for (let x = 0; x < width; x += step, target += 3) {
      const start = channels * (y * width + x);
      for (let c = 0; c < 3; c++) {
        const value = data[start + c];
        light[target + c] = isHalf ? VALUES[value] : value;
      }
    }
  return { light, width: size[0], height: size[1] };
}
