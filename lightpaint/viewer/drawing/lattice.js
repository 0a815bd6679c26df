/** View transforms that arrive as a lattice of halves. */
import { toFloats } from './half_floats.js';
import { SRGB } from './view_transform.js';

/** @typedef {Uint8Array | Int16Array | Uint16Array | Float32Array | Float64Array} Data */
/** An array. float16: bits of halves in a Uint16Array (see half_floats.js).
 * @typedef {{data: Data, shape: number[]}} Picture */
/** @import { Lut, Shaper } from './view_transform.js' */

/** @param {string} name of the transform @param {Picture} picture float16 @param {Shaper} shaper
 * @returns {Lut} */
export function lutOf(name, picture, shaper) {
  if (name === 'srgb') return SRGB;
  const { data } = picture;
  if (data.length !== shaper.side ** 3 * 3)
    throw new Error(`a lattice of ${data.length} numbers, not of ${shaper.side}³ colours`);
  const lattice = toFloats(data);
  return { shaper, lattice, curve: curveOf(lattice, shaper.side) };
}

/** Return the common curve of all channels, (side,), if the lattice equals it to half a code.
 * @param {Float32Array} lattice @param {number} side */
function curveOf(lattice, side) {
  const curve = Float32Array.from(
    { length: side },
    (_, i) => lattice[i * (side * side + side + 1) * 3],
  );
  let index = 0;
  for (let r = 0; r < side; r++)
    for (let g = 0; g < side; g++)
      for (let b = 0; b < side; b++)
        for (const i of [r, g, b])
          if (Math.abs(lattice[index++] - curve[i]) > 1 / 1024) return null;
  return curve;
}
