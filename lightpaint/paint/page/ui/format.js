/** Numbers as people read them. A true minus, a thin choice of digits, the unit behind. */

import { luminance, toKelvin } from './colours.js';

const MINUS = '\u2212';

/** @param {number} value @param {number} [digits] @returns {string} */
export function number(value, digits = 3) {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  const text =
    size >= 1e5 || (size > 0 && size < 1e-3)
      ? value.toExponential(1).replace('+', '')
      : String(Number(value.toPrecision(digits)));
  return text.replace('-', MINUS);
}

/** A number as it is typed, with the minus and the comma that people may write.
 * @param {string} text */
export const asTyped = (text) => text.trim().replace(MINUS, '-').replace(',', '.');

/** @param {number} value @param {number} [digits] @returns {string} "+0.5", "−1.2", "0" */
export function signed(value, digits = 1) {
  const rounded = Number(value.toFixed(digits));
  if (!rounded) return '0';
  return (rounded > 0 ? '+' : MINUS) + Math.abs(rounded).toFixed(digits);
}

/** @param {number | null | undefined} stops @returns {string} */
export function stopsText(stops) {
  if (stops === null || stops === undefined || !Number.isFinite(stops)) return '';
  return Math.abs(stops) < 0.05 ? 'as now' : `${signed(stops)} st`;
}

/** @param {number} share 0 to 1 @returns {string} */
export function percent(share) {
  const value = 100 * share;
  if (value > 0 && value < 1) return '<1 %';
  return `${Math.round(value)} %`;
}

/** No finer than an eye tells them apart. @param {number} kelvin @returns {string} */
const kelvinText = (kelvin) => {
  const step = kelvin < 4000 ? 10 : kelvin < 8000 ? 50 : 500;
  return `${Math.round(kelvin / step) * step} K`;
};

/** How far from that line, in the same thousandths, a white is seen to be green or pink: what lamps
 * are sold as white is nearer. */
const TINTED = 6;

/** A white by its kelvin, and its tint where it has one. @param {number} kelvin
 * @param {number} green as of `toKelvin` */
export const whiteText = (kelvin, green) =>
  kelvinText(kelvin) + (Math.abs(green) < TINTED ? '' : green > 0 ? ' green' : ' pink');

/** How far from a white's line, in thousandths of (u, v), light is called by its kelvin. */
const WHITE = 20;

/** Light as it is spoken of: stops from what is shown as white, and kelvin where it is a white;
 * nothing where there is none.
 * @param {number[]} rgb linear, the exposure included @returns {string} */
export const lightText = (rgb) => spoken(rgb, luminance(rgb));

/** Paint, as its panel speaks of it: its stops are those of its largest channel.
 * @param {number[]} rgb linear, the exposure included @returns {string} */
export const paintText = (rgb) => spoken(rgb, Math.max(...rgb));

/** @param {number[]} rgb @param {number} level */
function spoken(rgb, level) {
  if (!(level > 0)) return '';
  const found = toKelvin(rgb);
  const isWhite = found && Math.abs(found.green) <= WHITE;
  return `${signed(Math.log2(level))} st${isWhite ? ` · ${whiteText(found.kelvin, found.green)}` : ''}`;
}

/** @param {number} count @param {string} one @param {string} [many] @returns {string} */
export const counted = (count, one, many = `${one}s`) => `${count} ${count === 1 ? one : many}`;
