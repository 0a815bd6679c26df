/** The scene before anything was painted, shown in place of the answer while a key or a button is
 * held. */

import { html } from '../vendor/preact.js';
import { HeldButton } from './held_button.js';
import { t } from '../language/language.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./engine_interface.js").DrawnDisplay} DrawnDisplay */
/** @typedef {import("./shortcuts.js").App} App */

/** @param {App} app */
export function showOriginal({ store }) {
  if (store.value.ready && !store.value.mix?.more) store.set({ isOriginalHeld: true });
}

/** @param {App} app */
function hideOriginal({ store }) {
  if (store.value.isOriginalHeld) store.set({ isOriginalHeld: false });
}

/** Return a display with the original scene where it has the answer or a look. In blink, which has
 * one of two pictures, it is the one that is seen.
 * @param {DrawnDisplay} display @returns {DrawnDisplay} */
export function withOriginal(display) {
  const kinds = [display.left, display.right];
  const index = kinds.findIndex((kind) => kind !== 'painting' && kind !== 'present');
  const [left, right] = kinds.map((kind, k) => (k === index ? 'present' : kind));
  return { ...display, left, right, blink: left === 'present' ? 'left' : 'right' };
}

/** @param {{ui: Ui, app: App}} props */
export function OriginalButton({ ui, app }) {
  return html`<${HeldButton} ui=${ui} app=${app} command="original" icon="original"
    tip=${t('Hold: the original scene, in place of the answer')} isHeld=${ui.isOriginalHeld} disabled=${!ui.ready || Boolean(ui.mix?.more)}
    show=${showOriginal} hide=${hideOriginal} />`;
}
