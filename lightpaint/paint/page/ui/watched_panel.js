/** Panels that render again only when state that they read has changed. */

import { Component, html } from '../vendor/preact.js';

/** @import { Ui } from './ui_state.js' */
/** @typedef {{ui: Ui} & Record<string, any>} Props */

/** State on which panels depend through the engine, which has pictures and tables of colours.
 * @type {(keyof Ui)[]} */
const ENGINE_STATE = ['display', 'loadProgress', 'ready', 'state'];

/** Return a panel that renders again only if its properties change, or a part of the state that it
 * or its children have read. A dragged light changes two parts of the state at every move of the
 * pointer, and few panels show these.
 *
 * @template {(props: any) => any} P
 * @param {P} Panel with the whole state in `ui`
 * @returns {P} */
export function watched(Panel) {
  class WatchedPanel extends Component {
    /** @param {Props} props */
    constructor(props) {
      super(props);
      /** Parts that have been read since the panel is shown. @type {Set<PropertyKey>} */
      this.parts = new Set(ENGINE_STATE);
      /** What the last rendering sees; handlers of its events see the newest state. */
      this.seen = { ui: props.ui };
      this.shown = props;
    }

    /** @param {Props} next */
    shouldComponentUpdate(next) {
      const { shown, seen } = this;
      const isSame =
        Object.keys({ ...shown, ...next }).every(
          (name) => name === 'ui' || shown[name] === next[name],
        ) && [...this.parts].every((part) => valueOf(seen.ui, part) === valueOf(next.ui, part));
      if (isSame) seen.ui = next.ui;
      return !isSame;
    }

    render() {
      const props = /** @type {Props} */ (this.props);
      this.shown = props;
      this.seen = { ui: props.ui };
      return html`<${Panel} ...${props} ui=${observe(this.seen, this.parts)} />`;
    }
  }
  return /** @type {any} */ (WatchedPanel);
}

/** Return panels as `watched`, by their names. @template {Record<string, (props: any) => any>} P
 * @param {P} panels @returns {P} */
export const watchedPanels = (panels) =>
  /** @type {any} */ (
    Object.fromEntries(Object.entries(panels).map(([name, Panel]) => [name, watched(Panel)]))
  );

/** @param {Ui} ui @param {PropertyKey} part */
const valueOf = (ui, part) => ui[/** @type {keyof Ui} */ (part)];

/** Return the state, noting what is read of it.
 * @param {{ui: Ui}} seen @param {Set<PropertyKey>} parts @returns {Ui} */
function observe(seen, parts) {
  return new Proxy(/** @type {Ui} */ ({}), {
    get: (_, part) => {
      parts.add(part);
      return valueOf(seen.ui, part);
    },
    has: (_, part) => part in seen.ui,
    ownKeys: () => Reflect.ownKeys(seen.ui),
    getOwnPropertyDescriptor: (_, part) => ({
      value: valueOf(seen.ui, part),
      enumerable: true,
      configurable: true,
    }),
  });
}
