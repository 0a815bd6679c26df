/** Masks by what a picture shows: colours like the colour of a place, a range of brightness, a light. */
import { luminance } from '../../../../viewer/drawing/colour.js';
import { VALUES } from '../../../../viewer/drawing/half_floats.js';
import { decodeSrgb } from '../../../../viewer/drawing/view_transform.js';
import { FULL } from './polygon_mask.js';

/** Linear light of each display code. */
const LINEAR = Float32Array.from({ length: 256 }, (_, code) => decodeSrgb(code / 255));

/** Part of the tolerance over which a selection by colour fades, and the least, in ΔE. */
const [SOFT_PART, MIN_SOFT] = [0.3, 1];

/** Range of L* over which a selection by brightness fades on each side. */
const SOFT_BRIGHTNESS = 3;

/** Darkest albedo that a light's plane is divided by. */
const MIN_ALBEDO = 0.05;

/** Pixels that are brighter than all but this part show the light itself. */
const BRIGHTEST_PART = 1e-3;

/** Light relative to the typical lit place that counts as none. */
const MIN_LIGHT = 0.05;

/** Return L*, a*, b* of display codes, (n, 3). @param {Uint8ClampedArray} codes RGBA */
function labOf(codes) {
  const lab = new Float32Array((codes.length / 4) * 3);
  const curve = (/** @type {number} */ t) => (t > 0.008856 ? Math.cbrt(t) : 7.787 * t + 16 / 116);
  for (let p = 0, i = 0; p < codes.length; p += 4, i += 3) {
    const [r, g, b] = [LINEAR[codes[p]], LINEAR[codes[p + 1]], LINEAR[codes[p + 2]]];
    const x = curve(0.43388 * r + 0.37622 * g + 0.1899 * b);
    const y = curve(0.2126 * r + 0.7152 * g + 0.0722 * b);
    const z = curve(0.01773 * r + 0.10947 * g + 0.8728 * b);
    lab[i] = 116 * y - 16;
    lab[i + 1] = 500 * (x - y);
    lab[i + 2] = 200 * (y - z);
  }
  return lab;
}

/** Return what has nearly the colour of a pixel. @param {Uint8ClampedArray} codes RGBA of the picture
 * as it is shown @param {number} pixel @param {number} tolerance in ΔE (CIE 1976)
 * @returns {Uint8Array} */
export function colourMask(codes, pixel, tolerance) {
  const lab = labOf(codes);
  const soft = Math.max(MIN_SOFT, SOFT_PART * tolerance);
  const [l, a, b] = lab.subarray(3 * pixel, 3 * pixel + 3);
  const mask = new Uint8Array(codes.length / 4);
  for (let p = 0, i = 0; p < mask.length; p++, i += 3) {
    const difference = Math.hypot(lab[i] - l, lab[i + 1] - a, lab[i + 2] - b);
    mask[p] = Math.round(FULL * clamped((tolerance + soft - difference) / soft));
  }
  return mask;
}

/** Return what is between two brightnesses. @param {Uint8ClampedArray} codes RGBA of the picture as
 * it is shown @param {number} low @param {number} high L*, 0 to 100 @returns {Uint8Array} */
export function brightnessMask(codes, low, high) {
  const lab = labOf(codes);
  const mask = new Uint8Array(codes.length / 4);
  for (let p = 0; p < mask.length; p++) {
    const distance = Math.max(low - lab[3 * p], lab[3 * p] - high);
    mask[p] = Math.round(FULL * clamped(1 - distance / SOFT_BRIGHTNESS));
  }
  return mask;
}

/** Return how far a light lights each place: the light that arrives there, relative to the light of a
 * typical lit place. @param {Uint16Array} plane (h, w, 3) halves
 * @param {Uint16Array | null} albedo (h, w, 3) halves @returns {Uint8Array} */
export function lightMask(plane, albedo) {
  const level = new Float32Array(plane.length / 3);
  for (let p = 0, i = 0; p < level.length; p++, i += 3) {
    level[p] = levelAt(plane, i);
    if (albedo) level[p] /= Math.max(MIN_ALBEDO, levelAt(albedo, i));
  }
  const sorted = level.slice().sort();
  const brightest = sorted[Math.floor((1 - BRIGHTEST_PART) * (sorted.length - 1))];
  let [sum, squares] = [0, 0];
  for (const x of sorted) {
    const light = Math.min(x, brightest);
    sum += light;
    squares += light * light;
  }
  const typical = sum > 0 ? squares / sum : 1;
  return Uint8Array.from(level, (x) =>
    Math.round(FULL * clamped((x / typical - MIN_LIGHT) / (1 - MIN_LIGHT))),
  );
}

/** @param {Uint16Array} halves @param {number} i */
const levelAt = (halves, i) =>
  Math.max(0, luminance([VALUES[halves[i]], VALUES[halves[i + 1]], VALUES[halves[i + 2]]])) || 0;

/** Return what shows an object. @param {Int16Array} objects index of each pixel's
 * @param {number} object @returns {Uint8Array} */
export const objectMask = (objects, object) =>
  Uint8Array.from(objects, (index) => (index === object ? FULL : 0));

/** @param {number} x */
const clamped = (x) => Math.min(1, Math.max(0, x));
