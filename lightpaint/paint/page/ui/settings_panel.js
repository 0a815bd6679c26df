/**
 * The settings of the solve and of the page: a panel over the side panels, so that the pictures show
 * the effect of each.
 */

import { html, useLayoutEffect, useRef, useState } from '../vendor/preact.js';
import { Button, Choice, NumberField, Select, useId, option } from './controls.js';
import { capitalized, numberText } from './format.js';
import { language, languageChoices, storeLanguage, t } from '../language/language.js';
import { startTour } from './tour.js';

/** @import { App, Ui } from './ui_state.js' */

const AUTOMATIC_TIP = t('The best choice for a painting made here');

const SPACES = [
  option(null, t('Automatic'), AUTOMATIC_TIP),
  option('display', t('Display'), t('Differences as the eye sees them on a display')),
  option('linear', t('Linear'), t('Differences in linear light: bright areas count most')),
];
const COLOURS = [
  option(null, t('Automatic'), AUTOMATIC_TIP),
  option('free', t('Free'), t('Any colour')),
  option('gentle', t('Gentle'), t('Their own, unless the paint asks for another')),
  option('white', t('White'), t('Whites from 2200 to 9000 K')),
  option('own', t('Own'), t('Only the colours they have: lamps only get brighter or dimmer')),
];
const HOLDS = [
  option('auto', t('Automatic'), AUTOMATIC_TIP),
  option('hold', t('Hold'), t('They stay near their current look')),
  option('go', t('Ignore'), t('They may change freely: only the paint counts')),
];
const PAINT_READINGS = [
  option(false, t('Sketch'), t('Strokes show what should change')),
  option(true, t('Literal'), t('Each stroke is the exact light you want')),
];
const THEMES = [
  { value: 'system', label: t('System'), tip: t('As the system, or the notebook around it') },
  { value: 'dark', label: t('Dark') },
  { value: 'light', label: t('Light', { context: 'theme' }) },
];
const MINOR_LIGHTS = [
  option(false, t('May change'), t('Every change that brings the answer closer')),
  option(true, t('Stay'), t('As they are now, unless a change helps much')),
];

/** Short explanations of the choices. @type {Record<string, Record<string, string>>} */
const DESCRIPTIONS = {
  space: {
    display: t('differences as the eye sees them on a display'),
    linear: t('differences in linear light, where bright areas count most'),
  },
  colors: {
    free: t('any colour'),
    gentle: t('their own, unless the paint asks for another'),
    white: t('whites from 2200 to 9000 K'),
    own: t('only the colours they have'),
  },
};

/** Initial strengths; the first is the automatic one, if something is held. */
const DEFAULT_HOLD = 4;
const DEFAULT_PREFER_CURRENT = 0.01;

/** @param {{ui: Ui, app: App}} props */
export function SettingsPanel({ ui, app }) {
  const { settings, effectiveSettings } = ui;
  const id = useId();
  const set = (/** @type {string} */ key) => (/** @type {any} */ value) =>
    app.session.changeSetting(key, value);
  const close = () => app.store.set({ panel: null });
  const hold = settings.hold ?? null;
  const mode = hold === null ? 'auto' : hold === 0 ? 'go' : 'hold';
  const pull = settings.prefer_current || null;
  return html`<${Panel} labelledby=${id} close=${close}>
    <div class="panel-head">
      <h2 id=${id}>${t('Solve settings')}</h2>
      <${Button} icon="close" tip=${t('Close')} keys="Escape" act=${close} />
    </div>
    <${Row} title=${t('Unpainted parts')} description=${describeSource(hold === null, describeHold(effectiveSettings.hold))}>
      <${Choice} label=${t('Unpainted parts')} value=${mode} choices=${HOLDS}
        change=${(/** @type {string} */ newMode) => set('hold')({ auto: null, hold: hold || DEFAULT_HOLD, go: 0 }[newMode])} />
      ${
        mode === 'hold' &&
        html`<${NumberField} label=${t('Strength')} value=${hold} min=${0.01} max=${100} step=${0.1}
        unit="×" tip=${t('1: they count as much as all paint together. 3 is the usual value.')}
        change=${set('hold')} />`
      }
    </${Row}>
    <${Row} title=${t('Colour space of the match')} description=${describeSource(!settings.space, DESCRIPTIONS.space[effectiveSettings.space])}>
      <${Choice} label=${t('Colour space of the match')} value=${settings.space ?? null} choices=${SPACES}
        change=${set('space')} /></${Row}>
    <${Row} title=${t('Light colours')}
      description=${describeSource(!settings.colors, DESCRIPTIONS.colors[effectiveSettings.colors])}>
      <${Choice} label=${t('Light colours')} value=${settings.colors ?? null}
        choices=${COLOURS} change=${set('colors')} /></${Row}>
    <${Row} title=${t('Read the paint as')} description=${
      settings.literal
        ? t(
            'Every stroke is exact: linear light, nothing held, any colour, unless set otherwise above',
          )
        : t('Strokes show what should change; the rest of the picture counts, too')
    }>
      <${Choice} label=${t('Read the paint as')} value=${Boolean(settings.literal)} choices=${PAINT_READINGS}
        change=${set('literal')} /></${Row}>
    <${Row} title=${t('Lights that make little difference')} description=${
      pull ? t('They stay as they are now') : t('They may change, too')
    }>
      <${Choice} label=${t('Lights that make little difference')} value=${pull !== null} choices=${MINOR_LIGHTS}
        change=${(/** @type {boolean} */ isPulled) =>
          set('prefer_current')(isPulled ? (pull ?? DEFAULT_PREFER_CURRENT) : null)} />
      ${
        pull !== null &&
        html`<${NumberField} label=${t('Pull')} value=${pull} min=${0.001} max=${10} step=${0.01}
        digits=${3} tip=${t('0.01: only where the paint leaves it open. 1: unless a change helps very much.')}
        change=${set('prefer_current')} />`
      }
    </${Row}>
    <${Row} title=${t('Number of lights')} description=${
      settings.sparse
        ? t('The most useful ones, besides locked lights; the others are off')
        : t('No limit')
    }>
      <${NumberField} label=${t('At most')} value=${settings.sparse ?? null} min=${1} digits=${0}
        max=${ui.lights.length || 1} placeholder=${t('all')} unit=${t('lights')}
        tip=${t('Empty: no limit')} change=${set('sparse')} /></${Row}>
    <${PageSettings} ui=${ui} app=${app} />
  </${Panel}>`;
}

