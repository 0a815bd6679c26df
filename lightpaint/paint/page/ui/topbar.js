/** The bar above the pictures: scene, undo, layout, exposure, view transform and zoom. */

import { html } from '../vendor/preact.js';
import { Button, Checkbox, Choice, Select, Slider, TruncatedText } from './controls.js';
import { signedText } from './format.js';
import { PreviousButton } from './previous_answer.js';
import { showPixels } from './shortcuts.js';
import { togglePanels, updateDisplay } from './tools.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */

const LAYOUTS = [
  { value: 'side', label: 'Side by side', icon: 'side', keys: 'V' },
  { value: 'wipe', label: 'Wipe', icon: 'wipe', keys: 'V' },
  { value: 'blink', label: 'Blink', icon: 'blink', keys: 'V' },
];

/** @param {{ui: Ui, app: App}} props */
export function TopBar({ ui, app }) {
  const { store, session } = app;
  const { display, history } = ui;
  const undo = history.undo.at(-1);
  const redo = history.redo.at(-1);
  const title = ui.state?.scene || 'lightpaint';
  return html`<header class="top">
    <div class="title"><${TruncatedText} text=${title} maxLength=${16} tag="strong" /></div>
    <div class="group" role="group" aria-label="History">
      <${Button} icon="undo" tip=${undo ? `Undo: ${undo}` : 'Undo'} keys="Control+Z"
        disabled=${!undo} act=${() => session.send('undo')} />
      <${Button} icon="redo" tip=${redo ? `Redo: ${redo}` : 'Redo'} keys="Control+Shift+Z"
        disabled=${!redo} act=${() => session.send('redo')} />
      <${PreviousButton} ui=${ui} app=${app} />
    </div>
    <div class="spring"></div>
    <${Choice} label="Layout" icons value=${display.layout} choices=${LAYOUTS}
      change=${(/** @type {any} */ layout) => updateDisplay(store, { layout })} />
    <${ComparisonChoice} ui=${ui} app=${app} />
    <${Slider} label="Exposure" value=${display.stops} min=${-6} max=${6} step=${0.1} digits=${1}
      unit="st" resetValue=${0} keys=", ." tip="Display exposure. The light does not change."
      text=${`${signedText(display.stops)} stops`}
      change=${(/** @type {number} */ stops) => updateDisplay(store, { stops })} />
    <${ViewChoice} ui=${ui} app=${app} />
    <${Zoom} ui=${ui} app=${app} />
    <div class="group" role="group" aria-label="Painter">
      <${Button} icon="settings" tip="Solve settings"
        pressed=${ui.panel === 'settings'}
        act=${() => store.set({ panel: ui.panel ? null : 'settings' })} />
      <${Button} icon="export" tip="Export"
        act=${() => store.set({ dialog: 'export' })} />
      <${Button} icon="keys" tip="Keyboard shortcuts" keys="?" act=${() => store.set({ dialog: 'keys' })} />
      <${Button} icon="panel" tip="Show or hide the panels" keys="P" pressed=${ui.side || ui.panel !== null}
        act=${() => togglePanels(store)} />
    </div>
  </header>`;
}

/** The size of a picture pixel on the page, or *fit*.
 * @param {{ui: Ui, app: App}} props */
function Zoom({ ui: { display, fit }, app }) {
  const scale = (fit ?? 1) * display.zoom;
  const isFitted = display.zoom === 1 && display.pan.every((x) => x === 0);
  return html`<div class="group" role="group" aria-label="Zoom">
    <${Button} label=${isFitted ? 'Fit' : `${Math.round(100 * scale)} %`} class="zoom" keys="F"
      tip="Fit the whole picture. Zoom with Ctrl and the wheel, or with + and −."
      act=${() => updateDisplay(app.store, { zoom: 1, pan: [0, 0] })} />
    <${Button} label="1:1" class="zoom pixels" keys="Shift+F" pressed=${fit !== null && Math.abs(scale - 1) < 1e-3}
      tip="100 %: one image pixel on one pixel of the page" act=${() => showPixels(app)} />
  </div>`;
}

/** @param {{ui: Ui, app: App}} props */
function ViewChoice({ ui, app }) {
  const { display } = ui;
  if (!ui.ready) return null;
  const names = (ui.state?.transforms ?? []).map((/** @type {any} */ entry) => entry.name ?? entry);
  return html`<${Select} label="View" hidden value=${display.transform}
    tip="View transform: how the display shows linear light"
    choices=${names.map((/** @type {string} */ name) => ({ value: name, label: transformLabel(name) }))}
    change=${(/** @type {string} */ transform) => updateDisplay(app.store, { transform })} />
  <${Checkbox} label="Denoise" checked=${display.clean} tip="Denoise the pictures (C). The solve does not change."
    change=${(/** @type {boolean} */ clean) => updateDisplay(app.store, { clean })} />`;
}

/** @param {string} name */
function transformLabel(name) {
  const labels = /** @type {Record<string, string>} */ ({
    srgb: 'sRGB',
    linear: 'Linear',
    filmic: 'Filmic',
    agx: 'AgX',
  });
  return labels[name] ?? name.replace(/^ocio:/, '').replace('/', ' · ');
}

/** The choice of the two pictures to compare. @param {{ui: Ui, app: App}} props */
function ComparisonChoice({ ui, app }) {
  const { store } = app;
  const { display } = ui;
  const value = ui.mix ? 'looks' : `${display.left} ${display.right}`;
  const choices = [
    { value: 'painting solution', label: 'Painting | Answer' },
    { value: 'present solution', label: 'Now | Answer' },
    { value: 'present painting', label: 'Now | Painting' },
    ...(ui.verification ? [{ value: 'solution verified', label: 'Answer | Render' }] : []),
    ...(ui.mix ? [{ value: 'looks', label: 'Two looks' }] : []),
  ];
  return html`<${Select} label="Compare" hidden value=${value} choices=${choices}
    tip="Which two pictures to compare" change=${(/** @type {string} */ pair) => {
      if (pair === 'looks') return;
      const [left, right] = /** @type {any} */ (pair.split(' '));
      store.set({ mix: null });
      updateDisplay(store, { left, right, solutionWeights: null, otherWeights: null });
    }} />`;
}
