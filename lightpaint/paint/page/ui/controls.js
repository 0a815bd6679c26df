/** The controls that panels are made of. All have labels and work by keyboard and touch. */

import { slideByTouch } from '../../../viewer/touch_sliders.js';
import { html, useLayoutEffect, useRef, useState } from '../vendor/preact.js';
import { cleanNumberText, typedNumber } from './format.js';
import { Icon } from './icons.js';
import { t } from '../language/language.js';

/** The text being typed in a field, null if none, as state and as a ref. Event handlers read the
 * ref before the next render, so that text cancelled by Escape is not taken when the field loses
 * focus.
 * @returns {[string | null, (text: string | null) => void, {current: string | null}]} */
export function useDraft() {
  const [draft, set] = useState(/** @type {string | null} */ (null));
  const draftRef = useRef(draft);
  const setDraft = (/** @type {string | null} */ text) => {
    draftRef.current = text;
    set(text);
  };
  return [draft, setDraft, draftRef];
}

let lastId = 0;

/** @returns {string} an id that no other element of the page has */
export function useId() {
  const [id] = useState(() => `lp-${(lastId += 1)}`);
  return id;
}

/** A button with an icon, a word, or both. `tip` is its label where it has no word.
 * @param {{icon?: string, label?: string, tip?: string, keys?: string, pressed?: boolean,
 *   disabled?: boolean, primary?: boolean, act: (event: MouseEvent) => void, class?: string}} props */
export function Button({ icon, label, tip, keys, pressed, disabled, primary, act, class: name }) {
  const kind = [
    'button',
    icon && !label && 'is-icon',
    pressed && 'is-on',
    primary && 'is-primary',
    name,
  ]
    .filter(Boolean)
    .join(' ');
  const hint = tip ?? (keys ? label : undefined);
  return html`<button type="button" class=${kind} disabled=${disabled} onClick=${act}
    aria-label=${label && label.length > 1 ? undefined : tip} aria-pressed=${pressed === undefined ? undefined : String(pressed)}
    aria-keyshortcuts=${keys} data-tip=${hint} data-keys=${keys}>
    ${icon && html`<${Icon} name=${icon} />`}${label && html`<span>${label}</span>`}
  </button>`;
}

/** One of the choices of `Choice` or `Select`.
 * @template {string | boolean | null} T @param {T} value @param {string} label @param {string} [tip] */
export const option = (value, label, tip) => ({ value, label, tip });

/** A choice of one among a few visible options.
 * @param {{label: string, value: any, choices: {value: any, label: string, icon?: string,
 *   tip?: string, keys?: string, disabled?: boolean}[], change: (value: any) => void,
 *   icons?: boolean}} props */
export function Choice({ label, value, choices, change, icons }) {
  return html`<div class="choice" role="group" aria-label=${label}>
    ${choices.map(
      (choice) => html`<${Button} key=${String(choice.value)} icon=${choice.icon}
      label=${icons ? undefined : choice.label} tip=${choice.tip ?? (icons ? choice.label : undefined)}
      keys=${choice.keys} pressed=${choice.value === value} disabled=${choice.disabled}
      act=${() => change(choice.value)} />`,
    )}
  </div>`;
}

/** Characters that fit into a field or a list in any panel. */
const MAX_VISIBLE_CHARACTERS = 12;

/** A choice of one among many. Its tip repeats text that may not fit.
 * @param {{label: string, value: string, choices: {value: string, label: string}[],
 *   change: (value: string) => void, hidden?: boolean, tip?: string}} props */
export function Select({ label, value, choices, change, hidden, tip }) {
  const chosenLabel = choices.find((choice) => choice.value === value)?.label ?? '';
  const fullText =
    chosenLabel.length > MAX_VISIBLE_CHARACTERS && !tip?.includes(chosenLabel) ? chosenLabel : null;
  return html`<label class="field" data-tip=${[tip, fullText].filter(Boolean).join(': ') || undefined}>
    <span class=${hidden ? 'only-read' : 'name'}>${label}</span>
    <select value=${value}
      onChange=${(/** @type {any} */ event) => change(event.currentTarget.value)}>
      ${choices.map(
        (choice) => html`<option key=${choice.value} value=${choice.value}
        selected=${choice.value === value}>${choice.label}</option>`,
      )}
    </select>
  </label>`;
}

