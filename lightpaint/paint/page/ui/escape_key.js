/** Escape, while something goes on that it cancels. */

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
