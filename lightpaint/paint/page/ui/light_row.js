/** A row of the light list: the light in the answer, solo, mute, lock and dimmer. */

import { Component, html } from '../vendor/preact.js';
import { atFullBrightness, luminance, toHex, toKelvin } from '../../../viewer/drawing/colour.js';
import { LightConstraints } from './light_constraints.js';
import { numberText, percentText, stopsText, whiteText } from './format.js';
import { Icon } from './icons.js';
import { LampFields } from './lamp_fields.js';
import { isSelecting, pressLight } from './lamps/light_selection.js';
import { DIMMER_MIN_STOPS, scaleToLevel, presentLevel, stopsOf } from './level_field.js';
import { Dimmer, DisplayButtons, LightValue, LockButton, Pick, Share } from './row_parts.js';
import { Thumbnail } from './thumbnail.js';
import { toggled } from './ui_store.js';
import { t } from '../language/language.js';

/** @import { App, Constraints, Light, LightAnswer, RGB, Ui, UiStore } from './ui_state.js' */

/** Share of the picture's light from which a lamp's tint is named: nobody sees the tint of a dimmer one.
 * A share that is shown as 3 % is less. */
const MIN_TINT_SHARE = 0.035;

/** About the line on the rendering of colours. */
export const RENDERING_TIP = t(
  'How this light renders colours: colour temperature, distance from white, Ra and R9 of CIE 13.3, Rf and Rg of TM-30',
);

/** @typedef {{k: number, light: Light, app: App, rgb: RGB, answer?: LightAnswer, constraints?: Constraints,
 *   tie?: string[], isKept: boolean, isLive: boolean, isSelected: boolean, isSolo: boolean, isMute: boolean, isOpen: boolean,
 *   pointerShare?: number, hasSlider: boolean, picture: string, thumb?: number, allLights?: Light[],
 *   ui?: Ui}} Props */

/** @extends {Component<Props>} */
export class LightRow extends Component {
  /** The light at the start of a drag of its dimmer, so that it keeps its colour when it passes
   * through off. @type {RGB | null} */
  dragStartColour = null;

  /** Skip rows that do not change: a pointer over the picture changes few of many.
   * @param {Props} next */
  shouldComponentUpdate(next) {
    const keys = /** @type {(keyof Props)[]} */ (Object.keys({ ...this.props, ...next }));
    return keys.some((key) =>
      key === 'pointerShare'
        ? shareText(this.props.pointerShare) !== shareText(next.pointerShare)
        : next[key] !== this.props[key],
    );
  }

  /** A row removed under the pointer receives no pointerleave event. */
  componentWillUnmount() {
    const { k, app } = this.props;
    if (app.store.value.hoveredLight === k) app.store.set({ hoveredLight: null });
  }

  render() {
    const { k, light, app, isOpen, hasSlider, pointerShare, isMute, constraints, ui } = this.props;
    const { isSelected, answer } = this.props;
    const { store } = app;
    const dimClass = isMute || constraints?.off ? 'is-dim' : '';
    const select = (/** @type {MouseEvent} */ event) => pressLight(store, k, event);
    const press = (/** @type {MouseEvent} */ event) =>
      isSelecting(event) ? select(event) : toggleRow(store, k);
    const hover = (/** @type {number | null} */ hoveredLight) => () => store.set({ hoveredLight });
    return html`<div class=${`light ${dimClass} ${isOpen ? 'is-open' : ''} ${isSelected ? 'is-selected' : ''}`} role="group"
      aria-label=${light.label} data-light=${light.name}>
      <div class="light-thumb" onPointerEnter=${hover(k)} onPointerLeave=${hover(null)}>
        <${Thumbnail} name=${this.props.picture} generation=${this.props.thumb} app=${app} />
        <${Share} share=${this.props.answer?.share ?? 0} pointerShare=${pointerShare} />
        <${Badge} ...${this.props} />
        <${Pick} label=${light.label} isSelected=${isSelected} select=${select} />
      </div>
      <div class="light-main">
        <div class="light-head">
          <button type="button" class="light-name" aria-expanded=${String(isOpen)}
            aria-label=${light.label} onClick=${press} data-tip=${
              light.members.length > 1
                ? `${light.label}: ${light.members.join(', ')}`
                : [light.label, light.address || light.plugin].join(', ')
            }>
            <${Icon} name="fold" /><span class="its-name"><${Name} name=${light.label} /></span></button>
          ${this.renderButtons()}
        </div>
        ${this.renderNumbers()}
        ${light.emitters.length > 0 && html`<${Drives} emitters=${light.emitters} drives=${answer?.drives ?? []} address=${light.address} slotDeltaE=${answer?.slot_delta_e} />`}
        ${hasSlider && !light.is_fixed && this.renderDimmer()}
        ${isOpen && !light.lamp && answer?.rendering && html`<span class="rendering faint" data-tip=${RENDERING_TIP}>${answer.rendering}</span>`}
      </div>
      ${isOpen && html`<${LightConstraints} ...${this.props} />`}
      ${isOpen && ui && html`<${LampFields} k=${k} ui=${ui} app=${app} />`}
    </div>`;
  }

