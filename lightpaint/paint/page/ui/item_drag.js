/** Dragging an item of a list, by mouse, pen or finger: a press that moves far enough is a drag. */

/** Pixels after which a press is a drag. */
const THRESHOLD = 6;

/** Follow a press on an item of a list. `move` is called while it is dragged, `drop` at its end unless it
 * is cancelled, by Escape too. The item has the class `is-dragged` meanwhile, and `data-drop` marks
 * of the list are removed afterwards.
 * @param {PointerEvent} event the press, on the list
 * @param {HTMLElement} item
 * @param {{move: (event: PointerEvent) => void, drop: (event: PointerEvent) => void}} handlers */
export function dragItem(event, item, { move, drop }) {
  const list = /** @type {HTMLElement} */ (event.currentTarget);
  const ends = new AbortController();
  const { signal } = ends;
  let isDragged = false;
  const finish = (/** @type {PointerEvent | null} */ last) => {
    ends.abort();
    item.classList.remove('is-dragged');
    if (isDragged) {
      // The press that ends a drag does nothing else.
      list.addEventListener('click', (click) => click.stopPropagation(), { capture: true, once: true });
      setTimeout(() => list.dispatchEvent(new Event('click')));
      if (last) drop(last);
    }
    for (const one of list.querySelectorAll('[data-drop]')) one.removeAttribute('data-drop');
  };
  const follow = (/** @type {PointerEvent} */ now) => {
    if (!isDragged && Math.abs(now.clientY - event.clientY) < THRESHOLD) return;
    isDragged = true;
    item.classList.add('is-dragged');
    move(now);
  };
  window.addEventListener('pointermove', follow, { signal });
  window.addEventListener('pointerup', finish, { signal });
  window.addEventListener('pointercancel', () => finish(null), { signal });
  const cancel = (/** @type {KeyboardEvent} */ { key }) => key === 'Escape' && finish(null);
  window.addEventListener('keydown', cancel, { signal, capture: true });
}
