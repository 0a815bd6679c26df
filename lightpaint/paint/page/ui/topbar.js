/** The bar above the pictures: scene, undo, layout, exposure, view transform and zoom. */

import { html } from '../vendor/preact.js';
import { Button, Checkbox, Choice, Select, Slider, TruncatedText } from './controls.js';
import { signedText } from './format.js';
import { OriginalButton, PreviousButton } from './held_pictures.js';
import { showPixels } from './shortcuts.js';
import { togglePanels, updateDisplay } from './tools.js';
import { t } from '../language/language.js';
import { keyText, shortcutsOf } from './key_bindings.js';

/** @import { App, Ui } from './ui_state.js' */

const LAYOUTS = [
  { value: 'side', label: t('Side by side'), icon: 'side' },
  { value: 'wipe', label: t('Wipe'), icon: 'wipe' },
  { value: 'blink', label: t('Blink'), icon: 'blink' },
  { value: 'inset', label: t('One picture, the other small in a corner'), icon: 'inset' },
];

/** The layouts, with their keys. @param {Ui} ui */
const layoutsOf = (ui) =>
  LAYOUTS.map((choice) => ({
    ...choice,
    keys: shortcutsOf(
      ui,
      'layout',
      ...(['blink', 'inset'].includes(choice.value) ? /** @type {const} */ (['blink']) : []),
    ),
  }));

/** @param {{ui: Ui, app: App}} props */
export function TopBar({ ui, app }) {
  const { store, session } = app;
  const { display, history } = ui;
  const undo = history.undo.at(-1);
  const redo = history.redo.at(-1);
  const title = ui.state?.scene || 'lightpaint';
  return html`<header class="top">
    <div class="title"><${TruncatedText} text=${title} maxLength=${16} tag="strong" /></div>
    <div class="group" role="group" aria-label=${t('History')}>
      <${Button} icon="undo" tip=${undo ? t('Undo: {step}', { step: undo }) : t('Undo')} keys=${shortcutsOf(ui, 'undo')}
        disabled=${!undo} act=${() => session.send('undo')} />
      <${Button} icon="redo" tip=${redo ? t('Redo: {step}', { step: redo }) : t('Redo')} keys=${shortcutsOf(ui, 'redo')}
        disabled=${!redo} act=${() => session.send('redo')} />
      <${PreviousButton} ui=${ui} app=${app} />
      <${OriginalButton} ui=${ui} app=${app} />
    </div>
    <div class="spring"></div>
    <${Choice} label=${t('Layout')} icons value=${display.layout} choices=${layoutsOf(ui)}
      change=${(/** @type {any} */ layout) => updateDisplay(store, { layout })} />
    <${ComparisonChoice} ui=${ui} app=${app} />
    <${Slider} label=${t('Exposure')} value=${display.stops} min=${-6} max=${6} step=${0.1} digits=${1}
      unit=${t('st')} resetValue=${0} keys=${shortcutsOf(ui, 'lowerExposure', 'raiseExposure')} tip=${t('Display exposure. The light does not change.')}
      text=${t('{signed} stops', { signed: signedText(display.stops) })}
      change=${(/** @type {number} */ stops) => updateDisplay(store, { stops })} />
    <${ViewChoice} ui=${ui} app=${app} />
    <${Zoom} ui=${ui} app=${app} />
    <div class="group" role="group" aria-label=${t('Painter')}>
      <${Button} icon="settings" tip=${t('Solve settings')}
        pressed=${ui.panel === 'settings'}
        act=${() => store.set({ panel: ui.panel ? null : 'settings' })} />
      <${Button} icon="export" tip=${t('Export')}
        act=${() => store.set({ dialog: 'export' })} />
      <${Button} icon="keys" tip=${t('Keyboard shortcuts')} keys=${shortcutsOf(ui, 'shortcuts')} act=${() => store.set({ dialog: 'keys' })} />
      <${Button} icon="panel" tip=${t('Show or hide the panels')} keys=${shortcutsOf(ui, 'panels')} pressed=${ui.side || ui.panel !== null}
        act=${() => togglePanels(store)} />
    </div>
  </header>`;
}

