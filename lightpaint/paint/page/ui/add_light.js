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
const MOST_FOUND = 4;

/** @param {{ui: Ui, app: App}} props */
export function AddLight({ ui, app }) {
  const { store, session } = app;
  const { adding, pointing, rig } = ui;
  const isClick = adding.where === CLICK;
  const isOn = pointing?.mode === 'hang';
  const set = (/** @type {Partial<Ui["adding"]>} */ changed) =>
    store.set({ adding: { ...adding, ...changed }, pointing: null });
  const places = [
    { value: CLICK, label: 'where I click' },
    { value: ANYWHERE, label: 'anywhere free' },
    ...(rig?.surfaces ?? []).map((name) => ({ value: name, label: `on ${name}` })),
  ];
  const act = () =>
    isClick
      ? store.set({ lamps: true, pointing: isOn ? null : { mode: 'hang', type: adding.type } })
      : session.findLights(adding);
  return html`<div class="add-light" role="group" aria-label="Add a light">
    <${Select} label="New light" value=${adding.type} choices=${KINDS}
      change=${(/** @type {NewKind} */ type) => set({ type })} />
    <${Select} label="It hangs" value=${adding.where} choices=${places}
      tip="Click its place, or let a search find the places that come closest to the painting"
      change=${(/** @type {string} */ where) => set({ where })} />
    ${
      !isClick &&
      html`<${NumberField} label="At most" value=${adding.count} least=${1} most=${MOST_FOUND}
        step=${1} digits=${0} change=${(/** @type {number} */ count) => set({ count })} />`
    }
    <${Button} label=${isClick ? 'Add a light' : 'Find places'} icon="plus" on=${isClick && isOn}
      disabled=${ui.placing !== null}
      tip=${
        isClick
          ? 'Then click the surface that it hangs on, or its place in the plan'
          : 'Adds only lights that surely come closer to the painting. One step that undo takes back.'
      } act=${act} />
  </div>`;
}
