/**
 * The painting: linear light and importance of each pixel, and the stroke in progress.
 *
 * A stroke covers pixels from 0 to 1. The new value of a pixel follows from its old value and its
 * coverage, so a stroke in progress can change (a line, an adjusting drag) or be cancelled. Tiles
 * keep the old values where the stroke has been.
 */
import { FULL } from './selection/polygon_mask.js';
import { pixelChange } from './stroke_effects.js';
import { VALUES, toFloats } from '../../../viewer/drawing/half_floats.js';
import { union } from '../../../viewer/drawing/cpu_picture.js';

/** @import { Region } from '../../../viewer/drawing/view.js' */
/** @import { Selection } from './selection/selection_mirror.js' */
/** @import { Effect } from './stroke_effects.js' */

/** Pixels before a stroke, (s, s, 3) and (s, s), and the stroke's coverage.
 * @typedef {{top: number, left: number, image: Float32Array, importance: Float32Array,
 *   coverage: Float32Array}} Tile */

/** Width and height of tiles. */
const TILE = 64;

/** Importance below which a pixel is not painted. */
const MIN_IMPORTANCE = 1e-3;

/** Importance of the rest of a picture relative to a stroke, and the largest importance of a stroke
 * relative to the rest. The latter compensates for a stroke over a fortieth of the picture. */
const REST_SHARE = 4;
const MAX_ACCENT = 10;

/** Return the factor by which a stroke over this part of a fully painted picture counts more than
 * the rest. @param {number} part */
const accent = (part) => Math.min(MAX_ACCENT, Math.max(1, (1 - part) / (REST_SHARE * part)));

/** The largest half: values are clamped to it, so that both renderers can show them. */
const MAX_HALF = 65504;

export class PaintCanvas {
  /** @param {[height: number, width: number]} size @param {Uint16Array} present
   * (h, w, 3) halves: the current look */
  constructor([height, width], present) {
    this.height = height;
    this.width = width;
    this.present = present;
    this.image = toFloats(present);
    this.importance = new Float32Array(height * width);
    /** (h, w, 3) halves. @type {Uint16Array | null} */
    this.albedo = null;
    /** Whether every pixel had paint before the stroke. */
    this.isFullyPainted = false;
    /** Index of the object at each pixel, -1 for none. @type {Int16Array | null} */
    this.objects = null;
    /** @type {Map<number, Tile> | null} */
    this.tiles = null;
    /** Bounding box of the stroke. @type {Region | null} */
    this.region = null;
    /** Importance of what the stroke paints. */
    this.strokeImportance = 1;
    /** Factor on the importance of earlier paint. */
    this.importanceFactor = 1;
    /** What strokes keep to; null for everything. @type {Selection | null} */
    this.selection = null;
    /** A number that grows with every change. */
    this.revision = 0;
  }

  /** @returns {Region} */
  get wholeRegion() {
    return [0, this.height, 0, this.width];
  }

  /** A region of whole pixels within the picture.
   * @param {number} top @param {number} bottom @param {number} left @param {number} right
   * @returns {Region} */
  clip(top, bottom, left, right) {
    const clamp = (/** @type {number} */ x, /** @type {number} */ maximum) =>
      Math.min(maximum, Math.max(0, x));
    const [y0, x0] = [clamp(Math.floor(top), this.height), clamp(Math.floor(left), this.width)];
    const [y1, x1] = [clamp(Math.ceil(bottom), this.height), clamp(Math.ceil(right), this.width)];
    return [y0, Math.max(y0, y1), x0, Math.max(x0, x1)];
  }

  begin() {
    this.tiles = new Map();
    this.region = null;
    this.isFullyPainted = this.importance.every((x) => x > 0);
    this.importanceFactor = 1;
    this.setCoveredShare(0);
  }

  /** Set the part of the picture that the stroke covers, as far as is known. Over a fully painted
   * picture (darkened as a whole, say) a stroke should have the same effect as over an unpainted
   * one, whose rest is held. @param {number} part */
  setCoveredShare(part) {
    this.strokeImportance = this.isFullyPainted ? accent(part) : 1;
  }

  /** Mark the stroke as covering everything. Earlier strokes keep the effect that they had while the
   * rest was held. */
  setFullyCovered() {
    const total = this.importance.reduce((sum, x) => sum + x, 0);
    this.importanceFactor = this.isFullyPainted ? 1 : accent(total / this.importance.length);
    this.setCoveredShare(1);
  }

  /** Cover pixels with the stroke.
   * @param {Region} region @param {(x: number, y: number, before: number) => number} cover
   * how far a pixel is covered from now on */
  cover(region, cover) {
    this.region = union(this.region, region);
    this.visitTiles(region, true, (tile, q, p, x, y) => {
      tile.coverage[q] = cover(x, y, tile.coverage[q]);
    });
  }

  /** Clear the coverage and restore all pixels. @returns {Region | null} what has changed */
  uncover() {
    const { region } = this;
    this.revision += 1;
    if (region)
      this.visitTiles(region, false, (tile, q, p) => {
        this.restorePixel(tile, q, p);
        tile.coverage[q] = 0;
      });
    return region;
  }

  /** Apply the stroke's effect to the pixels.
   * @param {Region} region @param {Effect} effect */
  apply(region, effect) {
    this.revision += 1;
    const change = pixelChange(this, effect);
    const { importance, image, present } = this;
    this.visitTiles(region, false, (tile, q, p) => {
      const coverage = this.selectedPart(tile.coverage[q], p);
      if (coverage <= 0) return;
      change(tile, q, p, coverage);
      if (importance[p] < MIN_IMPORTANCE) importance[p] = 0;
      for (let i = 3 * p; i < 3 * p + 3; i++)
        image[i] = importance[p] ? Math.min(MAX_HALF, Math.max(0, image[i])) : VALUES[present[i]];
    });
  }

