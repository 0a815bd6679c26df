/** The options of the tool that selects, above the pictures. */

import { html } from '../../vendor/preact.js';
import { Button, Choice, Slider } from '../controls.js';
import { MODES, SHAPES, updateSelection } from './selection_settings.js';
import { t } from '../../language/language.js';
import { shortcutsOf } from '../key_bindings.js';

/** @import { App, Ui } from '../ui_state.js' */

/** Widest soft edge, in pixels, and largest tolerance, in ΔE. */
export const MAX_FEATHER = 200;
const MAX_TOLERANCE = 60;

/** Small widths matter more. */
const FEATHER_CURVE = {
  toPosition: (/** @type {number} */ x) => Math.sqrt(x),
  toValue: (/** @type {number} */ x) => Math.round(x * x),
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
    <${Choice} label=${t('Shape')} icons value=${selection.shape} choices=${shapes}
      change=${(/** @type {any} */ shape) => updateSelection(store, { shape })} />
    <${Choice} label=${t('Join')} icons value=${selection.mode} choices=${MODES}
      change=${(/** @type {any} */ mode) => updateSelection(store, { mode })} />
    <${Slider} label=${t('Feather')} value=${selection.feather} min=${0} max=${MAX_FEATHER} unit=${t('px')}
      curve=${FEATHER_CURVE} tip=${t('Width of the soft edge of what you select next')} resetValue=${0}
      change=${(/** @type {number} */ feather) => updateSelection(store, { feather })} />
    ${
      selection.shape === 'colour' &&
      html`<${Slider} label=${t('Tolerance')} value=${selection.tolerance} min=${1} max=${MAX_TOLERANCE}
      tip=${t('How far from the clicked colour, in ΔE of the picture as it is shown')}
      change=${(/** @type {number} */ tolerance) => updateSelection(store, { tolerance })} />`
    }
    <${Button} label=${t('None')} keys=${shortcutsOf(ui, 'selectNone')} tip=${t('Select nothing: paint goes everywhere')}
      disabled=${!selection.current} act=${() => engine.selections.change({ kind: 'none' })} />
    <${Button} label=${t('More')} pressed=${isPanelOpen} act=${togglePanel}
      tip=${t('Grow, shrink, feather; select by numbers, brightness, or what a light lights')} />`;
}
