/** Drawing of scopes on a canvas, with a pixel for each count. */

import { histogram, LEVELS, traceAlpha, vectorscope, waveform } from './scope_arithmetic.js';

/** @import { Codes, Trace } from './scope_arithmetic.js' */
/** @typedef {"histogram" | "waveform" | "parade" | "vectorscope"} ScopeKind */

/** Pixels of a side of a vectorscope. */
export const VECTOR_SIZE = 200;

/** Height of a histogram in pixels, and the part of the pixels of its highest bar that fills it. */
const HISTOGRAM_HEIGHT = 120;

/** Colours of red, green, blue and luma, bright enough to be distinguished on black. */
const INKS = [[255, 90, 80], [90, 220, 110], [100, 150, 255], [225, 225, 228]];

/** @param {HTMLCanvasElement} canvas @param {ScopeKind} kind @param {Codes} codes */
export function drawScope(canvas, kind, codes) {
  if (kind === 'histogram') return drawHistogram(canvas, histogram(codes));
  if (kind === 'vectorscope') return drawTraces(canvas, [vectorscope(codes, VECTOR_SIZE)], [INKS[1]]);
  if (kind === 'waveform') return drawTraces(canvas, [waveform(codes, 'luma')], [INKS[3]]);
  const channels = /** @type {const} */ ([0, 1, 2]);
  return drawTraces(canvas, channels.map((channel) => waveform(codes, channel)), INKS);
}

/** Draw traces beside each other. @param {HTMLCanvasElement} canvas @param {Trace[]} traces
 * @param {number[][]} inks */
function drawTraces(canvas, traces, inks) {
  const width = traces.reduce((sum, trace) => sum + trace.width, 0);
  const { height } = traces[0];
  const image = new ImageData(width, height);
  let left = 0;
  traces.forEach((trace, k) => {
    const alpha = traceAlpha(trace);
    for (let y = 0, p = 0; y < height; y += 1)
      for (let x = 0; x < trace.width; x += 1, p += 1)
        if (alpha[p]) image.data.set([...inks[k], alpha[p]], 4 * (y * width + left + x));
    left += trace.width;
  });
  put(canvas, image);
}

/** Draw bars of each code, luma behind the channels, whose inks add up. The highest bar but the bars of
 * black and white has the whole height. @param {HTMLCanvasElement} canvas
 * @param {Float32Array[]} counts */
function drawHistogram(canvas, counts) {
  const most = Math.max(1, ...counts.flatMap((channel) => [...channel.subarray(1, LEVELS - 1)]));
  const image = new ImageData(LEVELS, HISTOGRAM_HEIGHT);
  for (let code = 0; code < LEVELS; code += 1)
    counts.forEach((channel, k) => {
      const height = Math.min(1, Math.sqrt(channel[code] / most)) * HISTOGRAM_HEIGHT;
      for (let y = 0; y < Math.round(height); y += 1) {
        const i = 4 * ((HISTOGRAM_HEIGHT - 1 - y) * LEVELS + code);
        const share = k === 3 ? 0.25 : 0.75;
        for (let c = 0; c < 3; c += 1) image.data[i + c] += share * INKS[k][c];
        image.data[i + 3] = 255;
      }
    });
  put(canvas, image);
}

/** @param {HTMLCanvasElement} canvas @param {ImageData} image */
function put(canvas, image) {
  if (canvas.width !== image.width) canvas.width = image.width;
  if (canvas.height !== image.height) canvas.height = image.height;
  canvas.getContext('2d')?.putImageData(image, 0, 0);
}
