/** Controls for changes relative to the present: each goes back to the middle when it is let go. */

import { Slider, useDraft } from '../controls.js';
import { cleanNumberText } from '../format.js';
import { html, useState } from '../../vendor/preact.js';
import { t } from '../../language/language.js';

/** A slider whose middle is not a change, and a field for the same in numbers.
 * @param {{label: string, range: number, step: number, text: (amount: number) => string, tip: string,
 *   parse: (text: string) => number | null, hint: string, change: (amount: number, isFinal: boolean) => void,
 *   say: (text: string) => void, disabled?: boolean, isPlain?: boolean, track?: string}} props
 * parse: null for text that is none. hint: what can be typed. isPlain: without a visible label */
export function RelativeSlider(props) {
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
export function parseStops(text) {
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
export function parseMired(text) {
  const match = /^([+-]?(?:\d+\.?\d*|\.\d+))\s*(?:mired|mk)?$/.exec(text);
  return match && Math.abs(Number(match[1])) <= MAX_TYPED_MIRED ? Number(match[1]) : null;
}

const MAX_TYPED_MIRED = 500;
