/** A button whose effect lasts while it, or the key of its command, is held. */

import { html, useEffect } from '../vendor/preact.js';
import { Icon } from './icons.js';
import { keysOf, shortcutsOf } from './key_bindings.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */

/**
 * The key itself is in the table of shortcuts, which calls `show`; here its release is heard.
 * @param {{ui: Ui, app: App, command: import("./key_bindings.js").Command, icon: string, tip: string,
 *   isHeld: boolean, disabled: boolean, show: (app: App) => void, hide: (app: App) => void}} props
 */
export function HeldButton({ ui, app, command, icon, tip, isHeld, disabled, show, hide }) {
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
