/** Colour functions for paint. */

export {
  decode,
  encode,
  luminance,
  ofHex,
  ofHsv,
  ofKelvin,
  toHex,
  toHsv,
  toKelvin,
} from '../../../viewer/drawing/colour.js';

/** @typedef {import('./engine_interface.js').RGB} RGB */

/** A colour whatever its brightness: its largest channel is 1. @param {RGB} rgb @returns {RGB} */
export function atFull(rgb) {
  const top = Math.max(...rgb) || 1;
  return /** @type {RGB} */ (rgb.map((x) => x / top));
}
