/** The panel of the selection: by numbers and from lists, and changes of its edge. */

import { html } from '../../vendor/preact.js';
import { Button, Choice, NumberField, Select, reveal } from '../controls.js';
import { MAX_FEATHER } from './select_options.js';
import { MODES, selectedText, updateSelection } from './selection_settings.js';
import { t } from '../../language/language.js';
import { shortcutsOf } from '../key_bindings.js';

/** @import { App, Ui } from '../ui_state.js' */
/** @import { Change, Part } from '../../engine/selection/selections.js' */
/** @import { SelectionUi, TypedKind } from './selection_settings.js' */

/** @type {{value: TypedKind, label: string}[]} */
const KINDS = [
  { value: 'rectangle', label: t('Rectangle') },
  { value: 'ellipse', label: t('Ellipse') },
  { value: 'object', label: t('Object') },
  { value: 'light', label: t('What a light lights') },
  { value: 'brightness', label: t('Brightness') },
];

const PICTURES = [
  { value: 'painting', label: t('Painting') },
  { value: 'solution', label: t('Answer') },
];

/** @param {{ui: Ui, app: App}} props */
export function SelectionFields({ ui, app }) {
  const { store, engine } = app;
  const { selection } = ui;
  const set = (/** @type {Partial<SelectionUi>} */ changes) => updateSelection(store, changes);
  const part = partOf(ui);
  const change =
    (/** @type {Change} */ made) => () =>
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
    <div class="row" role="group" aria-label=${t('Selection')}>
      <${Button} label=${t('All')} keys=${shortcutsOf(ui, 'selectAll')} act=${() => engine.selections.select({ kind: 'all' })} />
      <${Button} label=${t('None')} keys=${shortcutsOf(ui, 'selectNone')} disabled=${!current} act=${change({ kind: 'none' })} />
      <${Button} label=${t('Invert')} keys=${shortcutsOf(ui, 'invert')} disabled=${!current} act=${change({ kind: 'invert' })} />
      <span class="spring"></span>
      <${Button} label=${t('Tint', { context: 'verb' })} pressed=${selection.show === 'tint'}
        tip=${t('Tint what is not selected, instead of an outline around what is at least half selected')}
        act=${() => set({ show: selection.show === 'tint' ? 'ants' : 'tint' })} />
    </div>
    <div class="row" role="group" aria-label=${t('Its edge')}>
      <${NumberField} label=${t('Edge')} hidden value=${pixels} min=${1} max=${MAX_FEATHER} digits=${0} unit=${t('px')}
        change=${(/** @type {number} */ value) => set({ pixels: value })} />
      <${Button} label=${t('Grow')} disabled=${!current} act=${change({ kind: 'grow', pixels })} />
      <${Button} label=${t('Shrink')} disabled=${!current} act=${change({ kind: 'grow', pixels: -pixels })} />
      <${Button} label=${t('Feather', { context: 'verb' })} disabled=${!current} act=${change({ kind: 'feather', pixels })} />
    </div>
    <${Select} label=${t('Select')} value=${selection.kind} choices=${kinds}
      change=${(/** @type {any} */ kind) => set({ kind })} />
    <${PartFields} ui=${ui} set=${set} />
    <div class="row">
      <${Choice} label=${t('Join')} icons value=${selection.mode} choices=${MODES}
        change=${(/** @type {any} */ mode) => set({ mode })} />
      <${Button} label=${t('Select')} primary disabled=${!part} act=${select} />
    </div>
  </div>`;
}

/** What says which part is meant. @param {{ui: Ui, set: (changes: Partial<SelectionUi>) => void}} props */
function PartFields({ ui, set }) {
  const { selection, lights } = ui;
  const { kind, box, brightness } = selection;
  const [height, width] = ui.state?.size ?? [1, 1];
  if (kind === 'object')
    return html`<${Select} label=${t('Object')} value=${selection.object}
      choices=${namesOf(ui.state?.objects ?? [])} change=${(/** @type {string} */ object) => set({ object })} />`;
  if (kind === 'light')
    return html`<${Select} label=${t('Light')} value=${selection.light}
      choices=${namesOf(lights.map(({ name }) => name))}
      tip=${t('Softly, as much as its light arrives there')} change=${(/** @type {string} */ light) => set({ light })} />`;
  if (kind === 'brightness')
    return html`<${Choice} label=${t('Of the picture')} value=${selection.picture} choices=${PICTURES}
        change=${(/** @type {any} */ picture) => set({ picture })} />
      <div class="row">
        <${NumberField} label=${t('From')} value=${brightness[0]} min=${0} max=${100} digits=${0} unit="%"
          tip=${t('Lightness L* of the picture as it is shown')}
          change=${(/** @type {number} */ low) => set({ brightness: [low, Math.max(low, brightness[1])] })} />
        <${NumberField} label=${t('to')} value=${brightness[1]} min=${0} max=${100} digits=${0} unit="%"
          change=${(/** @type {number} */ high) => set({ brightness: [Math.min(high, brightness[0]), high] })} />
      </div>`;
  const field = (
    /** @type {keyof typeof box} */ key,
    /** @type {string} */ label,
    /** @type {number} */ max,
  ) =>
    html`<${NumberField} label=${label} value=${box[key]} min=${key === 'x' || key === 'y' ? 0 : 1}
      max=${max} digits=${0} unit=${t('px')} change=${(/** @type {number} */ value) => set({ box: { ...box, [key]: value } })} />`;
  return html`<div class="row is-pair">${field('x', t('Left'), width)}${field('y', t('Top'), height)}</div>
    <div class="row is-pair">${field('width', t('Width'), width)}${field('height', t('Height'), height)}</div>`;
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
  return { kind, corners: [[x, y], [x + width, y + height]] };
}

/** @param {string[]} names */
const namesOf = (names) => [
  { value: '', label: t('Choose …') },
  ...[...names].sort((a, b) => a.localeCompare(b)).map((name) => ({ value: name, label: name })),
];