  /** Return the part of a stroke's coverage within the selection. @param {number} coverage
   * @param {number} p the pixel */
  selectedPart(coverage, p) {
    return this.selection ? (coverage * this.selection.mask[p]) / FULL : coverage;
  }

  /** Finish the stroke. @returns {Region | null} where it was */
  end() {
    const { region } = this;
    this.tiles = null;
    this.region = null;
    return region;
  }

  /** Cancel the stroke. @returns {Region | null} where it was */
  drop() {
    this.uncover();
    return this.end();
  }

  /** Replace a region by the session's values. @param {Region} region @param {Float32Array} image
   * @param {Float32Array} importance */
  set([top, bottom, left, right], image, importance) {
    const width = right - left;
    this.revision += 1;
    for (let y = top, source = 0; y < bottom; y++, source += width) {
      const destination = y * this.width + left;
      this.image.set(image.subarray(3 * source, 3 * (source + width)), 3 * destination);
      this.importance.set(importance.subarray(source, source + width), destination);
    }
    if (this.tiles)
      this.visitTiles([top, bottom, left, right], false, (tile, q, p) => {
        this.storePixel(tile, q, p);
        tile.coverage[q] = 0;
      });
  }

  /** Set a new current look, from a better basis. It shows wherever nothing is painted.
   * @param {Uint16Array} present */
  setPresent(present) {
    this.present = present;
    this.revision += 1;
    for (let p = 0; p < this.importance.length; p++)
      if (!this.importance[p])
        for (let i = 3 * p; i < 3 * p + 3; i++) this.image[i] = VALUES[present[i]];
    for (const tile of this.tiles?.values() ?? []) this.updateTile(tile);
  }

  /** @param {Tile} tile */
  updateTile(tile) {
    const region = this.clip(tile.top, tile.top + TILE, tile.left, tile.left + TILE);
    this.visitTiles(region, false, (_, q, p) => {
      if (!tile.importance[q])
        for (let c = 0; c < 3; c++) tile.image[3 * q + c] = VALUES[this.present[3 * p + c]];
    });
  }

  /** Return a copy of a region in the format of messages. @param {Region} region */
  copy([top, bottom, left, right]) {
    const [height, width] = [bottom - top, right - left];
    const image = new Float32Array(3 * height * width);
    const importance = new Float32Array(height * width);
    for (let y = top, destination = 0; y < bottom; y++, destination += width) {
      const source = y * this.width + left;
      image.set(this.image.subarray(3 * source, 3 * (source + width)), 3 * destination);
      importance.set(this.importance.subarray(source, source + width), destination);
    }
    return {
      image: { data: image, shape: [height, width, 3] },
      importance: { data: importance, shape: [height, width] },
    };
  }

  /** Return the object at a pixel, -1 for none. @param {number} x @param {number} y */
  objectAt(x, y) {
    const [column, row] = [Math.floor(x), Math.floor(y)];
    const isInside = column >= 0 && row >= 0 && column < this.width && row < this.height;
    return isInside && this.objects ? this.objects[row * this.width + column] : -1;
  }

  /** Visit the pixels of a region, tile by tile of the stroke. isNew: create missing tiles instead
   * of skipping them.
   * @param {Region} region @param {boolean} createsTiles
   * @param {(tile: Tile, q: number, p: number, x: number, y: number) => void} visit q: place in
   * the tile, p: in the picture */
  visitTiles([top, bottom, left, right], createsTiles, visit) {
    const { tiles } = this;
    if (!tiles) return;
    const tilesPerRow = Math.ceil(this.width / TILE);
    for (let row = Math.floor(top / TILE); row * TILE < bottom; row++)
      for (let column = Math.floor(left / TILE); column * TILE < right; column++) {
        const key = row * tilesPerRow + column;
        const tile = tiles.get(key) ?? (createsTiles ? this.tile(row * TILE, column * TILE) : null);
        if (!tile) continue;
        tiles.set(key, tile);
        const [y1, x1] = [Math.min(bottom, tile.top + TILE), Math.min(right, tile.left + TILE)];
        for (let y = Math.max(top, tile.top); y < y1; y++)
          for (let x = Math.max(left, tile.left); x < x1; x++)
            visit(tile, (y - tile.top) * TILE + x - tile.left, y * this.width + x, x, y);
      }
  }

  /** @param {number} top @param {number} left @returns {Tile} */
  tile(top, left) {
    const tile = {
      top,
      left,
      image: new Float32Array(3 * TILE * TILE),
      importance: new Float32Array(TILE * TILE),
      coverage: new Float32Array(TILE * TILE),
    };
    const [y1, x1] = [Math.min(this.height, top + TILE), Math.min(this.width, left + TILE)];
    for (let y = top; y < y1; y++)
      for (let x = left; x < x1; x++)
        this.storePixel(tile, (y - top) * TILE + x - left, y * this.width + x);
    return tile;
  }

  /** @param {Tile} tile @param {number} q @param {number} p */
  storePixel(tile, q, p) {
    for (let c = 0; c < 3; c++) tile.image[3 * q + c] = this.image[3 * p + c];
    tile.importance[q] = this.importance[p];
  }

  /** @param {Tile} tile @param {number} q @param {number} p */
  restorePixel(tile, q, p) {
    for (let c = 0; c < 3; c++) this.image[3 * p + c] = tile.image[3 * q + c];
    this.importance[p] = tile.importance[q];
  }
}
