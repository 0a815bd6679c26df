/** What is done to all selected lights, each time as one step. */

import { Button, Slider, useDraft } from '../controls.js';
import { lightCountText, signedText, stopsText, cleanNumberText } from '../format.js';
import { gradient } from '../colour_mixers.js';
import { stopsOf } from '../level_field.js';
import { fromKelvin } from '../../../../viewer/drawing/colour.js';
import { findTie } from '../tied_lights.js';
import { html, useState } from '../../vendor/preact.js';
import { LampColour } from './lamp_colour.js';
import { adjustableLights, colouredLights, isHeld } from './many_lights.js';
import { t } from '../../language/language.js';

/** @import { App, Ui } from '../ui_state.js' */

/** Ends of the sliders, in stops and in mireds. */
const [DIM_RANGE, WARM_RANGE] = [4, 100];

/** Cooler to warmer, as light around 4000 K looks. */
const WARM_TRACK = gradient([9000, 5600, 4000, 3000, 2300].map((kelvin) => fromKelvin(kelvin)));

/** A slider that dims lights by stops, and keeps their ratio.
 * @param {{app: App, lights: number[], label: string, isPlain?: boolean, disabled?: boolean}} props */
export function GroupDimmer({ app, lights, label, isPlain, disabled }) {
  return html`<${RelativeSlider} label=${label} range=${DIM_RANGE} step=${0.1} isPlain=${isPlain}
    disabled=${disabled} text=${(/** @type {number} */ stops) => t('{signed} st', { signed: signedText(stops) })} parse=${parseStops}
    tip=${t('Dims these lights together, which keeps their ratio, and locks them there')}
    hint=${t('Type stops (-1), percent (50 %) or off.')} say=${(/** @type {string} */ text) => app.session.toast(text)}
    change=${(/** @type {number} */ stops, /** @type {boolean} */ isFinal) =>
      app.session.many.dim(lights, 2 ** stops, isFinal)} />`;
}

/** @param {{ui: Ui, app: App}} props */
export function SelectionPanel({ ui, app }) {
  const [hasColour, setHasColour] = useState(false);
  const { selectedLights: lights } = ui;
  if (!lights.length) return null;
  const { many } = app.session;
  const coloured = colouredLights(ui, lights);
  const fixedCount = lights.length - adjustableLights(ui, lights).length;
  return html`<section class="lamp-selection" aria-label=${t('Selected lights')}>
    <div class="row">
      <strong role="status">${t('{count} selected', { count: lightCountText(lights.length) })}</strong>
      <span class="faint">${levelsText(ui, lights)}</span><span class="spring"></span>
      <${Button} icon="close" tip=${t('Select none')} keys="Escape" act=${() => app.store.set({ selectedLights: [] })} />
    </div>
    <${GroupDimmer} app=${app} lights=${lights} label=${t('Dim')} disabled=${fixedCount === lights.length} />
    <${RelativeSlider} label=${t('Warm')} range=${WARM_RANGE} step=${5} disabled=${!coloured.length} track=${WARM_TRACK}
      text=${(/** @type {number} */ mired) => t('{signed} mired', { signed: signedText(mired, 0) })} parse=${parseMired}
      tip=${t('Warmer to the right, in mireds; levels stay')} hint=${t('Type mireds: 20 is warmer, -20 cooler.')}
      say=${(/** @type {string} */ text) => app.session.toast(text)}
      change=${(/** @type {number} */ mired, /** @type {boolean} */ isFinal) =>
        many.warm(lights, mired, isFinal)} />
    <${Actions} ui=${ui} app=${app} hasColour=${hasColour} showColour=${setHasColour} />
    ${
      hasColour &&
      (coloured.length
        ? html`<${LampColour} ui=${ui} app=${app} lights=${coloured} />`
        : html`<p class="faint">${t('Tied lights, and lights with one number for all channels, keep their colours.')}</p>`)
    }
    ${fixedCount > 0 && html`<p class="faint">${t('{count} of these cannot be set.', { count: lightCountText(fixedCount) })}</p>`}
  </section>`;
}

/** @param {{ui: Ui, app: App, hasColour: boolean, showColour: (isShown: boolean) => void}} props */
function Actions({ ui, app, hasColour, showColour }) {
  const { selectedLights: lights, constraints, solo } = ui;
  const { session } = app;
  const { many } = session;
  const adjustable = adjustableLights(ui, lights);
  const names = adjustable.map((k) => ui.lights[k].name);
  const areHeld = adjustable.length > 0 && adjustable.every((k) => isHeld(ui, k));
  const areOff =
    adjustable.length > 0 && adjustable.every((k) => constraints[ui.lights[k].name]?.off);
  const tie = findTie(ui, lights[0]);
  const areTied = tie !== undefined && lights.every((k) => tie.includes(ui.lights[k].name));
  const isSolo = lights.every((k) => solo.includes(k));
  const toggleSolo = () =>
    app.store.set({
      solo: isSolo ? solo.filter((k) => !lights.includes(k)) : [...new Set([...solo, ...lights])],
    });
  return html`<div class="row">
    <${Button} label=${t('Colour')} pressed=${hasColour} tip=${t('Set the colour of all: white, HSV, RGB, hex or gel')}
      act=${() => showColour(!hasColour)} />
    <${Button} label=${areHeld ? t('Unlock') : t('Lock')} disabled=${!adjustable.length}
      tip=${areHeld ? t('Let the solve set them again') : t('Lock all as they are in the answer')}
      act=${() => void (areHeld ? many.unlock(lights) : many.lock(lights))} />
    <${Button} label=${areOff ? t('On') : t('Off')} disabled=${!adjustable.length}
      tip=${areOff ? t('Switch all on again') : t('Switch all off in every answer')}
      act=${() => void (areOff ? many.unlock(lights) : many.switchOff(lights))} />
    <${Button} label=${areTied ? t('Untie') : t('Tie')} disabled=${adjustable.length < 2}
      tip=${areTied ? t('Give each its own dimmer') : t('Put all on one dimmer')}
      act=${() => void (areTied ? session.untie(names) : session.tie(names))} />
    <${Button} label=${t('Solo')} pressed=${isSolo} tip=${t('Show these alone. The answer does not change.')}
      act=${toggleSolo} />
  </div>`;
}

