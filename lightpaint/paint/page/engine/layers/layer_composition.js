/**
 * Composition of layers into the painting, pixel by pixel; the twin of paint/layers/composition.py.
 *
 * Each operation is rounded to float32, as NumPy does, so that the page draws the session's bits.
 */

/** @import { Layer } from '../messages.js' */
/** @import { Tile } from './layer_pixels.js' */
/** A visible layer, with the strength and importance of its group included, and its accent.
 * @typedef {Layer & {accent: number}} ShownLayer */
/** Light (n, 3) and importance (n) of some pixels, changed in place.
 * @typedef {{light: Float32Array, counts: Float32Array}} Composed */

const round = Math.fround;

const [RED, GREEN, BLUE] = [0.2126, 0.7152, 0.0722].map(round);

/** Coverage below which a pixel is uncovered. */
const MIN_COVERAGE = round(1e-3);

/** Lower and upper bound of importance under repeated weighing. */
const [MIN_WEIGHED, MAX_WEIGHED] = [round(0.01), 1000];

/** Brightest light that a layer makes. */
const MAX_LIGHT = 65504;

/** Apply a layer to what lies below it. @param {ShownLayer} layer @param {Tile} tile
 * @param {Composed} below */
export function applyLayer(layer, tile, below) {
  if (layer.kind === 'pixels') replace(layer, tile, below);
  else if (layer.kind === 'weigh') weigh(layer, tile, below);
  else if (layer.kind === 'paint') paint(layer, tile, below);
  else if (layer.kind === 'adjust') adjust(layer, tile, below);
}

/** @param {ShownLayer} layer */
const factorOf = ({ accent, importance = 1 }) => round(accent * importance);

/** @param {ShownLayer} layer @param {Tile} tile @param {Composed} below */
function adjust({ gain = 1, tint = [1, 1, 1], strength = 1, ...rest }, { coverage }, below) {
  const { light, counts } = below;
  const factor = factorOf(/** @type {ShownLayer} */ (rest));
  const scale = round(gain ** strength);
  const [r, g, b] = tint.map((x) => round(x ** strength));
  for (let p = 0, i = 0; p < coverage.length; p++, i += 3) {
    const c = coverage[p];
    if (c < MIN_COVERAGE) continue;
    const before = luminance(light[i], light[i + 1], light[i + 2]);
    const [tr, tg, tb] = [round(light[i] * r), round(light[i + 1] * g), round(light[i + 2] * b)];
    const after = luminance(tr, tg, tb);
    const level = after > 0 ? round(round(scale * before) / after) : scale;
    light[i] = mixed(light[i], round(tr * level), c);
    light[i + 1] = mixed(light[i + 1], round(tg * level), c);
    light[i + 2] = mixed(light[i + 2], round(tb * level), c);
    counts[p] = counted(counts[p], factor, c);
  }
}

/** @param {ShownLayer} layer @param {Tile} tile @param {Composed} below */
function paint({ strength = 1, ...rest }, { image, coverage }, below) {
  const { light, counts } = below;
  if (!image) return;
  const factor = factorOf(/** @type {ShownLayer} */ (rest));
  const share = round(strength);
  for (let p = 0, i = 0; p < coverage.length; p++, i += 3) {
    const c = coverage[p];
    if (c < MIN_COVERAGE) continue;
    const part = round(c * share);
    light[i] = mixed(light[i], image[i], part);
    light[i + 1] = mixed(light[i + 1], image[i + 1], part);
    light[i + 2] = mixed(light[i + 2], image[i + 2], part);
    counts[p] = counted(counts[p], factor, c);
  }
}

/** @param {ShownLayer} layer @param {Tile} tile @param {Composed} below */
function weigh({ times = 1, strength = 1 }, { coverage }, { counts }) {
  const by = round(times ** strength);
  for (let p = 0; p < coverage.length; p++) {
    const c = coverage[p];
    if (c < MIN_COVERAGE) continue;
    const base = counts[p] > 0 ? counts[p] : 1;
    const [least, most] = [Math.min(base, MIN_WEIGHED), Math.max(base, MAX_WEIGHED)];
    const weighed = Math.min(most, Math.max(least, round(base * by)));
    counts[p] += round(c * round(weighed - counts[p]));
  }
}

/** @param {ShownLayer} layer @param {Tile} tile @param {Composed} below */
function replace({ strength = 1, ...rest }, { image, coverage }, { light, counts }) {
  if (!image) return;
  const factor = factorOf(/** @type {ShownLayer} */ (rest));
  const share = round(strength);
  for (let p = 0, i = 0; p < coverage.length; p++, i += 3) {
    if (!(coverage[p] > 0)) continue;
    for (let k = i; k < i + 3; k++)
      light[k] =
        strength === 1
          ? image[k]
          : Math.max(0, round(light[k] + round(share * round(image[k] - light[k]))));
    counts[p] = round(coverage[p] * factor);
  }
}

/** @param {number} r @param {number} g @param {number} b */
const luminance = (r, g, b) => round(round(round(RED * r) + round(GREEN * g)) + round(BLUE * b));

/** @param {number} below @param {number} to @param {number} share */
const mixed = (below, to, share) =>
  Math.min(MAX_LIGHT, Math.max(0, round(below + round(share * round(to - below)))));

/** @param {number} below @param {number} factor @param {number} coverage */
const counted = (below, factor, coverage) =>
  below < factor ? round(below + round(coverage * round(factor - below))) : below;
