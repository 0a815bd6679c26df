/** All colour filters, and the one that a lamp has. */
import { GEL_ROWS } from './gel_table.js';
import { filtered, findGels, gelsOf } from './gels.js';

/** @typedef {import("./gels.js").RGB} RGB */
/** @typedef {import("./gels.js").Gel} Gel */

/** Largest difference of a channel between equal colours, relative to the largest channel. */
const MAX_HUE_DIFFERENCE = 1e-3;

export const GELS = gelsOf(GEL_ROWS);

/** Return the filters that a text may mean, as `findGels`. @param {string} text */
export const gelsNamed = (text) => findGels(GELS, text);

/** Return the filter that gives a lamp its colour; null for none, or if several would: reds beyond
 * Rec.709 are one. @param {RGB} rgb of the lamp @param {RGB} white its own, without a filter
 * @param {string} [code] of the filter that was put there last */
export function gelOn(rgb, white, code) {
  if (isSameHue(white, rgb)) return null;
  const gels = GELS.filter((gel) => isSameHue(filtered(gel, white), rgb));
  return gels.find((gel) => gel.code === code) ?? (gels.length === 1 ? gels[0] : null);
}

/** Return whether two colours differ at most in brightness. @param {RGB} a @param {RGB} b */
function isSameHue(a, b) {
  const [first, second] = [Math.max(...a), Math.max(...b)];
  const differences = a.map((x, c) => Math.abs(x / first - b[c] / second));
  return first > 0 && second > 0 && Math.max(...differences) < MAX_HUE_DIFFERENCE;
}
