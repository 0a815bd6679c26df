/** Controls for the constraints on one light. */

import { html, useState } from '../vendor/preact.js';
import { luminance, atFullBrightness, toHex, toKelvin } from '../../../viewer/drawing/colour.js';
import { Button, Choice, NumberField, Select, TextField } from './controls.js';
import { numberText } from './format.js';
import { LampColour } from './lamps/lamp_colour.js';
import {
  DIMMER_MIN_STOPS,
  scaleToLevel,
  isOnAtPresent,
  presentLevel,
  stopsOf,
} from './level_field.js';
import { t } from '../language/language.js';

/** @import { App, Constraints, Light, RGB } from './ui_state.js' */
/** @import { Props } from './light_row.js' */

const LEVEL_MODES = [
  { value: 'free', label: t('Free'), tip: t('The solve sets it') },
  { value: 'held', label: t('Locked'), tip: t('Locked at a level that you set') },
  { value: 'present', label: t('As now'), tip: t('It stays as it is in the scene') },
  { value: 'off', label: t('Off'), tip: t('Switched off in every answer') },
];

/** @param {Props} props */
export function LightConstraints(props) {
  const { k, light, app, constraints = {}, rgb, tie, ui } = props;
  const { session } = app;
  if (light.is_fixed)
    return html`<p class="asking-light faint">${t('This light is not adjusted.')}</p>`;
  const mode = constraints.off
    ? 'off'
    : constraints.lock === true
      ? 'present'
      : constraints.lock !== undefined
        ? 'held'
        : 'free';
  const change = (/** @type {string} */ newMode) => {
    if (newMode === 'free') session.unlockLight(k);
    if (newMode === 'held') session.lockLight(k, rgb, true);
    if (newMode === 'present') session.constrainLight(k, { lock: true });
    if (newMode === 'off') session.switchLight(k, true);
  };
  return html`<div class="asking-light" role="group" aria-label=${t('Constraints on {label}', { label: light.label })}>
    <h3>${t('Constraints')}</h3>
    <${Choice} label=${t('Level')} value=${mode} choices=${LEVEL_MODES} change=${change} />
    ${
      mode === 'held' &&
      html`<${LockedLevel} ...${props} />
      ${
        !light.is_scalar &&
        !tie &&
        ui &&
        html`<div class="held-colour"><${LampColour} ui=${ui} app=${app} lights=${[k]} /></div>`
      }`
    }
    ${
      mode === 'free' &&
      html`<${LevelAndColour} light=${light} rgb=${rgb} constraints=${constraints} isTied=${Boolean(tie)} app=${app}
        set=${(/** @type {Constraints} */ limited) => void session.constrainLight(k, limited)} />`
    }
    <${TieFields} ...${props} />
  </div>`;
}

/** @param {Props} props */
function LockedLevel({ k, light, app, rgb }) {
  const [unit, setUnit] = useState(isOnAtPresent(light) ? 'stops' : 'value');
  const level = luminance(rgb);
  const lockAt = (/** @type {number} */ newLevel) =>
    app.session.lockLight(k, scaleToLevel(rgb, light, newLevel), true);
  const present = presentLevel(light);
  const { value, min, step, toLevel } = {
    stops: {
      value: stopsOf(rgb, light),
      min: -20,
      step: 0.1,
      toLevel: (/** @type {number} */ x) => present * 2 ** x,
    },
    share: {
      value: (100 * level) / present,
      min: 0,
      step: 5,
      toLevel: (/** @type {number} */ x) => (present * x) / 100,
    },
    value: { value: level, min: 0, step: 0.1, toLevel: (/** @type {number} */ x) => x },
  }[/** @type {'stops' | 'share' | 'value'} */ (unit)];
  const units = [{ value: 'stops', label: t('st from now') }, ...unitsOf(light)];
  return html`<div class="ask-fields is-pair">
    <${NumberField} label=${t('Locked at')} value=${value} min=${min} max=${unit === 'stops' ? 20 : undefined}
      figures=${unit === 'stops' ? undefined : SIGNIFICANT_DIGITS} step=${step} start=${DIMMER_MIN_STOPS}
      placeholder=${unit === 'stops' ? 'off' : undefined}
      change=${(/** @type {number | null} */ newLevel) => lockAt(newLevel === null ? 0 : toLevel(newLevel))} />
    ${
      isOnAtPresent(light) &&
      html`<${Select} label=${t('Unit')} value=${unit} choices=${units} change=${setUnit} />`
    }
  </div>`;
}

/** Significant digits of levels, which range from 1e-5 to 1e9 units. */
const SIGNIFICANT_DIGITS = 6;

/** Return the units that a light's level can be given in.
 * @param {Light} light */
const unitsOf = (light) => [
  { value: 'share', label: t('% of now') },
  { value: 'value', label: light.unit || 'value' },
];

