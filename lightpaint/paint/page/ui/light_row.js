/** A row of the light list: the light in the answer, solo, mute, lock and dimmer. */

import { Component, html } from '../vendor/preact.js';
import { atFull, luminance, toHex, toKelvin } from './paint_colour.js';
import { LightConstraints } from './light_constraints.js';
import { Button, Slider } from './controls.js';
import { number, percent, stopsText, whiteText } from './format.js';
import { Icon } from './icons.js';
import { LampFields } from './lamp_fields.js';
import { BRIGHTEST, DARKEST, Level, atLevel, nowOf, stopsOf } from './level_field.js';
import { Thumbnail } from './thumbnail.js';

/** @typedef {import("./ui_state.js").Light} Light */
/** @typedef {import("./ui_state.js").LightAnswer} LightAnswer */
/** @typedef {import("./ui_state.js").Constraints} Constraints */
/** @typedef {import("./engine_interface.js").RGB} RGB */
/** @typedef {import("./shortcuts.js").App} App */
/**
 * @typedef {{k: number, light: Light, app: App, rgb: RGB, lit?: LightAnswer, constraints?: Constraints,
 *   tied?: string[], isLive: boolean, isSolo: boolean, isMute: boolean, isOpen: boolean,
 *   here?: number, hasSlider: boolean, picture: string, thumb?: number, others?: Light[],
 *   ui?: import("./ui_state.js").Ui}} Props
 */

/** @extends {Component<Props>} */
export class LightRow extends Component {
  /** The light at the start of a drag of its dimmer, so that it keeps its colour when it passes
   * through off. @type {RGB | null} */
  grasped = null;

  /** Skip rows that do not change: a pointer over the picture changes few of many.
   * @param {Props} next */
  shouldComponentUpdate(next) {
    const keys = /** @type {(keyof Props)[]} */ (Object.keys({ ...this.props, ...next }));
    return keys.some((key) =>
      key === 'here' ? shareText(this.props.here) !== shareText(next.here) : next[key] !== this.props[key],
    );
  }

  /** A row removed under the pointer receives no pointerleave event. */
  componentWillUnmount() {
    const { k, app } = this.props;
    if (app.store.value.hovered === k) app.store.set({ hovered: null });
  }

  render() {
    const { k, light, app, isOpen, hasSlider, here, isMute, constraints, ui } = this.props;
    const { store } = app;
    const dim = isMute || constraints?.off ? 'is-dim' : '';
    const hover = (/** @type {number | null} */ hovered) => () => store.set({ hovered });
    return html`<div class=${`light ${dim} ${isOpen ? 'is-open' : ''}`} role="group"
      aria-label=${light.label} data-light=${light.name}>
      <div class="light-thumb" onPointerEnter=${hover(k)} onPointerLeave=${hover(null)}>
        <${Thumbnail} name=${this.props.picture} generation=${this.props.thumb} app=${app} />
        <${Share} share=${this.props.lit?.share ?? 0} here=${here} />
        <${Badge} ...${this.props} />
      </div>
      <div class="light-main">
        <div class="light-head">
          <button type="button" class="light-name" aria-expanded=${String(isOpen)}
            aria-label=${light.label} onClick=${() => unfold(store, k)} data-tip=${
              light.members.length > 1
                ? `${light.label}: ${light.members.join(', ')}`
                : `${light.label}, ${light.plugin}`
            }>
            <${Icon} name="fold" /><span class="its-name"><${Name} name=${light.label} /></span></button>
          ${this.marks()}
        </div>
        ${this.numbers()}
        ${hasSlider && !light.is_fixed && this.dimmer()}
      </div>
      ${isOpen && html`<${LightConstraints} ...${this.props} />`}
      ${isOpen && ui && html`<${LampFields} k=${k} ui=${ui} app=${app} />`}
    </div>`;
  }

