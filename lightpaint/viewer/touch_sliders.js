/** Sliders in scrolling lists on touch screens: a finger that comes down on one may scroll or
 * slide. */

/** Pixels that a finger moves before its direction is known. */
const MIN_DRAG_PIXELS = 6;

/** Approximate width of a slider's thumb: its centre stays half of it away from the ends. */
const THUMB_PIXELS = 18;

/** A slider that a touch moves only by a sideways drag or a tap; a scroll changes nothing. The
 * browser's own handling of touch, which begins at once, is suppressed; it keeps mouse, pen and
 * keys.
 * @param {HTMLInputElement} input
 * @param {(value: number, isFinal: boolean) => void} move done: false while the finger is down
 * @param {() => void} restore have it show its value again
 * @param {AbortSignal} [signal] ends it */
export function slideByTouch(input, move, restore, signal) {
  /** @type {{id: number, x: number, y: number, isSliding: boolean} | null} */
  let finger = null;
  // After a touch the browser also sends a change event and emulated mouse events.
  let isTouched = false;
  const moveTo = (/** @type {PointerEvent} */ event, /** @type {boolean} */ isFinal) => {
    const { left, width } = input.getBoundingClientRect();
    const share = (event.clientX - left - THUMB_PIXELS / 2) / (width - THUMB_PIXELS);
    const [low, high] = [Number(input.min), Number(input.max)];
    input.value = String(low + Math.min(1, Math.max(0, share)) * (high - low));
    move(Number(input.value), isFinal);
  };
  const listen = (/** @type {string} */ name, /** @type {(event: any) => void} */ handler) =>
    input.addEventListener(name, handler, { capture: true, signal });
  listen('pointerdown', (/** @type {PointerEvent} */ event) => {
    isTouched = event.pointerType === 'touch';
    if (!isTouched || finger || input.disabled) return;
    finger = { id: event.pointerId, x: event.clientX, y: event.clientY, isSliding: false };
  });
  listen('pointermove', (/** @type {PointerEvent} */ event) => {
    if (finger?.id !== event.pointerId) return;
    const [dx, dy] = [event.clientX - finger.x, event.clientY - finger.y].map(Math.abs);
    finger.isSliding ||= dx >= MIN_DRAG_PIXELS && dx > dy;
    if (finger.isSliding) moveTo(event, false);
  });
  listen('pointerup', (/** @type {PointerEvent} */ event) => {
    if (finger?.id !== event.pointerId) return;
    finger = null;
    input.focus({ preventScroll: true }); // text typed elsewhere is committed first
    moveTo(event, true);
  });
  listen('pointercancel', (/** @type {PointerEvent} */ event) => {
    if (finger?.id !== event.pointerId) return;
    // The movement so far stays.
    if (finger.isSliding) move(Number(input.value), true);
    else restore();
    finger = null;
  });
  listen('keydown', () => (isTouched = false));
  for (const name of ['input', 'change'])
    listen(name, (/** @type {Event} */ event) => {
      if (!isTouched) return;
      event.stopImmediatePropagation();
      if (!finger?.isSliding) restore();
    });
  listen('mousedown', (/** @type {Event} */ event) => isTouched && event.preventDefault());
}
