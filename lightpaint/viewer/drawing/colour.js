/**
 * Colours as people name them, to and from linear Rec.709 (D65).
 *
 * Kelvin is a place on Planck's locus; green is the distance from it in CIE 1960 (u, v), times
 * 1000, positive towards green (1000 Duv).
 */
import { fromXyz, luminance } from './chromaticity.js';
import { decodeSrgb, encodeSrgb } from './view_transform.js';

/** @typedef {[number, number, number]} RGB */

export { decodeSrgb as decode, encodeSrgb as encode, luminance };

/** Temperatures for which the locus below is good, in kelvin. */
const KELVIN_RANGE = { low: 1000, high: 15000 };

/** Neutral temperature of warmer and cooler gains. */
const NEUTRAL_MIRED = 200;

/** Return the display colour; light brighter than 1 is scaled down.
 * @param {ArrayLike<number>} rgb linear */
export function toHex(rgb) {
  const maxChannel = Math.max(1, rgb[0], rgb[1], rgb[2]);
  const codes = [0, 1, 2].map((c) => Math.round(255 * encodeSrgb(rgb[c] / maxChannel)));
  return `#${codes.map((code) => code.toString(16).padStart(2, '0')).join('')}`;
}

/** Return the linear light of `#ffaa66` or `#fa6`; null for other text.
 * @param {string} text @returns {RGB | null} */
export function fromHex(text) {
  const match = /^#?([0-9a-f]{3}|[0-9a-f]{6})$/i.exec(text.trim());
  if (!match) return null;
  const digits = match[1].length === 6 ? match[1] : match[1].replace(/./g, '$&$&');
  return mapChannels((c) => decodeSrgb(parseInt(digits.slice(2 * c, 2 * c + 2), 16) / 255));
}

/** Return hue in degrees, saturation and value in [0, 1] of the display colour.
 * @param {ArrayLike<number>} rgb linear @returns {RGB} */
export function toHsv(rgb) {
  const [r, g, b] = mapChannels((c) => encodeSrgb(rgb[c]));
  const maxChannel = Math.max(r, g, b);
  const range = maxChannel - Math.min(r, g, b);
  if (range < 1e-9) return [0, 0, maxChannel];
  const sixths =
    maxChannel === r
      ? (g - b) / range
      : maxChannel === g
        ? 2 + (b - r) / range
        : 4 + (r - g) / range;
  return [(60 * sixths + 360) % 360, range / maxChannel, maxChannel];
}

/** Return the linear light of hue, saturation and value. @param {RGB} hsv @returns {RGB} */
export function fromHsv([hue, saturation, value]) {
  return mapChannels((c) => {
    const k = ([5, 3, 1][c] + hue / 60) % 6;
    return decodeSrgb(value * (1 - saturation * Math.max(0, Math.min(k, 4 - k, 1))));
  });
}

/** Return the linear light of a temperature, its largest channel 1 and none below 0.
 * @param {number} kelvin @param {number} [green] @returns {RGB} */
export function fromKelvin(kelvin, green = 0) {
  const { uv, tangent } = locus(kelvin);
  const normal = greenNormal(tangent);
  const [u, v] = [0, 1].map((i) => uv[i] + (green / 1000) * normal[i]);
  const rgb = fromXyz((3 * u) / (2 * v), (4 - u - 10 * v) / (2 * v)).map((x) => Math.max(0, x));
  const maxChannel = Math.max(...rgb);
  return mapChannels((c) => rgb[c] / maxChannel);
}

/** Return the correlated temperature (Ohno 2013) and green of a colour; null for black, for colours
 * farther than 0.05 from the locus, and beyond its ends.
 * @param {ArrayLike<number>} rgb linear @returns {{kelvin: number, green: number} | null} */
