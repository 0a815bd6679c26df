/** Pointer, wheel and keyboard events on the pictures. */

import { useEffect } from '../vendor/preact.js';
import { clearProbe } from './brush_cursor.js';
import { isTyping } from './keyboard.js';
import { pointLamp } from './lamp_fields.js';
import { paneAt } from './pointer_input.js';
import { ARROW_STEPS } from './key_bindings.js';

/** @import { App } from './ui_state.js' */
/** @import { Pointer } from './pointer_input.js' */

/** @param {import("../vendor/preact.js").Ref<HTMLElement | null>} frame @param {Pointer} pointer
 * @param {App} app */
export function useStageInput(frame, pointer, app) {
  useEffect(() => {
    const element = frame.current;
    if (!element) return undefined;
    const { store } = app;
    const controller = new AbortController();
    const listen = (/** @type {string} */ name, /** @type {(event: any) => void} */ listener) =>
      element.addEventListener(name, listener, { signal: controller.signal, passive: false });
    // The focus outline is for keyboard users only.
    listen('pointerdown', (event) => {
      element.dataset.by = 'pointer';
      if (store.value.clickAction && event.button === 0 && !pointer.isSpaceDown) {
        event.preventDefault();
        return pointLamp(app, pointer.point(event));
      }
      pointer.down(event);
    });
    listen('blur', () => delete element.dataset.by);
    listen('pointermove', (event) => {
      if (element.dataset.by === 'keys') delete element.dataset.by;
      pointer.move(event);
    });
    // On pages from this machine, or over HTTPS, in browsers that have it.
    listen('pointerrawupdate', (event) => pointer.moveEarly(event));
    listen('pointerup', (event) => pointer.up(event));
    listen('pointercancel', (event) => pointer.up(event));
    listen('wheel', (event) => pointer.wheel(event));
    listen('contextmenu', (event) => event.preventDefault());
    listen('pointerleave', () => {
      clearProbe(store);
      const rings = /** @type {HTMLElement | null} */ (element.querySelector('.rings'));
      if (rings && !pointer.gesture) rings.hidden = true;
    });
    listen('keydown', (event) => handleBrushKey(event, pointer, app));
    const pan = (/** @type {boolean} */ isSpace) => {
      pointer.isSpaceDown = isSpace;
      element.classList.toggle('is-panning', isSpace);
    };
    const handleSpace = (/** @type {KeyboardEvent} */ event) => {
      const source = /** @type {HTMLElement} */ (event.composedPath()[0]);
      if (event.code !== 'Space' || isTyping(event)) return;
      const isOnStage = element.matches(':hover') || source === element;
      pan(event.type === 'keydown' && isOnStage);
      if (isOnStage) event.preventDefault();
    };
    // In the capture phase, since the painter stops its key events from leaving it.
    const captureOptions = { signal: controller.signal, capture: true };
    window.addEventListener('keydown', handleSpace, captureOptions);
    window.addEventListener('keyup', handleSpace, captureOptions);
    // If the key is released in another window, this one gets no event.
    window.addEventListener('blur', () => pan(false), { signal: controller.signal });
    return () => controller.abort();
  }, []);
}

/** Handle brush keys: arrows move it; Enter paints a dab, with Shift a line, or aims a light.
 * @param {KeyboardEvent} event @param {Pointer} pointer @param {App} app */
function handleBrushKey(event, pointer, app) {
  const { engine, store } = app;
  const direction = ARROW_STEPS[event.key];
  if ((!direction && event.key !== 'Enter') || event.target !== event.currentTarget) return;
  event.preventDefault();
  const element = /** @type {HTMLElement} */ (event.currentTarget);
  const rings = /** @type {HTMLElement} */ (element.querySelector('.rings'));
  const pane = engine.panes()[0];
  const step = event.shiftKey ? 1 : 12;
  rings.hidden = false;
  element.dataset.by = 'keys';
  const x =
    Number(rings.dataset.x ?? pane.x + pane.width / 2) + (direction ? direction[0] * step : 0);
  const y =
    Number(rings.dataset.y ?? pane.y + pane.height / 2) + (direction ? direction[1] * step : 0);
  pointer.onMove(x, y);
  if (event.key === 'Enter' && store.value.clickAction) {
    const target = paneAt(engine, x, y);
    pointLamp(
      app,
      target && { x: (x - target.left) / target.scale, y: (y - target.top) / target.scale },
    );
  } else if (event.key === 'Enter') pointer.dab(x, y, event.shiftKey);
}
