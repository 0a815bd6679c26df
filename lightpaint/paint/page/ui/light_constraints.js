/** Controls for the constraints on one light. */

import { html, useState } from '../vendor/preact.js';
import { luminance, ofKelvin, toKelvin } from './paint_colour.js';
import { ColourConstraint, colourOf } from './colour_constraint.js';
import { Button, Choice, NumberField, Select } from './controls.js';
import { number } from './format.js';
import { KelvinSlider } from './kelvin_slider.js';
import { DARKEST, atLevel, isOnNow, nowOf, stopsOf } from './level_field.js';

/** @typedef {import("./ui_state.js").Constraints} Constraints */
/** @typedef {import("./engine_interface.js").RGB} RGB */

const LEVEL_MODES = [
  { value: 'free', label: 'Free', tip: 'The solve sets it' },
  { value: 'held', label: 'Locked', tip: 'Locked at a level that you set' },
  { value: 'present', label: 'As now', tip: 'It stays as it is in the scene' },
  { value: 'off', label: 'Off', tip: 'Switched off in every answer' },
];

/** @param {import("./light_row.js").Props} props */
export function LightConstraints(props) {
  const { k, light, app, constraints = {}, rgb, tied } = props;
  const { session } = app;
  if (light.is_fixed) return html`<p class="asking-light faint">This light is not adjusted.</p>`;
  const mode = constraints.off
    ? 'off'
    : constraints.lock === true
      ? 'present'
      : constraints.lock !== undefined
        ? 'held'
        : 'free';
  const change = (/** @type {string} */ to) => {
    if (to === 'free') session.unlockLight(k);
    if (to === 'held') session.lockLight(k, rgb, true);
    if (to === 'present') session.constrainLight(k, { lock: true });
    if (to === 'off') session.switchLight(k, true);
  };
  return html`<div class="asking-light" role="group" aria-label=${`Constraints on ${light.label}`}>
    <h3>Constraints</h3>
    <${Choice} label="Level" value=${mode} choices=${LEVEL_MODES} change=${change} />
    ${
      mode === 'held' &&
      html`<${LockedLevel} ...${props} />
      ${!light.is_scalar && !tied && html`<${LockedColour} ...${props} />`}`
    }
    ${
      mode === 'free' &&
      html`<${LevelLimits} ...${props} />
      ${
        tied && colourOf(constraints) === 'any'
          ? html`<p class="faint">Tied lights keep their current colours.</p>`
          : !light.is_scalar && html`<${ColourConstraint} ...${props} />`
      }`
    }
    <${TieFields} ...${props} />
  </div>`;
}

/** @param {import("./light_row.js").Props} props */
function LockedLevel({ k, light, app, rgb }) {
  const [unit, setUnit] = useState(isOnNow(light) ? 'stops' : 'value');
  const level = luminance(rgb);
  const lockAt = (/** @type {number} */ to) =>
    app.session.lockLight(k, atLevel(rgb, light, to), true);
  const now = nowOf(light);
  const { value, least, step, of } = {
    stops: {
      value: stopsOf(rgb, light),
      least: -20,
      step: 0.1,
      of: (/** @type {number} */ x) => now * 2 ** x,
    },
    share: {
      value: (100 * level) / now,
      least: 0,
      step: 5,
      of: (/** @type {number} */ x) => (now * x) / 100,
    },
    value: { value: level, least: 0, step: 0.1, of: (/** @type {number} */ x) => x },
  }[/** @type {'stops' | 'share' | 'value'} */ (unit)];
  const units = [{ value: 'stops', label: 'st from now' }, ...unitsOf(light)];
  return html`<div class="ask-fields is-pair">
    <${NumberField} label="Locked at" value=${value} least=${least} most=${unit === 'stops' ? 20 : undefined}
      figures=${unit === 'stops' ? undefined : FIGURES} step=${step} start=${DARKEST}
      empty=${unit === 'stops' ? 'off' : undefined}
      change=${(/** @type {number | null} */ to) => lockAt(to === null ? 0 : of(to))} />
    ${
      isOnNow(light) &&
      html`<${Select} label="Unit" value=${unit} choices=${units} change=${setUnit} />`
    }
  </div>`;
}

/** Significant digits of levels, which range from 1e-5 to 1e9 units. */
const FIGURES = 6;

/** Return the units that a light's level can be given in.
 * @param {import("./ui_state.js").Light} light */
const unitsOf = (light) => [
  { value: 'share', label: '% of now' },
  { value: 'value', label: light.unit || 'value' },
];

/** The white that a light is locked to, at its current brightness.
 * @param {import("./light_row.js").Props} props */
