/**
 * Chooses a page's renderer by availability and by a timed frame.
 *
 * WebGL2 on a GPU takes a millisecond. Without a GPU a browser has no WebGL2, or one in software,
 * which may be slower than plain JavaScript. So a frame of black planes is timed.
 */
import { CpuView } from './cpu.js';
import { GlView } from './gl.js';
import { DEFAULTS } from './view.js';

/** @import { PictureView } from './view.js' */
/** planeSize: height and width of planes, by default as the picture; onRestored: all is to be
 * set again. @typedef {{planeSize?: [number, number], onRestored?: () => void}} ViewOptions */

/** Frame time in milliseconds below which no comparison is needed. */
const QUICK_FRAME_MS = 12;

/** Frame time in milliseconds below which no third frame is needed. */
const SLOW_FRAME_MS = 100;

/** Create a view in an element, on a canvas of its own.
 * @param {HTMLElement} element @param {[height: number, width: number]} size
 * @param {number} count of lights
 * @param {ViewOptions & {view?: 'gl' | 'cpu' | null}} [options] view: which one, whatever is faster
 * @returns {PictureView} */
export function chooseView(element, size, count, options = {}) {
  const gl = options.view === 'cpu' ? null : glView(size, count, options);
  const isGl =
    gl &&
    (options.view === 'gl' ||
      frameTime(gl, count) <=
        Math.max(QUICK_FRAME_MS, cpuTime(options.planeSize ?? size, count)));
  if (gl && !isGl) gl.close();
  if (options.view === 'gl' && !gl) throw new Error('no WebGL2 that can show the planes');
  const view = gl && isGl ? gl : new CpuView(createCanvas(), size, options.planeSize);
  view.setCount(count);
  element.append(view.canvas);
  return view;
}

function createCanvas() {
  const canvas = document.createElement('canvas');
  canvas.className = 'lightpaint-pictures';
  return canvas;
}

/** @param {[number, number]} size @param {number} count
 * @param {ViewOptions & {view?: 'gl' | 'cpu' | null}} options */
function glView(size, count, { view, ...options }) {
  try {
    const glView = new GlView(createCanvas(), size, { isSlowRefused: view !== 'gl', ...options });
    glView.setCount(count);
    return glView;
  } catch {
    return null;
  }
}

/** Return the milliseconds of the second frame; the first one compiles.
 * @param {PictureView} view @param {number} count */
function frameTime(view, count) {
  [view.canvas.width, view.canvas.height] = [640, 360];
  let time = Infinity;
  for (let frame = 0; frame < 3; frame++) {
    const start = performance.now();
    view.setWeights(new Float64Array(3 * count).fill(1 + frame));
    view.draw({ ...DEFAULTS, layout: 'blink', blink: 'right' });
    if (view.name === 'gl') view.read(0, 0, 1, 1); // Reading a pixel waits for the GPU.
    time = performance.now() - start;
    if (frame > 0 && time > SLOW_FRAME_MS) break;
  }
  return time;
}

/** Estimate the time of a frame without a GPU from one of a few rows.
 * @param {[number, number]} size @param {number} count */
function cpuTime([height, width], count) {
  const rows = Math.min(height, 64);
  const view = new CpuView(createCanvas(), [rows, width]);
  view.setCount(count);
  const black = new Uint16Array(rows * width * 3);
  for (let k = 0; k < count; k++) view.setPlane(k, black, 1);
  return (frameTime(view, count) * height) / rows;
}
