/** What the solve may do with one light: all that can be asked of it, in words of the trade. */

import { html, useState } from '../vendor/preact.js';
import { atFull, luminance, ofKelvin, toHex, toKelvin } from './paint_colour.js';
import { Button, Choice, Number_, Select, useTyped } from './controls.js';
import { number } from './format.js';
import { KelvinSlider } from './kelvin_slider.js';
import { DARKEST, atLevel, isOnNow, nowOf, stopsOf } from './level_field.js';

/** @typedef {import("./ui_state.js").Asked} Asked */
/** @typedef {import("./engine_interface.js").RGB} RGB */

const MANNERS = [
  { value: 'free', label: 'Free', tip: 'The solve sets it' },
  { value: 'held', label: 'Locked', tip: 'Locked at a level that you set' },
  { value: 'present', label: 'As now', tip: 'It stays as it is in the scene' },
  { value: 'off', label: 'Off', tip: 'Switched off in every answer' },
];
const COLOURS = [
  { value: 'any', label: 'Any colour' },
  { value: 'color', label: 'One colour' },
  { value: 'kelvin', label: 'White range' },
  { value: 'primaries', label: 'LED mix' },
];

/** @param {import("./light_row.js").Props} props */
export function Asking(props) {
  const { k, light, hands, asked = {}, rgb, tied } = props;
  const { session } = hands;
  if (light.is_fixed) return html`<p class="asking-light faint">This light is not adjusted.</p>`;
  const manner = asked.off
    ? 'off'
    : asked.lock === true
      ? 'present'
      : asked.lock !== undefined
        ? 'held'
        : 'free';
  const change = (/** @type {string} */ to) => {
    if (to === 'free') session.release(k);
    if (to === 'held') session.hold(k, rgb, true);
    if (to === 'present') session.ask(k, { lock: true });
    if (to === 'off') session.turn(k, true);
  };
  return html`<div class="asking-light" role="group" aria-label=${`Constraints on ${light.label}`}>
    <h3>Constraints</h3>
    <${Choice} label="Level" value=${manner} choices=${MANNERS} change=${change} />
    ${
      manner === 'held' &&
      html`<${Held} ...${props} />
      ${!light.is_scalar && !tied && html`<${HeldColour} ...${props} />`}`
    }
    ${
      manner === 'free' &&
      html`<${Limits} ...${props} />
      ${
        tied && colourOf(asked) === 'any'
          ? html`<p class="faint">Tied lights keep their present colours.</p>`
          : !light.is_scalar && html`<${Colours} ...${props} />`
      }`
    }
    <${Ties} ...${props} />
  </div>`;
}

