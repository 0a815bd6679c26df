/** The outline of the object that a click would fill, or that a drag adjusts. */

import { html, useLayoutEffect, useRef } from '../vendor/preact.js';
import { devicePane, fitCanvas, placesOf } from './pane_canvas.js';

/** @import { Engine, Pane, Ui } from './ui_state.js' */
/** @typedef {NonNullable<ReturnType<Engine["objects"]>>} Objects */

/** White inside the object and dark around it, so that it is visible on any picture. */
const [INSIDE_COLOUR, OUTSIDE_COLOUR] = [[255, 255, 255, 255], [0, 0, 0, 180]];

/** Index of the object that a press affects or would affect; null for none. @param {Ui} ui */
function objectOf({ tool, adjustedArea, probe, selection }) {
  if (!probe) return null;
  const isSelection = adjustedArea === 'selection' && selection.current !== null;
  if (tool === 'fill') return isSelection ? null : probe.index;
  if (tool === 'select' && selection.shape === 'object') return probe.index;
  return tool === 'adjust' && adjustedArea === 'object' && probe.index >= 0 ? probe.index : null;
}

/** Redrawn only when the object or its place changes.
 * @param {{ui: Ui, engine: Engine, panes: Pane[]}} props */
export function ObjectOutline({ ui, engine, panes }) {
  const ref = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const object = objectOf(ui);
  useLayoutEffect(() => {
    if (ref.current && object !== null) draw(ref.current, engine.objects(), object, panes);
  }, [object, ui.view, placesOf(panes)]);
  // Fainter during a drag, so that its effect is visible.
  return html`<canvas class=${ui.dragAdjustment ? 'outline is-asking' : 'outline'} ref=${ref} hidden=${object === null}
    aria-hidden="true"></canvas>`;
}

/** Draw the outline, or nothing if no objects are known.
 * @param {HTMLCanvasElement} canvas @param {Objects | null} objects @param {number} object
 * @param {Pane[]} panes */
function draw(canvas, objects, object, panes) {
  const { context, ratio } = fitCanvas(canvas);
  const box = objects && boxOf(objects, object);
  if (!context || !box) return;
  for (const pane of panes) {
    const outline = createOutline(objects, object, box, devicePane(pane, ratio), Math.round(ratio));
    if (outline) context.putImageData(outline.image, outline.x, outline.y);
  }
}

/** @typedef {[left: number, top: number, right: number, bottom: number]} Box */

/** Bounding boxes of objects, by picture.
 * @type {WeakMap<object, Map<number, Box>>} */
const boxes = new WeakMap();

/** @param {Objects} objects @param {number} object @returns {Box | undefined} in picture pixels */
function boxOf({ data, width, height }, object) {
  let boxByObject = boxes.get(data);
  if (!boxByObject) {
    boxByObject = new Map();
    // As runs of pixels, which are few in a picture of millions of pixels.
    for (let y = 0, row = 0; y < height; y += 1, row += width)
      for (let x = 0, end = 0; x < width; x = end) {
        const value = data[row + x];
        while (end < width && data[row + end] === value) end += 1;
        const box = boxByObject.get(value);
        if (!box) boxByObject.set(value, [x, y, end, y + 1]);
        else {
          box[0] = Math.min(box[0], x);
          box[2] = Math.max(box[2], end);
          box[3] = y + 1;
        }
      }
    boxes.set(data, boxByObject);
  }
  return boxByObject.get(object);
}

/** Draw the outline in a pane, some device pixels wide on both sides of the edge.
 * @param {Objects} objects @param {number} object @param {Box} box @param {Pane} pane
 * @param {number} lineWidth @returns {{image: ImageData, x: number, y: number} | null} */
function createOutline({ data, width, height }, object, box, pane, lineWidth) {
  const { left, top, scale } = pane;
  const x0 = Math.max(Math.round(pane.x), Math.floor(left + box[0] * scale) - lineWidth);
  const y0 = Math.max(Math.round(pane.y), Math.floor(top + box[1] * scale) - lineWidth);
  const x1 = Math.min(
    Math.round(pane.x + pane.width),
    Math.ceil(left + box[2] * scale) + lineWidth,
  );
  const y1 = Math.min(
    Math.round(pane.y + pane.height),
    Math.ceil(top + box[3] * scale) + lineWidth,
  );
  if (x1 <= x0 || y1 <= y0) return null;
  const inside = insideMask();
  const image = new ImageData(x1 - x0, y1 - y0);
  const rowLength = x1 - x0 + 2 * lineWidth;
  for (let y = 0, target = 0; y < y1 - y0; y += 1) {
    for (let x = 0; x < x1 - x0; x += 1, target += 4) {
      const index = (y + lineWidth) * rowLength + x + lineWidth;
      const isInside = inside[index];
      const isEdge =
        inside[index - lineWidth] !== isInside ||
        inside[index + lineWidth] !== isInside ||
        inside[index - lineWidth * rowLength] !== isInside ||
        inside[index + lineWidth * rowLength] !== isInside;
      if (isEdge) image.data.set(isInside ? INSIDE_COLOUR : OUTSIDE_COLOUR, target);
    }
  }
  return { image, x: x0, y: y0 };

  /** Return whether a device pixel shows the object, up to a line's width outside the drawing. */
  function insideMask() {
    const columns = Int32Array.from({ length: x1 - x0 + 2 * lineWidth }, (_, i) =>
      Math.floor((x0 - lineWidth + i + 0.5 - left) / scale),
    );
    const mask = new Uint8Array(columns.length * (y1 - y0 + 2 * lineWidth));
    for (let j = 0, index = 0; index < mask.length; j += 1) {
      const row = Math.floor((y0 - lineWidth + j + 0.5 - top) / scale);
      const isRow = row >= 0 && row < height;
      for (let i = 0; i < columns.length; i += 1, index += 1) {
        const column = columns[i];
        if (isRow && column >= 0 && column < width)
          mask[index] = Number(data[row * width + column] === object);
      }
    }
    return mask;
  }
}
