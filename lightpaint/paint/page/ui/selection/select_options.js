/** The options of the tool that selects, above the pictures. */

import { html } from '../../vendor/preact.js';
import { Button, Choice, Slider } from '../controls.js';
import { MODES, SHAPES, updateSelection } from './selection_settings.js';
import { words } from '../../language/language.js';
import { shortcutsOf } from '../key_bindings.js';

/** @typedef {import("../ui_state.js").Ui} Ui */
/** @typedef {import("../shortcuts.js").App} App */

/** Widest soft edge, in pixels, and largest tolerance, in ΔE. */
export const MAX_FEATHER = 200;
export const MAX_TOLERANCE = 60;

/** Small widths matter more. */
export const FEATHER_CURVE = {
  toPosition: (/** @type {number} */ x) => Math.sqrt(x),
  toValue: (/** @type {number} */ t) => Math.round(t * t),
};

/** @param {{ui: Ui, app: App}} props */
export function SelectOptions({ ui, app }) {
  const { store, engine } = app;
  const { selection } = ui;
  const shapes = SHAPES.map(({ shape, label, icon, hint }) => ({
    value: shape,
    label,
    icon,
    tip: `${label}: ${hint}`,
    disabled: shape === 'object' && !ui.state?.objects?.length,
  }));
  const isPanelOpen = ui.side && !ui.panel && Boolean(ui.open.select);
  const togglePanel = () =>
    store.set({ side: true, panel: null, open: { ...ui.open, select: !isPanelOpen } });
  return html`
    <${Choice} label=${words.selectOptions.shape} icons value=${selection.shape} choices=${shapes}
      change=${(/** @type {any} */ shape) => updateSelection(store, { shape })} />
    <${Choice} label=${words.selectOptions.join} icons value=${selection.mode} choices=${MODES}
      change=${(/** @type {any} */ mode) => updateSelection(store, { mode })} />
    <${Slider} label=${words.selectOptions.feather} value=${selection.feather} min=${0} max=${MAX_FEATHER} unit=${words.selectOptions.px}
      curve=${FEATHER_CURVE} tip=${words.selectOptions.widthOfTheSoftEdgeOf} resetValue=${0}
      change=${(/** @type {number} */ feather) => updateSelection(store, { feather })} />
    ${
      selection.shape === 'colour' &&
      html`<${Slider} label=${words.selectOptions.tolerance} value=${selection.tolerance} min=${1} max=${MAX_TOLERANCE}
      tip=${words.selectOptions.howFarFromTheClickedColour}
      change=${(/** @type {number} */ tolerance) => updateSelection(store, { tolerance })} />`
    }
    <${Button} label=${words.selectOptions.none} keys=${shortcutsOf(ui, 'selectNone')} tip=${words.selectOptions.selectNothingPaintGoesEverywhere}
      disabled=${!selection.current} act=${() => engine.selections.change({ kind: 'none' })} />
    <${Button} label=${words.selectOptions.more} pressed=${isPanelOpen} act=${togglePanel}
      tip=${words.selectOptions.growShrinkFeatherSelectByNumbers} />`;
}