  /** Buttons for the display; then, apart, those for the solve. */
  renderButtons() {
    const { k, light, app, isSolo, isMute, constraints = {} } = this.props;
    const { store, session } = app;
    const toggle = (/** @type {"solo" | "mute"} */ key) => store.set((ui) => ({ [key]: toggled(ui[key], k) }));
    const isLocked = constraints.lock !== undefined || Boolean(constraints.off);
    const lock = () =>
      isLocked ? session.unlockLight(k) : session.lockLight(k, this.props.rgb, true);
    return html`<${DisplayButtons} label=${light.label} isSolo=${isSolo} isMute=${isMute} toggle=${toggle} />
    ${
      !light.is_fixed &&
      html`<span class="marks is-solve" role="group" aria-label=${t('Solve')}>
        <${LockButton} label=${light.label} isLocked=${isLocked} lock=${lock} /></span>`
    }`;
  }

  renderNumbers() {
    const { light, rgb, answer, isLive } = this.props;
    const level = luminance(rgb);
    // The weight of a lamp's emitter is a level, without its colour.
    const match = light.lamp ? null : toKelvin(rgb);
    const swatch = light.lamp ? light.emitters[0]?.swatch : toHex(atFullBrightness(rgb));
    const kelvin = isLive || !answer ? match?.kelvin : answer.kelvin;
    const isTintSeen = (answer?.share ?? 1) >= MIN_TINT_SHARE;
    const white = kelvin && whiteText(kelvin, (isTintSeen && match?.green) || 0);
    const value = [white, numberText(level)].filter(Boolean).join(' · ');
    const error = answer?.error ?? '';
    const fullText = [value, light.unit, isLive ? '' : error].filter(Boolean).join(' ');
    // The error bar of the previous answer stays until the next one is known.
    return html`<div class=${`light-numbers ${this.props.hasSlider ? '' : 'is-two'}`}>
      <${LightValue} level=${level} swatch=${swatch} value=${value} tip=${fullText} />
      ${
        this.props.isKept
          ? html`<${KeptButton} ...${this.props} />`
          : html`<span class=${`error ${isLive ? 'is-old' : ''}`} aria-hidden=${isLive ? 'true' : undefined}
        >${level > 0 || !this.props.hasSlider ? error : ''}</span>`
      }
      ${!this.props.hasSlider && html`<span class="stops">${stopsText(stopsOf(rgb, light))}</span>`}
    </div>`;
  }

  renderDimmer() {
    const { k, light, rgb, app, constraints } = this.props;
    const scale = (/** @type {number} */ newStops, /** @type {boolean} */ isFinal) => {
      this.dragStartColour ??= rgb;
      app.session.lockLight(k, scaleToStops(this.dragStartColour, light, newStops), isFinal);
      if (isFinal) this.dragStartColour = null;
    };
    return html`<${Dimmer} light=${light} rgb=${rgb} label=${light.label} app=${app} scale=${scale}
      isHeld=${constraints?.lock !== undefined} disabled=${Boolean(constraints?.off)}
      change=${(/** @type {RGB} */ newRgb) => app.session.lockLight(k, newRgb, true)} />`;
  }
}

/** The end of a long name that always stays visible, since names of many lights differ there: whole
 * words from a separator on or, without one near the end, a fixed number of characters. A part of a
 * word would be no word of the name where the other line is scrolled away. */
const NAME_END = /[^\p{L}\p{N}].{1,8}$/u;
const NAME_END_LENGTH = 9;

/** A name on up to two lines, truncated before its end.
 * @param {{name: string}} props */
function Name({ name }) {
  const line = name.replace(/\s+/g, ' ');
  const end = line.length < 14 ? line.length : line.search(NAME_END);
  const split = end < 0 ? line.length - NAME_END_LENGTH : end;
  return html`<span class="name-start">${line.slice(0, split)}</span><span>${line.slice(split)}</span>`;
}

/** @param {number | undefined} share */
const shareText = (share) => (share === undefined ? '' : percentText(share));

/** The drives of a lamp's emitters, a bar for each. Below them, universe and channel on a console,
 * and the slot of a colour wheel with how far it is from the colour of the solve.
 * @param {{emitters: Light["emitters"], drives: number[], address?: string, slotDeltaE?: number}} props */
