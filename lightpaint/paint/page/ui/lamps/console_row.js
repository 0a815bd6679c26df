/** The switch by which a console follows the brush, and its blackout. */

import { Component, html } from '../../vendor/preact.js';
import { Button, Checkbox } from '../controls.js';
import { t } from '../../language/language.js';

/** @import { App, Ui } from '../ui_state.js' */

/** Milliseconds within which a second press confirms a blackout. */
const CONFIRM_MS = 3000;

/** @extends {Component<{ui: Ui, app: App}, {isAsked: boolean}>} */
export class ConsoleRow extends Component {
  /** @override */
  state = { isAsked: false };
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  timer = undefined;

  componentWillUnmount() {
    clearTimeout(this.timer);
  }

  /** Ask at the first press, and go dark at the second. */
  pressBlackout() {
    clearTimeout(this.timer);
    const { isAsked } = this.state;
    if (isAsked) this.props.app.session.send('black_out');
    else this.timer = setTimeout(() => this.setState({ isAsked: false }), CONFIRM_MS);
    this.setState({ isAsked: !isAsked });
  }

  render() {
    const { ui, app } = this.props;
    const { console } = ui;
    if (!console) return null;
    const { isAsked } = this.state;
    const light = () => app.session.send('switch_console', { is_on: true });
    return html`<div class=${`console ${console.is_on ? 'is-on' : ''}`} role="group" aria-label=${t('Console')}>
      <${Checkbox} label=${t('Console')} checked=${console.is_on}
        tip=${t('Send the answer to {address} as you paint. Off, nothing is sent.', { address: console.address })}
        change=${(/** @type {boolean} */ isOn) => app.session.send('switch_console', { is_on: isOn })} />
      <span class="console-address" data-tip=${console.address}>${console.trouble ?? console.address}</span>
      ${
        console.is_on &&
        (console.is_dark
          ? html`<${Button} label=${t('Light again')} act=${light} tip=${t('Send the answer again')} />`
          : html`<${Button} label=${isAsked ? t('Press again') : t('Blackout')} class=${isAsked ? 'is-warning' : ''}
            act=${() => this.pressBlackout()} tip=${t('Take all lamps of the rig to 0: press twice')} />`)
      }
    </div>`;
  }
}
