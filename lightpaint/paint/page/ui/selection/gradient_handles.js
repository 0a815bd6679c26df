/** The ends of the active gradient, on the painting: drag them, or move them by the arrow keys. */

import { html, useRef } from '../../vendor/preact.js';
import { t } from '../../language/language.js';

/** @import { App, Pane, Ui } from '../ui_state.js' */
/** @import { Gradient, Layer } from '../../engine/messages.js' */

/** @type {{end: "start" | "end", label: string}[]} */
const ENDS = [
  { end: 'start', label: t('Start of the gradient') },
  { end: 'end', label: t('End of the gradient') },
];

/** @param {{ui: Ui, app: App, panes: Pane[]}} props */
export function GradientHandles({ ui, app, panes }) {
  const layer = ui.layers.find(({ id }) => id === ui.layer);
  const isShown = ui.tool === 'gradient' || ui.openLayer === ui.layer;
  const pane = panes.find(({ kind }) => kind === 'painting') ?? panes[0];
  const gradient = layer?.gradient;
  if (!layer || !gradient || !pane || !isShown || !app.engine.isLayerHere(layer.id)) return null;
  const [start, end] = [gradient.start, gradient.end].map(([x, y]) => ({
    x: pane.left + x * pane.scale,
    y: pane.top + y * pane.scale,
  }));
  const line = { x1: start.x, y1: start.y, x2: end.x, y2: end.y };
  const box = { left: pane.x, top: pane.y, width: pane.width, height: pane.height };
  const boxStyle = Object.fromEntries(Object.entries(box).map(([key, x]) => [key, `${x}px`]));
  const radius = Math.hypot(end.x - start.x, end.y - start.y);
  return html`<div class="gradient-handles">
    <svg aria-hidden="true" style=${boxStyle}>
      <g transform=${`translate(${-pane.x} ${-pane.y})`}><line ...${line} /><line ...${line} />
      ${
        gradient.shape === 'radial' &&
        html`<circle cx=${start.x} cy=${start.y} r=${radius} /><circle cx=${start.x} cy=${start.y} r=${radius} />`
      }</g></svg>
    ${ENDS.map(
      (
        one,
        k,
      ) => html`<${Handle} key=${one.end} ...${one} app=${app} layer=${layer} gradient=${gradient}
        place=${[start, end][k]} scale=${pane.scale} />`,
    )}</div>`;
}

/** @param {{end: "start" | "end", label: string, app: App, layer: Layer, gradient: Gradient,
 *   place: {x: number, y: number}, scale: number}} props */
function Handle({ end, label, app, layer, gradient, place, scale }) {
  const grasp = useRef(/** @type {{x: number, y: number, from: [number, number]} | null} */ (null));
  const move = (/** @type {[number, number]} */ to, /** @type {boolean} */ isFinal) =>
    app.engine.changeLayers({
      layers: [{ ...layer, gradient: { ...gradient, [end]: to } }],
      label: t('gradient'),
      is_final: isFinal,
    });
  const press = (/** @type {PointerEvent} */ event) => {
    event.stopPropagation();
    /** @type {HTMLElement} */ (event.currentTarget).setPointerCapture(event.pointerId);
    grasp.current = { x: event.clientX, y: event.clientY, from: gradient[end] };
  };
  const drag = (/** @type {PointerEvent} */ event) => {
    if (!grasp.current) return;
    event.stopPropagation();
    const { x, y, from } = grasp.current;
    move([from[0] + (event.clientX - x) / scale, from[1] + (event.clientY - y) / scale], false);
  };
  const release = (/** @type {Event} */ event) => {
    if (!grasp.current) return;
    event.stopPropagation();
    grasp.current = null;
    app.engine.finishLayers();
  };
  const key = (/** @type {KeyboardEvent} */ event) => {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[
      event.key
    ];
    if (!way) return;
    event.preventDefault();
    event.stopPropagation();
    const step = event.shiftKey ? 10 : 1;
    const [x, y] = gradient[end];
    move([x + step * way[0], y + step * way[1]], true);
  };
  return html`<button type="button" class=${`gradient-end is-${end}`} aria-label=${label}
    data-tip=${t('{label}: drag it, or move it by the arrow keys', { label })}
    style=${{ transform: `translate(${place.x}px, ${place.y}px)` }} onPointerDown=${press}
    onPointerMove=${drag} onPointerUp=${release} onPointerCancel=${release} onKeyDown=${key} />`;
}
