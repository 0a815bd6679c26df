/** Effects of strokes on the pixels that they cover. */
import { luminance } from '../../../viewer/drawing/colour.js';
import { VALUES } from '../../../viewer/drawing/half_floats.js';

/** @typedef {import("./paint_canvas.js").PaintCanvas} PaintCanvas */
/** @typedef {import("./paint_canvas.js").Tile} Tile */
/** @typedef {import("./whole_adjustment.js").WholeAdjustment} WholeAdjustment */
/** @typedef {import("./message_frames.js").RGB} RGB */

/**
 * The effect of a stroke. paint: the pixel becomes a colour, or light of that colour on its albedo.
 * Surfaces without diffuse reflection, such as a flame, ignore light and keep their pixels. erase:
 * the pixel shows the current look again, unpainted; in a picture that was adjusted as a whole, it
 * shows that adjustment. weigh: its importance is multiplied by `times`; an unpainted pixel keeps
 * its look, with the importance of a stroke. adjust: its luminance is multiplied by `gain` and its
 * colour by `tint`.
 * @typedef {{kind: 'paint', rgb: RGB, as: 'light' | 'colour'} | {kind: 'erase', ground: WholeAdjustment | null} |
 *   {kind: 'weigh', times: number} | {kind: 'adjust', gain: number, tint: RGB}} Effect
 */

/** Lower and upper bound of importance under repeated changes. */
const [MIN, MAX] = [0.01, 1000];

/** Multiply importance within these bounds. A value beyond them already stays.
 * @param {number} importance @param {number} times */
function scaledImportance(importance, times) {
  const minimum = Math.min(MIN, importance);
  return Math.min(Math.max(MAX, importance), Math.max(minimum, importance * times));
}

/** Make light brighter and warmer. The gain alone decides the luminance, whatever the colour.
 * @param {Float64Array} light changed @param {WholeAdjustment} by */
function adjust(light, { gain, tint }) {
  const oldLevel = luminance(light);
  for (let c = 0; c < 3; c++) light[c] *= tint[c];
  const newLevel = luminance(light);
  const level = newLevel > 0 ? (gain * oldLevel) / newLevel : gain;
  for (let c = 0; c < 3; c++) light[c] *= level;
}

/** Apply a stroke to one pixel, given its earlier value and its coverage.
 * @param {PaintCanvas} canvas @param {Effect} effect
 * @returns {(tile: Tile, q: number, p: number, covered: number) => void} */
export function pixelChange(canvas, effect) {
  const { image, importance, present, albedo } = canvas;
  /** @type {(tile: Tile, q: number, p: number, covered: number, to: (c: number) => number) => void} */
  const blend = (tile, q, p, covered, target) => {
    for (let c = 0; c < 3; c++) {
      const value = tile.image[3 * q + c];
      image[3 * p + c] = value + covered * (target(c) - value);
    }
  };
  const { full, lift } = canvas;
  const pixel = new Float64Array(3); // reused for all pixels, for speed
  /** @type {(tile: Tile, q: number, p: number, covered: number) => void} */
  const count = (tile, q, p, covered) => {
    const weight = scaledImportance(tile.importance[q], lift);
    importance[p] = weight < full ? weight + covered * (full - weight) : weight;
  };
  switch (effect.kind) {
    case 'paint': {
      const { rgb } = effect;
      const reflectance = effect.as === 'light' ? albedo : null;
      return (tile, q, p, covered) => {
        if (
          reflectance &&
          !VALUES[reflectance[3 * p]] &&
          !VALUES[reflectance[3 * p + 1]] &&
          !VALUES[reflectance[3 * p + 2]]
        )
          return;
        blend(tile, q, p, covered, (c) =>
          reflectance ? VALUES[reflectance[3 * p + c]] * rgb[c] : rgb[c],
        );
        count(tile, q, p, covered);
      };
    }
    case 'erase': {
      const { ground } = effect;
      if (ground)
        return (tile, q, p, covered) => {
          for (let c = 0; c < 3; c++) pixel[c] = VALUES[present[3 * p + c]];
          adjust(pixel, ground);
          blend(tile, q, p, covered, (c) => pixel[c]);
          importance[p] = tile.importance[q] + covered * (1 - tile.importance[q]);
        };
      return (tile, q, p, covered) => {
        blend(tile, q, p, covered, (c) => VALUES[present[3 * p + c]]);
        importance[p] = tile.importance[q] * (1 - covered);
      };
    }
    case 'weigh':
      return (tile, q, p, covered) => {
        blend(tile, q, p, 0, () => 0);
        const weight = tile.importance[q];
        importance[p] = weight + covered * (scaledImportance(weight || 1, effect.times) - weight);
      };
    case 'adjust':
      return (tile, q, p, covered) => {
        for (let c = 0; c < 3; c++) pixel[c] = tile.image[3 * q + c];
        adjust(pixel, effect);
        blend(tile, q, p, covered, (c) => pixel[c]);
        count(tile, q, p, covered);
      };
  }
}
