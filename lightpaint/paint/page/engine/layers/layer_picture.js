/** The painting as its layers make it: composed tile by tile, where something has changed. */

import { VALUES } from '../../../../viewer/drawing/half_floats.js';
import { effectOf, gradientTile } from './gradient.js';
import { applyLayer } from './layer_composition.js';
import { isPlain, PAINTING_ID } from './layer_list.js';
import { enclosing, tileKeys, tileRegion } from './layer_pixels.js';

/** @import { Region } from '../../../../viewer/drawing/view.js' */
/** @import { Layer, RGB } from '../messages.js' */
/** @import { PaintCanvas } from '../paint_canvas.js' */
/** @import { Composed, ShownLayer } from './layer_composition.js' */
/** @import { LayerPixels, Tile } from './layer_pixels.js' */

/** The composition of the lowest layers, and what it depends on.
 * @typedef {{image: Float32Array, importance: Float32Array, count: number, state: string}} Base */
/** How many of the lowest layers are in a captured composition, or are kept tile by tile.
 * @typedef {{start: number, state: string, base: Base | null}} KnownBelow */

export class LayerPicture {
  /** @param {PaintCanvas} painting pixels of the layer that is always there */
  constructor(painting) {
    this.painting = painting;
    /** @type {[number, number]} */
    this.size = [painting.height, painting.width];
    /** Pixels of the other layers, by id. @type {Map<number, LayerPixels>} */
    this.pixels = new Map();
    /** @type {ShownLayer[]} */
    this.shown = [];
    /** The present look in float32, (h, w, 3). @type {Float32Array | null} */
    this.ground = null;
    /** How often it was set. */
    this.groundRevision = 0;
    /** Light and importance that are drawn: the painting's own while it is alone. */
    this.image = painting.image;
    this.importance = painting.importance;
    /** Whether parts are not composed yet. */
    this.isPartial = false;
    this.lower = new LowerLayers();
    /** What the lowest layers come to, captured while their pixels are not here. @type {Base | null} */
    this.base = null;
    /** Each shown layer as text. @type {string[]} */
    this.texts = [];
  }

  /** Show other layers. The caller composes what has changed.
   * @param {ShownLayer[]} shown @param {Layer[]} list */
  show(shown, list) {
    this.shown = shown;
    this.texts = shown.map((layer) => JSON.stringify(layer));
    const { painting } = this;
    const isOwn = this.image !== painting.image;
    if (isPlain(shown, list)) {
      this.image = painting.image;
      this.importance = painting.importance;
      this.isPartial = false;
    } else if (!isOwn) {
      this.image = painting.image.slice();
      this.importance = painting.importance.slice();
      this.isPartial = true;
    }
  }

  /** Whether the painting alone is drawn. */
  get isPlain() {
    return this.image === this.painting.image;
  }

  /** Replace a region by what the session has composed. @param {Region} region
   * @param {Float32Array} image @param {Float32Array} importance */
  set([top, bottom, left, right], image, importance) {
    const [, across] = this.size;
    const width = right - left;
    for (let y = top, source = 0; y < bottom; y++, source += width) {
      this.image.set(image.subarray(3 * source, 3 * (source + width)), 3 * (y * across + left));
      this.importance.set(importance.subarray(source, source + width), y * across + left);
    }
  }

  /** Compose the layers again in a region. @param {Region | null} region
   * @param {number[]} [changed] ids of the layers that have changed; all may have, if not given
   * @returns {Region | null} the region that may have changed */
  compose(region, changed = []) {
    if (!region || this.isPlain) return region;
    const keys = tileKeys(this.size, region);
    const known = this.knownBelow(changed);
    for (const key of keys) {
      const { light, counts } = this.tile(key, null, known);
      this.set(tileRegion(this.size, key), light, counts);
    }
    return enclosing(keys.map((key) => tileRegion(this.size, key)));
  }

  /** Compose what is not composed yet. @returns {Region | null} */
  complete() {
    if (!this.isPartial) return null;
    this.isPartial = this.ground === null;
    return this.compose(this.painting.wholeRegion);
  }

  /** Return the smallest region that holds these layers. @param {number[]} ids
   * @returns {Region | null} */
  boundsOf(ids) {
    const { painting, pixels } = this;
    return enclosing(
      ids.map((id) => (id === PAINTING_ID ? painting.wholeRegion : (pixels.get(id)?.bounds ?? null))),
    );
  }

  /** Return colour and coverage of a layer at a pixel; a mask has no colour. @param {number} id
   * @param {number} x @param {number} y
   * @returns {{colour: RGB | null, coverage: number}} */
  pixelAt(id, x, y) {
    const { painting, pixels, size } = this;
    const p = y * size[1] + x;
    if (id === PAINTING_ID) {
      const [r, g, b] = painting.image.subarray(3 * p, 3 * p + 3);
      return { colour: [r, g, b], coverage: painting.importance[p] };
    }
    const [key] = tileKeys(size, [y, y + 1, x, x + 1]);
    const mask = pixels.get(id)?.tiles.get(key);
    const layer = this.shown.find((one) => one.id === id);
    const tile = mask && layer ? this.effectTile(layer, mask, tileRegion(size, key)) : mask;
    const [top, , left, right] = tileRegion(size, key);
    const q = (y - top) * (right - left) + x - left;
    const [r, g, b] = tile?.image?.subarray(3 * q, 3 * q + 3) ?? [];
    return { colour: tile?.image ? [r, g, b] : null, coverage: tile?.coverage[q] ?? 0 };
  }

