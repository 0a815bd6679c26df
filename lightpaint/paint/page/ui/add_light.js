/** Adds a light where the user clicks, or where a search finds that the painting needs it. */

import { html, useEffect, useRef } from '../vendor/preact.js';
import { Button, NumberField, Select } from './controls.js';
import { t } from '../language/language.js';

/** @import { App, NewKind, Ui } from './ui_state.js' */

const KINDS = [
  { value: 'spot', label: t('Spot') },
  { value: 'point', label: t('Point') },
  { value: 'panel', label: t('Panel') },
];

/** Where a new light may hang, besides names of rails, surfaces and shapes. */
export const CLICK = 'click';
export const ANYWHERE = 'anywhere';

/** Largest number of lights that one search on the page adds. */
const MAX_NEW_LIGHTS = 4;

/** @param {{ui: Ui, app: App}} props */
export function AddLight({ ui, app }) {
  const { store, session } = app;
  const { newLight, clickAction, rig, isNewLightSought } = ui;
  const ref = useRef(/** @type {HTMLElement | null} */ (null));
  useEffect(() => {
    if (!isNewLightSought) return;
    ref.current?.scrollIntoView({ block: 'nearest' });
    store.set({ isNewLightSought: false });
  }, [isNewLightSought]);
  const isClick = newLight.surface === CLICK;
  const isClicking = clickAction?.mode === 'hang';
  const set = (/** @type {Partial<Ui["newLight"]>} */ changes) =>
    store.set({ newLight: { ...newLight, ...changes }, clickAction: null });
  const places = [
    { value: CLICK, label: t('where I click') },
    { value: ANYWHERE, label: t('anywhere free') },
    ...(rig?.surfaces ?? []).map((name) => ({ value: name, label: t('on {name}', { name }) })),
  ];
  const addOrSearch = () =>
    isClick
      ? store.set({
          areLampsMarked: true,
          clickAction: isClicking ? null : { mode: 'hang', type: newLight.type },
        })
      : session.findLights(newLight);
  return html`<div class="add-light" ref=${ref} role="group" aria-label=${t('Add a light')}>
    <${Select} label=${t('New light')} value=${newLight.type} choices=${KINDS}
      change=${(/** @type {NewKind} */ type) => set({ type })} />
    <${Select} label=${t('It hangs')} value=${newLight.surface} choices=${places}
      tip=${t('Click its place, or let a search find the places that come closest to the painting')}
      change=${(/** @type {string} */ surface) => set({ surface })} />
    ${
      !isClick &&
      html`<${NumberField} label=${t('At most')} value=${newLight.count} min=${1} max=${MAX_NEW_LIGHTS}
        step=${1} digits=${0} change=${(/** @type {number} */ count) => set({ count })} />`
    }
    <${Button} label=${isClick ? t('Add a light') : t('Find places')} icon="plus" pressed=${isClick && isClicking}
      disabled=${ui.placementProgress !== null}
      tip=${
        isClick
          ? t('Then click the surface that it hangs on, or its place in the plan')
          : t(
              'Adds only lights that surely come closer to the painting. One step that undo takes back.',
            )
      } act=${addOrSearch} />
  </div>`;
}
