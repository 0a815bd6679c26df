/** Sliders under a finger, in lists that scroll: a finger that comes down on one may be about to do
 * either. */

/** Pixels that a finger goes before it is known where to. */
const SURE = 6;

/** Of the mark on a slider, about: its middle does not come nearer to an end than half of this. */
const MARK = 18;

/**
 * A slider that a touch moves only once it goes sideways, or where it taps: one that becomes a
 * scroll changes nothing. What the browser makes of a touch by itself, which begins at once, is not
 * heard; mouse, pen and keys are left to it.
 * @param {HTMLInputElement} input
 * @param {(value: number, done: boolean) => void} move done: false while the finger is down
 * @param {() => void} restore have it show its value again
 * @param {AbortSignal} [signal] ends it
 */
export function slideByTouch(input, move, restore, signal) {
  /** @type {{id: number, x: number, y: number, isSure: boolean} | null} */
  let finger = null;
  // Of a touch comes more when it is over: a change, and what is like a mouse.
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
    input.focus({ preventScroll: true }); // what is typed elsewhere is taken first
    moveTo(event, true);
  });
  listen('pointercancel', (/** @type {PointerEvent} */ event) => {
    if (finger?.id !== event.pointerId) return;
    // What it has moved by then stays where it is.
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
