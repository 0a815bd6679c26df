/** Halves (IEC 60559 binary16): JavaScript has no array of them in all browsers yet. */

/** The largest half. Inf and NaN are replaced, since they would spread through the sums. */
export const MAX_HALF = 65504;

/** Values of all halves by their bits, (65536,). Inf is the largest half, NaN is 0. */
export const VALUES = decodeAll();

/** Replace Inf by the largest half and NaN by 0, in place; the same array.
 * @param {Uint16Array} halves */
export function replaceNonFinite(halves) {
  for (let i = 0; i < halves.length; i++) {
    const magnitude = halves[i] & 0x7fff;
    if (magnitude >= 0x7c00) halves[i] = magnitude > 0x7c00 ? 0 : (halves[i] & 0x8000) | 0x7bff;
  }
  return halves;
}

/** @param {ArrayLike<number>} halves @param {number} [scale] */
export function toFloats(halves, scale = 1) {
  const values = new Float32Array(halves.length);
  for (let i = 0; i < values.length; i++) values[i] = VALUES[halves[i]] * scale;
  return values;
}

function decodeAll() {
  const values = new Float32Array(65536);
  for (let bits = 0; bits < 65536; bits++) {
    const sign = bits & 0x8000 ? -1 : 1;
    const exponent = (bits >> 10) & 31;
    const mantissa = bits & 1023;
    if (exponent === 31) values[bits] = mantissa ? 0 : sign * MAX_HALF;
    else if (exponent) values[bits] = sign * (1 + mantissa / 1024) * 2 ** (exponent - 15);
    else values[bits] = sign * mantissa * 2 ** -24;
  }
  return values;
}
