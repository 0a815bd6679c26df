/** The views of a session: which one is seen and painted. One lighting is for all of them. */

import { inView } from '../engine/message_frames.js';
import { html } from '../vendor/preact.js';
import { number } from './format.js';
import { viewOf } from './state_updates.js';
import { Thumb } from './thumbnail.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").Hands} Hands */

/** Show another view. @param {Hands} hands @param {number} view */
export function see({ store, engine }, view) {
  if (!store.value.ready || view === store.value.view) return;
  engine.see(view);
  store.set((ui) => viewOf(ui, view));
}

/** The one after it. @param {Hands} hands */
export function seeNext(hands) {
  const { views, view } = hands.store.value;
  if (views.length > 1) see(hands, (view + 1) % views.length);
}

/** @param {{ui: Ui, hands: Hands}} props */
export function Views({ ui, hands }) {
  if (ui.views.length < 2) return null;
  return html`<div class="views" role="group" aria-label="Views">
    ${ui.views.map(({ name }, k) => {
      const picture = inView('look', k);
      const its = ui.ofViews?.[k];
      const about = its ? `ΔE ${number(its.delta_e, 2)}` : ui.ofViews && 'not painted';
      return html`<button type="button" class=${`view-tab ${k === ui.view ? 'is-on' : ''}`}
        key=${name} aria-pressed=${String(k === ui.view)} data-tip=${`Show and paint ${name}`}
        data-keys="N" onClick=${() => see(hands, k)}>
        <${Thumb} name=${picture} generation=${ui.resources[picture]} hands=${hands} />
        <span class="view-name">${name}</span>
        <span class="faint">${about}</span>
      </button>`;
    })}
  </div>`;
}
