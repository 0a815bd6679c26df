/** The bar above the pictures: scene, undo, layout, exposure, view transform and zoom. */

import { html } from '../vendor/preact.js';
import { Button, Checkbox, Choice, Select, Slider, TruncatedText } from './controls.js';
import { signedText } from './format.js';
import { OriginalButton } from './original_scene.js';
import { PreviousButton } from './previous_answer.js';
import { showPixels } from './shortcuts.js';
import { togglePanels, updateDisplay } from './tools.js';
import { fill, words } from '../language/language.js';
import { keyText, shortcutsOf } from './key_bindings.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */

const LAYOUTS = [
  { value: 'side', label: words.topbar.sideBySide, icon: 'side' },
  { value: 'wipe', label: words.topbar.wipe, icon: 'wipe' },
  { value: 'blink', label: words.topbar.blink, icon: 'blink' },
  { value: 'inset', label: words.topbar.inset, icon: 'inset' },
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
    <div class="group" role="group" aria-label=${words.topbar.history}>
      <${Button} icon="undo" tip=${undo ? fill(words.topbar.undo, { undo }) : words.topbar.undoNothing} keys=${shortcutsOf(ui, 'undo')}
        disabled=${!undo} act=${() => session.send('undo')} />
      <${Button} icon="redo" tip=${redo ? fill(words.topbar.redo, { redo }) : words.topbar.redoNothing} keys=${shortcutsOf(ui, 'redo')}
        disabled=${!redo} act=${() => session.send('redo')} />
      <${PreviousButton} ui=${ui} app=${app} />
      <${OriginalButton} ui=${ui} app=${app} />
    </div>
    <div class="spring"></div>
    <${Choice} label=${words.topbar.layout} icons value=${display.layout} choices=${layoutsOf(ui)}
      change=${(/** @type {any} */ layout) => updateDisplay(store, { layout })} />
    <${ComparisonChoice} ui=${ui} app=${app} />
    <${Slider} label=${words.topbar.exposure} value=${display.stops} min=${-6} max=${6} step=${0.1} digits=${1}
      unit=${words.topbar.st} resetValue=${0} keys=${shortcutsOf(ui, 'lowerExposure', 'raiseExposure')} tip=${words.topbar.displayExposureTheLightDoesNot}
      text=${fill(words.topbar.stops, { signed: signedText(display.stops) })}
      change=${(/** @type {number} */ stops) => updateDisplay(store, { stops })} />
    <${ViewChoice} ui=${ui} app=${app} />
    <${Zoom} ui=${ui} app=${app} />
    <div class="group" role="group" aria-label=${words.topbar.painter}>
      <${Button} icon="settings" tip=${words.topbar.solveSettings}
        pressed=${ui.panel === 'settings'}
        act=${() => store.set({ panel: ui.panel ? null : 'settings' })} />
      <${Button} icon="export" tip=${words.topbar.export}
        act=${() => store.set({ dialog: 'export' })} />
      <${Button} icon="keys" tip=${words.topbar.keyboardShortcuts} keys=${shortcutsOf(ui, 'shortcuts')} act=${() => store.set({ dialog: 'keys' })} />
      <${Button} icon="panel" tip=${words.topbar.showOrHideThePanels} keys=${shortcutsOf(ui, 'panels')} pressed=${ui.side || ui.panel !== null}
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
  return html`<div class="group" role="group" aria-label=${words.topbar.zoom}>
    <${Button} label=${isFitted ? words.topbar.fit : `${Math.round(100 * scale)} %`} class="zoom" keys=${shortcutsOf(ui, 'fit')}
      tip=${fill(words.topbar.fitTheWholePictureZoomWith, { zoomIn: keyText(ui, 'zoomIn'), zoomOut: keyText(ui, 'zoomOut') })}
      act=${() => updateDisplay(app.store, { zoom: 1, pan: [0, 0] })} />
    <${Button} label="1:1" class="zoom pixels" keys=${shortcutsOf(ui, 'pixels')} pressed=${fit !== null && Math.abs(scale - 1) < 1e-3}
      tip=${words.topbar.n100OneImagePixelOnOne} act=${() => showPixels(app)} />
  </div>`;
}

/** @param {{ui: Ui, app: App}} props */
function ViewChoice({ ui, app }) {
  const { display } = ui;
  if (!ui.ready) return null;
  const names = (ui.state?.transforms ?? []).map((/** @type {any} */ entry) => entry.name ?? entry);
  return html`<${Select} label=${words.topbar.view} hidden value=${display.transform}
    tip=${words.topbar.viewTransformHowTheDisplayShows}
    choices=${names.map((/** @type {string} */ name) => ({ value: name, label: transformLabel(name) }))}
    change=${(/** @type {string} */ transform) => updateDisplay(app.store, { transform })} />
  <${Checkbox} label=${words.topbar.denoise} checked=${display.clean} tip=${words.topbar.denoiseThePictures}
    keys=${shortcutsOf(ui, 'denoise')}
    change=${(/** @type {boolean} */ clean) => updateDisplay(app.store, { clean })} />`;
}

/** @param {string} name */
function transformLabel(name) {
  const labels = /** @type {Record<string, string>} */ ({
    srgb: 'sRGB',
    linear: words.topbar.linear,
    filmic: words.topbar.filmic,
    agx: words.topbar.agx,
  });
  return labels[name] ?? name.replace(/^ocio:/, '').replace('/', ' · ');
}

/** The choice of the two pictures to compare. @param {{ui: Ui, app: App}} props */
function ComparisonChoice({ ui, app }) {
  const { store } = app;
  const { display } = ui;
  const value = ui.mix ? 'looks' : `${display.left} ${display.right}`;
  const choices = [
    { value: 'painting solution', label: words.topbar.paintingAnswer },
    { value: 'present solution', label: words.topbar.nowAnswer },
    { value: 'present painting', label: words.topbar.nowPainting },
    ...(ui.verification ? [{ value: 'solution verified', label: words.topbar.answerRender }] : []),
    ...(ui.mix
      ? [
          {
            value: 'looks',
            label: ui.mix.more
              ? fill(words.topbar.looks, { count: 2 + ui.mix.more.length })
              : words.topbar.twoLooks,
          },
        ]
      : []),
  ];
  return html`<${Select} label=${words.topbar.compare} hidden value=${value} choices=${choices}
    tip=${words.topbar.whichTwoPicturesToCompare} change=${(/** @type {string} */ pair) => {
      if (pair === 'looks') return;
      const [left, right] = /** @type {any} */ (pair.split(' '));
      store.set({ mix: null });
      updateDisplay(store, { left, right, solutionWeights: null, otherWeights: null });
    }} />`;
}
