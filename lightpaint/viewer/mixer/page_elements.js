/** Functions with which the mixer and the gallery create page elements. */

/** @template {keyof HTMLElementTagNameMap} T
 * @param {T} tag @param {string} [className] @param {string} [text] */
export function createElement(tag, className = '', text = '') {
  const element = document.createElement(tag);
  if (className) element.className = className;
  element.textContent = text;
  return element;
}

/** @param {string} label @param {number} min @param {number} max */
export function createSlider(label, min, max) {
  const input = createElement('input');
  Object.assign(input, { type: 'range', min, max, step: 'any' });
  input.ariaLabel = label;
  return input;
}

/** Report where on a stage the pointer is dragged.
 * @param {HTMLElement} stage @param {(share: number) => void} report share: of its width, from 0 to 1 */
export function followDrag(stage, report) {
  const reportPlace = (/** @type {PointerEvent} */ event) => {
    const box = stage.getBoundingClientRect();
    report(Math.min(1, Math.max(0, (event.clientX - box.left) / box.width)));
  };
  stage.addEventListener('pointerdown', (event) => {
    if (event.button !== 0) return;
    stage.setPointerCapture(event.pointerId);
    reportPlace(event);
  });
  stage.addEventListener('pointermove', (event) => {
    if (stage.hasPointerCapture(event.pointerId)) reportPlace(event);
  });
}
