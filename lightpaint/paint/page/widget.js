/** The painter in a notebook: the same page, over the model of an anywidget. */
import { mount } from './app.js';
import { openEngine } from './engine/picture_engine.js';
import { ModelHost } from './engine/notebook_host.js';

/** Called by anywidget for each view of the model; returns a function that closes the view.
 * @param {{model: import("./engine/notebook_host.js").Model, el: HTMLElement}} notebook */
async function render({ model, el }) {
  const style = document.createElement('style');
  style.textContent = String(model.get('_sheet'));
  const frame = document.createElement('div');
  const size = () => (frame.style.height = `${Number(model.get('height'))}px`);
  size();
  model.on('change:height', size);
  // Styles go inside the element, since some notebooks render it in a shadow root.
  el.append(style, frame);
  const host = new ModelHost(model);
  const engine = openEngine(host);
  const painter = await mount(frame, host, { engine, isGuided: !navigator.webdriver });
  const turn = takeTurns(frame, String(model.get('_saved_view')));
  host.on('state', () => turn(true));
  // A painter that a page restores without its kernel is never answered.
  host.on('silence', ({ isSilent }) => {
    if (isSilent && !host.isAnswered) turn(false);
  });
  host.open();
  return () => {
    model.off('change:height', size);
    painter.close();
    turn(false);
    style.remove();
    frame.remove();
  };
}

/** Return a function that shows the painter or the saved view, which other outputs of the notebook
 * hold.
 * @param {HTMLElement} frame @param {string} savedView */
function takeTurns(frame, savedView) {
  const hiding = document.createElement('style');
  hiding.textContent = `[data-painter="${savedView}"] { display: none !important }`;
  return (/** @type {boolean} */ isAnswered) => {
    const hasSavedView = document.querySelector(`[data-painter="${savedView}"]`) !== null;
    frame.classList.toggle('is-unanswered', !isAnswered && hasSavedView);
    frame.hidden = !isAnswered && hasSavedView;
    if (isAnswered) document.head.append(hiding);
    else hiding.remove();
  };
}

const widget = { render };
export { widget as default };
