/** The data of a mixer, from JSON in the page, and their unpacked planes. */

import { toFloats, replaceNonFinite } from '../drawing/half_floats.js';
import { SRGB } from '../drawing/view_transform.js';
import { gelsOf } from '../gels/gels.js';

/** @import { Light } from './mixer_light.js' */
/** @import { RGB } from '../drawing/colour.js' */

/** Lights that share a row, such as the texels of an image. levels: brightness in each look. answer,
 * present: the emission of each of them at the level 1, by name, which two planes show, behind the planes
 * of single lights. columns: of the map that these make; 0 for none. places: which of them each
 * place of the map is, row by row. members: instead of these emissions and planes, the indices of
 * lights that have their own.
 * @typedef {{label: string, columns: number, places: number[],
 *   levels: {answer: number, present: number},
 *   answer: Record<string, RGB>, present: Record<string, RGB>, members?: number[]}} Joint */

/** lights: those with their own plane, in the order of the planes. shown: indices of those with
 * sliders; the others stay as in the look. joint: lights that share a row. gels: the table of filters, packed. lighting: the
 * answer's file.
 * @typedef {{size: [number, number], planes: Compact[], lights: Light[], shown?: number[],
 *   joint: Joint[],
 *   kelvins: {coolest: number, warmest: number, colors: RGB[]}, gels: string,
 *   transform: {stops: number, low: number, high: number,
 *   curve: number[] | null, lattice: Compact | null}, painting: string | null,
 *   lighting: {target?: string, lights: Record<string, {emission: RGB, weight: RGB}>},
 *   command: string | null}} Data */

/** The data of a mixer, its planes and its filters, once unpacked.
 * @typedef {[Data, Uint16Array[], import("../gels/gels.js").Gel[]]} Unpacked */
/** @type {WeakMap<HTMLElement, Promise<Unpacked>>} */
const unpackedMixers = new WeakMap();

/** @param {HTMLElement} root @returns {Promise<Unpacked>} */
export function unpackMixer(root) {
  const cachedData = unpackedMixers.get(root);
  if (cachedData) return cachedData;
  const text = root.querySelector('script[type="application/json"]')?.textContent ?? '';
  /** @type {Data} */
  const data = JSON.parse(text);
  const promise = Promise.all([Promise.all(data.planes.map(unpack)), inflate(data.gels)]).then(
    ([planes, gels]) =>
      /** @type {Unpacked} */ ([data, planes, gelsOf(new TextDecoder().decode(gels))]),
  );
  unpackedMixers.set(root, promise);
  return promise;
}

/** @param {Data['transform']} transform @returns {Promise<import("../drawing/view_transform.js").Lut>} */
export async function lutOf({ low, high, curve, lattice }) {
  if (curve) {
    // With a curve no lattice is needed.
    const shaper = { side: curve.length, low, high };
    return { shaper, lattice: new Float32Array(1), curve: Float32Array.from(curve) };
  }
  if (!lattice) return SRGB;
  const values = toFloats(await unpack(lattice), lattice.scale);
  return { shaper: { side: lattice.size[1], low, high }, lattice: values, curve: null };
}

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
async function inflate(data) {
  const text = data.slice(data.indexOf(',') + 1);
  const deflated = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([deflated]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