/** @param {import("./light_row.js").Props} props */
function Held({ k, light, hands, rgb }) {
  const [unit, setUnit] = useState(isOnNow(light) ? 'stops' : 'value');
  const level = luminance(rgb);
  const hold = (/** @type {number} */ to) => hands.session.hold(k, atLevel(rgb, light, to), true);
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
    <${Number_} label="Locked at" value=${value} least=${least} most=${unit === 'stops' ? 20 : undefined}
      figures=${unit === 'stops' ? undefined : FIGURES} step=${step} start=${DARKEST}
      empty=${unit === 'stops' ? 'off' : undefined}
      change=${(/** @type {number | null} */ to) => hold(to === null ? 0 : of(to))} />
    ${
      isOnNow(light) &&
      html`<${Select} label="Unit" value=${unit} choices=${units} change=${setUnit} />`
    }
  </div>`;
}

/** Of levels that are shown and taken: lamps are anything from 1e-5 to 1e9 units. */
const FIGURES = 6;

/** What levels of a light are given in. @param {import("./ui_state.js").Light} light */
const unitsOf = (light) => [
  { value: 'share', label: '% of now' },
  { value: 'value', label: light.unit || 'value' },
];

/** The white that a light is held at, as bright as it is. @param {import("./light_row.js").Props} props */
function HeldColour({ k, hands, rgb }) {
  const level = luminance(rgb);
  const [last, setLast] = useState(/** @type {number | null} */ (null));
  // Where it is no white, or off, what was chosen last stays on the slider.
  const kelvin = (level > 0 ? toKelvin(rgb)?.kelvin : null) ?? last ?? 3200;
  const change = (/** @type {number} */ made, /** @type {boolean} */ done) => {
    setLast(made);
    const white = ofKelvin(made);
    const factor = level / luminance(white);
    hands.session.hold(k, /** @type {RGB} */ (white.map((x) => x * factor)), done);
  };
  return html`<div class="held-colour"><${KelvinSlider} value=${kelvin} disabled=${level <= 0}
    change=${change} /></div>`;
}

/** @param {import("./light_row.js").Props} props */
function Limits({ k, light, hands, asked = {} }) {
  const limits = asked.limits ?? {};
  const given = Object.values(limits);
  const canShare = isOnNow(light);
  const [chosen, setUnit] = useState(canShare ? 'share' : 'value');
  // A lights file may have luminances, shares and colours: what is no share is shown as luminance.
  const areShares = given.every((x) => typeof x === 'string');
  const unit = given.length ? (areShares ? 'share' : 'value') : chosen;
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
      hands.session.toast(
        `The minimum (${low}) is above the maximum (${high}). The limits have not changed.`,
      );
      return;
    }
    const { limits: _, ...rest } = asked;
    hands.session.ask(k, Object.keys(kept).length ? { ...rest, limits: kept } : rest);
  };
  const into = (/** @type {string} */ to) => {
    setUnit(to);
    if (!given.length || to === unit) return;
    const turned = Object.entries(limits).map(([key, x]) => {
      const its = Number(amount(x, light, to).toPrecision(FIGURES));
      return [key, to === 'share' ? `${its}%` : its];
    });
    hands.session.ask(k, { ...asked, limits: Object.fromEntries(turned) });
  };
  return html`<div class="ask-fields is-levels">
    <${Number_} label="Min" value=${shown(limits.min)} least=${0} empty="–" step=${5}
      change=${(/** @type {number | null} */ value) => set('min', value)} figures=${FIGURES} />
    <${Number_} label="Max" value=${shown(limits.max)} least=${0} empty="–" step=${5}
      change=${(/** @type {number | null} */ value) => set('max', value)} figures=${FIGURES} />
    ${
      canShare &&
      html`<${Select} label="Unit" value=${unit} choices=${unitsOf(light)} change=${into} />`
    }
  </div>`;
}

/** A limit, as of a lights file: a luminance, a share of the present as '40%', or a colour.
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

/** What is asked of a light's colour. @param {Asked} asked */
const colourOf = (asked) =>
  ['color', 'kelvin', 'primaries'].find((key) => asked[key] !== undefined) ?? 'any';

/** @param {import("./light_row.js").Props} props */
function Colours(props) {
  const { k, hands, asked = {}, rgb } = props;
  const kind = colourOf(asked);
  const { color, kelvin, duv, primaries, ...rest } = asked;
  const change = (/** @type {string} */ to) => {
    const made = {
      any: {},
      color: { color: hexOf(rgb) },
      kelvin: { kelvin: [2700, 6500] },
      primaries: { primaries: ['#ff0000', '#00ff00', '#0000ff'] },
    }[to];
    hands.session.ask(k, { ...rest, ...made });
  };
  return html`<div class="ask-row">
      <${Select} label="Colour" value=${kind} choices=${COLOURS} change=${change} /></div>
    ${kind === 'color' && html`<${One} ...${props} rest=${rest} />`}
    ${kind === 'kelvin' && html`<${Whites} ...${props} rest=${rest} />`}
    ${
      kind === 'primaries' &&
      html`<${Words} label="LEDs" value=${[...primaries].join(', ')}
      take=${(/** @type {string} */ text) =>
        hands.session.ask(k, { ...rest, primaries: text.split(/[\s,]+/).filter(Boolean) })} />`
    }`;
}

/** @param {any} props */
function One({ k, hands, asked, rest, rgb }) {
  const text = Array.isArray(asked.color) ? hexOf(asked.color) : String(asked.color);
  const found = toKelvin(rgb);
  return html`<div class="ask-row">
    <${Words} label="Hex or kelvin" value=${text}
      take=${(/** @type {string} */ color) => hands.session.ask(k, { ...rest, color })} />
    ${
      found &&
      html`<${Button} label=${`${Math.round(found.kelvin / 50) * 50}K`}
      tip="The white nearest to its colour in the answer" act=${() =>
        hands.session.ask(k, { ...rest, color: `${Math.round(found.kelvin / 50) * 50}K` })} />`
    }
  </div>`;
}

/** @param {any} props */
function Whites({ k, hands, asked, rest }) {
  const ends = [asked.kelvin].flat();
  const [low, high] = [ends[0], ends.at(-1)];
  const set = (/** @type {number} */ a, /** @type {number} */ b, /** @type {number} */ duv) =>
    hands.session.ask(k, {
      ...rest,
      kelvin: a === b ? a : [Math.min(a, b), Math.max(a, b)],
      ...(duv ? { duv } : {}),
    });
  const duv = asked.duv ?? 0;
  return html`<div class="ask-fields">
    <${Number_} label="From" value=${low} least=${1000} most=${25000} step=${100} digits=${0}
      unit="K" change=${(/** @type {number} */ to) => set(to, high, duv)} />
    <${Number_} label="To" value=${high} least=${1000} most=${25000} step=${100} digits=${0}
      unit="K" change=${(/** @type {number} */ to) => set(low, to, duv)} />
    <${Number_} label="Tint" value=${1000 * duv} least=${-20} most=${20} digits=${1}
      tip="Duv × 1000: above 0 green, below 0 magenta"
      change=${(/** @type {number} */ to) => set(low, high, to / 1000)} />
  </div>`;
}

/** @param {import("./light_row.js").Props} props */
function Ties({ light, hands, tied, others = [] }) {
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
        .join(', ')}</span><${Button} label="Untie" act=${() => hands.session.untie(light.name)} />`
    }
    <${Select} label=${tied ? 'Also tie to' : 'Tie to'} value="" choices=${choices}
      change=${(/** @type {string} */ name) => name && hands.session.tie(light.name, name)} />
  </div>`;
}

/** @param {{label: string, value: string, take: (text: string) => void}} props */
function Words({ label, value, take }) {
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
    <input type="text" value=${typed ?? value} spellcheck="false" autocomplete="off"
      onInput=${(/** @type {any} */ event) => setTyped(event.currentTarget.value)} onBlur=${done}
      onKeyDown=${press} /></label>`;
}

/** @param {RGB} rgb */
const hexOf = (rgb) => toHex(atFull(rgb));
