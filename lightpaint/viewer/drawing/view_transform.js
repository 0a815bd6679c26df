/**
 * View transforms for display: light × 2^stops → display values.
 *
 * A lattice (side³) over log2 of light, from `low` to `high` on each axis; its first point stands
 * for all light below 2^low. Interpolation is trilinear. sRGB (IEC 61966-2-1) is computed exactly.
 * If each display value depends on its own channel only, one curve replaces the lattice.
 */
/** @typedef {{side: number, low: number, high: number}} Shaper */

/** lattice: (side, side, side, 3) display values, axes r, g, b; null for sRGB. curve: (side,) if it
 * is the same for all channels, else null.
 * @typedef {{shaper: Shaper, lattice: Float32Array | null, curve: Float32Array | null}} Lut */

/** Exact sRGB, used until another transform arrives. @type {Readonly<Lut>} */
export const SRGB = Object.freeze({
  shaper: { side: 2, low: -16, high: 0 },
  lattice: null,
  curve: null,
});

/** Return the display value in [0, 1] of light in [0, 1], by IEC 61966-2-1.
 * @param {number} light */
export function encodeSrgb(light) {
  const x = Math.min(1, Math.max(0, light));
  return x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055;
}

/** Return the light of a display value in [0, 1]: the inverse of encodeSrgb.
 * @param {number} display */
export function decodeSrgb(display) {
  return display <= 0.04045 ? display / 12.92 : ((display + 0.055) / 1.055) ** 2.4;
}

/** Steps of the table per doubling of light: 2^9 keep the error below a sixth of a code. */
const TABLE_BITS = 9;
const SHIFT = 23 - TABLE_BITS;

/** The last encoder of each view transform. @type {WeakMap<Readonly<Lut>, Encoder>} */
const encoders = new WeakMap();

/** Return the encoder of a view transform at an exposure: its tables take longer than a frame.
 * @param {Readonly<Lut>} lut @param {number} stops */
export function encoderOf(lut, stops) {
  const known = encoders.get(lut);
  if (known?.stops === stops) return known;
  const encoder = new Encoder(/** @type {Lut} */ (lut), stops);
  encoders.set(lut, encoder);
  return encoder;
}

/** Computes codes of many pixels. The upper bits of a float are a piecewise linear logarithm. They
 * index a table of codes if there is a curve, else of coordinates in the lattice. The table
 * includes the exposure. */
export class Encoder {
  /** @param {Lut} lut @param {number} stops */
  constructor(lut, stops) {
    this.lut = lut;
    this.stops = stops;
    const { low, high } = lut.shaper;
    const float = new Float32Array(1);
    const bits = new Int32Array(float.buffer);
    float[0] = 2 ** Math.max(-126, Math.floor(low - stops));
    this.firstIndex = bits[0] >> SHIFT;
    float[0] = 2 ** Math.min(127, Math.ceil(high - stops));
    const length = (bits[0] >> SHIFT) - this.firstIndex + 1;
    this.isCurve = !lut.lattice || !!lut.curve;
    /** The lattice as codes, if needed. */
    this.codes = !this.isCurve && lut.lattice ? lut.lattice.map((value) => 255 * value) : null;
    this.table = this.isCurve ? new Uint8ClampedArray(length) : new Float32Array(length);
    for (let i = 0; i < length; i++) {
      bits[0] = ((this.firstIndex + i) << SHIFT) | (1 << (SHIFT - 1)); // the middle of the step
      this.table[i] = this.valueAt(Math.log2(float[0]) + stops);
    }
  }

  /** Return the table's value for a logarithm of light. @param {number} log */
  valueAt(log) {
    const { shaper, lattice, curve } = this.lut;
    if (!lattice) return 255 * encodeSrgb(2 ** log);
    const lastIndex = shaper.side - 1;
    const position = ((log - shaper.low) / (shaper.high - shaper.low)) * lastIndex;
    const index = Math.min(lastIndex, Math.max(0, position));
    if (!curve) return index;
    const i = Math.min(lastIndex - 1, Math.floor(index));
    return 255 * (curve[i] + (index - i) * (curve[i + 1] - curve[i]));
  }

  /** Write the codes of a range of pixels (…, 3) into RGBA.
   * @param {Float32Array} light @param {Uint8ClampedArray} rgba @param {number} start
   * @param {number} end */
  pixels(light, rgba, start, end) {
    const bits = new Int32Array(light.buffer, light.byteOffset, light.length);
    if (this.isCurve) this.encodeByCurve(bits, rgba, start, end);
    else this.encodeByLattice(bits, rgba, start, end);
  }

  /** @param {Int32Array} bits @param {Uint8ClampedArray} rgba @param {number} start
   * @param {number} end */
  encodeByCurve(bits, rgba, start, end) {
    const { table, firstIndex } = this;
    const lastIndex = table.length - 1;
    for (let p = start; p < end; p++) {
      const r = (bits[3 * p] >> SHIFT) - firstIndex;
      const g = (bits[3 * p + 1] >> SHIFT) - firstIndex;
      const b = (bits[3 * p + 2] >> SHIFT) - firstIndex;
      rgba[4 * p] = table[r < 0 ? 0 : r > lastIndex ? lastIndex : r];
      rgba[4 * p + 1] = table[g < 0 ? 0 : g > lastIndex ? lastIndex : g];
      rgba[4 * p + 2] = table[b < 0 ? 0 : b > lastIndex ? lastIndex : b];
      rgba[4 * p + 3] = 255;
    }
  }

  /** @param {Int32Array} bits @param {Uint8ClampedArray} rgba @param {number} start
   * @param {number} end */
  encodeByLattice(bits, rgba, start, end) {
    const { table, firstIndex } = this;
    const codes = /** @type {Float32Array} */ (this.codes);
    const side = this.lut.shaper.side;
    const lastIndex = table.length - 1;
    const red = side * side * 3;
    const green = side * 3;
    for (let p = start; p < end; p++) {
      const i = (bits[3 * p] >> SHIFT) - firstIndex;
      const j = (bits[3 * p + 1] >> SHIFT) - firstIndex;
      const k = (bits[3 * p + 2] >> SHIFT) - firstIndex;
      const r = table[i < 0 ? 0 : i > lastIndex ? lastIndex : i];
      const g = table[j < 0 ? 0 : j > lastIndex ? lastIndex : j];
      const b = table[k < 0 ? 0 : k > lastIndex ? lastIndex : k];
      const ir = r >= side - 1 ? side - 2 : r | 0;
      const ig = g >= side - 1 ? side - 2 : g | 0;
      const ib = b >= side - 1 ? side - 2 : b | 0;
      const fr = r - ir;
      const fg = g - ig;
      const fb = b - ib;
      const w11 = fr * fg;
      const w10 = fr - w11;
      const w01 = fg - w11;
      const w00 = 1 - fr - w01;
      // From the nearer of two faces of the cell along blue to the farther one.
      let a00 = ir * red + ig * green + ib * 3;
      let a01 = a00 + green;
      let a10 = a00 + red;
      let a11 = a10 + green;
      for (let c = 4 * p; c < 4 * p + 3; c++, a00++, a01++, a10++, a11++) {
        const nearFace = w00 * codes[a00] + w01 * codes[a01] + w10 * codes[a10] + w11 * codes[a11];
        const farFace =
          w00 * codes[a00 + 3] + w01 * codes[a01 + 3] + w10 * codes[a10 + 3] + w11 * codes[a11 + 3];
        rgba[c] = nearFace + fb * (farFace - nearFace);
      }
      rgba[4 * p + 3] = 255;
    }
  }
}
