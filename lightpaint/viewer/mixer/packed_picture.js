/** Unpacks the pictures that images/packed_picture.py packs. */
import { replaceNonFinite } from '../drawing/half_floats.js';

/** data: base64, deflated. @typedef {{data: string, scale: number, dropped: number,
 *   size: [height: number, width: number]}} Compact */

/** Return the picture as halves (h, w, 3), divided by its scale.
 * @param {Compact} picture @returns {Promise<Uint16Array>} */
export async function unpack({ data, dropped, size: [height, width] }) {
  const bytes = await inflate(data);
  const count = height * width;
  const planes = [0, 1, 2].map((c) => unpackPlane(bytes, c * count, 3 * count, height, width));
  const [green, red, blue] = planes;
  const halves = new Uint16Array(3 * count);
  for (let i = 0; i < count; i++) {
    halves[3 * i] = (red[i] + green[i]) << dropped;
    halves[3 * i + 1] = green[i] << dropped;
    halves[3 * i + 2] = (blue[i] + green[i]) << dropped;
  }
  return replaceNonFinite(halves);
}

/** Return the numbers of one channel. Each is stored as the difference from a prediction by its
 * neighbours.
 * @param {Uint8Array} bytes @param {number} first @param {number} numberCount @param {number} height
 * @param {number} width @returns {Int32Array} */
function unpackPlane(bytes, first, numberCount, height, width) {
  const numbers = new Int32Array(height * width);
  for (let y = 0, i = 0; y < height; y++) {
    for (let x = 0; x < width; x++, i++) {
      const zigzag = bytes[first + i] | (bytes[numberCount + first + i] << 8);
      const left = x ? numbers[i - 1] : 0;
      const above = y ? numbers[i - width] : 0;
      const corner = x && y ? numbers[i - width - 1] : 0;
      const [low, high] = left < above ? [left, above] : [above, left];
      const plane = left + above - corner;
      numbers[i] =
        ((zigzag >> 1) ^ -(zigzag & 1)) + (plane < low ? low : plane > high ? high : plane);
    }
  }
  return numbers;
}

/** Return the bytes that an address `data:` has, deflated. @param {string} data
 * @returns {Promise<Uint8Array>} */
export async function inflate(data) {
  const text = data.slice(data.indexOf(',') + 1);
  const deflated = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([deflated]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
