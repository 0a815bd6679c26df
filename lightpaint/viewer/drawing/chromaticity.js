/** Luminance and chromaticity of linear Rec.709 (D65). */

/** @typedef {[number, number, number]} RGB */

/** Linear Rec.709 of CIE XYZ (IEC 61966-2-1's primaries and white). */
const FROM_XYZ = [
  [3.24096994, -1.53738318, -0.49861076],
  [-0.96924364, 1.8759675, 0.04155506],
  [0.05563008, -0.20397696, 1.05697151],
];

/** Relative luminance (ITU-R BT.709-6, item 3.2). @param {ArrayLike<number>} rgb linear */
export function luminance(rgb) {
  return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

/** Return the linear light of CIE X and Z, where Y is 1. Channels of colours outside of Rec.709 are
 * below 0. @param {number} X @param {number} Z @returns {RGB} */
export function fromXyz(X, Z) {
  return /** @type {RGB} */ (FROM_XYZ.map(([x, y, z]) => x * X + y + z * Z));
}

/** Return the linear light of a chromaticity, CIE 1931 (x, y), of luminance 1. Channels of colours
 * outside of Rec.709 are below 0. @param {number} x @param {number} y @returns {RGB} */
export const fromChromaticity = (x, y) => fromXyz(x / y, (1 - x - y) / y);
