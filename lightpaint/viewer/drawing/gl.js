/**
 * The view on a GPU: WebGL2, planes as halves in array textures.
 *
 * The mix is rendered to a texture when weights change; exposure, zoom and overlays are only the
 * last pass. A lost context loses everything that was set.
 */
import { mixPlanes } from './cpu.js';
import { Planes } from './gpu.js';
import { repeatPixels } from './coarse_planes.js';
import { Textures } from './textures.js';
import { SRGB } from './view_transform.js';
import { maxImportance } from './overlay.js';
import { GROUND, SQUARES, panes } from './view.js';

/** @import { Kind, Pane, Params, Region } from './view.js' */
/** @import { Lut } from './view_transform.js' */

const OVERLAYS = { falsecolor: 1, missed: 2, importance: 3, beyond: 4 };

/** Names of software renderers, which need no timed frame. */
const SOFTWARE_RENDERERS = /swiftshader|llvmpipe|softpipe|software|basic render/i;

/** @param {WebGL2RenderingContext} gl */
function isSoftware(gl) {
  const renderer = String(gl.getParameter(gl.RENDERER));
  // Some browsers need an extension for the name, which others call deprecated.
  const info = renderer.startsWith('WebKit') ? gl.getExtension('WEBGL_debug_renderer_info') : null;
  return SOFTWARE_RENDERERS.test(
    info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : renderer,
  );
}