/** @param {{label: string, checked: boolean, change: (checked: boolean) => void, tip?: string,
 *   disabled?: boolean, keys?: string, hidden?: boolean}} props */
export function Checkbox({ label, checked, change, tip, disabled, keys, hidden }) {
  return html`<label class="check" data-tip=${tip} data-keys=${keys}>
    <input type="checkbox" checked=${checked} disabled=${disabled} aria-keyshortcuts=${keys}
      onChange=${(/** @type {any} */ event) => change(event.currentTarget.checked)} />
    <span class=${hidden ? 'only-read' : undefined}>${label}</span>
  </label>`;
}

/** A line of text, taken on Enter or when the field loses focus, cancelled by Escape. `take` gets text
 * that is neither empty nor the old one. tip: of text that may not fit.
 * @param {{label: string, value: string, take: (text: string) => void, class: string, maxLength?: number,
 *   hidden?: boolean, tip?: string}} props */
export function TextField({ label, value, take, class: kind, maxLength, hidden, tip }) {
  const [draft, setDraft, draftRef] = useDraft();
  const commit = () => {
    const text = draftRef.current?.trim();
    setDraft(null);
    if (text && text !== value) take(text);
  };
  const press = (/** @type {KeyboardEvent} */ { key }) => {
    if (key === 'Enter') commit();
    if (key === 'Escape') setDraft(null);
  };
  return html`<label class=${`field ${kind}`} data-tip=${tip}
    ><span class=${hidden ? 'only-read' : 'name'}>${label}</span>
    <input type="text" value=${draft ?? value} data-typed=${draft === null ? 'no' : 'yes'} spellcheck=${false} autocomplete="off"
      maxlength=${maxLength} onInput=${(/** @type {any} */ event) => setDraft(event.currentTarget.value)}
      onBlur=${commit} onKeyDown=${press} /></label>`;
}

/** A typed number: taken on Enter or when the field loses focus, cancelled by Escape, stepped by the
 * arrow keys. digits: after the point; figures: significant digits that are shown, instead, while a
 * typed number is taken in full. start: value from which the keys step in an empty field. For text that
 * cannot be taken as it is, the field sends the event `refused`, with a sentence as its detail.
 * @param {{label: string, value: number | null, change: (value: number | null) => void,
 *   min?: number, max?: number, step?: number, digits?: number, figures?: number, unit?: string,
 *   start?: number, hidden?: boolean, placeholder?: string, disabled?: boolean, tip?: string}} props */
export function NumberField(props) {
  const { label, value, change, step = 1, digits = 2, unit, hidden, placeholder, disabled } = props;
  const { min = -Infinity, max = Infinity, figures, start = 0, tip } = props;
  const [draft, setDraft, draftRef] = useDraft();
  const round = (/** @type {number} */ x) =>
    Number(figures ? x.toPrecision(figures) : x.toFixed(digits));
  const displayText = draft ?? (value === null ? '' : String(round(value)));
  const clamp = (/** @type {number} */ x) => Math.min(max, Math.max(min, x));
  const take = (/** @type {string} */ text, /** @type {HTMLElement} */ field) => {
    setDraft(null);
    const refuse = (/** @type {string} */ detail) =>
      field.dispatchEvent(new CustomEvent('refused', { bubbles: true, composed: true, detail }));
    const [typed, number] = [text.trim(), typedNumber(text)];
    if (!typed) return void (placeholder !== undefined && change(null));
    if (!Number.isFinite(number)) {
      refuse(t('{label} is {typed}: expected a number', { label, typed }));
      return;
    }
    const taken = clamp(figures ? number : round(number));
    if (number < min || number > max)
      refuse(
        t('{label} cannot be {typed}: it is {taken} now', { label, typed, taken: round(taken) }),
      );
    change(taken);
  };
  const press = (/** @type {any} */ event) => {
    const sign = { ArrowUp: 1, ArrowDown: -1 }[/** @type {string} */ (event.key)];
    if (event.key === 'Enter') take(event.currentTarget.value, event.currentTarget);
    if (event.key === 'Escape') setDraft(null);
    if (!sign) return;
    event.preventDefault();
    setDraft(null);
    if (!displayText && sign < 0) return; // no negative amounts
    const base = displayText ? Number(cleanNumberText(displayText)) || 0 : start;
    change(clamp(round(base + sign * step * (event.shiftKey ? 10 : 1))));
  };
  return html`<label class="field number" data-tip=${tip}>
    <span class=${hidden ? 'only-read' : 'name'}>${label}</span>
    <input type="text" inputmode="decimal" value=${displayText} placeholder=${placeholder} autocomplete="off"
      data-typed=${draft === null ? 'no' : 'yes'} disabled=${disabled} onKeyDown=${press}
      onInput=${(/** @type {any} */ event) => setDraft(event.currentTarget.value)}
      onBlur=${(/** @type {any} */ event) =>
        draftRef.current !== null && take(draftRef.current, event.currentTarget)} />
    ${unit !== undefined && html`<span class="unit" aria-hidden="true">${unit}</span>`}
  </label>`;
}

