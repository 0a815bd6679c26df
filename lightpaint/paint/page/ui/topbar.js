/** Above the pictures: what is open, undo, how the pictures are looked at. */

import { html } from '../vendor/preact.js';
import { Button, Check, Choice, Select, Slider, Whole } from './controls.js';
import { signed } from './format.js';
import { showPixels } from './shortcuts.js';
import { fold, look } from './tools.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").Hands} Hands */

const LAYOUTS = [
  { value: 'side', label: 'Side by side', icon: 'side', keys: 'V' },
  { value: 'wipe', label: 'Wipe', icon: 'wipe', keys: 'V' },
  { value: 'blink', label: 'Blink', icon: 'blink', keys: 'V' },
];

/** @param {{ui: Ui, hands: Hands}} props */
export function TopBar({ ui, hands }) {
  const { store, session } = hands;
  const { show, history } = ui;
  const undo = history.undo.at(-1);
  const redo = history.redo.at(-1);
  const title = ui.state?.scene || 'lightpaint';
  return html`<header class="top">
    <div class="title"><${Whole} text=${title} most=${16} tag="strong" /></div>
    <div class="group" role="group" aria-label="History">
      <${Button} icon="undo" tip=${undo ? `Undo: ${undo}` : 'Undo'} keys="Control+Z"
        disabled=${!undo} act=${() => session.send('undo')} />
      <${Button} icon="redo" tip=${redo ? `Redo: ${redo}` : 'Redo'} keys="Control+Shift+Z"
        disabled=${!redo} act=${() => session.send('redo')} />
    </div>
    <div class="spring"></div>
    <${Choice} label="Layout" icons value=${show.layout} choices=${LAYOUTS}
      change=${(/** @type {any} */ layout) => look(store, { layout })} />
    <${Compare} ui=${ui} hands=${hands} />
    <${Slider} label="Exposure" value=${show.stops} least=${-6} most=${6} step=${0.1} digits=${1}
      unit="st" rest=${0} keys=", ." tip="Display exposure. The light does not change."
      text=${`${signed(show.stops)} stops`}
      change=${(/** @type {number} */ stops) => look(store, { stops })} />
    <${ViewChoice} ui=${ui} hands=${hands} />
    <${Zoom} ui=${ui} hands=${hands} />
    <div class="group" role="group" aria-label="Painter">
      <${Button} icon="settings" tip="Solve settings"
        on=${ui.panel === 'settings'}
        act=${() => store.set({ panel: ui.panel ? null : 'settings' })} />
      <${Button} icon="export" tip="Export"
        act=${() => store.set({ dialog: 'export' })} />
      <${Button} icon="keys" tip="Keyboard shortcuts" keys="?" act=${() => store.set({ dialog: 'keys' })} />
      <${Button} icon="panel" tip="Show or hide the panels" keys="P" on=${ui.side || ui.panel !== null}
        act=${() => fold(store)} />
    </div>
  </header>`;
}

/** How large a pixel of the picture is on the page, unless all of it is fitted in.
 * @param {{ui: Ui, hands: Hands}} props */
function Zoom({ ui: { show, fit }, hands }) {
  const scale = (fit ?? 1) * show.zoom;
  const isFitted = show.zoom === 1 && show.pan.every((x) => x === 0);
  return html`<div class="group" role="group" aria-label="Zoom">
    <${Button} label=${isFitted ? 'Fit' : `${Math.round(100 * scale)} %`} class="zoom" keys="F"
      tip="Fit the whole picture. Zoom with Ctrl and the wheel, or with + and −."
      act=${() => look(hands.store, { zoom: 1, pan: [0, 0] })} />
    <${Button} label="1:1" class="zoom pixels" keys="Shift+F" on=${Math.abs(scale - 1) < 1e-3}
      tip="100 %: one image pixel on one pixel of the page" act=${() => showPixels(hands)} />
  </div>`;
}

/** @param {{ui: Ui, hands: Hands}} props */
function ViewChoice({ ui, hands }) {
  const { show } = ui;
  if (!ui.ready) return null;
  const names = (ui.state?.transforms ?? []).map((/** @type {any} */ one) => one.name ?? one);
  return html`<${Select} label="View" hidden value=${show.transform}
    tip="View transform: how the display shows linear light"
    choices=${names.map((/** @type {string} */ name) => ({ value: name, label: spoken(name) }))}
    change=${(/** @type {string} */ transform) => look(hands.store, { transform })} />
  <${Check} label="Denoise" on=${show.clean} tip="Denoise the pictures (C). The solve does not change."
    change=${(/** @type {boolean} */ clean) => look(hands.store, { clean })} />`;
}

/** @param {string} name */
function spoken(name) {
  const known = /** @type {Record<string, string>} */ ({
    srgb: 'sRGB',
    linear: 'Linear',
    filmic: 'Filmic',
    agx: 'AgX',
  });
  return known[name] ?? name.replace(/^ocio:/, '').replace('/', ' · ');
}

/** Which two pictures are compared. @param {{ui: Ui, hands: Hands}} props */
function Compare({ ui, hands }) {
  const { store } = hands;
  const { show } = ui;
  const value = ui.mix ? 'looks' : `${show.left} ${show.right}`;
  const choices = [
    { value: 'painting solution', label: 'Painting | Answer' },
    { value: 'present solution', label: 'Now | Answer' },
    { value: 'present painting', label: 'Now | Painting' },
    ...(ui.verified ? [{ value: 'solution verified', label: 'Answer | Render' }] : []),
    ...(ui.mix ? [{ value: 'looks', label: 'Two looks' }] : []),
  ];
  return html`<${Select} label="Compare" hidden value=${value} choices=${choices}
    tip="Which two pictures to compare" change=${(/** @type {string} */ pair) => {
      if (pair === 'looks') return;
      const [left, right] = /** @type {any} */ (pair.split(' '));
      store.set({ mix: null });
      look(store, { left, right, instead: null, other: null });
    }} />`;
}
