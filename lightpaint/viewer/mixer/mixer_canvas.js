/** Canvases that show light. */

/** @typedef {import("../drawing/view_transform.js").Encoder} Encoder */

/** Draw light on a canvas of its size. @param {HTMLCanvasElement} canvas
 * @param {Float32Array} light @param {Encoder} encoder */
export function drawLight(canvas, light, encoder) {
  const image = new ImageData(canvas.width, canvas.height);
  encoder.pixels(light, image.data, 0, canvas.width * canvas.height);
  contextOf(canvas).putImageData(image, 0, 0);
}

/** @param {[height: number, width: number]} size */
export function canvasOfSize([height, width]) {
  const canvas = document.createElement('canvas');
  Object.assign(canvas, { width, height });
  return canvas;
}

/** @param {HTMLCanvasElement} canvas */
export function contextOf(canvas) {
  const context = canvas.getContext('2d', { alpha: false });
  if (!context) throw new Error('no canvas to draw on');
  return context;
}
