/** Numbers as text: a true minus sign, few digits, units behind. */

import { luminance, toKelvin } from '../../../viewer/drawing/colour.js';
import { plural, t } from '../language/language.js';

const MINUS = '\u2212';

/** @param {number} value @param {number} [digits] @returns {string} */
export function numberText(value, digits = 3) {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  const text =
    size >= 1e5 || (size > 0 && size < 1e-3)
      ? value.toExponential(1).replace('+', '')
      : String(Number(value.toPrecision(digits)));
  return text.replace('-', MINUS);
}

/** Parse a typed number, which may have a true minus sign and a decimal comma.
 * @param {string} text */
export const cleanNumberText = (text) => text.trim().replace(MINUS, '-').replace(',', '.');

/** Return a typed number, or NaN for other text. @param {string} text */
export function typedNumber(text) {
  const cleanText = cleanNumberText(text);
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(cleanText) ? Number(cleanText) : NaN;
}

/** @param {number} value @param {number} [digits] @returns {string} "+0.5", "−1.2", "0" */
export function signedText(value, digits = 1) {
  const roundedValue = Number(value.toFixed(digits));
  if (!roundedValue) return '0';
  return (roundedValue > 0 ? '+' : MINUS) + Math.abs(roundedValue).toFixed(digits);
}

/** @param {number | null | undefined} stops @returns {string} */
export function stopsText(stops) {
  if (stops === null || stops === undefined || !Number.isFinite(stops)) return '';
  return Math.abs(stops) < 0.05 ? t('as now') : t('{signed} st', { signed: signedText(stops) });
}

/** Return progress and remaining time as text, in one form for all tasks.
 * @param {{done: number, total: number, remainingSeconds?: number}} progress */
export function progressText({ done, total, remainingSeconds: remaining }) {
  if (!total) return '';
  const share = `${Math.floor((100 * Math.min(done, total)) / total)} %`;
  return remaining === undefined
    ? share
    : t('{share}, {time} left', { share, time: durationText(remaining) });
}

/** Return a time, rounded to the precision of an estimate. @param {number} seconds */
export function durationText(seconds) {
  if (seconds < 60)
    return t('{value} s', {
      value: Math.max(1, seconds < 10 ? Math.round(seconds) : 5 * Math.round(seconds / 5)),
    });
  if (seconds < 3600) return t('{value} min', { value: Math.round(seconds / 60) });
  return t('{value} h', { value: (seconds / 3600).toFixed(1) });
}

/** @param {number} share 0 to 1 @returns {string} */
export function percentText(share) {
  const value = 100 * share;
  if (value > 0 && value < 1) return '<1 %';
  return `${Math.round(value)} %`;
}

/** Rounded to what an eye can distinguish. @param {number} kelvin @returns {string} */
const kelvinText = (kelvin) => {
  const step = kelvin < 4000 ? 10 : kelvin < 8000 ? 50 : 500;
  return t('{step} K', { step: Math.round(kelvin / step) * step });
};

/** Distance from Planck's locus, in thousandths, beyond which a white looks green or pink. Lamps
 * that are sold as white are nearer. */
const MIN_TINT_DUV = 6;

/** Return a white as kelvin, with its tint if it has one. @param {number} kelvin
 * @param {number} green as of `toKelvin` */
export const whiteText = (kelvin, green) =>
  Math.abs(green) < MIN_TINT_DUV
    ? kelvinText(kelvin)
    : green > 0
      ? t('{kelvin} green', { kelvin: kelvinText(kelvin) })
      : t('{kelvin} pink', { kelvin: kelvinText(kelvin) });

/** Distance from Planck's locus, in thousandths of (u, v), up to which light has a colour
 * temperature. */
const MAX_WHITE_DUV = 20;

/** Return light as text: stops from display white, and kelvin if it is a white; empty for no light.
 * @param {number[]} rgb linear, the exposure included @returns {string} */
export const lightText = (rgb) => describeLight(rgb, luminance(rgb));

/** Return paint as text, as in its panel: its stops are its largest channel's.
 * @param {number[]} rgb linear, the exposure included @returns {string} */
export const paintText = (rgb) => describeLight(rgb, Math.max(...rgb));

/** @param {number[]} rgb @param {number} level */
function describeLight(rgb, level) {
  if (!(level > 0)) return '';
  const white = toKelvin(rgb);
  const isWhite = white && Math.abs(white.green) <= MAX_WHITE_DUV;
  const stops = t('{signed} st', { signed: signedText(Math.log2(level)) });
  return isWhite ? `${stops} · ${whiteText(white.kelvin, white.green)}` : stops;
}

/** Return a name shortened in the middle, since names of many lights differ at their ends.
 * @param {string} name @param {number} maxLength */
export function shortenName(name, maxLength) {
  if (name.length <= maxLength) return name;
  const end = Math.ceil((maxLength - 1) / 2);
  return `${name.slice(0, maxLength - 1 - end)}…${name.slice(-end)}`;
}

/** @param {number} count of lights @returns {string} */
export const lightCountText = (count) =>
  plural(count, { one: '{count} light', other: '{count} lights' });

/** @param {string} text */
export const capitalized = (text) => text.charAt(0).toUpperCase() + text.slice(1);

/** Return the name of a file without its folder. @param {string} file @param {string} folder */
export function relativePath(file, folder) {
  return file.startsWith(folder) ? file.slice(folder.length).replace(/^[/\\]+/, '') : file;
}

/** @param {number} stamp seconds since 1970 @returns {string} the time of day, in the user's own form */
export const clockText = (stamp) =>
  new Date(1000 * stamp).toLocaleTimeString([], { hour: '2-digit', minute: '2-digit' });

/** @param {number} stamp seconds since 1970 @returns {string} day and time, in the user's own form */
export const dateText = (stamp) =>
  new Date(1000 * stamp).toLocaleString([], { dateStyle: 'medium', timeStyle: 'short' });

/** Return a sentence with no-break spaces between numbers and units. @param {string} text */
export const joinUnits = (text) => text.replace(/(\d) (?=%)|(ΔE) (?=\d)/g, '$1$2\u00a0');
