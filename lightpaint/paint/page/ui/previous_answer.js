/** The answer before the last step, shown in place of the answer while a key or a button is held. */

import { html } from '../vendor/preact.js';
import { HeldButton } from './held_button.js';
import { t } from '../language/language.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./engine_interface.js").RGB} RGB */
/** @typedef {import("./shortcuts.js").App} App */

/** @param {App} app */
export async function showPrevious({ store, session }) {
  if (store.value.isPreviousHeld || !store.value.history.undo.length) return;
  store.set({ isPreviousHeld: true });
  const reply = await session.send('show_previous');
  const data = reply?.kind === 'previous' && reply.arrays?.weights.data;
  if (!data || !store.value.isPreviousHeld) return;
  const previousWeights = store.value.lights.map((_, k) => {
    const [r, g, b] = data.slice(3 * k, 3 * k + 3);
    return /** @type {RGB} */ ([r, g, b]);
  });
  store.set({ previousWeights });
}

/** @param {App} app */
function hidePrevious({ store }) {
  if (store.value.isPreviousHeld) store.set({ isPreviousHeld: false, previousWeights: null });
}

/** @param {{ui: Ui, app: App}} props */
export function PreviousButton({ ui, app }) {
  return html`<${HeldButton} ui=${ui} app=${app} command="previous" icon="previous"
    tip=${t('Hold: the answer before the last step')} isHeld=${ui.isPreviousHeld}
    disabled=${!ui.history.undo.length} show=${showPrevious} hide=${hidePrevious} />`;
}
