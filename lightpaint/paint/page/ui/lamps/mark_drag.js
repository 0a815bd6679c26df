/** Drags of the marks of lights. */

import { useEffect, useLayoutEffect, useRef } from '../../vendor/preact.js';

/** @import { App, Pane } from '../ui_state.js' */
/** @import { LightPlace } from '../../engine/messages.js' */
/** @import { LampRequest } from '../lamp_moves.js' */

/** A drag that goes on. x, y: where it began, on the screen. dx, dy: from the mark's middle to there.
 * mark: where the mark belongs.
 * @typedef {{button: HTMLElement, light: number, place: LightPlace, x: number, y: number, dx: number,
 *   dy: number, mark: {x: number, y: number} | null, lastRequest: LampRequest | null}} Drag */

/** CSS pixels that the pointer goes before a press becomes a drag: a hand is never quite still. */
export const DRAG_MIN_PIXELS = 4;

/** A drag of a mark: it requests a place at every move, and keeps the last. The mark itself follows
 * each move at once; what else shows the place is drawn with the answer, since frames of the whole
 * page would take the time of the answers.
 * @param {App} app @param {Pane} pane
 * @param {(x: number, y: number, isShift: boolean, start: {place: LightPlace}) =>
 *   {place: Partial<LightPlace>, aimPixel?: [number, number], mark: {x: number, y: number} | null,
 *    request: LampRequest} | null} resolveDrag from the place of the pointer, in pixels of the picture */
export function useMarkDrag(app, pane, resolveDrag) {
  const current = useRef(/** @type {Drag | null} */ (null));
  const onEscape = useRef(/** @type {() => void} */ (() => {}));
  const wasDragged = useRef(false);
  const inPicture = (/** @type {PointerEvent} */ event) => {
    const { left, top } = app.engine.element.getBoundingClientRect();
    return [
      (event.clientX - left - pane.left) / pane.scale,
      (event.clientY - top - pane.top) / pane.scale,
    ];
  };
  const end = () => {
    onEscape.current();
    if (current.current) current.current.button.style.translate = '';
    current.current = null;
    app.engine.dragLight(null);
    app.store.set({ drag: null });
  };
  useLayoutEffect(() => void (current.current && shiftMark(current.current)));
  // A mark that goes away while it is dragged hears of no end: pictures would stay drafts.
  useEffect(() => () => void (current.current && end()), []);
  const down = (
    /** @type {PointerEvent} */ event,
    /** @type {number} */ light,
    /** @type {LightPlace} */ place,
  ) => {
    if (event.button !== 0) return;
    event.stopPropagation();
    const button = /** @type {HTMLElement} */ (event.currentTarget);
    button.setPointerCapture(event.pointerId);
    const { left, top, width, height } = button.getBoundingClientRect();
    // The mark keeps its offset from the pointer.
    const offset = { dx: event.clientX - left - width / 2, dy: event.clientY - top - height / 2 };
    wasDragged.current = false;
    const start = { x: event.clientX, y: event.clientY };
    current.current = { button, light, place, ...start, ...offset, mark: null, lastRequest: null };
    onEscape.current = endOnEscape(() => {
      if (current.current?.lastRequest) app.session.lampMoves.cancel(light);
      end();
    });
  };
  const move = (/** @type {PointerEvent} */ event) => {
    const drag = current.current;
    if (!drag) return;
    event.stopPropagation();
    const distance = Math.hypot(event.clientX - drag.x, event.clientY - drag.y);
    if (!drag.lastRequest && distance < DRAG_MIN_PIXELS) return;
    const [x, y] = inPicture(event);
    const result = resolveDrag(
      x - drag.dx / pane.scale,
      y - drag.dy / pane.scale,
      event.shiftKey,
      drag,
    );
    if (!result) return;
    wasDragged.current = true;
    drag.mark = result.mark;
    drag.lastRequest = result.request;
    shiftMark(drag);
    app.store.setWithNext({
      drag: { light: drag.light, place: result.place, aimPixel: result.aimPixel },
    });
    app.session.lampMoves.drag(drag.light, result.request, app.engine);
  };
  const up = (/** @type {PointerEvent} */ event) => {
    const drag = current.current;
    if (!drag) return;
    event.stopPropagation();
    if (drag.lastRequest) app.session.lampMoves.queue(drag.light, drag.lastRequest);
    end();
  };
  return { down, move, up, wasDragged };
}

/** Shift a mark from where it is drawn to where it belongs. @param {Drag} drag */
function shiftMark({ button, mark }) {
  if (!mark) return;
  const [left, top] = [button.style.left, button.style.top].map(parseFloat);
  button.style.translate = [mark.x - left, mark.y - top].map((offset) => `${offset}px`).join(' ');
}

/** Call `cancel` once Escape is pressed. @param {() => void} cancel @returns {() => void} to stop it */
export function endOnEscape(cancel) {
  const controller = new AbortController();
  const press = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== 'Escape') return;
    event.preventDefault();
    event.stopPropagation();
    cancel();
  };
  window.addEventListener('keydown', press, { signal: controller.signal, capture: true });
  return () => controller.abort();
}
