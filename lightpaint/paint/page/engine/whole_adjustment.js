/** The adjustment of a whole picture, under the strokes that were painted on it. */
import { luminance } from '../../../viewer/drawing/colour.js';
import { VALUES } from '../../../viewer/drawing/half_floats.js';

/** @typedef {import("./paint_canvas.js").PaintCanvas} PaintCanvas */
/** @typedef {import("./message_frames.js").RGB} RGB */
/** Factors on luminance (`gain`) and colour (`tint`).
 * @typedef {{gain: number, tint: RGB}} WholeAdjustment */

/** Number of sampled pixels, and the smallest number that suffices. */
const MAX_SAMPLES = 4096;
const MIN_SAMPLES = 32;

/** Largest deviation from the median, in stops, of half of them. */
const MAX_DEVIATION_STOPS = 0.1;

/** Smallest luminance with a meaningful ratio, relative to the picture's mean. */
const MIN_RELATIVE_LUMINANCE = 0.01;

/**
 * Return the adjustment under the strokes of a fully painted picture, or null if it is not uniform.
 * @param {PaintCanvas} canvas @returns {WholeAdjustment | null}
 */
export function wholeAdjustment({ isFullyPainted, importance, image, present }) {
  if (!isFullyPainted) return null;
  /** Luminance, and red and blue over green, in stops. @type {[number[], number[], number[]]} */
  const ratios = [[], [], []];
  const step = Math.max(1, Math.floor(importance.length / MAX_SAMPLES));
  const valueAt = (/** @type {number} */ p, /** @type {boolean} */ isPresent) =>
    [0, 1, 2].map((c) => (isPresent ? VALUES[present[3 * p + c]] : image[3 * p + c]));
  let sum = 0;
  for (let p = 0; p < importance.length; p += step) sum += luminance(valueAt(p, true));
  const minLuminance = (MIN_RELATIVE_LUMINANCE * sum * step) / importance.length;
  for (let p = 0; p < importance.length; p += step) {
    const [presentLight, paintedLight] = [valueAt(p, true), valueAt(p, false)];
    const isGround = importance[p] <= 1 && luminance(presentLight) > minLuminance;
    if (!isGround || Math.min(...presentLight, ...paintedLight) <= 0) continue;
    ratios[0].push(Math.log2(luminance(paintedLight) / luminance(presentLight)));
    ratios[1].push(
      Math.log2((paintedLight[0] * presentLight[1]) / (presentLight[0] * paintedLight[1])),
    );
    ratios[2].push(
      Math.log2((paintedLight[2] * presentLight[1]) / (presentLight[2] * paintedLight[1])),
    );
  }
  if (ratios[0].length < MIN_SAMPLES) return null;
  const [gain, red, blue] = ratios.map(median);
  const isSame = [gain, red, blue].every(
    (middle, i) => median(ratios[i].map((x) => Math.abs(x - middle))) <= MAX_DEVIATION_STOPS,
  );
  return isSame ? { gain: 2 ** gain, tint: [2 ** red, 1, 2 ** blue] } : null;
}

/** @param {number[]} values */
const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];