  /** Take what is drawn as the composition of all layers that show, so that those above can be
   * painted without the pixels of these. */
  capture() {
    const count = this.shown.length;
    const state = this.stateBelow(count);
    this.base = { image: this.image.slice(), importance: this.importance.slice(), count, state };
  }

  /** Whether the captured composition still has the lowest layers. */
  get isBaseCurrent() {
    return this.base !== null && this.stateBelow(this.base.count) === this.base.state;
  }

  /** Do something that adds pixels which the captured composition has already.
   * @param {() => void} act */
  keepingBase(act) {
    const isCurrent = this.isBaseCurrent;
    act();
    if (this.base && isCurrent) this.base.state = this.stateBelow(this.base.count);
  }

  /** Return how many of the lowest layers are composed, or to be kept for the next time.
   * @param {number[]} changed ids of the layers that change; none for all
   * @returns {KnownBelow} */
  knownBelow(changed) {
    if (this.base && this.isBaseCurrent) return { start: this.base.count, state: '', base: this.base };
    const places = changed.map((id) => this.shown.findIndex((layer) => layer.id === id));
    const start = places.length ? Math.max(0, Math.min(...places)) : 0;
    return { start, state: this.stateBelow(start), base: null };
  }

  /** Return light and importance of a tile. @param {number} key
   * @param {number | null} [without] id of a layer to leave out
   * @param {KnownBelow} [known] @returns {Composed} */
  tile(key, without = null, { start, state, base } = this.knownBelow([])) {
    const { shown } = this;
    /** @type {Composed | undefined} */
    let composed;
    if (base) composed = this.baseTile(key, base);
    else if (start)
      composed = this.lower.tile(state, key, () => this.apply(key, shown.slice(0, start)));
    const upper = shown.slice(start).filter(({ id }) => id !== without);
    return this.apply(key, upper, composed);
  }

  /** @param {number} key @param {Base} base @returns {Composed} */
  baseTile(key, { image, importance }) {
    const [top, bottom, left, right] = tileRegion(this.size, key);
    const [, across] = this.size;
    const width = right - left;
    const light = new Float32Array(3 * (bottom - top) * width);
    const counts = new Float32Array((bottom - top) * width);
    for (let y = top, to = 0; y < bottom; y++, to += width) {
      const from = y * across + left;
      light.set(image.subarray(3 * from, 3 * (from + width)), 3 * to);
      counts.set(importance.subarray(from, from + width), to);
    }
    return { light, counts };
  }

  /** Return what the composition of the lowest layers depends on. @param {number} count */
  stateBelow(count) {
    const { painting, pixels, shown, texts } = this;
    const revisions = shown
      .slice(0, count)
      .map(({ id }) => (id === PAINTING_ID ? painting : pixels.get(id))?.revision ?? 0);
    const look = [
      this.ground ? this.groundRevision : `${painting.revision} of halves`,
      painting.albedo !== null, // which gradients of light need
    ];
    return [...look, ...revisions, ...texts.slice(0, count)].join();
  }

  /** Apply layers, the lowest first. @param {number} key @param {ShownLayer[]} layers
   * @param {Composed} [composed] what lies below, which is changed; the present look if not given
   * @returns {Composed} */
  apply(key, layers, composed) {
    const area = tileRegion(this.size, key);
    composed ??= { light: this.groundOf(area), counts: new Float32Array(pixelCount(area)) };
    for (const layer of layers) {
      const tile =
        layer.id === PAINTING_ID ? this.paintingTile(area) : this.pixels.get(layer.id)?.tiles.get(key);
      if (tile) applyLayer(effectOf(layer), this.effectTile(layer, tile, area), composed);
    }
    return composed;
  }

  /** Return the pixels that a layer is composed of: of a gradient, what it comes to in its mask.
   * @param {Layer} layer @param {Tile} tile @param {Region} area @returns {Tile} */
  effectTile({ gradient }, tile, area) {
    return gradient ? gradientTile(gradient, tile, area, this.painting.albedo, this.size[1]) : tile;
  }

  /** @param {Region} area @returns {Float32Array} */
  groundOf([top, bottom, left, right]) {
    const { ground, painting } = this;
    const [, across] = this.size;
    const width = 3 * (right - left);
    const light = new Float32Array((bottom - top) * width);
    for (let y = top, to = 0; y < bottom; y++, to += width) {
      const from = 3 * (y * across + left);
      if (ground) light.set(ground.subarray(from, from + width), to);
      else for (let i = 0; i < width; i++) light[to + i] = VALUES[painting.present[from + i]];
    }
    return light;
  }

  /** @param {Region} area @returns {Tile} */
  paintingTile(area) {
    const { image, importance } = this.painting.copy(area);
    return { image: image.data, coverage: importance.data };
  }
}

/** @param {Region} region */
const pixelCount = ([top, bottom, left, right]) => (bottom - top) * (right - left);

class LowerLayers {
  constructor() {
    /** What the tiles depend on. */
    this.state = '';
    /** @type {Map<number, Composed>} */
    this.tiles = new Map();
  }

  /** Return a copy of a tile, which is composed if it is not known for this state.
   * @param {string} state @param {number} key @param {() => Composed} compose
   * @returns {Composed} */
  tile(state, key, compose) {
    if (state !== this.state) this.tiles.clear();
    this.state = state;
    const { light, counts } = this.tiles.get(key) ?? this.keep(key, compose());
    return { light: light.slice(), counts: counts.slice() };
  }

  /** @param {number} key @param {Composed} tile */
  keep(key, tile) {
    this.tiles.set(key, tile);
    return tile;
  }
}
