/** Sliders in scrolling lists on touch screens: a finger that comes down on one may scroll or
 * slide. */

/** Pixels that a finger moves before its direction is known. */
const SURE = 6;

/** Approximate width of a slider's thumb: its centre stays half of it away from the ends. */
const MARK = 18;

/**
 * A slider that a touch moves only by a sideways drag or a tap; a scroll changes nothing. The
 * browser's own handling of touch, which begins at once, is suppressed; it keeps mouse, pen and
 * keys.
 * @param {HTMLInputElement} input
 * @param {(value: number, done: boolean) => void} move done: false while the finger is down
 * @param {() => void} restore have it show its value again
 * @param {AbortSignal} [signal] ends it
 */
export function slideByTouch(input, move, restore, signal) {
  /** @type {{id: number, x: number, y: number, isSure: boolean} | null} */
  let finger = null;
  // After a touch the browser also sends a change event and emulated mouse events.
  let isTouched = false;
  const moveTo = (/** @type {PointerEvent} */ event, /** @type {boolean} */ done) => {
    const { left, width } = input.getBoundingClientRect();
    const part = (event.clientX - left - MARK / 2) / (width - MARK);
    const [low, high] = [Number(input.min), Number(input.max)];
    input.value = String(low + Math.min(1, Math.max(0, part)) * (high - low));
    move(Number(input.value), done);
  };
  const listen = (/** @type {string} */ name, /** @type {(event: any) => void} */ handler) =>
    input.addEventListener(name, handler, { capture: true, signal });
  listen('pointerdown', (/** @type {PointerEvent} */ event) => {
    isTouched = event.pointerType === 'touch';
    if (!isTouched || finger || input.disabled) return;
    finger = { id: event.pointerId, x: event.clientX, y: event.clientY, isSure: false };
  });
  listen('pointermove', (/** @type {PointerEvent} */ event) => {
    if (finger?.id !== event.pointerId) return;
    const [across, down] = [event.clientX - finger.x, event.clientY - finger.y].map(Math.abs);
    finger.isSure ||= across >= SURE && across > down;
    if (finger.isSure) moveTo(event, false);
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
    if (finger.isSure) move(Number(input.value), true);
    else restore();
    finger = null;
  });
  listen('keydown', () => (isTouched = false));
  for (const name of ['input', 'change'])
    listen(name, (/** @type {Event} */ event) => {
      if (!isTouched) return;
      event.stopImmediatePropagation();
      if (!finger?.isSure) restore();
    });
  listen('mousedown', (/** @type {Event} */ event) => isTouched && event.preventDefault());
}