/** The size of a picture pixel on the page, or *fit*.
 * @param {{ui: Ui, app: App}} props */
function Zoom({ ui, app }) {
  const { display, fit } = ui;
  const scale = (fit ?? 1) * display.zoom;
  const isFitted = display.zoom === 1 && display.pan.every((x) => x === 0);
  return html`<div class="group" role="group" aria-label=${t('Zoom')}>
    <${Button} label=${isFitted ? t('Fit') : `${Math.round(100 * scale)} %`} class="zoom" keys=${shortcutsOf(ui, 'fit')}
      tip=${t(
        'Fit the whole picture. Zoom with Ctrl and the wheel, or with {zoomIn} and {zoomOut}.',
        { zoomIn: keyText(ui, 'zoomIn'), zoomOut: keyText(ui, 'zoomOut') },
      )}
      act=${() => updateDisplay(app.store, { zoom: 1, pan: [0, 0] })} />
    <${Button} label="1:1" class="zoom pixels" keys=${shortcutsOf(ui, 'pixels')} pressed=${fit !== null && Math.abs(scale - 1) < 1e-3}
      tip=${t('100 %: one image pixel on one pixel of the page')} act=${() => showPixels(app)} />
  </div>`;
}

/** @param {{ui: Ui, app: App}} props */
function ViewChoice({ ui, app }) {
  const { display } = ui;
  if (!ui.ready) return null;
  const names = (ui.state?.transforms ?? []).map((/** @type {any} */ entry) => entry.name ?? entry);
  return html`<${Select} label=${t('View')} hidden value=${display.transform}
    tip=${t('View transform: how the display shows linear light')}
    choices=${names.map((/** @type {string} */ name) => ({ value: name, label: transformLabel(name) }))}
    change=${(/** @type {string} */ transform) => updateDisplay(app.store, { transform })} />
  <${Checkbox} label=${t('Denoise')} checked=${display.clean} tip=${t('Denoise the pictures. The solve does not change.')}
    keys=${shortcutsOf(ui, 'denoise')}
    change=${(/** @type {boolean} */ clean) => updateDisplay(app.store, { clean })} />`;
}

/** @param {string} name */
function transformLabel(name) {
  const labels = /** @type {Record<string, string>} */ ({
    srgb: 'sRGB',
    linear: t('Linear'),
    filmic: t('Filmic'),
    agx: t('AgX'),
  });
  return labels[name] ?? name.replace(/^ocio:/, '').replace('/', ' · ');
}

/** The choice of the two pictures to compare. @param {{ui: Ui, app: App}} props */
function ComparisonChoice({ ui, app }) {
  const { store } = app;
  const { display } = ui;
  const value = ui.mix ? 'looks' : `${display.left} ${display.right}`;
  const choices = [
    { value: 'painting solution', label: t('Painting | Answer') },
    { value: 'present solution', label: t('Now | Answer') },
    { value: 'present painting', label: t('Now | Painting') },
    ...(ui.verification ? [{ value: 'solution verified', label: t('Answer | Render') }] : []),
    ...(ui.mix
      ? [
          {
            value: 'looks',
            label: ui.mix.more
              ? t('{count} looks', { count: 2 + ui.mix.more.length })
              : t('Two looks'),
          },
        ]
      : []),
  ];
  return html`<${Select} label=${t('Compare')} hidden value=${value} choices=${choices}
    tip=${t('Which two pictures to compare')} change=${(/** @type {string} */ pair) => {
      if (pair === 'looks') return;
      const [left, right] = /** @type {any} */ (pair.split(' '));
      store.set({ mix: null });
      updateDisplay(store, { left, right, solutionWeights: null, otherWeights: null });
    }} />`;
}
