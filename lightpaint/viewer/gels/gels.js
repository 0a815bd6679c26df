/**
 * Colour filters (gels) on lamps. A filter multiplies each channel of the lamp's own white, so that
 * its published colour and transmission come out exactly on a lamp of the white that it was measured
 * with. On daylight lamps the colour is off by .01 in (x, y) as a rule, and .025 for one in ten
 * filters, compared with their spectra.
 */
import { fromChromaticity, luminance } from '../drawing/chromaticity.js';

/** @import { RGB } from '../drawing/chromaticity.js' */
/** factor: of each channel. percent: of the light that passes.
 * @typedef {{code: string, maker: string, number: string, name: string, percent: number,
 *   factor: RGB}} Gel */

/** Makers by the letter of their codes, and chromaticities of the light that they measure with. */
const MAKERS = new Map([
  ['L', { maker: 'Lee', source: fromChromaticity(0.4234, 0.399) }],
  ['R', { maker: 'Rosco', source: fromChromaticity(0.44757, 0.40745) }],
]);

/** Return the filters of a table like `GEL_ROWS`. @param {string} rows @returns {Gel[]} */
export function gelsOf(rows) {
  return rows
    .trim()
    .split('\n')
    .map((row) => {
      const words = row.split(' ');
      const [x, y, percent] = words.slice(-3).map(Number);
      const [code] = words;
      const { maker, source } = /** @type {{maker: string, source: RGB}} */ (MAKERS.get(code[0]));
      const name = words.slice(1, -3).join(' ');
      const factor = transmission(fromChromaticity(x, y), source, percent / 100);
      return { code, maker, number: code.slice(1), name, percent, factor };
    });
}

/** Return the factor of each channel. A colour outside of Rec.709 has none below 0; its transmission
 * stays. @param {RGB} colour @param {RGB} source @param {number} share of the light that passes
 * @returns {RGB} */
function transmission(colour, source, share) {
  const factor = colour.map((x, c) => Math.max(0, x) / source[c]);
  const passed = luminance(factor.map((x, c) => x * source[c])) / luminance(source);
  return /** @type {RGB} */ (factor.map((x) => (x * share) / passed));
}

/** Return the light of a lamp through a filter. @param {Gel} gel @param {RGB} white of the lamp
 * @returns {RGB} */
export const filtered = ({ factor }, white) =>
  /** @type {RGB} */ (white.map((x, c) => x * factor[c]));

/** Return the stops that a filter costs on a lamp. @param {Gel} gel @param {RGB} white of the lamp */
export const lossInStops = (gel, white) =>
  -Math.log2(luminance(filtered(gel, white)) / luminance(white));

/** Return the name of a filter, as "Lee 201". @param {Gel} gel */
export const gelName = ({ maker, number }) => `${maker} ${number}`;

/** Return the filters that a text may mean: all whose number or code begin with it, then those with
 * its words in their names. @param {Gel[]} gels @param {string} text like 201, L201, lee 201, amber
 * @returns {Gel[]} */
export function findGels(gels, text) {
  const words = text.trim().toLowerCase().split(/\s+/).filter(Boolean);
  const rank = (/** @type {Gel} */ gel) => {
    const [code, number] = [gel.code.toLowerCase(), gel.number];
    const whole = `${gel.maker} ${number} ${code} ${gel.name}`.toLowerCase();
    if (!words.every((word) => whole.includes(word))) return 0;
    return words.some((word) => word === number || word === code)
      ? 3
      : words.some((word) => number.startsWith(word) || code.startsWith(word))
        ? 2
        : 1;
  };
  return gels
    .map((gel) => ({ gel, rank: rank(gel) }))
    .filter((entry) => entry.rank > 0)
    .sort((a, b) => b.rank - a.rank)
    .map(({ gel }) => gel);
}
