/**
 * The view without a GPU: plain JavaScript over typed arrays.
 *
 * Planes stay halves, decoded by table: 6 bytes per pixel and light. If a frame takes longer than
 * the budget, only every second row and column is mixed while the brush is down, and all when it
 * rests.
 */
import { stepFor } from './coarse_planes.js';
import { VALUES, replaceNonFinite, toFloats } from './half_floats.js';
import { Layer } from './cpu_picture.js';
import { SRGB } from './view_transform.js';
import { Mix } from './mix.js';
import { INKS, drawFalseColour, maxImportance, inkOf, drawInk, drawMissed } from './overlay.js';
import { GROUND, SQUARES, panes } from './view.js';

/** @import { Kind, Params, Region } from './view.js' */
/** @import { Lut } from './view_transform.js' */

/** Milliseconds of a live frame above which it is mixed at reduced size, and the number of values
 * (pixels times lights) that take about as long, for use before any timing. */
const FRAME_BUDGET_MS = 14;
const BUDGET_VALUES = 3e6;

/** @implements {PictureView} @typedef {import("./view.js").PictureView} PictureView */
export class CpuView {
  /** @param {HTMLCanvasElement} canvas @param {[height: number, width: number]} size
   * @param {[height: number, width: number]} [planeSize] of planes, which are stretched to `size` */
  constructor(canvas, size, planeSize = size) {
    this.name = /** @type {const} */ ('cpu');
    this.canvas = canvas;
    this.size = size;
    this.planeSize = planeSize;
    // Pixels come from the CPU, so a canvas on the GPU, real or in software, would be slower.
    const context = canvas.getContext('2d', { alpha: false, willReadFrequently: true });
    if (!context) throw new Error('no canvas to draw on');
    this.context = context;
    /** @type {import("./mix.js").Plane[]} */
    this.planes = [];
    this.mixes = { solution: new Mix(planeSize), other: new Mix(planeSize) };
    /** @type {Map<string, Layer>} */
    this.layers = new Map();
    /** @type {Lut} */
    this.lut = SRGB;
    /** @type {Float32Array} */
    this.importance = new Float32Array(0);
    /** @type {Uint8Array | null} */
    this.beyond = null;
    /** Milliseconds of the last whole mix. */
    this.mixMs = 0;
    this.step = 1;
    this.wasLive = false;
    /** @type {Params | null} */
    this.lastParams = null;
  }

  /** @param {number} count */
  setCount(count) {
    this.planes = Array.from({ length: count }, () => ({ halves: null, scale: 1, step: 1 }));
    for (const mix of Object.values(this.mixes)) {
      mix.weights = new Float64Array(3 * count);
      mix.invalidate();
    }
  }

  /** @param {number} light @param {Uint16Array} halves @param {number} scale
   * @param {number} [step] */
  setPlane(light, halves, scale, step = 1) {
    const [rows, columns] = this.planeSize.map((n) => Math.ceil(n / step));
    if (halves.length !== rows * columns * 3)
      throw new Error(`a plane of ${halves.length} numbers on a picture of ${rows} × ${columns}`);
    this.planes[light] = { halves: replaceNonFinite(halves), scale, step };
    for (const mix of Object.values(this.mixes)) mix.invalidate();
  }

  /** @param {ArrayLike<number>} weights @param {'solution' | 'other'} [kind] */
  setWeights(weights, kind = 'solution') {
    this.mixes[kind].weights = Float64Array.from(weights);
  }

  /** @param {Region} region @param {Float32Array} image @param {Float32Array} importance */
  setCanvas(region, image, importance) {
    this.importance = importance;
    this.layer('painting').setLight(image, region);
  }

  /** @param {'verified' | 'present'} kind @param {Uint16Array | null} halves */
  setPicture(kind, halves) {
    if (halves) this.layer(kind).setLight(toFloats(halves));
    else this.layers.delete(kind);
  }

