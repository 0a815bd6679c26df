/** The panel of the selection: by numbers and from lists, and changes of its edge. */

import { html } from '../../vendor/preact.js';
import { Button, Choice, NumberField, Select, reveal } from '../controls.js';
import { MAX_FEATHER } from './select_options.js';
import { MODES, selectedText, updateSelection } from './selection_settings.js';
import { words } from '../../language/language.js';
import { shortcutsOf } from '../key_bindings.js';

/** @typedef {import("../ui_state.js").Ui} Ui */
/** @typedef {import("../shortcuts.js").App} App */
/** @typedef {import("./selection_settings.js").Part} Part */
/** @typedef {import("./selection_settings.js").SelectionUi} SelectionUi */

/** @type {{value: import("./selection_settings.js").TypedKind, label: string}[]} */
const KINDS = [
  { value: 'rectangle', label: words.selectionFields.rectangle },
  { value: 'ellipse', label: words.selectionFields.ellipse },
  { value: 'object', label: words.selectionFields.object },
  { value: 'light', label: words.selectionFields.whatALightLights },
  { value: 'brightness', label: words.selectionFields.brightness },
];

const PICTURES = [
  { value: 'painting', label: words.selectionFields.painting },
  { value: 'solution', label: words.selectionFields.answer },
];

/** @param {{ui: Ui, app: App}} props */
export function SelectionFields({ ui, app }) {
  const { store, engine } = app;
  const { selection } = ui;
  const set = (/** @type {Partial<SelectionUi>} */ changes) => updateSelection(store, changes);
  const part = partOf(ui);
  const change =
    (/** @type {import("../../engine/selection/selections.js").Change} */ made) => () =>
      engine.selections.change(made);
  const { pixels, current } = selection;
  const select = () =>
    part && engine.selections.select(part, { mode: selection.mode, feather: selection.feather });
  const kinds = KINDS.filter(({ value }) => value !== 'object' || ui.state?.objects?.length > 0);
  // After a press of a pointer the focus returns to the pictures, for their keys.
  const leave = (/** @type {MouseEvent} */ event) => {
    const button = /** @type {HTMLElement} */ (event.target).closest('button');
    if (event.detail && button) reveal(button, '.stage', true);
  };
  return html`<div class="ask select-panel" data-numbers onClick=${leave}>
    <p role="status">${selectedText(selection)}</p>
    <div class="row" role="group" aria-label=${words.selectionFields.selection}>
      <${Button} label=${words.selectionFields.all} keys=${shortcutsOf(ui, 'selectAll')} act=${() => engine.selections.select({ kind: 'all' })} />
      <${Button} label=${words.selectionFields.none} keys=${shortcutsOf(ui, 'selectNone')} disabled=${!current} act=${change({ kind: 'none' })} />
      <${Button} label=${words.selectionFields.invert} keys=${shortcutsOf(ui, 'invert')} disabled=${!current} act=${change({ kind: 'invert' })} />
      <span class="spring"></span>
      <${Button} label=${words.selectionFields.tint} pressed=${selection.show === 'tint'}
        tip=${words.selectionFields.tintWhatIsNotSelectedInstead}
        act=${() => set({ show: selection.show === 'tint' ? 'ants' : 'tint' })} />
    </div>
    <div class="row" role="group" aria-label=${words.selectionFields.itsEdge}>
      <${NumberField} label=${words.selectionFields.edge} hidden value=${pixels} min=${1} max=${MAX_FEATHER} digits=${0} unit=${words.selectionFields.px}
        change=${(/** @type {number} */ value) => set({ pixels: value })} />
      <${Button} label=${words.selectionFields.grow} disabled=${!current} act=${change({ kind: 'grow', pixels })} />
      <${Button} label=${words.selectionFields.shrink} disabled=${!current} act=${change({ kind: 'grow', pixels: -pixels })} />
      <${Button} label=${words.selectionFields.feather} disabled=${!current} act=${change({ kind: 'feather', pixels })} />
    </div>
    <${Select} label=${words.selectionFields.select} value=${selection.kind} choices=${kinds}
      change=${(/** @type {any} */ kind) => set({ kind })} />
    <${PartFields} ui=${ui} set=${set} />
    <div class="row">
      <${Choice} label=${words.selectionFields.join} icons value=${selection.mode} choices=${MODES}
        change=${(/** @type {any} */ mode) => set({ mode })} />
      <${Button} label=${words.selectionFields.select} primary disabled=${!part} act=${select} />
    </div>
  </div>`;
}

