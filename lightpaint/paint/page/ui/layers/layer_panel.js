/** The list of layers: the topmost first, with the controls of the active one. */

import { html } from '../../vendor/preact.js';
import { Button } from '../controls.js';
import { LayerRow } from './layer_row.js';
import { LayerImportButton } from './layer_import.js';
import { rowsOf, movedLayer } from './layer_order.js';
import { t } from '../../language/language.js';
import { dragItem } from '../item_drag.js';

/** @import { App, Ui } from '../ui_state.js' */

/** Whether there is more than the plain painting. @param {Ui} ui */
export const hasLayers = ({ layers }) => layers.length > 1;

/** Return the rows that are seen: without an empty painting, and without members of folded groups.
 * @param {Ui} ui */
function seenRows(ui) {
  return rowsOf(ui.layers).filter(
    ({ layer, group }) =>
      !(layer.id === 0 && ui.isPaintingEmpty && hasLayers(ui)) &&
      (group === null || (ui.open[`layer ${group}`] ?? true)),
  );
}

/** @param {{ui: Ui, app: App}} props */
export function LayerPanel({ ui, app }) {
  if (!hasLayers(ui))
    return html`<p class="faint layers-none">${t('Adjustments and fills become layers here.')}</p>
      <${LayerImportButton} app=${app} />`;
  const rows = seenRows(ui);
  const leave = () => app.store.set({ hoveredLayer: null });
  return html`<ul class="layers" aria-label=${t('Layers, the topmost first')}
    onPointerLeave=${leave}
    onPointerDown=${(/** @type {PointerEvent} */ event) => dragLayer(event, app)}>
    ${rows.map(
      ({ layer, group }) => html`<${LayerRow} key=${layer.id} ui=${ui} app=${app} layer=${layer}
        isInner=${group !== null} isActive=${layer.id === ui.layer}
        isUnfolded=${layer.id === ui.openLayer} isChosen=${ui.selectedLayers.includes(layer.id)} />`,
    )}
  </ul>
  <${LayerImportButton} app=${app} />
  <span class="only-read" role="status">${ui.layerNote}</span>`;
}

/** How many layers there are, beside the title. @param {{ui: Ui}} props */
export function LayerCount({ ui }) {
  if (!hasLayers(ui) || (ui.open.layers ?? true)) return null;
  return html`<span class="whose">${ui.layers.length - (ui.isPaintingEmpty ? 1 : 0)}</span>`;
}

/** What the brush does while a mask is painted, below the pictures' names. @param {{ui: Ui, app: App}} props */
export function MaskNote({ ui, app }) {
  const layer = ui.layers.find(({ id }) => id === ui.maskLayer);
  if (!layer) return null;
  const stop = (/** @type {Event} */ event) => event.stopPropagation();
  return html`<div class="mask-note" role="status" onPointerDown=${stop}>
    <span>${t('Mask of')} <strong>${layer.name}</strong>${t(': the brush adds, the eraser removes.')}</span>
    <${Button} label=${t('Done')} act=${() => app.engine.paintMask(null)} />
  </div>`;
}

/** Pixels from the left of the list beyond which a layer below a group's last member joins it. */
const INDENT = 24;

/** Begin a drag, if a press becomes one. Fingers drag by the grip, since elsewhere they scroll.
 * @param {PointerEvent} event on the list @param {App} app */
function dragLayer(event, app) {
  const target = /** @type {HTMLElement} */ (event.target);
  const isGrip = Boolean(target.closest('.grip'));
  const isHandle = isGrip || (event.pointerType === 'mouse' && target.closest('.layer-name, .layer-thumb'));
  const row = /** @type {HTMLElement | null} */ (target.closest('[data-layer]'));
  if (!row || !isHandle || event.button !== 0) return;
  const list = /** @type {HTMLElement} */ (event.currentTarget);
  const id = Number(row.dataset.layer);
  dragItem(event, row, {
    move: (now) => {
      app.store.set({ hoveredLayer: null });
      mark(list, placeAt(list, now, id));
    },
    drop: (last) => {
      const place = placeAt(list, last, id);
      if (place) app.engine.changeLayers(movedLayer(app.store.value.layers, id, place.before, place.group));
    },
  });
  if (isGrip) event.preventDefault();
}

/** Return before which layer, and into which group, a drag drops a layer; null where it is.
 * @param {HTMLElement} list @param {PointerEvent} event @param {number} id
 * @returns {{before: number | null, group: number | null} | null} */
function placeAt(list, event, id) {
  const rows = /** @type {HTMLElement[]} */ ([...list.querySelectorAll('[data-layer]')]);
  const own = rows.find((row) => Number(row.dataset.layer) === id);
  const isGroup = Boolean(own?.querySelector('.layer-fold'));
  const at = rows.findIndex((row) => {
    const line = /** @type {HTMLElement} */ (row.querySelector('.layer-line'));
    const { top, height } = line.getBoundingClientRect();
    return event.clientY < top + height / 2;
  });
  const [above, below] = [rows[at < 0 ? rows.length - 1 : at - 1], at < 0 ? undefined : rows[at]];
  const isInner = (/** @type {HTMLElement | undefined} */ row) =>
    Boolean(row?.classList.contains('is-inner'));
  const headOf = (/** @type {HTMLElement | undefined} */ row) => {
    let found = row;
    while (found && isInner(found)) found = /** @type {any} */ (found.previousElementSibling);
    return found ? Number(found.dataset.layer) : null;
  };
  const before = below ? Number(below.dataset.layer) : null;
  if (isGroup) return isInner(below) || before === id ? null : { before, group: null };
  const isFurther = event.clientX - list.getBoundingClientRect().left > INDENT;
  const isAfterHead = Boolean(above?.querySelector('.layer-fold'));
  const isIn = isInner(below) || (isFurther && (isAfterHead || isInner(above)) && above !== own);
  return { before: before === id ? nextOf(rows, at) : before, group: isIn ? headOf(isInner(below) ? below : above) : null };
}

/** @param {HTMLElement[]} rows @param {number} at */
const nextOf = (rows, at) => (rows[at + 1] ? Number(rows[at + 1].dataset.layer) : null);

/** Mark where a layer would be dropped. @param {HTMLElement} list
 * @param {{before: number | null, group: number | null} | null} place */
function mark(list, place) {
  const rows = /** @type {HTMLElement[]} */ ([...list.querySelectorAll('[data-layer]')]);
  for (const row of rows) delete row.dataset.drop;
  if (!place) return;
  const row = rows.find(({ dataset }) => Number(dataset.layer) === place.before);
  const inner = place.group === null ? '' : ' inner';
  if (row) row.dataset.drop = `before${inner}`;
  else if (rows.length) rows[rows.length - 1].dataset.drop = `after${inner}`;
}