  /** @param {Uint8Array | null} beyond */
  setBeyond(beyond) {
    this.beyond = beyond;
    for (const layer of this.layers.values()) layer.invalidate();
  }

  /** @param {Lut} lut */
  setLut(lut) {
    this.lut = lut;
  }

  /** @param {Params} params */
  draw(params) {
    const { context, canvas } = this;
    const { draftStep = 1 } = params;
    this.lastParams = params;
    if (!params.live) this.step = 1;
    else if (!this.wasLive || draftStep > this.step)
      this.step = Math.max(this.liveStep(), draftStep);
    this.wasLive = params.live;
    context.fillStyle = `rgb(${GROUND.join(' ')})`;
    context.fillRect(0, 0, canvas.width, canvas.height);
    for (const pane of panes(params, canvas, this.size)) {
      const layer = this.layerOf(pane.kind, params);
      if (!layer) continue;
      context.save();
      context.beginPath();
      context.rect(pane.x, pane.y, pane.width, pane.height);
      context.clip();
      const isSharp = layer.step === 1 && layer.width === this.size[1];
      context.imageSmoothingEnabled = !(isSharp && (pane.scale >= SQUARES || pane.scale === 1));
      context.imageSmoothingQuality = pane.scale < 0.75 && !params.live ? 'medium' : 'low';
      const [rows, columns] = this.stretch(pane.kind).map((x) => x * pane.scale * layer.step);
      const [height, width] = [layer.height * rows, layer.width * columns];
      context.drawImage(layer.canvas, pane.left, pane.top, width, height);
      context.restore();
    }
  }

  /** Return the pixels of the picture along the sides of a pixel of one of its kinds.
   * @param {Kind} kind */
  stretch(kind) {
    const isMix = kind === 'solution' || kind === 'other';
    return isMix ? this.size.map((n, i) => n / this.planeSize[i]) : [1, 1];
  }

  /** Return the step between the rows and columns that are mixed while the brush is down. */
  liveStep() {
    const count = this.planes.filter(({ halves }) => halves).length;
    const work = (count * this.planeSize[0] * this.planeSize[1]) / BUDGET_VALUES;
    const frames = Math.max(work, this.mixMs / FRAME_BUDGET_MS);
    return frames <= 1 ? 1 : frames <= 5 ? 2 : frames <= 9 ? 3 : 4;
  }

  /** Return the picture of a kind with current codes, or null.
   * @param {Kind} kind @param {Params} params @returns {Layer | null} */
  layerOf(kind, params) {
    if (kind === 'solution' || kind === 'other') return this.updateMixLayer(kind, params);
    const layer = this.layers.get(kind);
    if (!layer) return null;
    const isImportance = kind === 'painting' && params.overlay === 'importance';
    if (isImportance && layer.staleRegion) layer.invalidate();
    layer.show(
      this.lut,
      params.stops,
      isImportance ? 'importance' : falseColourOnly(params),
      (rgba) => {
        if (!isImportance) return drawFalseColour(rgba, layer.light, 2 ** params.stops);
        const { importance } = this;
        const maxInk = maxImportance(importance);
        drawInk(rgba, (p) => inkOf(importance[p], maxInk), INKS.importance, this.grid(1));
      },
    );
    return layer;
  }

  /** @param {'solution' | 'other'} kind @param {Params} params */
  updateMixLayer(kind, params) {
    const mix = this.mixes[kind];
    const startTime = performance.now();
    const step = stepFor(mix.weights, this.planes, this.step);
    const isOther = mix.update(this.planes, step, params.live);
    const layer = this.layer(kind, step);
    if (isOther) layer.setLight(mix.light);
    const overlay = kind === 'solution' ? params.overlay : falseColourOnly(params);
    // The difference depends on the painting, too.
    if (overlay === 'missed') layer.invalidate();
    const painting = overlay === 'missed' ? this.codesOfPainting(params) : null;
    const { beyond } = this;
    layer.show(this.lut, params.stops, overlay === 'importance' ? null : overlay, (rgba) => {
      const grid = { ...this.grid(step), shown: [layer.height, layer.width] };
      if (overlay === 'falsecolor') drawFalseColour(rgba, layer.light, 2 ** params.stops);
      else if (overlay === 'beyond' && beyond)
        drawInk(rgba, (p) => beyond[p] / 255, INKS.beyond, grid);
      else if (painting) drawMissed(rgba, painting, this.importance, grid);
    });
    if (isOther) this.mixMs = (performance.now() - startTime) * step ** 2;
    return layer;
  }

