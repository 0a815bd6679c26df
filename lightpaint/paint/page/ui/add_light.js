/** Adds a light where the user clicks, or where a search finds that the painting needs it. */

import { html } from '../vendor/preact.js';
import { Button, NumberField, Select } from './controls.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */
/** @typedef {import("./ui_state.js").NewKind} NewKind */

const KINDS = [
  { value: 'spot', label: 'Spot' },
  { value: 'point', label: 'Point' },
  { value: 'panel', label: 'Panel' },
];

/** Where a new light may hang, besides names of rails, surfaces and shapes. */
const CLICK = 'click';
const ANYWHERE = 'anywhere';

/** Largest number of lights that one search on the page adds. */
const MAX_NEW_LIGHTS = 4;

/** @param {{ui: Ui, app: App}} props */
export function AddLight({ ui, app }) {
  const { store, session } = app;
  const { newLight, clickAction, rig } = ui;
  const isClick = newLight.surface === CLICK;
  const isClicking = clickAction?.mode === 'hang';
  const set = (/** @type {Partial<Ui["newLight"]>} */ changes) =>
    store.set({ newLight: { ...newLight, ...changes }, clickAction: null });
  const places = [
    { value: CLICK, label: 'where I click' },
    { value: ANYWHERE, label: 'anywhere free' },
    ...(rig?.surfaces ?? []).map((name) => ({ value: name, label: `on ${name}` })),
  ];
  const addOrSearch = () =>
    isClick
      ? store.set({
          areLampsMarked: true,
          clickAction: isClicking ? null : { mode: 'hang', type: newLight.type },
        })
      : session.findLights(newLight);
  return html`<div class="add-light" role="group" aria-label="Add a light">
    <${Select} label="New light" value=${newLight.type} choices=${KINDS}
      change=${(/** @type {NewKind} */ type) => set({ type })} />
    <${Select} label="It hangs" value=${newLight.surface} choices=${places}
      tip="Click its place, or let a search find the places that come closest to the painting"
      change=${(/** @type {string} */ surface) => set({ surface })} />
    ${
      !isClick &&
      html`<${NumberField} label="At most" value=${newLight.count} min=${1} max=${MAX_NEW_LIGHTS}
        step=${1} digits=${0} change=${(/** @type {number} */ count) => set({ count })} />`
    }
    <${Button} label=${isClick ? 'Add a light' : 'Find places'} icon="plus" pressed=${isClick && isClicking}
      disabled=${ui.placementProgress !== null}
      tip=${
        isClick
          ? 'Then click the surface that it hangs on, or its place in the plan'
          : 'Adds only lights that surely come closer to the painting. One step that undo takes back.'
      } act=${addOrSearch} />
  </div>`;
}
