/** One picture as the CPU shows it: its light, its codes, and a canvas with them. */
import { encoderOf } from './view_transform.js';

/** @import { Region } from './view.js' */

export class Layer {
  /** @param {[height: number, width: number]} size of the picture
   * @param {number} step of which each so manieth pixel of so manieth row is held */
  constructor([height, width], step = 1) {
    this.step = step;
    this.height = Math.ceil(height / step);
    this.width = Math.ceil(width / step);
    /** @type {Float32Array} */
    this.light = new Float32Array(0);
    this.image = new ImageData(this.width, this.height);
    this.canvas = document.createElement('canvas');
    this.canvas.width = this.width;
    this.canvas.height = this.height;
    const context = this.canvas.getContext('2d', { alpha: false, willReadFrequently: true });
    if (!context) throw new Error('no canvas to draw on');
    this.context = context;
    /** @type {import("./view_transform.js").Encoder | null} */
    this.encoder = null;
    /** Region whose codes are out of date. @type {Region | null} */
    this.staleRegion = null;
    /** @type {string | null} */
    this.drawnOverlay = null;
  }

  /** @param {Float32Array} light (h, w, 3), kept @param {Region} [region] what changed of it */
  setLight(light, region = this.wholeRegion()) {
    if (light !== this.light) region = this.wholeRegion();
    this.light = light;
    this.staleRegion = union(this.staleRegion, region);
  }

  /** Mark all codes as out of date. */
  invalidate() {
    this.staleRegion = this.wholeRegion();
  }

  /** Bring codes and canvas up to date.
   * @param {import("./view_transform.js").Lut} lut @param {number} stops
   * @param {string | null} overlay its name, null for none
   * @param {(rgba: Uint8ClampedArray) => void} drawOverlay draws it over all codes */
  show(lut, stops, overlay, drawOverlay) {
    const encoder = encoderOf(lut, stops);
    if (encoder !== this.encoder) this.invalidate();
    this.encoder = encoder;
    if (overlay !== this.drawnOverlay || (overlay && this.staleRegion)) this.invalidate();
    this.drawnOverlay = overlay;
    if (!this.staleRegion || !this.light.length) return;
    const [top, bottom, left, right] = this.staleRegion;
    const { width } = this;
    const rgba = this.image.data;
    if (right - left === width) encoder.pixels(this.light, rgba, top * width, bottom * width);
    else
      for (let y = top; y < bottom; y++)
        encoder.pixels(this.light, rgba, y * width + left, y * width + right);
    if (overlay) drawOverlay(rgba);
    this.context.putImageData(this.image, 0, 0, left, top, right - left, bottom - top);
    this.staleRegion = null;
  }

  /** @returns {Region} */
  wholeRegion() {
    return [0, this.height, 0, this.width];
  }

  /** Return the bytes of codes and canvas. */
  memory() {
    return 2 * this.image.data.byteLength;
  }
}

/** Return the smallest region that contains two. @param {Region | null} a @param {Region | null} b
 * @returns {Region | null} */
export function union(a, b) {
  if (!a || !b) return a ?? b;
  return [Math.min(a[0], b[0]), Math.max(a[1], b[1]), Math.min(a[2], b[2]), Math.max(a[3], b[3])];
}