/** What says which part is meant. @param {{ui: Ui, set: (changes: Partial<SelectionUi>) => void}} props */
function PartFields({ ui, set }) {
  const { selection, lights } = ui;
  const { kind, box, brightness } = selection;
  const [height, width] = ui.state?.size ?? [1, 1];
  if (kind === 'object')
    return html`<${Select} label=${words.selectionFields.object} value=${selection.object}
      choices=${namesOf(ui.state?.objects ?? [])} change=${(/** @type {string} */ object) => set({ object })} />`;
  if (kind === 'light')
    return html`<${Select} label=${words.selectionFields.light} value=${selection.light}
      choices=${namesOf(lights.map(({ name }) => name))}
      tip=${words.selectionFields.softlyAsMuchAsItsLight} change=${(/** @type {string} */ light) => set({ light })} />`;
  if (kind === 'brightness')
    return html`<${Choice} label=${words.selectionFields.ofThePicture} value=${selection.picture} choices=${PICTURES}
        change=${(/** @type {any} */ picture) => set({ picture })} />
      <div class="row">
        <${NumberField} label=${words.selectionFields.from} value=${brightness[0]} min=${0} max=${100} digits=${0} unit="%"
          tip=${words.selectionFields.lightnessLOfThePictureAs}
          change=${(/** @type {number} */ low) => set({ brightness: [low, Math.max(low, brightness[1])] })} />
        <${NumberField} label=${words.selectionFields.to} value=${brightness[1]} min=${0} max=${100} digits=${0} unit="%"
          change=${(/** @type {number} */ high) => set({ brightness: [Math.min(high, brightness[0]), high] })} />
      </div>`;
  const field = (
    /** @type {keyof typeof box} */ key,
    /** @type {string} */ label,
    /** @type {number} */ max,
  ) =>
    html`<${NumberField} label=${label} value=${box[key]} min=${key === 'x' || key === 'y' ? 0 : 1}
      max=${max} digits=${0} unit=${words.selectionFields.px} change=${(/** @type {number} */ value) => set({ box: { ...box, [key]: value } })} />`;
  return html`<div class="row is-pair">${field('x', words.selectionFields.left, width)}${field('y', words.selectionFields.top, height)}</div>
    <div class="row is-pair">${field('width', words.selectionFields.width, width)}${field('height', words.selectionFields.height, height)}</div>`;
}

/** Return the part that the panel describes; null while something is missing. @param {Ui} ui
 * @returns {Part | null} */
function partOf({ selection, state, lights }) {
  const { kind, box, picture, brightness } = selection;
  if (kind === 'object') {
    const object = (state?.objects ?? []).indexOf(selection.object);
    return object < 0 ? null : { kind, object };
  }
  if (kind === 'light') {
    const light = lights.findIndex(({ name }) => name === selection.light);
    return light < 0 ? null : { kind, light };
  }
  if (kind === 'brightness') return { kind, picture, low: brightness[0], high: brightness[1] };
  const { x, y, width, height } = box;
  return {
    kind,
    corners: [
      [x, y],
      [x + width, y + height],
    ],
  };
}

/** @param {string[]} names */
const namesOf = (names) => [
  { value: '', label: words.selectionFields.choose },
  ...[...names].sort((a, b) => a.localeCompare(b)).map((name) => ({ value: name, label: name })),
];