function Drives({ emitters, drives, address, slotDeltaE }) {
  const text = emitters.map(({ name }, j) => `${name} ${percentText(drives[j] ?? 0)}`).join(', ');
  const slot = emitters.find((_, j) => (drives[j] ?? 0) > 0)?.name ?? '';
  const isOff =
    slotDeltaE !== undefined &&
    t('{slot}, ΔE {distance} off', { slot, distance: slotDeltaE.toFixed(1) });
  const place = address?.split(' ').at(-1);
  return html`<span class="drives" role="img" aria-label=${t('Drives: {text}', { text })} data-tip=${text}>
    ${emitters.map(
      ({ name, swatch }, j) =>
        html`<i key=${name} style=${{ '--drive': String(drives[j] ?? 0), color: swatch }}></i>`,
    )}</span>
    <span class="lamp-notes">
      ${place && html`<span data-tip=${t('{fixture}: universe and channel', { fixture: address ?? '' })}>${place}</span>`}
      ${isOff && html`<span class="wheel-slot" data-tip=${t('Its colour wheel is at the slot closest to the colour of the solve')}>${isOff}</span>`}
    </span>`;
}

/** Remarks below the picture, where they do not change the height of the row.
 * @param {{light: Light, answer?: LightAnswer, constraints?: Constraints, tie?: string[],
 *   isKept: boolean}} props */
function Badge(props) {
  const { answer, constraints = {}, tie } = props;
  const remarks = listRemarks(props);
  if (!remarks.length) return null;
  // Constraints on all lights, such as their colours, are not a remark on this one.
  const hasConstraint = Boolean(tie ?? constraints.limits ?? colourConstraint(constraints));
  const isHeldBack =
    Boolean(answer?.is_constrained) &&
    hasConstraint &&
    constraints.lock === undefined &&
    !constraints.off;
  const sentences = remarks.map(([, text]) => `${text}.`);
  if (isHeldBack) sentences.push(t('This keeps it from what the painting asks for.'));
  const moreText = remarks.length > 1 ? ` +${remarks.length - 1}` : '';
  return html`<span class=${`badge ${isHeldBack ? 'is-back' : ''}`} data-tip=${sentences.join(' ')}
    >${isHeldBack ? t('held back') : `${remarks[0][0]}${moreText}`}</span>`;
}

/** The reason why a light that was moved stays as it is; a press lets the solve set it again.
 * @param {Props} props */
function KeptButton({ k, light, app }) {
  return html`<button type="button" class="kept" aria-label=${t('Release {label}: the solve sets it again', { label: light.label })}
    data-tip=${t('You moved it, so it keeps its level, and the others are solved around it. A press releases it: the solve sets it again')}
    onClick=${() => app.session.unlockLight(k)}
    >${t('kept')}</button>`;
}

/** @param {UiStore} store @param {number} k */
function toggleRow(store, k) {
  store.set(({ openLights }) => ({ openLights: toggled(openLights, k) }));
}

/** Return the colour constraint, if there is one. @param {Constraints} constraints */
const colourConstraint = ({ color, kelvin, primaries }) => color ?? kelvin ?? primaries;

/** Return a short and a long text for each remark.
 * @param {{light: Light, answer?: LightAnswer, constraints?: Constraints, tie?: string[],
 *   isKept: boolean}} props
 * @returns {string[][]} */
function listRemarks({ light, answer, constraints = {}, tie, isKept }) {
  /** @type {[unknown, string, string][]} */
  const remarks = [
    [light.is_fixed, t('fixed'), t('It stays as it is in the scene')],
    [constraints.off, t('off'), t('You switched it off')],
    [constraints.lock !== undefined && !isKept, t('locked'), t('You locked it at this level')],
    [constraints.limits, t('limits'), t('You limited its level')],
    [colourConstraint(constraints), t('colour'), t('You limited its colour')],
    [
      tie,
      t('tied'),
      t('It is tied to {value}', { value: tie?.filter((name) => name !== light.name).join(', ') }),
    ],
    [answer?.is_unreached, t('unseen'), t('None of its light reaches the picture')],
  ];
  return remarks.filter(([applies]) => applies).map(([, ...texts]) => texts);
}

/** Return the same colour at a number of stops from the current level; the left end is off.
 * @param {RGB} rgb @param {Light} light @param {number} stops @returns {RGB} */
function scaleToStops(rgb, light, stops) {
  return scaleToLevel(rgb, light, stops <= DIMMER_MIN_STOPS ? 0 : presentLevel(light) * 2 ** stops);
}