/** Limits of a level and of a colour: of a light, or of all texels of an image.
 * @typedef {{light: Light, rgb: RGB, constraints: Constraints, isTied: boolean,
 *   isImage?: boolean, app: App, set: (constraints: Constraints) => void}} LimitProps
 * @param {LimitProps} props */
export function LevelAndColour(props) {
  const { light, constraints, isTied } = props;
  return html`<${LevelLimits} ...${props} />
    ${
      isTied && colourKind(constraints) === 'any'
        ? html`<p class="faint">${t('Tied lights keep their current colours.')}</p>`
        : !light.is_scalar && html`<${ColourConstraint} ...${props} />`
    }`;
}

/** @param {LimitProps} props */
function LevelLimits({ light, app, constraints, isImage = false, set: constrain }) {
  const limits = constraints.limits ?? {};
  const levels = Object.values(limits);
  const canShare = isOnAtPresent(light);
  const [chosenUnit, setUnit] = useState(canShare && !isImage ? 'share' : 'value');
  // A lights file may have luminances, shares and colours; all but shares are shown as luminance.
  const areShares = levels.every((x) => typeof x === 'string');
  const unit = levels.length ? (areShares ? 'share' : 'value') : chosenUnit;
  const limitValue = (/** @type {any} */ level) => limitAmount(level, light, unit);
  const set = (/** @type {"min" | "max"} */ key, /** @type {number | null} */ value) => {
    const newLimits = {
      ...limits,
      [key]: value === null ? null : unit === 'share' ? `${value}%` : value,
    };
    const validLimits = Object.fromEntries(Object.entries(newLimits).filter(([, x]) => x !== null));
    const [min, max] = [limitValue(newLimits.min), limitValue(newLimits.max)];
    if (min !== null && max !== null && min > max) {
      const limitText = (/** @type {number} */ x) =>
        unit === 'share' ? `${x} %` : numberText(x, SIGNIFICANT_DIGITS);
      const [low, high] = [min, max].map(limitText);
      app.session.toast(
        t('The minimum ({low}) is above the maximum ({high}). The limits have not changed.', {
          low,
          high,
        }),
      );
      return;
    }
    const { limits: _, ...otherConstraints } = constraints;
    constrain(
      Object.keys(validLimits).length
        ? { ...otherConstraints, limits: validLimits }
        : otherConstraints,
    );
  };
  const convert = (/** @type {string} */ newUnit) => {
    setUnit(newUnit);
    if (!levels.length || newUnit === unit) return;
    const convertedLimits = Object.entries(limits).map(([key, x]) => {
      const level = Number(limitAmount(x, light, newUnit).toPrecision(SIGNIFICANT_DIGITS));
      return [key, newUnit === 'share' ? `${level}%` : level];
    });
    constrain({ ...constraints, limits: Object.fromEntries(convertedLimits) });
  };
  // A share belongs to each texel, so that no single level is equal to it.
  const isUnitSet = isImage && levels.length > 0;
  const units = unitsOf(light).filter(({ value }) => !isUnitSet || value === unit);
  return html`<div class="ask-fields is-levels">
    <${NumberField} label=${t('Min')} value=${limitValue(limits.min)} min=${0} placeholder="–" step=${5}
      change=${(/** @type {number | null} */ value) => set('min', value)} figures=${SIGNIFICANT_DIGITS} />
    <${NumberField} label=${t('Max')} value=${limitValue(limits.max)} min=${0} placeholder="–" step=${5}
      change=${(/** @type {number | null} */ value) => set('max', value)} figures=${SIGNIFICANT_DIGITS} />
    ${
      canShare &&
      html`<${Select} label=${t('Unit')} value=${unit} choices=${units} change=${convert} />`
    }
  </div>`;
}

/** A limit as in a lights file: a luminance, a share of the current one like '40%', or a colour.
 * @param {any} level @param {Light} light @param {string} unit
 * @returns {any} a number, in percent where `unit` is 'share'; null for none */
function limitAmount(level, light, unit) {
  if (level === undefined || level === null) return null;
  const isShare = typeof level === 'string';
  if (isShare && unit === 'share') return parseFloat(level);
  const absolute = Array.isArray(level) ? luminance(/** @type {RGB} */ (level)) : level;
  const value = isShare ? (parseFloat(level) / 100) * presentLevel(light) : absolute;
  return unit === 'share' ? (100 * value) / presentLevel(light) : value;
}

