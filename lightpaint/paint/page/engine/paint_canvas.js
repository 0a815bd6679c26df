/**
 * The painting: linear light and importance of each pixel, and the stroke in progress.
 *
 * A stroke covers pixels, from 0 to 1, and what it makes of a pixel follows from how that was
 * before and from how far it is covered. So a stroke can change as long as it lasts (a line, a
 * drag that asks), and be dropped. What was before is kept in tiles, where the stroke has been.
 */
import { pixelChange } from './stroke_effects.js';
import { VALUES, toFloats } from '../../../viewer/drawing/half.js';
import { union } from '../../../viewer/drawing/layer.js';

/** @typedef {import("./message_frames.js").Region} Region */
/** @typedef {import("./stroke_effects.js").Effect} Effect */

/** How a pixel was before a stroke: (s, s, 3), (s, s), and how far the stroke covers it.
 * @typedef {{top: number, left: number, image: Float32Array, importance: Float32Array,
 *   coverage: Float32Array}} Tile */

/** Width and height of tiles. */
const TILE = 64;

/** Importance below which a pixel is not painted. */
const MIN_IMPORTANCE = 1e-3;

/** Importance of the rest of a picture beside that of a stroke, and by how much at most a stroke
 * counts more than the rest: that makes up for a stroke over a fortieth of the picture. */
const REST_SHARE = 4;
const MAX_ACCENT = 10;

/** By how much what covers that part of a picture counts more than the rest of it, where all is
 * painted. @param {number} part */
const accent = (part) => Math.min(MAX_ACCENT, Math.max(1, (1 - part) / (REST_SHARE * part)));

/** What halves can hold, so that both views can show it. */
const MAX_HALF = 65504;

export class PaintCanvas {
  /** @param {[height: number, width: number]} size @param {Uint16Array} present
   * (h, w, 3) halves: the present look */
  constructor([height, width], present) {
    this.height = height;
    this.width = width;
    this.present = present;
    this.image = toFloats(present);
    this.importance = new Float32Array(height * width);
    /** (h, w, 3) halves. @type {Uint16Array | null} */
    this.albedo = null;
    /** Whether there was no pixel without paint before the stroke. */
    this.isAll = false;
    /** Which object each pixel shows, -1 for none. @type {Int16Array | null} */
    this.objects = null;
    /** @type {Map<number, Tile> | null} */
    this.tiles = null;
    /** Where the stroke has been. @type {Region | null} */
    this.region = null;
    /** Importance of what the stroke paints. */
    this.full = 1;
    /** By how much what was painted before it counts more than it did. */
    this.lift = 1;
  }

  /** @returns {Region} */
  get whole() {
    return [0, this.height, 0, this.width];
  }

  /** A region of whole pixels within the picture.
   * @param {number} top @param {number} bottom @param {number} left @param {number} right
   * @returns {Region} */
  clipped(top, bottom, left, right) {
    const within = (/** @type {number} */ x, /** @type {number} */ most) =>
      Math.min(most, Math.max(0, x));
    const [y0, x0] = [within(Math.floor(top), this.height), within(Math.floor(left), this.width)];
    const [y1, x1] = [within(Math.ceil(bottom), this.height), within(Math.ceil(right), this.width)];
    return [y0, Math.max(y0, y1), x0, Math.max(x0, x1)];
  }

  begin() {
    this.tiles = new Map();
    this.region = null;
    this.isAll = this.importance.every((x) => x > 0);
    this.lift = 1;
    this.covers(0);
  }

  /**
   * The stroke covers this part of the picture, as far as is known: over a picture of which all is
   * painted (a whole that was asked to be darker, say) it is to come about as it does over one that
   * is not, of which the rest is held. @param {number} part
   */
  covers(part) {
    this.full = this.isAll ? accent(part) : 1;
  }

  /**
   * The stroke covers all: what was painted before it is not to get lost in that, but to come about
   * as it did while the rest was held.
   */
  coversAll() {
    const painted = this.importance.reduce((sum, x) => sum + x, 0);
    this.lift = this.isAll ? 1 : accent(painted / this.importance.length);
    this.covers(1);
  }

  /** Cover pixels with the stroke.
   * @param {Region} region @param {(x: number, y: number, before: number) => number} cover
   * how far a pixel is covered from now on */
  cover(region, cover) {
    this.region = union(this.region, region);
    this.each(region, true, (tile, q, p, x, y) => {
      tile.coverage[q] = cover(x, y, tile.coverage[q]);
    });
  }

  /** Nothing is covered any more, and all as it was. @returns {Region | null} what has changed */
  uncover() {
    const { region } = this;
    if (region)
      this.each(region, false, (tile, q, p) => {
        this.restore(tile, q, p);
        tile.coverage[q] = 0;
      });
    return region;
  }