/** Return the levels of lights, from the lowest to the highest. @param {Ui} ui
 * @param {number[]} lights */
export function levelsText(ui, lights) {
  const levels = lights.map((k) => stopsOf(ui.weights[k] ?? ui.lights[k].present, ui.lights[k]));
  const stops = levels.filter((level) => level !== null);
  if (!stops.length) return t('off');
  const [low, high] = [Math.min(...stops), Math.max(...stops)];
  const isEqual = stopsText(low) === stopsText(high);
  const text = isEqual
    ? stopsText(low)
    : t('{low} to {high} st', { low: signedText(low), high: signedText(high) });
  return stops.length < levels.length ? t('{text}, some off', { text }) : text;
}

/** A slider whose middle is not a change, and a field for the same in numbers.
 * @param {{label: string, range: number, step: number, text: (amount: number) => string, tip: string,
 *   parse: (text: string) => number | null, hint: string, change: (amount: number, isFinal: boolean) => void,
 *   say: (text: string) => void, disabled?: boolean, isPlain?: boolean, track?: string}} props
 * parse: null for text that is none. hint: what can be typed. isPlain: without a visible label */
function RelativeSlider(props) {
  const { label, range, step, text, parse, hint, change, say, disabled, isPlain, track, tip } =
    props;
  const [amount, setAmount] = useState(0);
  const [draft, setDraft, draftRef] = useDraft();
  const move = (/** @type {number} */ newAmount, /** @type {boolean} */ isFinal) => {
    setAmount(isFinal ? 0 : newAmount);
    change(newAmount, isFinal);
  };
  const take = () => {
    const typed = draftRef.current?.trim();
    setDraft(null);
    if (!typed) return;
    const parsed = parse(cleanNumberText(typed).toLowerCase());
    if (parsed === null) say(t('{typed} is not a change. {hint}', { typed, hint }));
    else if (parsed !== 0) change(parsed, true);
  };
  const press = (/** @type {any} */ event) => {
    const sign = { ArrowUp: 1, ArrowDown: -1 }[/** @type {string} */ (event.key)];
    if (event.key === 'Enter') take();
    if (event.key === 'Escape') setDraft(null);
    if (!sign) return;
    event.preventDefault();
    change(sign * step * (event.shiftKey ? 10 : 1), true);
  };
  return html`<div class="relative">
    ${!isPlain && html`<span class="name" aria-hidden="true">${label}</span>`}
    <${Slider} plain label=${label} value=${amount} min=${-range} max=${range} step=${step}
      text=${text(amount)} disabled=${disabled} change=${move} tip=${tip} track=${track} />
    <input class="level" type="text" autocomplete="off" spellcheck=${false} disabled=${disabled}
      data-typed=${draft === null ? 'no' : 'yes'} aria-label=${t('{label} by', { label })} data-tip=${hint}
      placeholder=${amount ? text(amount) : '±0'} value=${draft ?? ''}
      onInput=${(/** @type {any} */ event) => setDraft(event.currentTarget.value)}
      onBlur=${take} onKeyDown=${press} />
  </div>`;
}

/** Parse a change of level: stops (`-1`, `+0.5 st`), a factor in percent (`50 %`) or `off`.
 * @param {string} text @returns {number | null} in stops */
function parseStops(text) {
  if (text === 'off') return -Infinity;
  const match = /^([+-]?(?:\d+\.?\d*|\.\d+))\s*(%|st|stops?)?$/.exec(text);
  if (!match) return null;
  const amount = Number(match[1]);
  if (match[2] === '%') return amount >= 0 ? Math.log2(amount / 100) : null;
  return Math.abs(amount) <= MAX_TYPED_STOPS ? amount : null;
}

/** Largest typed change, in stops. */
const MAX_TYPED_STOPS = 20;

/** Parse a change of warmth. @param {string} text like `20`, `-35 mired` @returns {number | null} */
function parseMired(text) {
  const match = /^([+-]?(?:\d+\.?\d*|\.\d+))\s*(?:mired|mk)?$/.exec(text);
  return match && Math.abs(Number(match[1])) <= MAX_TYPED_MIRED ? Number(match[1]) : null;
}

const MAX_TYPED_MIRED = 500;