  /** Buttons for the display; then, apart, those for the solve. */
  marks() {
    const { k, light, app, isSolo, isMute, constraints = {} } = this.props;
    const { store, session } = app;
    const turn = (/** @type {"solo" | "mute"} */ key, /** @type {boolean} */ on) =>
      store.set((ui) => ({ [key]: on ? ui[key].filter((one) => one !== k) : [...ui[key], k] }));
    const isHeld = constraints.lock !== undefined || Boolean(constraints.off);
    const lock = () =>
      isHeld ? session.unlockLight(k) : session.lockLight(k, this.props.rgb, true);
    return html`<span class="marks" role="group" aria-label="Display">
      <${Button} label="S" class="letter" on=${isSolo} act=${() => turn('solo', isSolo)}
        tip=${`Solo: show ${light.label} alone. The answer does not change.`} />
      <${Button} label="M" class="letter" on=${isMute} act=${() => turn('mute', isMute)}
        tip=${`Mute: show the picture without ${light.label}. The answer does not change.`} />
    </span>
    ${
      !light.is_fixed &&
      html`<span class="marks is-solve" role="group"
      aria-label="Solve">
      <${Button} icon="lock" on=${isHeld} act=${lock} tip=${
        isHeld
          ? `Unlock ${light.label}: the solve sets it again`
          : `Lock ${light.label} as it is in the answer`
      } />
    </span>`
    }`;
  }

  numbers() {
    const { light, rgb, lit, isLive } = this.props;
    const level = luminance(rgb);
    const found = toKelvin(rgb);
    const kelvin = isLive || !lit ? found?.kelvin : lit.kelvin;
    const white = kelvin && whiteText(kelvin, found?.green ?? 0);
    const value = [white, number(level)].filter(Boolean).join(' · ');
    const error = lit?.error ?? '';
    const whole = [value, light.unit, isLive ? '' : error].filter(Boolean).join(' ');
    // The error bar of the previous answer stays until the next one is known.
    return html`<div class=${`light-numbers ${this.props.hasSlider ? '' : 'is-two'}`}>
      <span class=${`dot ${level > 0 ? '' : 'is-off'}`} aria-hidden="true"
        style=${{ background: level > 0 ? toHex(atFull(rgb)) : 'none' }}></span>
      <span class="values" data-tip=${level > 0 ? whole : undefined}
        >${level > 0 ? value : 'off'}</span>
      <span class=${`error ${isLive ? 'is-old' : ''}`} aria-hidden=${isLive ? 'true' : undefined}
        >${level > 0 || !this.props.hasSlider ? error : ''}</span>
      ${!this.props.hasSlider && html`<span class="stops">${stopsText(stopsOf(rgb, light))}</span>`}
    </div>`;
  }

  dimmer() {
    const { k, light, rgb, app, constraints } = this.props;
    const stops = stopsOf(rgb, light) ?? DARKEST;
    const move = (/** @type {number} */ to, /** @type {boolean} */ done) => {
      this.grasped ??= rgb;
      app.session.lockLight(k, moved(this.grasped, light, to), done);
      if (done) this.grasped = null;
    };
    const text = luminance(rgb) > 0 ? stopsText(stops) : 'off';
    return html`<div class=${`dimmer ${constraints?.lock !== undefined ? 'is-held' : ''}`}>
      <${Slider} plain label=${`${light.label}, stops from now`} value=${clamp(stops)}
        least=${DARKEST} most=${BRIGHTEST} step=${0.05} rest=${0} text=${text}
        disabled=${Boolean(constraints?.off)} change=${move} />
      <${Level} light=${light} rgb=${rgb} disabled=${Boolean(constraints?.off)}
        say=${(/** @type {string} */ words) => app.session.toast(words)}
        change=${(/** @type {RGB} */ made) => app.session.lockLight(k, made, true)} />
    </div>`;
  }
}

/** The end of a long name that always stays visible, since names of many lights differ there: whole
 * words from a separator on or, without one near the end, a fixed number of characters. A part of a
 * word would be no word of the name where the other line is scrolled away. */