/** A slider with its number beside it. `change(value, done)`: done is false while it moves. `curve`
 * maps a value to a place and back; if it decreases, the greatest value is left.
 * @param {{label: string, value: number, min: number, max: number, step?: number, unit?: string,
 *   digits?: number, change: (value: number, isFinal: boolean) => void, track?: string, resetValue?: number,
 *   curve?: {toPosition: (x: number) => number, toValue: (t: number) => number}, text?: string, plain?: boolean,
 *   disabled?: boolean, keys?: string, tip?: string}} props */
export function Slider(props) {
  const { label, value, min, max, step = 1, unit, digits = 0, change, track, resetValue } = props;
  const { curve, text, plain, disabled, keys, tip } = props;
  const toPosition = curve?.toPosition ?? ((/** @type {number} */ x) => x);
  const toValue = curve?.toValue ?? ((/** @type {number} */ x) => x);
  const move = (/** @type {number} */ position, /** @type {boolean} */ isFinal) =>
    change(toValue(position), isFinal);
  const moveTo = (/** @type {any} */ event, /** @type {boolean} */ isFinal) =>
    move(Number(event.currentTarget.value), isFinal);
  const input = useRef(/** @type {HTMLInputElement | null} */ (null));
  const latest = useRef({ move, position: toPosition(value) });
  latest.current = { move, position: toPosition(value) };
  useLayoutEffect(() => {
    const element = input.current;
    if (!element) return undefined;
    const controller = new AbortController();
    slideByTouch(
      element,
      (position, isFinal) => latest.current.move(position, isFinal),
      () => (element.value = String(latest.current.position)),
      controller.signal,
    );
    return () => controller.abort();
  }, []);
  const [low, high] = [toPosition(min), toPosition(max)].sort((a, b) => a - b);
  const share = Math.min(1, Math.max(0, (toPosition(value) - low) / (high - low)));
  return html`<div class="slider" data-tip=${tip} data-keys=${keys}>
    ${!plain && html`<span class="name" aria-hidden="true">${label}</span>`}
    <input type="range" ref=${input} aria-label=${label} min=${low} max=${high}
      step=${curve ? (high - low) / 200 : step} value=${toPosition(value)} disabled=${disabled}
      aria-valuetext=${text ?? `${Number(value.toFixed(digits))} ${unit ?? ''}`.trim()}
      class=${track ? 'has-track' : ''}
      style=${{ '--at': String(share), ...(track ? { '--track': track } : {}) }}
      onInput=${(/** @type {any} */ event) => moveTo(event, false)}
      onChange=${(/** @type {any} */ event) => moveTo(event, true)}
      onDblClick=${() => resetValue !== undefined && change(resetValue, true)} />
    ${
      !plain &&
      html`<${NumberField} label=${label} hidden value=${value} min=${min} max=${max}
      step=${step} digits=${digits} unit=${unit ?? ''} disabled=${disabled}
      change=${(/** @type {number} */ number) => change(number, true)} />`
    }
  </div>`;
}

/** Text that may be truncated: if it is longer than a number of characters, its tip has all of it,
 * also for the keyboard.
 * @param {{text: string, maxLength: number, class?: string, tag?: string}} props */
export function TruncatedText({ text, maxLength, class: name, tag: Tag = 'span' }) {
  const isLong = text.length > maxLength;
  return html`<${Tag} class=${name} data-tip=${isLong ? text : undefined}
    tabindex=${isLong ? 0 : undefined}>${text}</${Tag}>`;
}

