/** Textures and programs of WebGL2, with their properties. */
import { MAX_HALF } from './half_floats.js';
import { SRGB } from './view_transform.js';

/** @import { Region } from './view.js' */

/** The half that is 1. */
const HALF_ONE = 0x3c00;

/** @typedef {{use: () => {uniform: (name: string) => WebGLUniformLocation | null}}} Program */

/** @param {WebGL2RenderingContext} gl @param {string} vertex @param {string} fragment
 * @returns {Program} */
export function linkProgram(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, source] of /** @type {const} */ ([
    [gl.VERTEX_SHADER, vertex],
    [gl.FRAGMENT_SHADER, fragment],
  ])) {
    const shader = gl.createShader(kind);
    if (!shader) throw new Error('no shader: the context is lost');
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    const log = gl.getShaderInfoLog(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(`a shader: ${log}`);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS))
    throw new Error(`a program: ${gl.getProgramInfoLog(program)}`);
  /** @type {Map<string, WebGLUniformLocation | null>} */
  const locations = new Map();
  /** @param {string} name */
  const uniform = (name) => {
    if (!locations.has(name)) locations.set(name, gl.getUniformLocation(program, name));
    return locations.get(name) ?? null;
  };
  return {
    use: () => {
      gl.useProgram(program);
      return { uniform };
    },
  };
}

