/** What is selected, over the pictures: marching ants, or a tint of the rest; and a shape in progress. */

import { ellipse, rectangle } from '../../engine/selection/polygon_mask.js';
import { html, useLayoutEffect, useRef } from '../../vendor/preact.js';
import { devicePane, distinctPanes, drawOverPanes, fitCanvas, placesOf } from '../pane_canvas.js';

/** @import { Engine, Pane, Ui } from '../ui_state.js' */
/** @import { Selection } from '../../engine/selection/selection_mirror.js' */
/** Indices of the pixels of an outline in an image, and the sum of their row and column.
 * @typedef {{image: ImageData, x: number, y: number, pixels: Int32Array, diagonals: Int32Array}} Ants */

/** Share from which a pixel is within the ants, in 255ths. */
const HALF = 128;

/** Length of a dash and its gap, in CSS pixels, and milliseconds between their steps. */
const [DASH, STEP_MS] = [4, 120];

/** Colour of the tint over what is not selected at all, and its alpha. */
const [TINT, TINT_ALPHA] = [[64, 110, 255], 76];

const NO_MOTION = '(prefers-reduced-motion: reduce)';

/** @param {{ui: Ui, engine: Engine, panes: Pane[]}} props */
export function SelectionOutline({ ui, engine, panes }) {
  const ref = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const { current, show, draft } = ui.selection;
  const isTinted = show === 'tint' || Boolean(current?.isFaint);
  const places = placesOf(panes);
  useLayoutEffect(() => {
    const selection = engine.selections.current;
    const canvas = ref.current;
    if (!canvas || !selection) return undefined;
    const { context, ratio } = fitCanvas(canvas);
    if (!context) return undefined;
    const { width } = /** @type {{width: number}} */ (engine.selections);
    if (isTinted) return void drawTint(context, selection, width, panes, ratio);
    const all = distinctPanes(panes).flatMap((pane) => antsOf(selection, width, pane, ratio) ?? []);
    let step = 0;
    const draw = () => {
      for (const ants of all) drawAnts(context, ants, step, DASH * ratio);
      step += ratio;
    };
    draw();
    if (window.matchMedia(NO_MOTION).matches) return undefined;
    const timer = setInterval(() => !document.hidden && draw(), STEP_MS);
    return () => clearInterval(timer);
  }, [current?.revision, isTinted, ui.view, places]);
  return html`<canvas class="ants" ref=${ref} hidden=${!current} aria-hidden="true"></canvas>
    ${draft && html`<${Draft} draft=${draft} panes=${distinctPanes(panes)} />`}`;
}

/** A shape that is being drawn.
 * @param {{draft: NonNullable<Ui["selection"]["draft"]>, panes: Pane[]}} props */
function Draft({ draft, panes }) {
  const { shape, corners } = draft;
  const [first, second] = corners;
  const path =
    shape === 'lasso'
      ? corners
      : (shape === 'ellipse' ? ellipse : rectangle)(first, second ?? first);
  return html`<svg class="select-draft" aria-hidden="true">
    ${panes.map((pane, k) => {
      const points = path
        .map(([x, y]) => `${pane.left + x * pane.scale},${pane.top + y * pane.scale}`)
        .join(' ');
      return html`<g key=${k}><polygon points=${points} /><polygon points=${points} /></g>`;
    })}
  </svg>`;
}

/** Return the outline in a pane; null if it is elsewhere. @param {Selection} selection
 * @param {number} width of the picture @param {Pane} cssPane @param {number} ratio device pixels for
 * each CSS pixel @returns {Ants | null} */
function antsOf({ mask, bounds }, width, cssPane, ratio) {
  const pane = devicePane(cssPane, ratio);
  const line = Math.round(ratio);
  const x0 = Math.max(Math.ceil(pane.x), Math.floor(pane.left + bounds[2] * pane.scale) - line);
  const y0 = Math.max(Math.ceil(pane.y), Math.floor(pane.top + bounds[0] * pane.scale) - line);
  const x1 = Math.min(pane.x + pane.width, Math.ceil(pane.left + bounds[3] * pane.scale) + line);
  const y1 = Math.min(pane.y + pane.height, Math.ceil(pane.top + bounds[1] * pane.scale) + line);
  const [columns, rows] = [Math.floor(x1 - x0), Math.floor(y1 - y0)];
  if (columns <= 0 || rows <= 0) return null;
  const across = columns + line;
  const inside = new Uint8Array(across * (rows + line));
  for (let j = 0, index = 0; j < rows + line; j += 1) {
    const row = Math.floor((y0 + j + 0.5 - pane.top) / pane.scale);
    const isRow = row >= bounds[0] && row < bounds[1];
    for (let i = 0; i < across; i += 1, index += 1) {
      const column = Math.floor((x0 + i + 0.5 - pane.left) / pane.scale);
      if (isRow && column >= bounds[2] && column < bounds[3])
        inside[index] = Number(mask[row * width + column] >= HALF);
    }
  }
  const [pixels, diagonals] = [/** @type {number[]} */ ([]), /** @type {number[]} */ ([])];
  for (let j = 0; j < rows; j += 1)
    for (let i = 0, index = j * across; i < columns; i += 1, index += 1) {
      const isEdge =
        inside[index] !== inside[index + line] || inside[index] !== inside[index + line * across];
      if (!isEdge) continue;
      pixels.push(j * columns + i);
      diagonals.push(x0 + i + y0 + j);
    }
  const image = new ImageData(columns, rows);
  return { image, x: x0, y: y0, pixels: Int32Array.from(pixels), diagonals: Int32Array.from(diagonals) };
}

/** @param {CanvasRenderingContext2D} context @param {Ants} ants @param {number} step
 * @param {number} dash in device pixels */
function drawAnts(context, { image, x, y, pixels, diagonals }, step, dash) {
  const codes = new Uint32Array(image.data.buffer);
  for (let k = 0; k < pixels.length; k += 1)
    codes[pixels[k]] = (diagonals[k] + step) % (2 * dash) < dash ? 0xffffffff : 0xff000000;
  context.putImageData(image, x, y);
}

/** @param {CanvasRenderingContext2D} context @param {Selection} selection @param {number} width
 * @param {Pane[]} panes @param {number} ratio */
function drawTint(context, { mask }, width, panes, ratio) {
  const height = mask.length / width;
  const image = new ImageData(width, height);
  for (let p = 0; p < mask.length; p += 1)
    image.data.set([...TINT, (TINT_ALPHA * (255 - mask[p])) / 255], 4 * p);
  drawOverPanes(context, image, panes, ratio);
}