/**
 * A collapsible section of the side bar, which has a name there and can be moved. The caller keeps whether it is open.
 * @param {{title: string, name: string, open: boolean, toggle: () => void, children?: any,
 *   extra?: any, class?: string}} props
 */
export function Fold({ title, name, open, toggle, children, extra, class: classes }) {
  const id = useId();
  return html`<section class=${`fold ${classes ?? ''} ${open ? 'is-open' : ''}`} aria-label=${title}
    data-panel=${name}>
    <div class="fold-head">
      <h2><button type="button" aria-expanded=${String(open)} aria-controls=${id} onClick=${toggle}
        aria-keyshortcuts="Alt+ArrowUp Alt+ArrowDown">
        <${Icon} name="fold" /><span>${title}</span></button></h2>
      ${extra}
      <span class="fold-grip" aria-hidden="true" data-tip=${t('Drag this panel to another place')}><${Icon} name="grip" /></span>
    </div>
    <div class="fold-body" id=${id} hidden=${!open}>${open && children}</div>
  </section>`;
}

/** Scroll a part of the painter into view once it exists, and optionally focus it.
 * @param {HTMLElement} element whatever in the same painter @param {string} name @param {boolean} [isFocused]
 */
export function reveal(element, name, isFocused = false) {
  const root = element.closest('.lightpaint');
  requestAnimationFrame(() => {
    const part = /** @type {HTMLElement | null | undefined} */ (root?.querySelector(name));
    part?.scrollIntoView({ block: 'nearest' });
    if (isFocused) part?.focus({ preventScroll: true });
  });
}

/** Height in pixels below which the visible part of a painter is too low for a dialog. */
const MIN_DIALOG_HEIGHT = 300;

/** Place a dialog over the visible part of the painter. The centre of the frame may be far away: VS
 * Code shows all outputs of a notebook in one frame, as high as all of them together.
 * @param {HTMLElement} element */
function placeOver(element) {
  const root = /** @type {HTMLElement} */ (element.closest('.lightpaint'));
  const box = root.getBoundingClientRect();
  const { clientWidth, clientHeight } = document.documentElement;
  const [left, right] = [Math.max(0, box.left), Math.max(0, clientWidth - box.right)];
  let [top, bottom] = [Math.max(0, box.top), Math.max(0, clientHeight - box.bottom)];
  if (clientHeight - top - bottom < MIN_DIALOG_HEIGHT) top = bottom = 0;
  const lengths = { top, right, bottom, left };
  for (const [name, length] of Object.entries(lengths)) {
    element.style.setProperty(`--${name}`, `${length}px`);
  }
}

/** A dialog over the painter that keeps the focus until it is closed; Escape closes it.
 * @param {{title: string, close: () => void, children?: any, class?: string}} props */
export function Dialog({ title, close, children, class: name }) {
  const ref = useRef(/** @type {HTMLDialogElement | null} */ (null));
  const id = useId();
  // At once, since the next key may be Escape.
  useLayoutEffect(() => {
    const element = ref.current;
    const previousFocus = /** @type {HTMLElement | null} */ (
      /** @type {Document | ShadowRoot | undefined} */ (element?.getRootNode())?.activeElement
    );
    if (element && !element.open) element.showModal();
    const position = () => element && placeOver(element);
    position();
    window.addEventListener('resize', position);
    return () => {
      window.removeEventListener('resize', position);
      previousFocus?.focus?.();
    };
  }, []);
  return html`<dialog class=${`dialog ${name ?? ''}`} ref=${ref} aria-labelledby=${id}
    onClose=${close} onClick=${(/** @type {any} */ event) => event.target === ref.current && close()}>
    <div class="dialog-head">
      <h2 id=${id}>${title}</h2>
      <${Button} icon="close" tip=${t('Close')} act=${close} />
    </div>
    <div class="dialog-body">${children}</div>
  </dialog>`;
}

/** @param {{progress: {done: number, total: number, unit?: string}, label: string}} props */
export function ProgressBar({ progress, label }) {
  const { done, total } = progress;
  const isKnown = total > 0;
  return html`<span class=${`bar ${isKnown ? '' : 'is-endless'}`} role="progressbar"
    aria-label=${label} aria-valuemin="0" aria-valuemax=${isKnown ? total : undefined}
    aria-valuenow=${isKnown ? done : undefined}>
    <i style=${{ '--share': String(isKnown ? Math.min(1, done / total) : 1) }}></i></span>`;
}
