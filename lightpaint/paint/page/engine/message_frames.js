/**
 * Messages between page and session as bytes; the twin of paint/message_frames.py. `messages.d.ts` has their
 * types.
 *
 * A frame is: uint32 length of the JSON, little endian | JSON | padding to 8 bytes | buffers, each
 * padded. `buffers` in the JSON describes them. Colours are linear Rec.709.
 */

/** Version of this protocol. */
export const VERSION = 3;

/** @import { Data, Picture } from '../../../viewer/drawing/lattice.js' */
/** @import { LightInfo as Light } from './messages.js' */
/** @typedef {Record<string, Picture>} Arrays */

/** A received message: its fields together with its arrays.
 * @typedef {{kind: string, seq?: number, reply?: number, arrays: Arrays, [field: string]: any}}
 * Message */


/** @typedef {{name: string, dtype: string, shape: number[]}} BufferInfo */

/** Return the name of a view's item: the plain name in the first view, `name@1` in the second.
 * @param {string} name @param {number} view */
export function nameInView(name, view) {
  return view ? `${name}@${view}` : name;
}

/** Return the state of one view: its size, its objects, and size and scales of its planes.
 * @param {Message} state @param {number} view @returns {Message} */
export function stateOfView(state, view) {
  const viewState = state.views?.[view];
  if (!viewState) return state;
  const lights = state.lights.map((/** @type {Light} */ light, /** @type {number} */ k) => ({
    ...light,
    scale: viewState.scales[k],
  }));
  const { size, objects, plane_size: planeSize, has_mixes: hasMixes } = viewState;
  return { ...state, lights, size, objects, planeSize, hasMixes };
}

/** @type {Record<string, {new (buffer: ArrayBuffer, at: number, length: number): Data,
 *   BYTES_PER_ELEMENT: number}>} */
const DTYPES = {
  float16: Uint16Array,
  float32: Float32Array,
  float64: Float64Array,
  int16: Int16Array,
  uint8: Uint8Array,
};

/** Description of the bytes of an array.
 * @param {string} dtype @param {number[]} shape @param {ArrayBuffer} buffer @param {number} offset
 * @returns {Picture} */
export function pictureOf(dtype, shape, buffer, offset = 0) {
  const ArrayType = DTYPES[dtype];
  const length = shape.reduce((a, b) => a * b, 1);
  if (!ArrayType)
    throw new Error(`an array of ${dtype}: expected ${Object.keys(DTYPES).join(', ')}`);
  if (offset + length * ArrayType.BYTES_PER_ELEMENT > buffer.byteLength)
    throw new Error(`${buffer.byteLength} bytes are not an array of shape ${shape.join(' × ')}`);
  return { data: new ArrayType(buffer, offset, length), shape };
}

/** Element type of an array. Halves travel from session to page only.
 * @param {Data} data */
function dtypeOf(data) {
  for (const [name, ArrayType] of Object.entries(DTYPES))
    if (name !== 'float16' && data instanceof ArrayType) return name;
  throw new Error('an array that no message holds');
}

/** Return the `buffers` entries of some arrays.
 * @param {Arrays} arrays @returns {BufferInfo[]} */
export function bufferInfo(arrays) {
  return Object.entries(arrays).map(([name, { data, shape }]) => ({
    name,
    dtype: dtypeOf(data),
    shape,
  }));
}

/** Encode a message as one binary frame.
 * @param {Record<string, unknown>} content @param {Arrays} [arrays]
 * @returns {ArrayBuffer} */
export function encodeFrame(content, arrays = {}) {
  const text = new TextEncoder().encode(
    JSON.stringify({ ...content, buffers: bufferInfo(arrays) }),
  );
  const pictures = Object.values(arrays);
  const start = padSize(4 + text.length);
  const size = pictures.reduce((offset, { data }) => offset + padSize(data.byteLength), start);
  const buffer = new ArrayBuffer(size);
  new DataView(buffer).setUint32(0, text.length, true);
  const bytes = new Uint8Array(buffer);
  bytes.set(text, 4);
  let offset = start;
  for (const { data } of pictures) {
    bytes.set(new Uint8Array(data.buffer, data.byteOffset, data.byteLength), offset);
    offset += padSize(data.byteLength);
  }
  return buffer;
}

/** Decode a binary frame. Throws if it is not one.
 * @param {ArrayBuffer} buffer @returns {Message} */
export function decodeFrame(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  if (4 + length > buffer.byteLength) throw new Error('a frame that is cut short');
  const content = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  return attachArrays(content, buffer, padSize(4 + length));
}

/** Decode a message whose buffers are consecutive, each padded.
 * @param {Record<string, any>} content @param {ArrayBuffer} buffer @param {number} offset
 * @returns {Message} */
function attachArrays(content, buffer, offset) {
  /** @type {Arrays} */
  const arrays = {};
  for (const { name, dtype, shape } of /** @type {BufferInfo[]} */ (content.buffers ?? [])) {
    arrays[name] = pictureOf(dtype, shape, buffer, offset);
    offset += padSize(arrays[name].data.byteLength);
  }
  return { ...content, kind: String(content.kind), arrays };
}

/** @param {number} size */
function padSize(size) {
  return (size + 7) & ~7;
}