/** @param {Props} props */
function TieFields({ light, app, tie, allLights = [] }) {
  const candidates = allLights.filter(
    (other) => !other.is_fixed && other.name !== light.name && !tie?.includes(other.name),
  );
  const label = (/** @type {string} */ name) =>
    allLights.find((other) => other.name === name)?.label ?? name;
  const choices = [
    { value: '', label: t('no light') },
    ...candidates.map((other) => ({ value: other.name, label: other.label })),
  ];
  return html`<div class="ask-row">
    ${
      tie &&
      html`<span>${t('Tied to {value}', {
        value: tie
          .filter((name) => name !== light.name)
          .map(label)
          .join(', '),
      })}</span><${Button} label=${t('Untie')} act=${() => app.session.untie([light.name])} />`
    }
    <${Select} label=${tie ? t('Also tie to') : t('Tie to')} value="" choices=${choices}
      change=${(/** @type {string} */ name) => name && app.session.tie([light.name, name])} />
  </div>`;
}

const COLOURS = [
  { value: 'any', label: t('Any colour') },
  { value: 'color', label: t('One colour') },
  { value: 'kelvin', label: t('White range') },
  { value: 'primaries', label: t('LED mix') },
];

/** Return the kind of colour constraint of a light. @param {Constraints} constraints */
const colourKind = (constraints) =>
  ['color', 'kelvin', 'primaries'].find((key) => constraints[key] !== undefined) ?? 'any';

/** @param {LimitProps} props */
function ColourConstraint(props) {
  const { constraints, rgb, set } = props;
  const kind = colourKind(constraints);
  const { color, kelvin, duv, primaries, ...otherConstraints } = constraints;
  const change = (/** @type {string} */ newKind) => {
    const constraint = {
      any: {},
      color: { color: hexOf(rgb) },
      kelvin: { kelvin: [2700, 6500] },
      primaries: { primaries: ['#ff0000', '#00ff00', '#0000ff'] },
    }[newKind];
    set({ ...otherConstraints, ...constraint });
  };
  return html`<div class="ask-row">
      <${Select} label=${t('Colour')} value=${kind} choices=${COLOURS} change=${change} /></div>
    ${kind === 'color' && html`<${SingleColour} ...${props} otherConstraints=${otherConstraints} />`}
    ${kind === 'kelvin' && html`<${WhiteRange} ...${props} otherConstraints=${otherConstraints} />`}
    ${
      kind === 'primaries' &&
      html`<${Words} label=${t('LEDs')} value=${[...primaries].join(', ')}
      take=${(/** @type {string} */ text) =>
        set({ ...otherConstraints, primaries: text.split(/[\s,]+/).filter(Boolean) })} />`
    }`;
}

/** @param {any} props */
function SingleColour({ constraints, otherConstraints, rgb, set }) {
  const text = Array.isArray(constraints.color)
    ? hexOf(constraints.color)
    : String(constraints.color);
  const white = toKelvin(rgb);
  return html`<div class="ask-row">
    <${Words} label=${t('Hex or kelvin')} value=${text}
      take=${(/** @type {string} */ color) => set({ ...otherConstraints, color })} />
    ${
      white &&
      html`<${Button} label=${`${Math.round(white.kelvin / 50) * 50}K`}
      tip=${t('The white nearest to its colour in the answer')} act=${() =>
        set({
          ...otherConstraints,
          color: `${Math.round(white.kelvin / 50) * 50}K`,
        })} />`
    }
  </div>`;
}

/** @param {any} props */
function WhiteRange({ constraints, otherConstraints, set }) {
  const range = [constraints.kelvin].flat();
  const [low, high] = [range[0], range.at(-1)];
  const setRange = (/** @type {number} */ a, /** @type {number} */ b, /** @type {number} */ duv) =>
    set({
      ...otherConstraints,
      kelvin: a === b ? a : [Math.min(a, b), Math.max(a, b)],
      ...(duv ? { duv } : {}),
    });
  const duv = constraints.duv ?? 0;
  return html`<div class="ask-fields">
    <${NumberField} label=${t('From')} value=${low} min=${1000} max=${25000} step=${100} digits=${0}
      unit=${t('K')} change=${(/** @type {number} */ kelvin) => setRange(kelvin, high, duv)} />
    <${NumberField} label=${t('To')} value=${high} min=${1000} max=${25000} step=${100} digits=${0}
      unit=${t('K')} change=${(/** @type {number} */ kelvin) => setRange(low, kelvin, duv)} />
    <${NumberField} label=${t('Tint')} value=${1000 * duv} min=${-20} max=${20} digits=${1}
      tip=${t('Duv × 1000: above 0 green, below 0 magenta')}
      change=${(/** @type {number} */ tint) => setRange(low, high, tint / 1000)} />
  </div>`;
}

/** @param {{label: string, value: string, take: (text: string) => void}} props */
const Words = (props) =>
  html`<${TextField} class="words" tip=${props.value.length > 16 ? props.value : undefined} ...${props} />`;

/** @param {RGB} rgb */
const hexOf = (rgb) => toHex(atFullBrightness(rgb));
