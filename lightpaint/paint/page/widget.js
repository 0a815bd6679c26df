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
  host.open();
  return () => {
    model.off('change:height', size);
    painter.close();
    style.remove();
    frame.remove();
  };
}

const widget = { render };
export { widget as default };
