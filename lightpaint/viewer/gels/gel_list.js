/** All colour filters, and the one that a lamp has. */
import { isSameHue } from '../drawing/colour.js';
import { GEL_ROWS } from './gel_table.js';
import { filtered, findGels, gelsOf } from './gels.js';

/** @import { RGB } from '../drawing/chromaticity.js' */

/** Largest difference of a channel between equal colours, relative to the largest channel. */
const MAX_HUE_DIFFERENCE = 1e-3;

export const GELS = gelsOf(GEL_ROWS);

/** Return the filters that a text may mean, as `findGels`. @param {string} text */
export const gelsNamed = (text) => findGels(GELS, text);

/** Return the filter that gives a lamp its colour; null for none, or if several would: reds beyond
 * Rec.709 are one. @param {RGB} rgb of the lamp @param {RGB} white its own, without a filter
 * @param {string} [code] of the filter that was put there last */
export function gelOn(rgb, white, code) {
  if (isSameHue(white, rgb, MAX_HUE_DIFFERENCE)) return null;
  const gels = GELS.filter((gel) => isSameHue(filtered(gel, white), rgb, MAX_HUE_DIFFERENCE));
  return gels.find((gel) => gel.code === code) ?? (gels.length === 1 ? gels[0] : null);
}