export class Textures {
  /** @param {WebGL2RenderingContext} gl @param {[height: number, width: number]} size */
  constructor(gl, size) {
    this.gl = gl;
    this.size = size;
    /** @type {Map<WebGLTexture, number>} bytes */
    this.sizes = new Map();
    /** Upload some rows to the GPU. */
    this.rows = Math.max(1, Math.floor(2 ** 18 / size[1]));
    this.rgba = new Uint16Array(4 * this.rows * size[1]).fill(HALF_ONE);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    this.blank = this.createTexture(gl.TEXTURE_2D, 8, gl.NEAREST, () =>
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA16F, 1, 1),
    );
    this.black = this.lattice(SRGB);
    /** @type {WebGLTexture | null} */
    this.weightsTexture = null;
    /** @type {{count: number, texture: WebGLTexture} | null} */
    this.probeTarget = null;
  }

  /** @param {number} kind @param {number} bytes @param {number} filter
   * @param {() => void} fill */
  createTexture(kind, bytes, filter, fill) {
    const { gl } = this;
    const texture = gl.createTexture();
    this.bind(0, kind, texture);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R])
      gl.texParameteri(kind, name, gl.CLAMP_TO_EDGE);
    gl.texParameteri(kind, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(kind, gl.TEXTURE_MAG_FILTER, filter);
    fill();
    this.sizes.set(texture, bytes);
    return texture;
  }

  /** @param {number} unit @param {number} kind @param {WebGLTexture | null} texture */
  bind(unit, kind, texture) {
    this.gl.activeTexture(this.gl.TEXTURE0 + unit);
    this.gl.bindTexture(kind, texture);
  }

  /** @param {WebGLTexture | null} texture */
  drop(texture) {
    if (!texture) return;
    this.gl.deleteTexture(texture);
    this.sizes.delete(texture);
  }

  memory() {
    return [...this.sizes.values()].reduce((a, b) => a + b, this.rgba.byteLength);
  }

  /** Create black planes for some lights. @param {number} count */
  planes(count) {
    const { gl } = this;
    const [height, width] = this.size;
    return this.createTexture(gl.TEXTURE_2D_ARRAY, 8 * height * width * count, gl.NEAREST, () =>
      gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGBA16F, width, height, count),
    );
  }

  /** @param {WebGLTexture} slice @param {number} layer @param {Uint16Array} halves (h, w, 3) */
  setPlane(slice, layer, halves) {
    const { gl } = this;
    const width = this.size[1];
    this.bind(0, gl.TEXTURE_2D_ARRAY, slice);
    for (const { top, rows, rgba } of this.rgbaBands(halves))
      gl.texSubImage3D(
        ...[gl.TEXTURE_2D_ARRAY, 0, 0, top, layer, width, rows, 1, gl.RGBA, gl.HALF_FLOAT],
        rgba,
      );
  }

  /** Create a render target of halves, RGBA. */
  halves() {
    const { gl } = this;
    const [height, width] = this.size;
    return this.createTexture(gl.TEXTURE_2D, 8 * height * width, gl.LINEAR, () =>
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA16F, width, height),
    );
  }

  /** @param {WebGLTexture} texture @param {Uint16Array} halves (h, w, 3) */
  setHalves(texture, halves) {
    const { gl } = this;
    const width = this.size[1];
    this.bind(0, gl.TEXTURE_2D, texture);
    for (const { top, rows, rgba } of this.rgbaBands(halves))
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, top, width, rows, gl.RGBA, gl.HALF_FLOAT, rgba);
  }

  /** Add a fourth channel to halves and remove Inf and NaN, some rows at a time.
   * @param {Uint16Array} halves (h, w, 3) */
  *rgbaBands(halves) {
    const [height, width] = this.size;
    const { rgba } = this;
    for (let top = 0; top < height; top += this.rows) {
      const rows = Math.min(this.rows, height - top);
      const end = 3 * width * (top + rows);
      for (let source = 3 * width * top, p = 0; source < end; p++)
        for (let c = 0; c < 3; c++) {
          const bits = halves[source++];
          const magnitude = bits & 0x7fff;
          const isFiniteHalf = magnitude < 0x7c00;
          rgba[p++] = isFiniteHalf ? bits : magnitude > 0x7c00 ? 0 : (bits & 0x8000) | 0x7bff;
        }
      yield { top, rows, rgba: rgba.subarray(0, 4 * rows * width) };
    }
  }

  /** @param {WebGLTexture} texture @param {Region} region @param {Float32Array} image (h, w, 3)
   * @param {Float32Array} importance (h, w), which is the fourth channel */
  setCanvas(texture, [top, bottom, left, right], image, importance) {
    const { gl } = this;
    const [height, width] = [bottom - top, right - left];
    if (height <= 0 || width <= 0) return;
    const rgba = new Float32Array(4 * height * width);
    for (let y = top, destination = 0; y < bottom; y++)
      for (let p = y * this.size[1] + left, end = p + width; p < end; p++, destination += 4) {
        rgba[destination] = Math.min(MAX_HALF, image[3 * p]);
        rgba[destination + 1] = Math.min(MAX_HALF, image[3 * p + 1]);
        rgba[destination + 2] = Math.min(MAX_HALF, image[3 * p + 2]);
        rgba[destination + 3] = importance[p];
      }
    this.bind(0, gl.TEXTURE_2D, texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, left, top, width, height, gl.RGBA, gl.FLOAT, rgba);
  }

  /** Create a texture of (h, w) bytes; null for none. @param {Uint8Array | null} data */
  bytes(data) {
    const { gl } = this;
    const [height, width] = data ? this.size : [1, 1];
    const bytes = data ?? new Uint8Array(1);
    return this.createTexture(gl.TEXTURE_2D, bytes.length, gl.NEAREST, () =>
      gl.texImage2D(
        ...[gl.TEXTURE_2D, 0, gl.R8, width, height, 0, gl.RED, gl.UNSIGNED_BYTE],
        bytes,
      ),
    );
  }

  /** @param {import("./view_transform.js").Lut} lut */
  lattice({ shaper, lattice }) {
    const { gl } = this;
    const side = lattice ? shaper.side : 1;
    const rgba = new Float32Array(4 * side ** 3);
    for (let i = 0; lattice && i < side ** 3; i++)
      rgba.set(lattice.subarray(3 * i, 3 * i + 3), 4 * i);
    return this.createTexture(gl.TEXTURE_3D, 8 * side ** 3, gl.LINEAR, () =>
      gl.texImage3D(
        ...[gl.TEXTURE_3D, 0, gl.RGBA16F, side, side, side, 0, gl.RGBA, gl.FLOAT],
        rgba,
      ),
    );
  }

  /** Create a row of weights. @param {Float32Array} rgba (n, 4) */
  weights(rgba) {
    const { gl } = this;
    this.weightsTexture ??= this.createTexture(
      gl.TEXTURE_2D,
      rgba.byteLength,
      gl.NEAREST,
      () => {},
    );
    this.bind(1, gl.TEXTURE_2D, this.weightsTexture);
    gl.texImage2D(
      ...[gl.TEXTURE_2D, 0, gl.RGBA32F, rgba.length / 4, 1, 0, gl.RGBA, gl.FLOAT],
      rgba,
    );
    return this.weightsTexture;
  }

  /** Create a render target for one pixel of each plane. @param {number} count */
  probe(count) {
    const { gl } = this;
    if (this.probeTarget?.count !== count) {
      this.drop(this.probeTarget?.texture ?? null);
      const texture = this.createTexture(gl.TEXTURE_2D, 8 * count, gl.NEAREST, () =>
        gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA16F, count, 1),
      );
      this.probeTarget = { count, texture };
    }
    return this.probeTarget.texture;
  }
}
