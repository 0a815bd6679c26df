/**
 * The pixels of one layer in one view, in tiles that exist only where it has coverage; the twin of
 * paint/layers/layer_pixels.py.
 */

/** @import { Region } from '../../../../viewer/drawing/view.js' */

/** Side of a tile, in pixels. */
export const TILE_SIDE = 64;

/** Rows of a tile follow each other without gaps. image: null for a mask.
 * @typedef {{image: Float32Array | null, coverage: Float32Array}} Tile */
/** A picture's pixels, row by row. @typedef {{image: Float32Array | null, coverage: Float32Array}} Pixels */

/** Coverage of whole tiles, which many layers share: tiles are replaced, and never written to.
 * @type {Map<number, Float32Array>} */
const wholeTiles = new Map();

let changes = 0;

export class LayerPixels {
  /** @param {[height: number, width: number]} size @param {boolean} hasColour */
  constructor(size, hasColour) {
    this.size = size;
    this.hasColour = hasColour;
    /** @type {Map<number, Tile>} */
    this.tiles = new Map();
    /** A number that grows with every change, also from one object to the next. */
    this.revision = ++changes;
  }

  /** The smallest region of whole tiles that contains all covered pixels. @returns {Region | null} */
  get bounds() {
    return enclosing([...this.tiles.keys()].map((key) => tileRegion(this.size, key)));
  }

  /** Replace the pixels of a region by those that a picture has there.
   * @param {Region} region @param {Pixels} pixels @param {Region} [frame] region of that picture */
  put(region, pixels, frame = [0, this.size[0], 0, this.size[1]]) {
    this.revision = ++changes;
    for (const key of tileKeys(this.size, region)) {
      const area = tileRegion(this.size, key);
      const [top, bottom, left, right] = area;
      const tile = this.copyOf(key, area);
      const width = right - left;
      const [y1, x0, x1] = [
        Math.min(bottom, region[1]),
        Math.max(left, region[2]),
        Math.min(right, region[3]),
      ];
      for (let y = Math.max(top, region[0]); y < y1; y++) {
        const source = (y - frame[0]) * (frame[3] - frame[2]) + x0 - frame[2];
        const to = (y - top) * width + x0 - left;
        tile.coverage.set(pixels.coverage.subarray(source, source + x1 - x0), to);
        if (tile.image && pixels.image)
          tile.image.set(pixels.image.subarray(3 * source, 3 * (source + x1 - x0)), 3 * to);
      }
      this.keep(key, tile);
    }
  }

  /** Return a copy, which shares the tiles. */
  copy() {
    const made = new LayerPixels(this.size, this.hasColour);
    made.tiles = new Map(this.tiles);
    return made;
  }

  /** Write the pixels into a picture that is empty. @param {Pixels} picture */
  writeTo(picture) {
    const [, across] = this.size;
    for (const [key, { image, coverage }] of this.tiles) {
      const [top, bottom, left, right] = tileRegion(this.size, key);
      const width = right - left;
      for (let y = top, from = 0; y < bottom; y++, from += width) {
        picture.coverage.set(coverage.subarray(from, from + width), y * across + left);
        if (image && picture.image)
          picture.image.set(image.subarray(3 * from, 3 * (from + width)), 3 * (y * across + left));
      }
    }
  }

  /** Return the coverage of a pixel. @param {number} x @param {number} y */
  coverageAt(x, y) {
    const [column, row] = [Math.floor(x / TILE_SIDE), Math.floor(y / TILE_SIDE)];
    const key = row * tilesAcross(this.size) + column;
    const tile = this.tiles.get(key);
    if (!tile) return 0;
    const [top, , left, right] = tileRegion(this.size, key);
    return tile.coverage[(y - top) * (right - left) + x - left];
  }

  /** @param {number} key @param {Region} area @returns {Tile} */
  copyOf(key, [top, bottom, left, right]) {
    const tile = this.tiles.get(key);
    const count = (bottom - top) * (right - left);
    const image = this.hasColour ? (tile?.image?.slice() ?? new Float32Array(3 * count)) : null;
    return { image, coverage: tile?.coverage.slice() ?? new Float32Array(count) };
  }

  /** @param {number} key @param {Tile} tile */
  keep(key, { image, coverage }) {
    const [first] = coverage;
    const isEven = coverage.every((x) => x === first);
    if (isEven && first === 0) return void this.tiles.delete(key);
    if (image)
      for (let p = 0; p < coverage.length; p++)
        if (!coverage[p]) image[3 * p] = image[3 * p + 1] = image[3 * p + 2] = 0;
    const isWhole = isEven && first === 1;
    this.tiles.set(key, { image, coverage: isWhole ? wholeTile(coverage) : coverage });
  }
}

/** @param {Float32Array} coverage 1 everywhere */
function wholeTile(coverage) {
  const { length } = coverage;
  if (!wholeTiles.has(length)) wholeTiles.set(length, coverage);
  return wholeTiles.get(length) ?? coverage;
}

/** @param {[number, number]} size */
const tilesAcross = ([, width]) => Math.ceil(width / TILE_SIDE);

/** Return the region of a tile. @param {[number, number]} size @param {number} key
 * @returns {Region} */
export function tileRegion(size, key) {
  const across = tilesAcross(size);
  const top = TILE_SIDE * Math.floor(key / across);
  const left = TILE_SIDE * (key % across);
  return [top, Math.min(top + TILE_SIDE, size[0]), left, Math.min(left + TILE_SIDE, size[1])];
}

/** Return the keys of the tiles that a region touches. @param {[number, number]} size
 * @param {Region} region @returns {number[]} */
export function tileKeys(size, [top, bottom, left, right]) {
  if (top >= bottom || left >= right) return [];
  const across = tilesAcross(size);
  const keys = [];
  for (let row = Math.floor(top / TILE_SIDE); row * TILE_SIDE < bottom; row++)
    for (let column = Math.floor(left / TILE_SIDE); column * TILE_SIDE < right; column++)
      keys.push(row * across + column);
  return keys;
}

/** Return the smallest region that holds all of these; null for none.
 * @param {(Region | null)[]} regions @returns {Region | null} */
export function enclosing(regions) {
  /** @type {Region | null} */
  let made = null;
  for (const region of regions) {
    if (!region || region[0] >= region[1] || region[2] >= region[3]) continue;
    made = made
      ? [
          Math.min(made[0], region[0]),
          Math.max(made[1], region[1]),
          Math.min(made[2], region[2]),
          Math.max(made[3], region[3]),
        ]
      : region;
  }
  return made;
}

/** Part the pixels of a layer's picture into colour and coverage. @param {Float32Array} data
 * @param {number} depth @returns {{image: Float32Array | null, coverage: Float32Array}} */
export function splitPixels(data, depth) {
  if (depth === 1) return { image: null, coverage: data };
  const coverage = new Float32Array(data.length / 4);
  const image = new Float32Array(3 * coverage.length);
  for (let p = 0; p < coverage.length; p++) {
    image.set(data.subarray(4 * p, 4 * p + 3), 3 * p);
    coverage[p] = data[4 * p + 3];
  }
  return { image, coverage };
}
