/** Planes and mixes on a GPU: the state of the lights in one WebGL2 context. */
import { MIX, PROBE, SHOW, VERTEX } from './glsl.js';
import { Textures, linkProgram } from './textures.js';

/** @typedef {{weights: Float64Array, texture: WebGLTexture | null, isStale: boolean}} MixState */

/** Bytes of one texture of planes; drivers refuse larger ones. */
const MAX_TEXTURE_BYTES = 512 * 2 ** 20;

export class Planes {
  /** Throws if the context cannot render to halves, or cannot hold a picture of that size.
   * @param {WebGL2RenderingContext} gl @param {[height: number, width: number]} size */
  constructor(gl, size) {
    this.gl = gl;
    this.size = size;
    const isFloat = gl.getExtension('EXT_color_buffer_float');
    if (!isFloat && !gl.getExtension('EXT_color_buffer_half_float'))
      throw new Error('this WebGL2 does not render to halves');
    if (Math.max(...size) > gl.getParameter(gl.MAX_TEXTURE_SIZE))
      throw new Error(`this WebGL2 holds no picture of ${size.join(' × ')}`);
    this.mixProgram = linkProgram(gl, VERTEX, MIX);
    this.showProgram = linkProgram(gl, VERTEX, SHOW);
    this.probeProgram = linkProgram(gl, VERTEX, PROBE);
    this.textures = new Textures(gl, size);
    this.target = gl.createFramebuffer();
    this.count = 0;
    this.planesPerSlice = 1;
    /** @type {WebGLTexture[]} */
    this.slices = [];
    /** @type {number[]} */
    this.scales = [];
    /** @type {Record<'solution' | 'other', MixState>} */
    this.mixes = { solution: createMix(0), other: createMix(0) };
  }

  /** @param {number} count */
  setCount(count) {
    const { gl, textures } = this;
    for (const slice of this.slices) textures.drop(slice);
    for (const { texture } of Object.values(this.mixes)) textures.drop(texture);
    const layerBytes = this.size[0] * this.size[1] * 8;
    const maxLayers = Math.min(
      gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS),
      gl.getParameter(gl.MAX_TEXTURE_SIZE), // weights and probes, which are in one row
      Math.max(1, Math.floor(MAX_TEXTURE_BYTES / layerBytes)),
    );
    this.count = count;
    this.planesPerSlice = maxLayers;
    this.scales = new Array(count).fill(1);
    this.slices = [];
    for (let first = 0; first < count; first += maxLayers)
      this.slices.push(textures.planes(Math.min(maxLayers, count - first)));
    this.mixes = { solution: createMix(count), other: createMix(count) };
    if (gl.getError() === gl.OUT_OF_MEMORY) throw new Error('the GPU has no room for the planes');
  }

  /** @param {number} light @param {Uint16Array} halves @param {number} scale */
  setPlane(light, halves, scale) {
    if (halves.length !== this.size[0] * this.size[1] * 3)
      throw new Error(
        `a plane of ${halves.length} numbers on a picture of ${this.size.join(' × ')}`,
      );
    const slice = this.slices[Math.floor(light / this.planesPerSlice)];
    this.textures.setPlane(slice, light % this.planesPerSlice, halves);
    this.scales[light] = scale;
    for (const mix of Object.values(this.mixes)) mix.isStale = true;
  }

  /** @param {ArrayLike<number>} weights @param {'solution' | 'other'} [kind] */
  setWeights(weights, kind = 'solution') {
    this.mixes[kind].weights = Float64Array.from(weights);
    this.mixes[kind].isStale = true;
  }

  /** Bring a mix up to date. @param {'solution' | 'other'} kind */
  mix(kind) {
    const { gl, count, planesPerSlice } = this;
    const mix = this.mixes[kind];
    if (!mix.isStale) return;
    mix.texture ??= this.textures.halves();
    const { uniform } = this.mixProgram.use();
    const scaledWeights = new Float32Array(4 * Math.max(1, count));
    for (let k = 0; k < count; k++)
      for (let c = 0; c < 3; c++)
        scaledWeights[4 * k + c] = mix.weights[3 * k + c] * this.scales[k];
    this.textures.bind(1, gl.TEXTURE_2D, this.textures.weights(scaledWeights));
    gl.uniform1i(uniform('planes'), 0);
    gl.uniform1i(uniform('weights'), 1);
    this.bindTarget(mix.texture, this.size[1], this.size[0]);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    this.slices.forEach((slice, i) => {
      this.textures.bind(0, gl.TEXTURE_2D_ARRAY, slice);
      gl.uniform1i(uniform('first'), i * planesPerSlice);
      gl.uniform1i(uniform('count'), Math.min(planesPerSlice, count - i * planesPerSlice));
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    });
    gl.disable(gl.BLEND);
    mix.isStale = false;
  }

  /** Direct drawing to a texture. @param {WebGLTexture} texture @param {number} width
   * @param {number} height */
  bindTarget(texture, width, height) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    const attachment = gl.COLOR_ATTACHMENT0;
    gl.framebufferTexture2D(gl.FRAMEBUFFER, attachment, gl.TEXTURE_2D, texture, 0);
    gl.viewport(0, 0, width, height);
  }

  /** Return the light of each plane at a pixel, at unit emission, (n, 3).
   * @param {number} x @param {number} y */
  probe(x, y) {
    const { gl, count, planesPerSlice } = this;
    const values = new Float32Array(3 * count);
    const { uniform } = this.probeProgram.use();
    gl.uniform1i(uniform('planes'), 0);
    gl.uniform2i(uniform('at'), x, y);
    this.slices.forEach((slice, i) => {
      const sliceCount = Math.min(planesPerSlice, count - i * planesPerSlice);
      this.textures.bind(0, gl.TEXTURE_2D_ARRAY, slice);
      this.bindTarget(this.textures.probe(sliceCount), sliceCount, 1);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      const rgba = new Float32Array(4 * sliceCount);
      gl.readPixels(0, 0, sliceCount, 1, gl.RGBA, gl.FLOAT, rgba);
      for (let k = 0; k < sliceCount; k++)
        for (let c = 0; c < 3; c++)
          values[3 * (i * planesPerSlice + k) + c] =
            rgba[4 * k + c] * this.scales[i * planesPerSlice + k];
    });
    return values;
  }
}

/** @param {number} count @returns {MixState} */
function createMix(count) {
  return { weights: new Float64Array(3 * count), texture: null, isStale: true };
}
