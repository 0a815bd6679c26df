/** Pointer, wheel and keyboard events on the pictures. */

import { useEffect } from '../vendor/preact.js';
import { pointAway } from './brush_cursor.js';
import { isTyping } from './keyboard.js';
import { pointLamp } from './lamp_fields.js';
import { paneAt } from './pointer_input.js';

/** @typedef {import("./engine_interface.js").Engine} Engine */
/** @typedef {import("./pointer_input.js").Pointer} Pointer */
/** @typedef {import("./ui_state.js").UiStore} UiStore */
/** @typedef {import("./shortcuts.js").App} App */

/** @param {import("../vendor/preact.js").Ref<HTMLElement | null>} frame @param {Pointer} pointer
 * @param {App} app */
export function useStageInput(frame, pointer, app) {
  useEffect(() => {
    const element = frame.current;
    if (!element) return undefined;
    const { store } = app;
    const ends = new AbortController();
    const on = (/** @type {string} */ name, /** @type {(event: any) => void} */ listener) =>
      element.addEventListener(name, listener, { signal: ends.signal, passive: false });
    // The focus outline is for keyboard users only.
    on('pointerdown', (event) => {
      element.dataset.by = 'pointer';
      if (store.value.pointing && event.button === 0 && !pointer.isSpace) {
        event.preventDefault();
        return pointLamp(app, pointer.point(event));
      }
      pointer.down(event);
    });
    on('blur', () => delete element.dataset.by);
    on('pointermove', (event) => pointer.move(event));
    on('pointerup', (event) => pointer.up(event));
    on('pointercancel', (event) => pointer.up(event));
    on('wheel', (event) => pointer.wheel(event));
    on('contextmenu', (event) => event.preventDefault());
    on('pointerleave', () => {
      pointAway(store);
      const rings = /** @type {HTMLElement | null} */ (element.querySelector('.rings'));
      if (rings && !pointer.doing) rings.hidden = true;
    });
    on('keydown', (event) => byKeys(event, pointer, app));
    const pan = (/** @type {boolean} */ isSpace) => {
      pointer.isSpace = isSpace;
      element.classList.toggle('is-panning', isSpace);
    };
    const onSpace = (/** @type {KeyboardEvent} */ event) => {
      const inner = /** @type {HTMLElement} */ (event.composedPath()[0]);
      if (event.code !== 'Space' || isTyping(event)) return;
      const isHere = element.matches(':hover') || inner === element;
      pan(event.type === 'keydown' && isHere);
      if (isHere) event.preventDefault();
    };
    // In the capture phase, since the painter stops its key events from leaving it.
    const early = { signal: ends.signal, capture: true };
    window.addEventListener('keydown', onSpace, early);
    window.addEventListener('keyup', onSpace, early);
    // If the key is released in another window, this one gets no event.
    window.addEventListener('blur', () => pan(false), { signal: ends.signal });
    return () => ends.abort();
  }, []);
}

/** Handle brush keys: arrows move it; Enter paints a dab, with Shift a line, or aims a light.
 * @param {KeyboardEvent} event @param {Pointer} pointer @param {App} app */
function byKeys(event, pointer, app) {
  const { engine, store } = app;
  const way = /** @type {Record<string, [number, number]>} */ ({
    ArrowLeft: [-1, 0],
    ArrowRight: [1, 0],
    ArrowUp: [0, -1],
    ArrowDown: [0, 1],
  })[event.key];
  if ((!way && event.key !== 'Enter') || event.target !== event.currentTarget) return;
  event.preventDefault();
  const element = /** @type {HTMLElement} */ (event.currentTarget);
  const rings = /** @type {HTMLElement} */ (element.querySelector('.rings'));
  const pane = engine.panes()[0];
  const step = event.shiftKey ? 1 : 12;
  rings.hidden = false;
  const x = Number(rings.dataset.x ?? pane.x + pane.width / 2) + (way ? way[0] * step : 0);
  const y = Number(rings.dataset.y ?? pane.y + pane.height / 2) + (way ? way[1] * step : 0);
  pointer.moved(x, y);
  if (event.key === 'Enter' && store.value.pointing) {
    const target = paneAt(engine, x, y);
    pointLamp(
      app,
      target && { x: (x - target.left) / target.scale, y: (y - target.top) / target.scale },
    );
  } else if (event.key === 'Enter') pointer.dab(x, y, event.shiftKey);
}