  /** Make of the pixels what the stroke does to them.
   * @param {Region} region @param {Effect} effect */
  apply(region, effect) {
    const change = pixelChange(this, effect);
    const { importance, image, present } = this;
    this.each(region, false, (tile, q, p) => {
      const covered = tile.coverage[q];
      if (covered <= 0) return;
      change(tile, q, p, covered);
      if (importance[p] < MIN_IMPORTANCE) importance[p] = 0;
      for (let i = 3 * p; i < 3 * p + 3; i++)
        image[i] = importance[p] ? Math.min(MAX_HALF, Math.max(0, image[i])) : VALUES[present[i]];
    });
  }

  /** The stroke is done. @returns {Region | null} where it was */
  end() {
    const { region } = this;
    this.tiles = null;
    this.region = null;
    return region;
  }

  /** The stroke has never been. @returns {Region | null} where it was */
  drop() {
    this.uncover();
    return this.end();
  }

  /** What the session says of a region. @param {Region} region @param {Float32Array} image
   * @param {Float32Array} importance */
  set([top, bottom, left, right], image, importance) {
    const width = right - left;
    for (let y = top, from = 0; y < bottom; y++, from += width) {
      const to = y * this.width + left;
      this.image.set(image.subarray(3 * from, 3 * (from + width)), 3 * to);
      this.importance.set(importance.subarray(from, from + width), to);
    }
    if (this.tiles)
      this.each([top, bottom, left, right], false, (tile, q, p) => {
        this.keep(tile, q, p);
        tile.coverage[q] = 0;
      });
  }

  /** Another present look, of a better basis: it is what shows where nothing is painted.
   * @param {Uint16Array} present */
  setPresent(present) {
    this.present = present;
    for (let p = 0; p < this.importance.length; p++)
      if (!this.importance[p])
        for (let i = 3 * p; i < 3 * p + 3; i++) this.image[i] = VALUES[present[i]];
    for (const tile of this.tiles?.values() ?? []) this.follow(tile);
  }

  /** @param {Tile} tile */
  follow(tile) {
    const region = this.clipped(tile.top, tile.top + TILE, tile.left, tile.left + TILE);
    this.each(region, false, (_, q, p) => {
      if (!tile.importance[q])
        for (let c = 0; c < 3; c++) tile.image[3 * q + c] = VALUES[this.present[3 * p + c]];
    });
  }

  /** A copy of a region, as messages have it. @param {Region} region */
  copy([top, bottom, left, right]) {
    const [height, width] = [bottom - top, right - left];
    const image = new Float32Array(3 * height * width);
    const importance = new Float32Array(height * width);
    for (let y = top, to = 0; y < bottom; y++, to += width) {
      const from = y * this.width + left;
      image.set(this.image.subarray(3 * from, 3 * (from + width)), 3 * to);
      importance.set(this.importance.subarray(from, from + width), to);
    }
    return {
      image: { data: image, shape: [height, width, 3] },
      importance: { data: importance, shape: [height, width] },
    };
  }

  /** Object that a pixel shows; -1 for none. @param {number} x @param {number} y */
  objectAt(x, y) {
    const [column, row] = [Math.floor(x), Math.floor(y)];
    const isIn = column >= 0 && row >= 0 && column < this.width && row < this.height;
    return isIn && this.objects ? this.objects[row * this.width + column] : -1;
  }

  /** Visit pixels of a region, by the tile of the stroke that they lie in. isNew: whether tiles
   * are made where there is none; else they are passed over.
   * @param {Region} region @param {boolean} isNew
   * @param {(tile: Tile, q: number, p: number, x: number, y: number) => void} visit q: place in
   * the tile, p: in the picture */
  each([top, bottom, left, right], isNew, visit) {
    const { tiles } = this;
    if (!tiles) return;
    const across = Math.ceil(this.width / TILE);
    for (let row = Math.floor(top / TILE); row * TILE < bottom; row++)
      for (let column = Math.floor(left / TILE); column * TILE < right; column++) {
        const key = row * across + column;
        const tile = tiles.get(key) ?? (isNew ? this.tile(row * TILE, column * TILE) : null);
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
        this.keep(tile, (y - top) * TILE + x - left, y * this.width + x);
    return tile;
  }

  /** @param {Tile} tile @param {number} q @param {number} p */
  keep(tile, q, p) {
    for (let c = 0; c < 3; c++) tile.image[3 * q + c] = this.image[3 * p + c];
    tile.importance[q] = this.importance[p];
  }

  /** @param {Tile} tile @param {number} q @param {number} p */
  restore(tile, q, p) {
    for (let c = 0; c < 3; c++) this.image[3 * p + c] = tile.image[3 * q + c];
    this.importance[p] = tile.importance[q];
  }
}
