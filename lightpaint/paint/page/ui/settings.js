/** How a painting is answered: a panel over those at the side, so that the pictures show what each
 * setting does. */

import { html, useLayoutEffect, useRef } from '../vendor/preact.js';
import { Button, Choice, Number_, useId } from './controls.js';
import { number } from './format.js';

/** @typedef {import("./model.js").Ui} Ui */
/** @typedef {import("./keys.js").Hands} Hands */

const AUTO = 'What suits a painting that was made here';

const SPACES = [
  { value: null, label: 'Automatic', tip: AUTO },
  { value: 'display', label: 'Display', tip: 'Differences count as the eye sees them' },
  { value: 'linear', label: 'Linear', tip: 'Differences count as light: bright places the most' },
];
const COLOURS = [
  { value: null, label: 'Automatic', tip: AUTO },
  { value: 'free', label: 'Free', tip: 'Any colour, whatever is best' },
  { value: 'gentle', label: 'Gentle', tip: 'Their own, unless the paint asks for others' },
  { value: 'white', label: 'White', tip: 'Whites of 2200 to 9000 K' },
];
const HOLDS = [
  { value: 'auto', label: 'Automatic', tip: AUTO },
  { value: 'hold', label: 'Hold', tip: 'It stays near how it looks now' },
  { value: 'go', label: 'Let go', tip: 'It may become anything: only the paint counts' },
];
const MEANT = [
  { value: false, label: 'As a sketch', tip: 'Strokes say where it should go' },
  { value: true, label: 'At its word', tip: 'Each stroke is the very light that is wanted' },
];
const UNSURE = [
  { value: false, label: 'May change', tip: 'Whatever brings the answer closer, however little' },
  { value: true, label: 'Stay', tip: 'As they are now, unless it brings much' },
];

/** What a choice means, in a few words. @type {Record<string, Record<string, string>>} */
const MEANS = {
  space: {
    display: 'differences as the eye sees them on a display',
    linear: 'differences of light, of which bright places have most',
  },
  colors: {
    free: 'any colour, whatever is best',
    gentle: 'their own, unless the paint asks for others',
    white: 'whites of 2200 to 9000 K',
  },
};

/** Strengths to begin with; the first is what is automatic, where something is held. */
const HOLD = 3;
const PREFER_CURRENT = 0.01;

/** @param {{ui: Ui, hands: Hands}} props */
export function SettingsPanel({ ui, hands }) {
  const { settings, meant } = ui;
  const id = useId();
  const set = (/** @type {string} */ key) => (/** @type {any} */ value) =>
    hands.session.setting(key, value);
  const close = () => hands.store.set({ panel: null });
  const hold = settings.hold ?? null;
  const manner = hold === null ? 'auto' : hold === 0 ? 'go' : 'hold';
  const stays = settings.prefer_current || null;
  return html`<${Panel} labelledby=${id} close=${close}>
    <div class="panel-head">
      <h2 id=${id}>How the painting is answered</h2>
      <${Button} icon="close" tip="Close" keys="Escape" act=${close} />
    </div>
    <${Row} title="What you did not paint" says=${said(hold === null, ofUnpainted(meant.hold))}>
      <${Choice} label="What you did not paint" value=${manner} choices=${HOLDS}
        change=${(/** @type {string} */ to) => set('hold')({ auto: null, hold: hold || HOLD, go: 0 }[to])} />
      ${
        manner === 'hold' &&
        html`<${Number_} label="How firmly" value=${hold} least=${0.01} most=${100} step=${0.1}
        unit="×" tip="1: it counts as much as all that is painted; 3, as usual: three times as much"
        change=${set('hold')} />`
      }
    </${Row}>
    <${Row} title="What counts as close" says=${said(!settings.space, MEANS.space[meant.space])}>
      <${Choice} label="What counts as close" value=${settings.space ?? null} choices=${SPACES}
        change=${set('space')} /></${Row}>
    <${Row} title="Which colours lamps may have"
      says=${said(!settings.colors, MEANS.colors[meant.colors])}>
      <${Choice} label="Which colours lamps may have" value=${settings.colors ?? null}
        choices=${COLOURS} change=${set('colors')} /></${Row}>
    <${Row} title="How the paint is meant" says=${
      settings.literal
        ? 'every stroke is exact: linear, nothing held, any colour, but for what is chosen above'
        : 'strokes say where it should go, and the rest of the picture has a say, too'
    }>
      <${Choice} label="How the paint is meant" value=${Boolean(settings.literal)} choices=${MEANT}
        change=${set('literal')} /></${Row}>
    <${Row} title="Lights that hardly help" says=${
      stays ? 'they stay as they are now' : 'they may change, too'
    }>
      <${Choice} label="Lights that hardly help" value=${stays !== null} choices=${UNSURE}
        change=${(/** @type {boolean} */ stay) =>
          set('prefer_current')(stay ? (stays ?? PREFER_CURRENT) : null)} />
      ${
        stays !== null &&
        html`<${Number_} label="How strongly" value=${stays} least=${0.001} most=${10} step=${0.01}
        digits=${3} tip="0.01: where the paint leaves it open; 1: unless it brings very much"
        change=${set('prefer_current')} />`
      }
    </${Row}>
    <${Row} title="How many lights may be on" says=${
      settings.sparse
        ? 'those that serve best, beside locked ones; the others are off'
        : 'all that serve'
    }>
      <${Number_} label="At most" value=${settings.sparse ?? null} least=${1} digits=${0}
        most=${ui.lights.length || 1} empty="all" unit="lights"
        tip="Empty: as many as there are" change=${set('sparse')} /></${Row}>
  </${Panel}>`;
}

/**
 * Over the panels at the side. It takes the focus, which goes back to where it was; Escape closes it.
 * @param {{labelledby: string, close: () => void, children?: any}} props
 */
function Panel({ labelledby, close, children }) {
  const ref = useRef(/** @type {HTMLElement | null} */ (null));
  useLayoutEffect(() => {
    const element = ref.current;
    if (!element) return undefined;
    const root = /** @type {Document | ShadowRoot} */ (element.getRootNode());
    const before = /** @type {HTMLElement | null} */ (root.activeElement);
    element.focus({ preventScroll: true });
    return () => {
      if (element.contains(root.activeElement)) before?.focus?.();
    };
  }, []);
  const press = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== 'Escape') return;
    event.preventDefault();
    event.stopPropagation();
    close();
  };
  return html`<aside class="side settings" ref=${ref} tabindex="-1" aria-labelledby=${labelledby}
    onKeyDown=${press}>${children}</aside>`;
}

/** @param {{title: string, says: string, children?: any}} props */
function Row({ title, says, children }) {
  return html`<section class="setting"><h3>${title}</h3>
    <div class="row">${children}</div><p class="faint">${says}</p></section>`;
}

/** What is so, and whether that follows from the painting. @param {boolean} isAuto
 * @param {string | undefined} text */
function said(isAuto, text = '') {
  return isAuto && text ? `at present: ${text}` : text;
}

/** What becomes of what is not painted. @param {number | null | undefined} hold */
function ofUnpainted(hold) {
  if (hold === undefined || hold === null) return '';
  if (!hold) return 'it may become anything';
  const much = hold === 1 ? 'as much' : `${number(hold)} times as much`;
  return `it stays near how it looks now, and counts ${much} as all that is painted`;
}
