/** Changes of the colour and the level of lamps. */

import { filtered } from '../../../../viewer/gels/gels.js';
import { fromKelvin, luminance, toKelvin, warmer } from '../../../../viewer/drawing/colour.js';

/** @import { Light, RGB } from '../ui_state.js' */
/** @import { Gel } from '../../../../viewer/gels/gels.js' */

/** Ends of a colour temperature, in mireds: 15,000 and 1000 K. */
const [MIN_MIRED, MAX_MIRED] = [1e6 / 15000, 1000];

/** Distance from Planck's locus, in thousandths of (u, v), up to which a light is warmed along it. */
const MAX_WHITE_DUV = 20;

/** @param {RGB} rgb @param {number} factor @returns {RGB} */
export const scaled = (rgb, factor) => /** @type {RGB} */ (rgb.map((x) => x * factor));

/** Return a colour at the level of another. @param {RGB} colour @param {RGB} rgb */
export const atLevelOf = (colour, rgb) => scaled(colour, luminance(rgb) / luminance(colour));

/** Return light warmer by some mireds (below 0: cooler), at the same level: a white along Planck's
 * locus, at the same distance from it. @param {RGB} rgb @param {number} mired @returns {RGB} */
export function warmed(rgb, mired) {
  const white = toKelvin(rgb);
  if (!white || Math.abs(white.green) > MAX_WHITE_DUV) {
    const gains = warmer(mired);
    return atLevelOf(/** @type {RGB} */ (rgb.map((x, c) => x * gains[c])), rgb);
  }
  const newMired = Math.min(MAX_MIRED, Math.max(MIN_MIRED, 1e6 / white.kelvin + mired));
  return atLevelOf(fromKelvin(1e6 / newMired, white.green), rgb);
}

/** Return the own white of a lamp: its colour in the scene, at its brightest channel 1.
 * @param {Light} light @returns {RGB} */
export function ownWhite({ present }) {
  const maxChannel = Math.max(...present);
  return maxChannel > 0 ? scaled(present, 1 / maxChannel) : [1, 1, 1];
}

/** Return a lamp with another filter: the filter that is there is taken off, at the level that its
 * loss has left. @param {RGB} rgb @param {Light} light @param {Gel | null} gel
 * @param {Gel | null} present the filter that is there @returns {RGB} */
export function withGel(rgb, light, gel, present) {
  const white = ownWhite(light);
  const passed = present ? luminance(filtered(present, white)) / luminance(white) : 1;
  const open = scaled(white, luminance(rgb) / luminance(white) / passed);
  return gel ? filtered(gel, open) : open;
}
