/** What a stroke makes of the pixels that it covers. */
import { VALUES } from './half.js';

/** @typedef {import("./canvas.js").PaintCanvas} PaintCanvas */
/** @typedef {import("./canvas.js").Tile} Tile */
/** @typedef {import("./protocol.js").RGB} RGB */

/**
 * What a stroke does. paint: the pixel becomes a colour, or light of that colour on its albedo.
 * erase: it is the present look again, and not painted. weigh: its importance becomes another
 * one. ask: its light is multiplied, its luminance times `gain` and its colour by `tint`.
 * @typedef {{kind: 'paint', rgb: RGB, as: 'light' | 'look'} | {kind: 'erase'} |
 *   {kind: 'weigh', importance: number} | {kind: 'ask', gain: number, tint: RGB}} Effect
 */

/** What a stroke does to one pixel, by how that was before and how far it is covered.
 * @param {PaintCanvas} canvas @param {Effect} effect
 * @returns {(tile: Tile, q: number, p: number, covered: number) => void} */
export function changing(canvas, effect) {
  const { image, importance, present, albedo } = canvas;
  /** @type {(tile: Tile, q: number, p: number, covered: number, to: (c: number) => number) => void} */
  const towards = (tile, q, p, covered, to) => {
    for (let c = 0; c < 3; c++) {
      const before = tile.image[3 * q + c];
      image[3 * p + c] = before + covered * (to(c) - before);
    }
  };
  const { full } = canvas;
  /** @type {(tile: Tile, q: number, p: number, covered: number) => void} */
  const count = (tile, q, p, covered) => {
    const before = tile.importance[q];
    importance[p] = before < full ? before + covered * (full - before) : before;
  };
  switch (effect.kind) {
    case 'paint': {
      const { rgb } = effect;
      const on = effect.as === 'light' ? albedo : null;
      return (tile, q, p, covered) => {
        towards(tile, q, p, covered, (c) => (on ? VALUES[on[3 * p + c]] * rgb[c] : rgb[c]));
        count(tile, q, p, covered);
      };
    }
    case 'erase':
      return (tile, q, p, covered) => {
        towards(tile, q, p, covered, (c) => VALUES[present[3 * p + c]]);
        importance[p] = tile.importance[q] * (1 - covered);
      };
    case 'weigh':
      return (tile, q, p, covered) => {
        towards(tile, q, p, 0, () => 0);
        const before = tile.importance[q];
        importance[p] = before + covered * (effect.importance - before);
      };
    case 'ask': {
      const { gain, tint } = effect;
      return (tile, q, p, covered) => {
        const [r, g, b] = [tile.image[3 * q], tile.image[3 * q + 1], tile.image[3 * q + 2]];
        const before = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        const after = 0.2126 * r * tint[0] + 0.7152 * g * tint[1] + 0.0722 * b * tint[2];
        // Its luminance is what the gain makes of it, whatever its colour was.
        const level = after > 0 ? (gain * before) / after : gain;
        towards(tile, q, p, covered, (c) => tile.image[3 * q + c] * tint[c] * level);
        count(tile, q, p, covered);
      };
    }
  }
}
