/**
 * The arithmetic of scopes, on display codes (RGBA, 8 bits): luma and differences of colour as in
 * Rec. 709.
 */

/** Display codes of a picture. @typedef {{data: ArrayLike<number>, width: number, height: number}} Codes */
/** Counts of pixels, row by row from the top. @typedef {{counts: Float32Array, width: number, height: number}} Trace */

/** Number of codes. */
export const LEVELS = 256;

/** Rec. 709: parts of luma, and the largest differences of blue and red from it, which become 1/2. */
const [RED, GREEN, BLUE] = [0.2126, 0.7152, 0.0722];
const [BLUE_SCALE, RED_SCALE] = [2 * (1 - BLUE), 2 * (1 - RED)];

/** Angle in degrees, counterclockwise from blue, of the line on which skin of any tone lies. */
export const SKIN_ANGLE = 123;

/** Amplitude of the colour bars that the targets of a vectorscope stand for. */
const BAR_LEVEL = 0.75;

/** Return luma of codes from 0 to 255, on the same scale. @param {number} r @param {number} g
 * @param {number} b */
export const luma = (r, g, b) => RED * r + GREEN * g + BLUE * b;

/** Return the counts of each code in red, green, blue and luma. @param {Codes} codes */
export function histogram({ data, width, height }) {
  const counts = Array.from({ length: 4 }, () => new Float32Array(LEVELS));
  for (let i = 0; i < 4 * width * height; i += 4) {
    for (let c = 0; c < 3; c += 1) counts[c][data[i + c]] += 1;
    counts[3][Math.round(luma(data[i], data[i + 1], data[i + 2]))] += 1;
  }
  return counts;
}

/** Return a waveform: in each column of the picture how many pixels have each level, 100 % on top.
 * @param {Codes} codes @param {0 | 1 | 2 | "luma"} channel @returns {Trace} */
export function waveform({ data, width, height }, channel) {
  const counts = new Float32Array(width * LEVELS);
  for (let p = 0, i = 0; p < width * height; p += 1, i += 4) {
    const level =
      channel === 'luma' ? Math.round(luma(data[i], data[i + 1], data[i + 2])) : data[i + channel];
    counts[(LEVELS - 1 - level) * width + (p % width)] += 1;
  }
  return { counts, width, height: LEVELS };
}

/** Return the differences of blue and red from luma, each from −1/2 to 1/2. @param {number} r
 * @param {number} g @param {number} b all three from 0 to 1 @returns {[cb: number, cr: number]} */
export function colourDifferences(r, g, b) {
  const y = luma(r, g, b);
  return [(b - y) / BLUE_SCALE, (r - y) / RED_SCALE];
}

/** Return how many pixels have each difference of colour: blue to the right, red upwards.
 * @param {Codes} codes @param {number} size of the square @returns {Trace} */
export function vectorscope({ data, width, height }, size) {
  const counts = new Float32Array(size * size);
  for (let i = 0; i < 4 * width * height; i += 4) {
    const difference = colourDifferences(data[i] / 255, data[i + 1] / 255, data[i + 2] / 255);
    const [x, y] = placeOf(difference, size).map(Math.round);
    counts[y * size + x] += 1;
  }
  return { counts, width: size, height: size };
}

/** Return where a difference of colour lies in a square of pixels, from its top left.
 * @param {[number, number]} difference @param {number} size @returns {[x: number, y: number]} */
export const placeOf = ([cb, cr], size) => [(0.5 + cb) * (size - 1), (0.5 - cr) * (size - 1)];

/** The targets of a vectorscope: where bars of 75 % lie. @returns {{name: string,
 *   difference: [number, number]}[]} */
export function targets() {
  const bars = { R: [1, 0, 0], Mg: [1, 0, 1], B: [0, 0, 1], Cy: [0, 1, 1], G: [0, 1, 0], Yl: [1, 1, 0] };
  return Object.entries(bars).map(([name, bar]) => {
    const [r, g, b] = bar.map((value) => BAR_LEVEL * value);
    return { name, difference: colourDifferences(r, g, b) };
  });
}

/** Return the level in percent below which a part of the pixels lies. @param {Float32Array} counts of
 * each code @param {number} part from 0 to 1 */
export function percentile(counts, part) {
  const total = counts.reduce((sum, count) => sum + count, 0);
  let sum = 0;
  const code = counts.findIndex((count) => (sum += count) >= part * total && sum > 0);
  return (100 * Math.max(0, code)) / (LEVELS - 1);
}

/** Return the largest part of pixels of a channel at a code. @param {Float32Array[]} counts
 * @param {number} code */
export function clippedPart(counts, code) {
  const total = counts[0].reduce((sum, count) => sum + count, 0);
  return total ? Math.max(...counts.slice(0, 3).map((channel) => channel[code])) / total : 0;
}

/** Return alpha of a trace for each pixel, from 0 to 255: the logarithm of the counts, since few
 * pixels matter as well. @param {Trace} trace */
export function traceAlpha({ counts }) {
  const most = counts.reduce((a, b) => Math.max(a, b), 0);
  const full = Math.log2(1 + most) || 1;
  return Uint8ClampedArray.from(counts, (count) => (count ? 110 + (145 * Math.log2(1 + count)) / full : 0));
}
