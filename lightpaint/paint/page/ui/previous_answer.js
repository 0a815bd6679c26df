/** The answer before the last step, shown in place of the answer while a key or a button is held. */

import { html, useEffect } from '../vendor/preact.js';
import { Icon } from './icons.js';
import { keysOf, shortcutsOf } from './key_bindings.js';
import { words } from '../language/language.js';

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
export function hidePrevious({ store }) {
  if (store.value.isPreviousHeld) store.set({ isPreviousHeld: false, previousWeights: null });
}

/** @param {{ui: Ui, app: App}} props */
export function PreviousButton({ ui, app }) {
  const hide = () => hidePrevious(app);
  useEffect(() => {
    const controller = new AbortController();
    // In the capture phase, since the painter stops its key events from leaving it.
    const options = { signal: controller.signal, capture: true };
    const release = (/** @type {KeyboardEvent} */ event) =>
      [keysOf(app.store.value, 'previous').at(-1), ' ', 'enter'].includes(
        event.key.toLowerCase(),
      ) && hide();
    window.addEventListener('keyup', release, options);
    // A key or a finger that is lifted in another window sends no event here.
    const leave = (/** @type {Event} */ event) => event.target === window && hide();
    window.addEventListener('blur', leave, options);
    window.addEventListener('pointerup', hide, options);
    window.addEventListener('pointercancel', hide, options);
    return () => controller.abort();
  }, []);
  const press = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== ' ' && event.key !== 'Enter') return;
    event.preventDefault();
    void showPrevious(app);
  };
  const keys = shortcutsOf(ui, 'previous');
  return html`<button type="button" class=${`button is-icon previous ${ui.isPreviousHeld ? 'is-on' : ''}`}
    disabled=${!ui.history.undo.length} aria-label=${words.previousAnswer.holdTheAnswerBeforeTheLast}
    aria-keyshortcuts=${keys} data-tip=${words.previousAnswer.holdTheAnswerBeforeTheLast} data-keys=${keys}
    onPointerDown=${() => showPrevious(app)} onKeyDown=${press}><${Icon} name="previous" /></button>`;
}
