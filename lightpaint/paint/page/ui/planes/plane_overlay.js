/** False colours of the illuminance on measuring planes, over the picture of the answer. */

import { html, useLayoutEffect, useRef } from '../../vendor/preact.js';
import { overlayOf } from '../display_state.js';
import { numberText } from '../format.js';
import { clipToPane, devicePane, fitCanvas } from '../pane_canvas.js';
import { t } from '../../language/language.js';
import { DOT_RADIUS, cellAt, cellsInView } from './plane_cells.js';
import { colourOf, luxText, scaleTop } from './plane_picture.js';

/** @import { Pane, Ui } from '../ui_state.js' */
/** @import { PlaneCell } from './plane_cells.js' */

/** Share of the time that drawing takes at most while a stroke is made; at rest, all is drawn. */
const LARGEST_SHARE = 0.1;

/** Return whether the planes can be drawn in the picture of the view. @param {Ui} ui */
export const hasPlanesInView = ({ planes, view }) => Boolean(planes?.cameras[view]);

/** Return the case whose light the pictures show; "" without cases.
 * @param {Pick<Ui, "planes" | "planeCase">} ui */
export function caseOf({ planes, planeCase }) {
  const cases = casesOf(planes);
  return planeCase !== null && cases.includes(planeCase) ? planeCase : cases[0];
}

/** Return the cases in which planes are measured; "" is the light of the scene.
 * @param {Ui["planes"]} planes @returns {string[]} */
export const casesOf = (planes) => [...new Set(planes?.planes.map((plane) => plane.case))];

/** Return the cells that are drawn; none where the answer's light is not shown, or not asked for.
 * @param {Ui} ui @returns {PlaneCell[]} */
function shownCells(ui) {
  const { planes, planesReading } = ui;
  const isOther = ui.previousWeights || ui.isOriginalHeld || ui.mix || ui.hoveredLight !== null;
  if (overlayOf(ui) !== 'lux' || !planes || !planesReading || isOther) return [];
  const shownCase = caseOf(ui);
  const isShown = planes.planes.map(
    (plane) => plane.case === shownCase && !ui.hiddenPlanes.includes(plane.plane),
  );
  return cellsInView(planes, ui.view).filter(({ plane }) => isShown[plane]);
}

/** Return the title of the legend, and the lx at its colours. @param {Ui} ui */
export function luxLegend(ui) {
  const { planes, planesReading } = ui;
  const shownCase = caseOf(ui);
  const top = planes && planesReading ? scaleTop(planes, planesReading, shownCase) : 0;
  const title = t('Lux on planes');
  return {
    title: shownCase ? `${title}, ${shownCase}` : title,
    texts: ['0', numberText(top / 2), luxText(top)],
  };
}

/** Return the illuminance under the pointer in words; null where no cell is drawn. @param {Ui} ui */
export function luxAtPointer(ui) {
  if (!ui.probe) return null;
  const [x, y] = ui.probe.place;
  const cell = cellAt(shownCells(ui), x, y, DOT_RADIUS / ((ui.fit ?? 1) * ui.display.zoom));
  const light = cell && ui.planesReading?.planes[cell.plane];
  if (!light) return null;
  const name = ui.planes?.planes[cell.plane].name ?? '';
  return t('{name} {lux}', { name, lux: luxText(light.lux[cell.point]) });
}

/** @param {{ui: Ui, panes: Pane[]}} props panes: without a small picture in a corner */
export function PlanesOverlay({ ui, panes }) {
  const ref = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const pane = panes.find(({ kind }) => kind === 'solution');
  const cells = pane ? shownCells(ui) : [];
  const nextMs = useRef(0);
  useLayoutEffect(() => {
    const drawNow = () => {
      const beginMs = performance.now();
      if (ref.current && pane && cells.length) draw(ref.current, cells, pane, ui);
      const endMs = performance.now();
      nextMs.current = endMs + (endMs - beginMs) / LARGEST_SHARE;
    };
    const waitMs = ui.isLive ? nextMs.current - performance.now() : 0;
    const timer = waitMs > 0 ? setTimeout(drawNow, waitMs) : drawNow();
    return () => clearTimeout(timer ?? undefined);
  }, [
    cells.length,
    ui.isLive,
    ui.planes,
    ui.planesReading,
    ui.planeCase,
    ui.hiddenPlanes,
    ui.view,
    Object.values(pane ?? {}).join(' '),
  ]);
  // It has the numbers of the panel and of the line below the pictures.
  return html`<canvas class="plane-overlay" ref=${ref} hidden=${!cells.length} aria-hidden="true"></canvas>`;
}

/** @param {HTMLCanvasElement} canvas @param {PlaneCell[]} cells @param {Pane} pane @param {Ui} ui */
function draw(canvas, cells, pane, { planes, planesReading, planeCase, state }) {
  const { context, ratio } = fitCanvas(canvas);
  if (!context || !planes || !planesReading) return;
  const [rows, columns] = state.size;
  const { scale, left, top: above, ...frame } = devicePane(pane, ratio);
  clipToPane(context, frame);
  context.translate(left, above);
  clipToPane(context, { x: 0, y: 0, width: columns * scale, height: rows * scale });
  const top = scaleTop(planes, planesReading, caseOf({ planes, planeCase }));
  for (const { plane, point, corners } of cells) {
    const lux = planesReading.planes[plane].lux[point];
    context.fillStyle = `rgb(${colourOf(lux / (top || 1)).join(' ')})`;
    context.beginPath();
    if (corners.length === 1)
      context.arc(corners[0][0] * scale, corners[0][1] * scale, DOT_RADIUS * ratio, 0, 7);
    for (const [x, y] of corners.length > 1 ? corners : []) context.lineTo(x * scale, y * scale);
    context.fill();
  }
}
