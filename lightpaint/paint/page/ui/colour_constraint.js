/** Controls for the colours that one light may have. */

import { html } from '../vendor/preact.js';
import { Button, NumberField, Select, TextField } from './controls.js';
import { atFullBrightness, toHex, toKelvin } from './paint_colour.js';
import { t } from '../language/language.js';

/** @typedef {import("./ui_state.js").Constraints} Constraints */
/** @typedef {import("./engine_interface.js").RGB} RGB */

const COLOURS = [
  { value: 'any', label: t('Any colour') },
  { value: 'color', label: t('One colour') },
  { value: 'kelvin', label: t('White range') },
  { value: 'primaries', label: t('LED mix') },
];

/** Return the kind of colour constraint of a light. @param {Constraints} constraints */
export const colourKind = (constraints) =>
  ['color', 'kelvin', 'primaries'].find((key) => constraints[key] !== undefined) ?? 'any';

/** @param {import("./light_constraints.js").LimitProps} props */
export function ColourConstraint(props) {
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
        set({
          ...otherConstraints,
          primaries: text.split(/[\s,]+/).filter(Boolean),
        })} />`
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