const END = /[^\p{L}\p{N}].{1,8}$/u;
const END_LENGTH = 9;

/** A name on up to two lines, truncated before its end.
 * @param {{name: string}} props */
function Name({ name }) {
  const line = name.replace(/\s+/g, ' ');
  const end = line.length < 14 ? line.length : line.search(END);
  const split = end < 0 ? line.length - END_LENGTH : end;
  return html`<span class="name-start">${line.slice(0, split)}</span><span>${line.slice(split)}</span>`;
}

/** @param {number | undefined} share */
const shareText = (share) => (share === undefined ? '' : percent(share));

/** @param {{share: number, here?: number}} props */
function Share({ share, here }) {
  const isHere = here !== undefined;
  const value = isHere ? here : share;
  return html`<span class=${`share ${isHere ? 'is-here' : ''}`}
    data-tip=${isHere ? 'Share of the light here' : "Share of the picture's light"}>
    <i style=${{ '--share': String(value) }}></i><span>${percent(value)}</span></span>`;
}

/** Remarks below the picture, where they do not change the height of the row.
 * @param {{light: Light, lit?: LightAnswer, constraints?: Constraints, tied?: string[]}} props */
function Badge(props) {
  const { lit, constraints = {}, tied } = props;
  const remarks = notes(props);
  if (!remarks.length) return null;
  // Constraints on all lights, such as their colours, are no remark on this one.
  const isAsked = Boolean(tied ?? constraints.limits ?? colourOf(constraints));
  const isBack = Boolean(lit?.is_constrained) && isAsked && constraints.lock === undefined && !constraints.off;
  const words = remarks.map(([, text]) => `${text}.`);
  if (isBack) words.push('This keeps it from what the painting asks for.');
  const more = remarks.length > 1 ? ` +${remarks.length - 1}` : '';
  return html`<span class=${`badge ${isBack ? 'is-back' : ''}`} data-tip=${words.join(' ')}
    >${isBack ? 'held back' : `${remarks[0][0]}${more}`}</span>`;
}

/** @param {import("./ui_state.js").UiStore} store @param {number} k */
function unfold(store, k) {
  store.set(({ unfolded }) => ({
    unfolded: unfolded.includes(k) ? unfolded.filter((one) => one !== k) : [...unfolded, k],
  }));
}

/** Return the colour constraint, if there is one. @param {Constraints} constraints */
const colourOf = ({ color, kelvin, primaries }) => color ?? kelvin ?? primaries;

/** Return a short and a long text for each remark.
 * @param {{light: Light, lit?: LightAnswer, constraints?: Constraints, tied?: string[]}} about
 * @returns {string[][]} */
function notes({ light, lit, constraints = {}, tied }) {
  /** @type {[unknown, string, string][]} */
  const all = [
    [light.is_fixed, 'fixed', 'It stays as it is in the scene'],
    [constraints.off, 'off', 'You switched it off'],
    [constraints.lock !== undefined, 'locked', 'You locked it at this level'],
    [constraints.limits, 'limits', 'You limited its level'],
    [colourOf(constraints), 'colour', 'You limited its colour'],
    [tied, 'tied', `It is tied to ${tied?.filter((name) => name !== light.name).join(', ')}`],
    [lit?.is_unreached, 'unseen', 'None of its light reaches the picture'],
  ];
  return all.filter(([isSo]) => isSo).map(([, ...words]) => words);
}

/** @param {number} stops */
const clamp = (stops) => Math.min(BRIGHTEST, Math.max(DARKEST, stops));

/** Return the same colour at a number of stops from the current level; the left end is off.
 * @param {RGB} rgb @param {Light} light @param {number} stops @returns {RGB} */
function moved(rgb, light, stops) {
  return atLevel(rgb, light, stops <= DARKEST ? 0 : nowOf(light) * 2 ** stops);
}