function LockedColour({ k, app, rgb }) {
  const level = luminance(rgb);
  const [last, setLast] = useState(/** @type {number | null} */ (null));
  // If the light is off or not white, the slider keeps the last choice.
  const kelvin = (level > 0 ? toKelvin(rgb)?.kelvin : null) ?? last ?? 3200;
  const change = (/** @type {number} */ made, /** @type {boolean} */ done) => {
    setLast(made);
    const white = ofKelvin(made);
    const factor = level / luminance(white);
    app.session.lockLight(k, /** @type {RGB} */ (white.map((x) => x * factor)), done);
  };
  return html`<div class="held-colour"><${KelvinSlider} value=${kelvin} disabled=${level <= 0}
    change=${change} /></div>`;
}

/** @param {import("./light_row.js").Props} props */
function LevelLimits({ k, light, app, constraints = {} }) {
  const limits = constraints.limits ?? {};
  const levels = Object.values(limits);
  const canShare = isOnNow(light);
  const [chosen, setUnit] = useState(canShare ? 'share' : 'value');
  // A lights file may have luminances, shares and colours; all but shares are shown as luminance.
  const areShares = levels.every((x) => typeof x === 'string');
  const unit = levels.length ? (areShares ? 'share' : 'value') : chosen;
  const shown = (/** @type {any} */ level) => amount(level, light, unit);
  const set = (/** @type {"min" | "max"} */ key, /** @type {number | null} */ value) => {
    const made = {
      ...limits,
      [key]: value === null ? null : unit === 'share' ? `${value}%` : value,
    };
    const kept = Object.fromEntries(Object.entries(made).filter(([, x]) => x !== null));
    const [least, most] = [shown(made.min), shown(made.max)];
    if (least !== null && most !== null && least > most) {
      const spoken = (/** @type {number} */ x) =>
        unit === 'share' ? `${x} %` : number(x, FIGURES);
      const [low, high] = [least, most].map(spoken);
      app.session.toast(
        `The minimum (${low}) is above the maximum (${high}). The limits have not changed.`,
      );
      return;
    }
    const { limits: _, ...rest } = constraints;
    app.session.constrainLight(k, Object.keys(kept).length ? { ...rest, limits: kept } : rest);
  };
  const convert = (/** @type {string} */ to) => {
    setUnit(to);
    if (!levels.length || to === unit) return;
    const turned = Object.entries(limits).map(([key, x]) => {
      const level = Number(amount(x, light, to).toPrecision(FIGURES));
      return [key, to === 'share' ? `${level}%` : level];
    });
    app.session.constrainLight(k, { ...constraints, limits: Object.fromEntries(turned) });
  };
  return html`<div class="ask-fields is-levels">
    <${NumberField} label="Min" value=${shown(limits.min)} least=${0} empty="–" step=${5}
      change=${(/** @type {number | null} */ value) => set('min', value)} figures=${FIGURES} />
    <${NumberField} label="Max" value=${shown(limits.max)} least=${0} empty="–" step=${5}
      change=${(/** @type {number | null} */ value) => set('max', value)} figures=${FIGURES} />
    ${
      canShare &&
      html`<${Select} label="Unit" value=${unit} choices=${unitsOf(light)} change=${convert} />`
    }
  </div>`;
}

/** A limit as in a lights file: a luminance, a share of the current one like '40%', or a colour.
 * @param {any} level @param {import("./ui_state.js").Light} light @param {string} unit
 * @returns {any} a number, in percent where `unit` is 'share'; null for none */
function amount(level, light, unit) {
  if (level === undefined || level === null) return null;
  const isShare = typeof level === 'string';
  if (isShare && unit === 'share') return parseFloat(level);
  const plain = Array.isArray(level) ? luminance(/** @type {RGB} */ (level)) : level;
  const value = isShare ? (parseFloat(level) / 100) * nowOf(light) : plain;
  return unit === 'share' ? (100 * value) / nowOf(light) : value;
}

/** @param {import("./light_row.js").Props} props */
function TieFields({ light, app, tied, others = [] }) {
  const free = others.filter(
    (one) => !one.is_fixed && one.name !== light.name && !tied?.includes(one.name),
  );
  const label = (/** @type {string} */ name) =>
    others.find((one) => one.name === name)?.label ?? name;
  const choices = [
    { value: '', label: 'no light' },
    ...free.map((one) => ({ value: one.name, label: one.label })),
  ];
  return html`<div class="ask-row">
    ${
      tied &&
      html`<span>Tied to ${tied
        .filter((name) => name !== light.name)
        .map(label)
        .join(', ')}</span><${Button} label="Untie" act=${() => app.session.untie(light.name)} />`
    }
    <${Select} label=${tied ? 'Also tie to' : 'Tie to'} value="" choices=${choices}
      change=${(/** @type {string} */ name) => name && app.session.tie(light.name, name)} />
  </div>`;
}