/** @implements {PictureView} @typedef {import("./view.js").PictureView} PictureView */
export class GlView {
  /** Throws if WebGL2 cannot render to halves.
   * @param {HTMLCanvasElement} canvas @param {[height: number, width: number]} size
   * @param {import("./choose_renderer.js").ViewOptions & {isSlowRefused?: boolean}} [options]
   * isSlowRefused: whether a context without a GPU is none */
  constructor(canvas, size, options = {}) {
    this.name = /** @type {const} */ ('gl');
    this.canvas = canvas;
    this.size = size;
    this.planeSize = options.planeSize ?? size;
    const gl = canvas.getContext('webgl2', {
      alpha: false,
      antialias: false,
      depth: false,
      powerPreference: 'high-performance',
      failIfMajorPerformanceCaveat: options.isSlowRefused ?? false,
    });
    if (!gl) throw new Error('no WebGL2');
    if (options.isSlowRefused && isSoftware(gl)) {
      gl.getExtension('WEBGL_lose_context')?.loseContext();
      throw new Error('WebGL2 in software');
    }
    this.gl = gl;
    this.isLost = false;
    canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();
      this.isLost = true;
    });
    canvas.addEventListener('webglcontextrestored', () => {
      this.isLost = false;
      this.planes = new Planes(gl, this.planeSize);
      this.textures = this.pictureTextures();
      this.forget();
      options.onRestored?.();
    });
    this.planes = new Planes(gl, this.planeSize);
    this.textures = this.pictureTextures();
    /** @type {Lut} */
    this.lut = SRGB;
    /** @type {WebGLTexture | null} */
    this.lattice = null;
    /** @type {Map<Kind, WebGLTexture>} */
    this.pictures = new Map();
    /** @type {WebGLTexture | null} */
    this.beyond = null;
    /** @type {Float32Array | null} */
    this.image = null;
    this.importance = /** @type {Float32Array} */ (new Float32Array(0));
    /** @type {Params | null} */
    this.lastParams = null;
  }

  /** State to restore after a lost context. */
  forget() {
    this.lut = SRGB;
    this.lattice = null;
    this.beyond = null;
    this.image = null;
    this.pictures.clear();
  }

  /** Whether planes have fewer pixels than the picture. */
  get isReduced() {
    return String(this.planeSize) !== String(this.size);
  }

  /** Return the textures of pictures: of the planes, if these are as large. */
  pictureTextures() {
    return this.isReduced ? new Textures(this.gl, this.size) : this.planes.textures;
  }

  /** @param {number} count */
  setCount(count) {
    this.planes.setCount(count);
  }

  /** @param {number} light @param {Uint16Array} halves @param {number} scale
   * @param {number} [step] */
  setPlane(light, halves, scale, step = 1) {
    this.planes.setPlane(light, repeatPixels(halves, step, this.planeSize), scale);
  }

  /** @param {ArrayLike<number>} weights @param {'solution' | 'other'} [kind] */
  setWeights(weights, kind = 'solution') {
    this.planes.setWeights(weights, kind);
  }

  /** @param {number} x @param {number} y */
  planesAt(x, y) {
    const [row, column] = [y, x].map((at, i) => Math.floor((at * this.planeSize[i]) / this.size[i]));
    return this.planes.probe(column, row);
  }

  /** @param {Region} region @param {Float32Array} image @param {Float32Array} importance */
  setCanvas(region, image, importance) {
    if (image !== this.image) region = [0, this.size[0], 0, this.size[1]];
    this.image = image;
    this.importance = importance;
    const texture = this.pictures.get('painting') ?? this.textures.halves();
    this.pictures.set('painting', texture);
    this.textures.setCanvas(texture, region, image, importance);
  }

  /** @param {'verified' | 'present'} kind @param {Uint16Array | null} halves */
  setPicture(kind, halves) {
    this.textures.drop(this.pictures.get(kind) ?? null);
    this.pictures.delete(kind);
    if (!halves) return;
    const texture = this.textures.halves();
    this.textures.setHalves(texture, halves);
    this.pictures.set(kind, texture);
  }

  /** @param {Uint8Array | null} beyond */
  setBeyond(beyond) {
    this.textures.drop(this.beyond);
    this.beyond = beyond && this.textures.bytes(beyond);
  }

  /** @param {Lut} lut */
  setLut(lut) {
    if (lut === this.lut) return;
    this.lut = lut;
    this.textures.drop(this.lattice);
    this.lattice = lut.lattice && this.textures.lattice(lut);
  }

  /** @param {Params} params */
  draw(params) {
    const { gl, canvas } = this;
    this.lastParams = params;
    if (this.hasLostContext()) return;
    const visiblePanes = panes(params, canvas, this.size);
    for (const { kind } of visiblePanes)
      if (kind === 'solution' || kind === 'other') this.planes.mix(kind);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.disable(gl.SCISSOR_TEST);
    const [red, green, blue] = GROUND.map((code) => code / 255);
    gl.clearColor(red, green, blue, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.enable(gl.SCISSOR_TEST);
    for (const pane of visiblePanes) this.show(pane, params);
    gl.disable(gl.SCISSOR_TEST);
  }

  /** @param {Kind} kind */
  texture(kind) {
    const isMix = kind === 'solution' || kind === 'other';
    return (isMix ? this.planes.mixes[kind].texture : this.pictures.get(kind)) ?? null;
  }

  /** @param {Pane} pane @param {Params} params */
  show(pane, params) {
    const { gl, canvas, textures } = this;
    const picture = this.texture(pane.kind);
    if (!picture) return;
    const { uniform } = this.planes.showProgram.use();
    const isStretched = this.isReduced && (pane.kind === 'solution' || pane.kind === 'other');
    const isSharp = !isStretched && (pane.scale >= SQUARES || pane.scale === 1);
    const { blank } = textures;
    const units = [picture, this.pictures.get('painting') ?? blank, this.beyond ?? blank];
    units.forEach((texture, i) => textures.bind(i, gl.TEXTURE_2D, texture));
    textures.bind(3, gl.TEXTURE_3D, this.lattice ?? textures.black);
    for (const [i, name] of ['picture', 'painting', 'beyond', 'lattice'].entries())
      gl.uniform1i(uniform(name), i);
    const { shaper, lattice } = this.lut;
    gl.uniform2f(uniform('size'), this.size[1], this.size[0]);
    gl.uniform2f(uniform('corner'), pane.left, pane.top);
    gl.uniform1f(uniform('scale'), pane.scale);
    gl.uniform1f(uniform('above'), canvas.height);
    gl.uniform1f(uniform('gain'), 2 ** params.stops);
    gl.uniform1f(uniform('side'), shaper.side);
    gl.uniform2f(uniform('shaper'), shaper.low, shaper.high);
    gl.uniform1i(uniform('isSrgb'), Number(!lattice));
    gl.uniform1i(uniform('isSharp'), Number(isSharp));
    gl.uniform1i(uniform('isSmall'), Number(pane.scale < 0.75));
    const overlay = overlayOf(pane.kind, params);
    gl.uniform1i(uniform('overlay'), overlay);
    const isImportance = overlay === OVERLAYS.importance;
    gl.uniform1f(uniform('full'), isImportance ? maxImportance(this.importance) : 1);
    gl.scissor(pane.x, canvas.height - pane.y - pane.height, pane.width, pane.height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** @param {number} x @param {number} y @param {number} width @param {number} height */
  read(x, y, width, height) {
    const { gl, canvas } = this;
    // The drawing buffer is valid only until the browser has shown it.
    if (this.lastParams) this.draw(this.lastParams);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    const pixels = new Uint8Array(width * height * 4);
    gl.readPixels(x, canvas.height - y - height, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    const flippedPixels = new Uint8Array(pixels.length);
    for (let row = 0; row < height; row++)
      flippedPixels.set(
        pixels.subarray(row * width * 4, (row + 1) * width * 4),
        (height - 1 - row) * width * 4,
      );
    return flippedPixels;
  }

  /** @param {Kind} kind @param {number} x @param {number} y
   * @returns {[number, number, number]} */
  lightAt(kind, x, y) {
    if (kind === 'solution' || kind === 'other')
      return mixPlanes(this.planesAt(x, y), this.planes.mixes[kind].weights);
    const start = 3 * (y * this.size[1] + x);
    if (kind === 'painting' && this.image)
      return [this.image[start], this.image[start + 1], this.image[start + 2]];
    const texture = this.texture(kind);
    if (!texture) return [0, 0, 0];
    this.planes.bindTarget(texture, this.size[1], this.size[0]);
    const rgba = new Float32Array(4);
    this.gl.readPixels(x, y, 1, 1, this.gl.RGBA, this.gl.FLOAT, rgba);
    return [rgba[0], rgba[1], rgba[2]];
  }

  mixedLight() {
    if (this.hasLostContext()) return null;
    this.planes.mix('solution');
    const [height, width] = this.planeSize;
    const { texture } = this.planes.mixes.solution;
    if (!texture) return null;
    this.planes.bindTarget(texture, width, height);
    const data = new Float32Array(4 * width * height);
    this.gl.readPixels(0, 0, width, height, this.gl.RGBA, this.gl.FLOAT, data);
    return { data, width, height, channels: 4 };
  }

  hasLostContext() {
    return this.isLost || this.gl.isContextLost();
  }

  memory() {
    const ofPlanes = this.isReduced ? this.planes.textures.memory() : 0;
    return this.textures.memory() + ofPlanes + 4 * this.canvas.width * this.canvas.height;
  }

  close() {
    this.gl.getExtension('WEBGL_lose_context')?.loseContext();
  }
}

/** Return the number of the overlay of a picture. @param {Kind} kind @param {Params} params */
function overlayOf(kind, { overlay }) {
  if (!overlay) return 0;
  const isShown =
    overlay === 'falsecolor' ||
    (overlay === 'importance' ? kind === 'painting' : kind === 'solution');
  return isShown ? OVERLAYS[overlay] : 0;
}
