/** Controls for the colours that one light may have. */

import { html } from '../vendor/preact.js';
import { Button, NumberField, Select, useTyped } from './controls.js';
import { atFull, toHex, toKelvin } from './paint_colour.js';

/** @typedef {import("./ui_state.js").Constraints} Constraints */
/** @typedef {import("./engine_interface.js").RGB} RGB */

const COLOURS = [
  { value: 'any', label: 'Any colour' },
  { value: 'color', label: 'One colour' },
  { value: 'kelvin', label: 'White range' },
  { value: 'primaries', label: 'LED mix' },
];

/** Return the kind of colour constraint of a light. @param {Constraints} constraints */
export const colourOf = (constraints) =>
  ['color', 'kelvin', 'primaries'].find((key) => constraints[key] !== undefined) ?? 'any';

/** @param {import("./light_row.js").Props} props */
export function ColourConstraint(props) {
  const { k, app, constraints = {}, rgb } = props;
  const kind = colourOf(constraints);
  const { color, kelvin, duv, primaries, ...rest } = constraints;
  const change = (/** @type {string} */ to) => {
    const made = {
      any: {},
      color: { color: hexOf(rgb) },
      kelvin: { kelvin: [2700, 6500] },
      primaries: { primaries: ['#ff0000', '#00ff00', '#0000ff'] },
    }[to];
    app.session.constrainLight(k, { ...rest, ...made });
  };
  return html`<div class="ask-row">
      <${Select} label="Colour" value=${kind} choices=${COLOURS} change=${change} /></div>
    ${kind === 'color' && html`<${SingleColour} ...${props} rest=${rest} />`}
    ${kind === 'kelvin' && html`<${WhiteRange} ...${props} rest=${rest} />`}
    ${
      kind === 'primaries' &&
      html`<${TextField} label="LEDs" value=${[...primaries].join(', ')}
      take=${(/** @type {string} */ text) =>
        app.session.constrainLight(k, {
          ...rest,
          primaries: text.split(/[\s,]+/).filter(Boolean),
        })} />`
    }`;
}

/** @param {any} props */
function SingleColour({ k, app, constraints, rest, rgb }) {
  const text = Array.isArray(constraints.color) ? hexOf(constraints.color) : String(constraints.color);
  const found = toKelvin(rgb);
  return html`<div class="ask-row">
    <${TextField} label="Hex or kelvin" value=${text}
      take=${(/** @type {string} */ color) => app.session.constrainLight(k, { ...rest, color })} />
    ${
      found &&
      html`<${Button} label=${`${Math.round(found.kelvin / 50) * 50}K`}
      tip="The white nearest to its colour in the answer" act=${() =>
        app.session.constrainLight(k, {
          ...rest,
          color: `${Math.round(found.kelvin / 50) * 50}K`,
        })} />`
    }
  </div>`;
}

/** @param {any} props */
function WhiteRange({ k, app, constraints, rest }) {
  const ends = [constraints.kelvin].flat();
  const [low, high] = [ends[0], ends.at(-1)];
  const set = (/** @type {number} */ a, /** @type {number} */ b, /** @type {number} */ duv) =>
    app.session.constrainLight(k, {
      ...rest,
      kelvin: a === b ? a : [Math.min(a, b), Math.max(a, b)],
      ...(duv ? { duv } : {}),
    });
  const duv = constraints.duv ?? 0;
  return html`<div class="ask-fields">
    <${NumberField} label="From" value=${low} least=${1000} most=${25000} step=${100} digits=${0}
      unit="K" change=${(/** @type {number} */ to) => set(to, high, duv)} />
    <${NumberField} label="To" value=${high} least=${1000} most=${25000} step=${100} digits=${0}
      unit="K" change=${(/** @type {number} */ to) => set(low, to, duv)} />
    <${NumberField} label="Tint" value=${1000 * duv} least=${-20} most=${20} digits=${1}
      tip="Duv × 1000: above 0 green, below 0 magenta"
      change=${(/** @type {number} */ to) => set(low, high, to / 1000)} />
  </div>`;
}

/** @param {{label: string, value: string, take: (text: string) => void}} props */
function TextField({ label, value, take }) {
  const [typed, setTyped, now] = useTyped();
  const done = () => {
    const text = now.current?.trim();
    setTyped(null);
    if (text && text !== value) take(text);
  };
  const press = (/** @type {KeyboardEvent} */ { key }) => {
    if (key === 'Enter') done();
    if (key === 'Escape') setTyped(null);
  };
  return html`<label class="field words" data-tip=${value.length > 16 ? value : undefined}
    ><span class="name">${label}</span>
    <input type="text" value=${typed ?? value} data-typed=${typed === null ? 'no' : 'yes'} spellcheck=${false} autocomplete="off"
      onInput=${(/** @type {any} */ event) => setTyped(event.currentTarget.value)} onBlur=${done}
      onKeyDown=${press} /></label>`;
}

/** @param {RGB} rgb */
const hexOf = (rgb) => toHex(atFull(rgb));
