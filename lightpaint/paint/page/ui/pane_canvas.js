/** Canvases over the pictures, with the pixels of the device. */

/** @import { Pane } from './ui_state.js' */

/** Give a canvas the pixels of the device, which clears it. @param {HTMLCanvasElement} canvas
 * @returns {{context: CanvasRenderingContext2D | null, ratio: number}} ratio: device pixels for each CSS
 *   pixel */
export function fitCanvas(canvas) {
  const ratio = Math.max(1, window.devicePixelRatio || 1);
  canvas.width = Math.round(canvas.clientWidth * ratio);
  canvas.height = Math.round(canvas.clientHeight * ratio);
  return { context: canvas.getContext('2d'), ratio };
}

/** Return a pane in device pixels. @param {Pane} pane @param {number} ratio @returns {Pane} */
export function devicePane({ kind, ...lengths }, ratio) {
  const entries = Object.entries(lengths).map(([key, value]) => [key, value * ratio]);
  return { kind, .../** @type {Omit<Pane, 'kind'>} */ (Object.fromEntries(entries)) };
}

/** Return the panes side by side; of overlapping ones the first. @param {Pane[]} panes */
export const distinctPanes = (panes) =>
  panes.filter(
    (pane, k) => panes.findIndex((x) => x.left === pane.left && x.top === pane.top) === k,
  );

/** Return a text that differs where panes lie elsewhere. @param {Pane[]} panes */
export const placesOf = (panes) => panes.map((pane) => Object.values(pane).join(' ')).join();

/** Keep what is drawn within a rectangle, in device pixels. @param {CanvasRenderingContext2D} context
 * @param {{x: number, y: number, width: number, height: number}} box */
export function clipToPane(context, { x, y, width, height }) {
  context.beginPath();
  context.rect(x, y, width, height);
  context.clip();
}

/** Draw an image of the film over the pictures. @param {CanvasRenderingContext2D} context
 * @param {ImageData} image @param {Pane[]} panes in CSS pixels @param {number} ratio */
export function drawOverPanes(context, image, panes, ratio) {
  const { width, height } = image;
  const source = Object.assign(document.createElement('canvas'), { width, height });
  source.getContext('2d')?.putImageData(image, 0, 0);
  for (const pane of panes.map((one) => devicePane(one, ratio))) {
    context.save();
    clipToPane(context, pane);
    context.drawImage(source, pane.left, pane.top, width * pane.scale, height * pane.scale);
    context.restore();
  }
}
