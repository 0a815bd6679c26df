/** The list of layers: the topmost first, with the controls of the active one. */

import { html } from '../../vendor/preact.js';
import { Button } from '../controls.js';
import { LayerRow } from './layer_row.js';
import { LayerImportButton } from './layer_import.js';
import { dragLayer } from './layer_drag.js';
import { rowsOf } from './layer_order.js';
import { t } from '../../language/language.js';

/** @typedef {import("../ui_state.js").Ui} Ui */
/** @typedef {import("../shortcuts.js").App} App */
/** @typedef {import("../../engine/messages.js").Layer} Layer */

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
