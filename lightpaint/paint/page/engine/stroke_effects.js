/** Effects of strokes on the pixels that they cover. */

import { luminance } from '../../../viewer/drawing/colour.js';
import { VALUES } from '../../../viewer/drawing/half_floats.js';

/** @import { PaintCanvas, Tile } from './paint_canvas.js' */
/** @import { WholeAdjustment } from './stroke.js' */
/** @import { RGB } from '../../../viewer/drawing/colour.js' */

/** The effect of a stroke. paint: the pixel becomes a colour, or light of that colour on its albedo.
 * Surfaces without diffuse reflection, such as a flame, ignore light and keep their pixels. erase:
 * the pixel shows the current look again, unpainted; in a picture that was adjusted as a whole, it
 * shows that adjustment. weigh: its importance is multiplied by `times`; an unpainted pixel keeps
 * its look, with the importance of a stroke. adjust: its luminance is multiplied by `gain` and its
 * colour by `tint`.
 * @typedef {{kind: 'paint', rgb: RGB, paintMode: 'light' | 'colour'} | {kind: 'erase', ground: WholeAdjustment | null} |
 *   {kind: 'weigh', factor: number} | {kind: 'adjust', gain: number, tint: RGB}} Effect */

/** Lower and upper bound of importance under repeated changes. */
const [MIN_IMPORTANCE, MAX_IMPORTANCE] = [0.01, 1000];

/** Multiply importance within these bounds. A value beyond them already stays.
 * @param {number} importance @param {number} factor */
function scaleImportance(importance, factor) {
  const minimum = Math.min(MIN_IMPORTANCE, importance);
  return Math.min(Math.max(MAX_IMPORTANCE, importance), Math.max(minimum, importance * factor));
}

/** Make light brighter and warmer. The gain alone decides the luminance, whatever the colour.
 * @param {Float64Array} light changed @param {WholeAdjustment} adjustment */
function adjust(light, { gain, tint }) {
  const oldLevel = luminance(light);
  for (let c = 0; c < 3; c++) light[c] *= tint[c];
  const newLevel = luminance(light);
  const level = newLevel > 0 ? (gain * oldLevel) / newLevel : gain;
  for (let c = 0; c < 3; c++) light[c] *= level;
}

/** Apply a stroke to one pixel, given its earlier value and its coverage.
 * @param {PaintCanvas} canvas @param {Effect} effect
 * @returns {(tile: Tile, q: number, p: number, coverage: number) => void} */
export function pixelChange(canvas, effect) {
  const { image, importance, present, albedo } = canvas;
  /** @type {(tile: Tile, q: number, p: number, coverage: number, target: (c: number) => number) => void} */
  const blend = (tile, q, p, coverage, target) => {
    for (let c = 0; c < 3; c++) {
      const value = tile.image[3 * q + c];
      image[3 * p + c] = value + coverage * (target(c) - value);
    }
  };
  const { strokeImportance, importanceFactor } = canvas;
  const pixel = new Float64Array(3); // reused for all pixels, for speed
  /** @type {(tile: Tile, q: number, p: number, coverage: number) => void} */
  const raiseImportance = (tile, q, p, coverage) => {
    const weight = scaleImportance(tile.importance[q], importanceFactor);
    importance[p] =
      weight < strokeImportance ? weight + coverage * (strokeImportance - weight) : weight;
  };
  switch (effect.kind) {
    case 'paint': {
      const { rgb } = effect;
      const reflectance = effect.paintMode === 'light' ? albedo : null;
      return (tile, q, p, coverage) => {
        if (
          reflectance &&
          !VALUES[reflectance[3 * p]] &&
          !VALUES[reflectance[3 * p + 1]] &&
          !VALUES[reflectance[3 * p + 2]]
        )
          return;
        blend(tile, q, p, coverage, (c) =>
          reflectance ? VALUES[reflectance[3 * p + c]] * rgb[c] : rgb[c],
        );
        raiseImportance(tile, q, p, coverage);
      };
    }
    case 'erase': {
      const { ground } = effect;
      if (ground)
        return (tile, q, p, coverage) => {
          for (let c = 0; c < 3; c++) pixel[c] = VALUES[present[3 * p + c]];
          adjust(pixel, ground);
          blend(tile, q, p, coverage, (c) => pixel[c]);
          importance[p] = tile.importance[q] + coverage * (1 - tile.importance[q]);
        };
      return (tile, q, p, coverage) => {
        blend(tile, q, p, coverage, (c) => VALUES[present[3 * p + c]]);
        importance[p] = tile.importance[q] * (1 - coverage);
      };
    }
    case 'weigh':
      return (tile, q, p, coverage) => {
        blend(tile, q, p, 0, () => 0);
        const weight = tile.importance[q];
        importance[p] = weight + coverage * (scaleImportance(weight || 1, effect.factor) - weight);
      };
    case 'adjust':
      return (tile, q, p, coverage) => {
        for (let c = 0; c < 3; c++) pixel[c] = tile.image[3 * q + c];
        adjust(pixel, effect);
        blend(tile, q, p, coverage, (c) => pixel[c]);
        raiseImportance(tile, q, p, coverage);
      };
  }
}
