/** Colour functions for paint. */

export {
  decode,
  encode,
  luminance,
  fromHex,
  fromHsv,
  fromKelvin,
  toHex,
  toHsv,
  toKelvin,
  warmer,
} from '../../../viewer/drawing/colour.js';

/** @typedef {import('./engine_interface.js').RGB} RGB */

/** A colour whatever its brightness: its largest channel is 1. @param {RGB} rgb @returns {RGB} */
export function atFullBrightness(rgb) {
  const maxChannel = Math.max(...rgb) || 1;
  return /** @type {RGB} */ (rgb.map((x) => x / maxChannel));
}
