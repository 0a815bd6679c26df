/**
 * Overlays on pictures, as cpu.js computes them. glsl.js has the same in the shader's language, and
 * a test compares the two.
 *
 * No overlay relies on colour alone: too dark and too bright are also hatched in two directions.
 */

/** Light at the centre of the false-colour scale. */
export const GREY = 0.18;

/** Codes of false colour: from six stops below grey to six above, in whole stops. */
export const BANDS = [
  [24, 10, 40],
  [52, 18, 96],
  [46, 44, 150],
  [30, 84, 178],
  [18, 128, 170],
  [20, 152, 120],
  [128, 128, 128],
  [120, 170, 60],
  [196, 190, 40],
  [232, 164, 40],
  [236, 116, 44],
  [220, 60, 56],
  [255, 220, 228],
];

/** Colour codes of too dark, too bright, beyond reach, and importance. */
export const INKS = {
  dark: [64, 132, 255],
  bright: [255, 148, 40],
  beyond: [232, 72, 200],
  importance: [72, 208, 140],
};

/** Difference of codes at which ink is opaque. */
export const OPAQUE_DIFFERENCE = 64;

/** Luma of codes, for the picture under ink. */
export const LUMA = [0.2126, 0.7152, 0.0722];

/** Period of a hatch in device pixels, and how many of these have less ink. */
export const HATCH = { period: 8, thin: 4, strength: 0.55 };

/** Return the false-colour band of a luminance, exposure included. @param {number} luminance */
function bandIndex(luminance) {
  const stops = Math.log2(Math.max(luminance, 1e-9) / GREY);
  return Math.min(BANDS.length - 1, Math.max(0, Math.floor(stops + 0.5) + 6));
}

/** Return the share of ink that a hatch lets through at a pixel of the picture; slope ±1.
 * @param {number} x @param {number} y @param {number} slope */
export function hatch(x, y, slope) {
  const phase = (((x + slope * y) % HATCH.period) + HATCH.period) % HATCH.period;
  return phase < HATCH.thin ? HATCH.strength : 1;
}

/** Lay ink over a pixel of RGBA: the pixel below loses its colour and half its light.
 * @param {Uint8ClampedArray} rgba @param {number} index @param {number[]} ink
 * @param {number} amount 0 to 1 */
function blendInk(rgba, index, ink, amount) {
  const grey =
    (LUMA[0] * rgba[index] + LUMA[1] * rgba[index + 1] + LUMA[2] * rgba[index + 2]) * 0.6;
  for (let c = 0; c < 3; c++) rgba[index + c] = grey + (ink[c] - grey) * amount;
}

/** Pixels of a picture that are shown: every `step`th of every `step`th row; or, if these are not the
 * rows and columns that are `shown`, those at the middle of each of them.
 * @typedef {{height: number, width: number, step: number, shown?: number[]}} Grid */

/** Visit each pixel shown: its index in RGBA, and its column, row and index in the whole picture.
 * @param {Grid} grid @param {(at: number, x: number, y: number, p: number) => void} visit */
function visitPixels({ height, width, step, shown: [rows, columns] = [] }, visit) {
  let index = 0;
  if (rows && (rows !== Math.ceil(height / step) || columns !== Math.ceil(width / step))) {
    for (let row = 0; row < rows; row++)
      for (let column = 0; column < columns; column++, index += 4) {
        const y = Math.floor(((row + 0.5) * height) / rows);
        const x = Math.floor(((column + 0.5) * width) / columns);
        visit(index, x, y, y * width + x);
      }
    return;
  }
  for (let y = 0; y < height; y += step)
    for (let x = 0; x < width; x += step, index += 4) visit(index, x, y, y * width + x);
}

/** Draw the difference of solution and painting, both as codes, where something is painted.
 * @param {Uint8ClampedArray} rgba of the solution, changed @param {Uint8ClampedArray} painting
 * @param {Float32Array} importance @param {Grid} grid of the solution */
export function drawMissed(rgba, painting, importance, grid) {
  visitPixels(grid, (index, x, y, p) => {
    const r = rgba[index] - painting[4 * p];
    const g = rgba[index + 1] - painting[4 * p + 1];
    const b = rgba[index + 2] - painting[4 * p + 2];
    const maxDifference = Math.max(Math.abs(r), Math.abs(g), Math.abs(b));
    const isDark = LUMA[0] * r + LUMA[1] * g + LUMA[2] * b < 0;
    const amount = importance[p] > 0 ? Math.min(1, maxDifference / OPAQUE_DIFFERENCE) : 0;
    blendInk(rgba, index, isDark ? INKS.dark : INKS.bright, amount * hatch(x, y, isDark ? -1 : 1));
  });
}

/** Return the importance with full ink: the greatest, at least 1.
 * @param {Float32Array} importance */
export function maxImportance(importance) {
  let maximum = 1;
  for (const x of importance) if (x > maximum) maximum = x;
  return maximum;
}

/** Return the share of full ink for an importance, on a scale of ratios, so that the rest stays
 * visible beside an accent ten times as important. @param {number} x
 * @param {number} maxInk the one with full ink */
export const inkOf = (x, maxInk) => Math.log1p(Math.max(0, x)) / Math.log1p(maxInk);

/** @param {Uint8ClampedArray} rgba changed @param {(p: number) => number} amount of ink at a pixel
 * @param {number[]} ink @param {Grid} grid */
export function drawInk(rgba, amount, ink, grid) {
  visitPixels(grid, (index, x, y, p) =>
    blendInk(rgba, index, ink, 0.8 * Math.min(1, amount(p)) * hatch(x, y, 1)),
  );
}

/** @param {Uint8ClampedArray} rgba changed @param {Float32Array} light (…, 3)
 * @param {number} gain of the exposure */
export function drawFalseColour(rgba, light, gain) {
  for (let p = 0; p < light.length / 3; p++) {
    const i = 3 * p;
    const y = LUMA[0] * light[i] + LUMA[1] * light[i + 1] + LUMA[2] * light[i + 2];
    const [r, g, b] = BANDS[bandIndex(y * gain)];
    rgba[4 * p] = r;
    rgba[4 * p + 1] = g;
    rgba[4 * p + 2] = b;
    rgba[4 * p + 3] = 255;
  }
}
