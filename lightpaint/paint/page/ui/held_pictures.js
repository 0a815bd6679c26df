/** Pictures that are shown in place of the answer while a button, or the key of its command, is held: the
 * original scene, and the answer before the last step. */

import { html, useEffect } from '../vendor/preact.js';
import { Icon } from './icons.js';
import { keysOf, shortcutsOf } from './key_bindings.js';
import { t } from '../language/language.js';

/** @import { App, DrawnDisplay, RGB, Ui } from './ui_state.js' */

/** The key itself is in the table of shortcuts, which calls `show`; here its release is heard.
 * @param {{ui: Ui, app: App, command: import("./key_bindings.js").Command, icon: string, tip: string,
 *   isHeld: boolean, disabled: boolean, show: (app: App) => void, hide: (app: App) => void}} props */
function HeldButton({ ui, app, command, icon, tip, isHeld, disabled, show, hide }) {
  useEffect(() => {
    const controller = new AbortController();
    // In the capture phase, since the painter stops its key events from leaving it.
    const options = { signal: controller.signal, capture: true };
    const end = () => hide(app);
    const release = (/** @type {KeyboardEvent} */ event) =>
      [keysOf(app.store.value, command).at(-1), ' ', 'enter'].includes(event.key.toLowerCase()) &&
      end();
    window.addEventListener('keyup', release, options);
    // A key or a finger that is lifted in another window sends no event here.
    const leave = (/** @type {Event} */ event) => event.target === window && end();
    window.addEventListener('blur', leave, options);
    window.addEventListener('pointerup', end, options);
    window.addEventListener('pointercancel', end, options);
    return () => controller.abort();
  }, []);
  const press = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== ' ' && event.key !== 'Enter') return;
    event.preventDefault();
    show(app);
  };
  const keys = shortcutsOf(ui, command);
  return html`<button type="button" class=${`button is-icon held ${isHeld ? 'is-on' : ''}`}
    disabled=${disabled} aria-label=${tip} aria-keyshortcuts=${keys} data-tip=${tip} data-keys=${keys}
    onPointerDown=${() => show(app)} onKeyDown=${press}><${Icon} name=${icon} /></button>`;
}

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