export function toKelvin(rgb) {
  const [X, Y, Z] = mapChannels((c) => TO_XYZ[c].reduce((sum, part, i) => sum + part * rgb[i], 0));
  const sum = X + 15 * Y + 3 * Z;
  if (!(sum > 0)) return null;
  const [u, v] = [(4 * X) / sum, (6 * Y) / sum];
  /** @param {number} mired */
  const distance = (mired) => {
    const { uv } = locus(1e6 / mired);
    return Math.hypot(u - uv[0], v - uv[1]);
  };
  let [low, high] = [1e6 / KELVIN_RANGE.high, 1e6 / KELVIN_RANGE.low];
  for (let round = 0; round < 60; round++) {
    const third = (high - low) / 3;
    if (distance(low + third) < distance(high - third)) high -= third;
    else low += third;
  }
  const mired = (low + high) / 2;
  const isEnd = mired < 1e6 / KELVIN_RANGE.high + 0.01 || mired > 1e6 / KELVIN_RANGE.low - 0.01;
  if (distance(mired) > 0.05 || (isEnd && distance(mired) > 0.002)) return null;
  const { uv, tangent } = locus(1e6 / mired);
  const normal = greenNormal(tangent);
  const green = 1000 * ((u - uv[0]) * normal[0] + (v - uv[1]) * normal[1]);
  return { kelvin: 1e6 / mired, green };
}

/** Return the factor of luminance 1 that makes light warmer by some mireds (below 0: cooler), along
 * Planck's locus around 5000 K. @param {number} mired @returns {RGB} */
export function warmer(mired) {
  const minShift = 1e6 / KELVIN_RANGE.high - NEUTRAL_MIRED;
  const maxShift = 500 - NEUTRAL_MIRED; // Below 2000 K hardly any blue is left.
  const target = fromKelvin(1e6 / (NEUTRAL_MIRED + Math.min(maxShift, Math.max(minShift, mired))));
  const neutral = fromKelvin(1e6 / NEUTRAL_MIRED);
  const gains = mapChannels((c) => target[c] / neutral[c]);
  return mapChannels((c) => gains[c] / luminance(gains));
}

/** CIE XYZ of linear Rec.709 (IEC 61966-2-1's primaries and white). */
const TO_XYZ = [
  [0.4123908, 0.35758434, 0.18048079],
  [0.21263901, 0.71516868, 0.07219232],
  [0.01933082, 0.11919478, 0.95053215],
];

/** Planck's locus in CIE 1960 (u, v), and its direction towards lower temperatures: the rational
 * approximation of M. Krystek, "An algorithm to calculate correlated colour temperature", Color
 * Research & Application 10 (1985), good to 1e-4 from 1000 to 15,000 K.
 * @param {number} kelvin @returns {{uv: [number, number], tangent: [number, number]}} */
function locus(kelvin) {
  const t = kelvin;
  const a = 0.860117757 + 1.54118254e-4 * t + 1.28641212e-7 * t * t;
  const b = 1 + 8.42420235e-4 * t + 7.08145163e-7 * t * t;
  const c = 0.317398726 + 4.22806245e-5 * t + 4.20481691e-8 * t * t;
  const d = 1 - 2.89741816e-5 * t + 1.61456053e-7 * t * t;
  const [da, db] = [1.54118254e-4 + 2 * 1.28641212e-7 * t, 8.42420235e-4 + 2 * 7.08145163e-7 * t];
  const [dc, dd] = [4.22806245e-5 + 2 * 4.20481691e-8 * t, 2 * 1.61456053e-7 * t - 2.89741816e-5];
  return {
    uv: [a / b, c / d],
    tangent: [-(da * b - a * db) / b ** 2, -(dc * d - c * dd) / d ** 2],
  };
}

/** Unit vector at a right angle to the locus. @param {[number, number]} along */
function greenNormal([u, v]) {
  const length = Math.hypot(u, v);
  return [-v / length, u / length];
}

/** @param {(channel: number) => number} value @returns {RGB} */
function mapChannels(value) {
  return [value(0), value(1), value(2)];
}

/** A colour whatever its brightness: its largest channel is 1. @param {RGB} rgb @returns {RGB} */
export function atFullBrightness(rgb) {
  const maxChannel = Math.max(...rgb) || 1;
  return /** @type {RGB} */ (rgb.map((x) => x / maxChannel));
}

/** Return whether two colours differ at most in brightness. @param {RGB} a @param {RGB} b
 * @param {number} tolerance of a channel, relative to the largest one */
export function isSameHue(a, b, tolerance) {
  const [first, second] = [Math.max(...a), Math.max(...b)];
  const isEqual = a.every((x, c) => Math.abs(x / first - b[c] / second) < tolerance);
  return first > 0 && second > 0 && isEqual;
}
