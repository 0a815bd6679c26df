/** Colours of paint, as the engine has them. */

export {
  decode,
  encode,
  luminance,
  ofHex,
  ofHsv,
  ofKelvin,
  toHex,
  toHsv,
  toKelvin,
} from '../engine/colour.js';

/** @typedef {import('./engine.js').RGB} RGB */