/** Settings of this page that change no answer. @param {{ui: Ui, app: App}} props */
function PageSettings({ ui, app }) {
  const [nextLanguage, setNextLanguage] = useState(language);
  const chooseLanguage = (/** @type {string} */ code) => {
    storeLanguage(code);
    setNextLanguage(code);
  };
  return html`<div class="panel-head is-page"><h2>${t('This page')}</h2></div>
    <${Row} title=${t('Theme')} description=${t('The grey around the pictures is the same in both')}>
      <${Choice} label=${t('Theme')} value=${ui.theme} choices=${THEMES}
        change=${(/** @type {import("./theme.js").Theme} */ theme) => app.store.set({ theme })} />
    </${Row}>
    <${Row} title=${t('Panels')} description=${t('Drag their titles, or press Alt and an arrow key there, for another order.')}>
      <${Button} label=${t('Order as at first')} disabled=${!ui.panelOrder.length}
        act=${() => app.store.set({ panelOrder: [] })} /></${Row}>
    <${Row} title=${t('Tour')} description=${t('Five steps through what the painter does')}>
      <${Button} label=${t('Show the tour')} act=${() => startTour(app.store)} /></${Row}>
    ${
      languageChoices.length > 1 &&
      html`<${Row} title=${t('Language')} description=${t('When the page opens next')}>
        <${Select} label=${t('Language')} hidden value=${nextLanguage}
          choices=${languageChoices} change=${chooseLanguage} /></${Row}>`
    }`;
}

/** The panel over the side panels. It takes the focus and returns it when closed; Escape closes it.
 * @param {{labelledby: string, close: () => void, children?: any}} props */
function Panel({ labelledby, close, children }) {
  const ref = useRef(/** @type {HTMLElement | null} */ (null));
  useLayoutEffect(() => {
    const element = ref.current;
    if (!element) return undefined;
    const root = /** @type {Document | ShadowRoot} */ (element.getRootNode());
    const previousFocus = /** @type {HTMLElement | null} */ (root.activeElement);
    element.focus({ preventScroll: true });
    return () => {
      if (element.contains(root.activeElement)) previousFocus?.focus?.();
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

/** @param {{title: string, description: string, children?: any}} props */
function Row({ title, description, children }) {
  return html`<section class="setting"><h3>${title}</h3>
    <div class="row">${children}</div><p class="faint">${description}</p></section>`;
}

/** The current value, and whether it follows from the painting. @param {boolean} isAuto
 * @param {string | undefined} text */
function describeSource(isAuto, text = '') {
  return isAuto && text ? t('Now: {text}', { text }) : capitalized(text);
}

/** The setting for unpainted parts. @param {number | null | undefined} hold */
function describeHold(hold) {
  if (hold === undefined || hold === null) return '';
  if (!hold) return t('free to change');
  const weight =
    hold === 1
      ? t('the same weight as')
      : t('{number} times the weight of', { number: numberText(hold) });
  return t('held near their current look, with {weight} the paint', { weight });
}
