/** The pixels of the layer that a stroke paints: colour and coverage of a painted layer, or a mask. */
import { PaintCanvas } from '../paint_canvas.js';
import { VALUES } from '../../../../viewer/drawing/half_floats.js';

/** @import { Region } from '../../../../viewer/drawing/view.js' */
/** @import { Layer } from '../messages.js' */
/** @import { Tile } from '../paint_canvas.js' */
/** @import { Effect } from '../stroke_effects.js' */
/** @import { LayerPixels } from './layer_pixels.js' */

/** Coverage below which a pixel is uncovered. */
const MIN_COVERAGE = 1e-3;

/** The largest half. */
const MAX_HALF = 65504;

export class LayerCanvas extends PaintCanvas {
  /** @param {[height: number, width: number]} size @param {Layer} layer
   * @param {LayerPixels} pixels @param {PaintCanvas} scene which knows albedo and objects */
  constructor(size, layer, pixels, scene) {
    super(size, new Uint16Array(0));
    this.image = new Float32Array(3 * size[0] * size[1]);
    this.layer = layer;
    this.scene = scene;
    this.pixels = pixels;
    pixels.writeTo({ image: this.image, coverage: this.importance });
  }

  get isMask() {
    return ['adjust', 'weigh', 'gradient'].includes(this.layer.kind);
  }

  /** @override */
  begin() {
    this.tiles = new Map();
    this.region = null;
    this.albedo = this.scene.albedo;
    this.objects = this.scene.objects;
  }

  /** The session balances layers. @override */
  setCoveredShare() {}

  /** @override */
  setFullyCovered() {}

  /** @override */
  setPresent() {}

  /** @override @param {Region} region @param {Effect} effect */
  apply(region, effect) {
    if (effect.kind === 'adjust' && this.layer.kind === 'adjust')
      this.layer = { ...this.layer, gain: effect.gain, tint: effect.tint };
    const change = this.isMask ? this.maskChange(effect) : this.paintChange(effect);
    const { image, importance } = this;
    this.visitTiles(region, false, (tile, q, p) => {
      const covered = this.selectedPart(tile.coverage[q], p);
      if (covered <= 0) return;
      change(tile, q, p, covered);
      if (importance[p] >= MIN_COVERAGE) return;
      importance[p] = 0;
      for (let i = 3 * p; i < 3 * p + 3; i++) image[i] = 0;
    });
  }

  /** @param {Effect} effect @returns {(tile: Tile, q: number, p: number, covered: number) => void} */
  maskChange(effect) {
    const { importance } = this;
    if (effect.kind === 'erase')
      return (tile, q, p, covered) => (importance[p] = tile.importance[q] * (1 - covered));
    return (tile, q, p, covered) => {
      const before = tile.importance[q];
      importance[p] = Math.min(1, before + covered * (1 - before));
    };
  }

  /** @param {Effect} effect @returns {(tile: Tile, q: number, p: number, covered: number) => void} */
  paintChange(effect) {
    const { image, importance } = this;
    if (effect.kind !== 'paint') return this.maskChange(effect);
    const { rgb } = effect;
    const reflectance = effect.paintMode === 'light' ? this.albedo : null;
    return (tile, q, p, covered) => {
      const i = 3 * p;
      // Surfaces without diffuse reflection ignore light.
      if (reflectance && !reflectance[i] && !reflectance[i + 1] && !reflectance[i + 2]) return;
      const before = tile.importance[q];
      const after = Math.min(1, before + covered * (1 - before));
      const part = covered / after;
      for (let c = 0; c < 3; c++) {
        const to = reflectance ? VALUES[reflectance[i + c]] * rgb[c] : rgb[c];
        const value = tile.image[3 * q + c];
        image[i + c] = Math.min(MAX_HALF, Math.max(0, value + part * (to - value)));
      }
      importance[p] = after;
    };
  }

  /** @override @param {Region} region */
  copy(region) {
    const { image, importance } = super.copy(region);
    return /** @type {any} */ (this.isMask ? { importance } : { image, importance });
  }
}
