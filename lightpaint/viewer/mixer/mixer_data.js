/** The data of a mixer, from JSON in the page, and their unpacked planes. */
import { toFloats } from '../drawing/half_floats.js';
import { SRGB } from '../drawing/view_transform.js';
import { gelsOf } from '../gels/gels.js';
import { inflate, unpack } from './packed_picture.js';

/** @typedef {import("./packed_picture.js").Compact} Compact */
/** @typedef {import("./mixer_light.js").Light} Light */
/** @typedef {import("../drawing/colour.js").RGB} RGB */

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