  /** @param {Params} params */
  codesOfPainting(params) {
    const layer = this.layerOf('painting', { ...params, overlay: null });
    return layer && layer.image.data;
  }

  /** @param {number} step */
  grid(step) {
    return { height: this.size[0], width: this.size[1], step };
  }

  /** @param {Kind} kind @param {number} [step] */
  layer(kind, step = 1) {
    const name = `${kind}/${step}`;
    const key = step === 1 ? kind : name;
    let layer = this.layers.get(key);
    const isMix = kind === 'solution' || kind === 'other';
    const size = isMix ? this.planeSize : this.size;
    if (!layer) this.layers.set(key, (layer = new Layer(size, step)));
    return layer;
  }

  /** @param {number} x @param {number} y @param {number} width @param {number} height */
  read(x, y, width, height) {
    return new Uint8Array(this.context.getImageData(x, y, width, height).data.buffer);
  }

  /** @param {number} x @param {number} y */
  planesAt(x, y) {
    const values = new Float32Array(3 * this.planes.length);
    const [row, column] = [y, x].map((at, i) => Math.floor((at * this.planeSize[i]) / this.size[i]));
    this.planes.forEach(({ halves, scale, step }, k) => {
      const inRow = Math.ceil(this.planeSize[1] / step);
      const start = 3 * (Math.floor(row / step) * inRow + Math.floor(column / step));
      for (let c = 0; halves && c < 3; c++) values[3 * k + c] = VALUES[halves[start + c]] * scale;
    });
    return values;
  }

  /** @param {Kind} kind @param {number} x @param {number} y
   * @returns {[number, number, number]} */
  lightAt(kind, x, y) {
    if (kind === 'solution' || kind === 'other')
      return mixPlanes(this.planesAt(x, y), this.mixes[kind].weights);
    const start = 3 * (y * this.size[1] + x);
    const light = this.layers.get(kind)?.light;
    return light ? [light[start], light[start + 1], light[start + 2]] : [0, 0, 0];
  }

  mixedLight() {
    if (!this.lastParams) return null;
    const { light, width, height } = this.updateMixLayer('solution', this.lastParams);
    return light.length ? { data: light, width, height, channels: 3 } : null;
  }

  hasLostContext() {
    return false;
  }

  memory() {
    const planes = this.planes.reduce((sum, { halves }) => sum + (halves?.byteLength ?? 0), 0);
    const layers = [...this.layers].reduce((sum, [kind, layer]) => {
      const isOwn = kind === 'verified' || kind === 'present';
      return sum + layer.memory() + (isOwn ? layer.light.byteLength : 0);
    }, 0);
    return planes + layers + this.mixes.solution.memory() + this.mixes.other.memory();
  }

  close() {
    this.planes = [];
    this.layers.clear();
  }
}

/** Return the light of a pixel with known planes.
 * @param {Float32Array} planes (n, 3) @param {ArrayLike<number>} weights (n, 3)
 * @returns {[number, number, number]} */
export function mixPlanes(planes, weights) {
  /** @type {[number, number, number]} */
  const sum = [0, 0, 0];
  planes.forEach((light, i) => (sum[i % 3] += light * weights[i]));
  return sum;
}

/** @param {Params} params */
function falseColourOnly(params) {
  return params.overlay === 'falsecolor' ? params.overlay : null;
}
