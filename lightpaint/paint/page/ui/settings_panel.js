/**
 * The settings of the solve and of the page: a panel over the side panels, so that the pictures show
 * the effect of each.
 */

import { html, useLayoutEffect, useRef, useState } from '../vendor/preact.js';
import { Button, Choice, NumberField, Select, useId } from './controls.js';
import { numberText } from './format.js';
import { fill, words, language, languageChoices, storeLanguage } from '../language/language.js';
import { startTour } from './tour.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */

const AUTOMATIC_TIP = words.settingsPanel.theBestChoiceForAPainting;

const SPACES = [
  { value: null, label: words.settingsPanel.automatic, tip: AUTOMATIC_TIP },
  {
    value: 'display',
    label: words.settingsPanel.display,
    tip: words.settingsPanel.differencesAsTheEyeSeesThem,
  },
  {
    value: 'linear',
    label: words.settingsPanel.linear,
    tip: words.settingsPanel.differencesInLinearLightBright,
  },
];
const COLOURS = [
  { value: null, label: words.settingsPanel.automatic, tip: AUTOMATIC_TIP },
  { value: 'free', label: words.settingsPanel.free, tip: words.settingsPanel.anyColour },
  {
    value: 'gentle',
    label: words.settingsPanel.gentle,
    tip: words.settingsPanel.theirOwnUnlessThePaintAsks,
  },
  {
    value: 'white',
    label: words.settingsPanel.white,
    tip: words.settingsPanel.whitesFrom2200To9000K,
  },
  { value: 'own', label: words.settingsPanel.own, tip: words.settingsPanel.onlyTheirOwn },
];
const HOLDS = [
  { value: 'auto', label: words.settingsPanel.automatic, tip: AUTOMATIC_TIP },
  {
    value: 'hold',
    label: words.settingsPanel.hold,
    tip: words.settingsPanel.theyStayNearTheirCurrentLook,
  },
  {
    value: 'go',
    label: words.settingsPanel.ignore,
    tip: words.settingsPanel.theyMayChangeFreelyOnlyThe,
  },
];
const PAINT_READINGS = [
  {
    value: false,
    label: words.settingsPanel.sketch,
    tip: words.settingsPanel.strokesShowWhatShouldChange,
  },
  {
    value: true,
    label: words.settingsPanel.literal,
    tip: words.settingsPanel.eachStrokeIsTheExactLight,
  },
];
const THEMES = [
  {
    value: 'system',
    label: words.settingsPanel.system,
    tip: words.settingsPanel.asTheSystemOrTheNotebook,
  },
  { value: 'dark', label: words.settingsPanel.dark },
  { value: 'light', label: words.settingsPanel.light },
];
const MINOR_LIGHTS = [
  {
    value: false,
    label: words.settingsPanel.mayChange,
    tip: words.settingsPanel.everyChangeThatBringsTheAnswer,
  },
  { value: true, label: words.settingsPanel.stay, tip: words.settingsPanel.asTheyAreNowUnlessA },
];

/** Short explanations of the choices. @type {Record<string, Record<string, string>>} */
const DESCRIPTIONS = {
  space: {
    display: words.settingsPanel.describedDisplay,
    linear: words.settingsPanel.differencesInLinearLightWhere,
  },
  colors: {
    free: words.settingsPanel.describedFree,
    gentle: words.settingsPanel.describedGentle,
    white: words.settingsPanel.describedWhite,
    own: words.settingsPanel.describedOwn,
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
      <h2 id=${id}>${words.settingsPanel.solveSettings}</h2>
      <${Button} icon="close" tip=${words.settingsPanel.close} keys="Escape" act=${close} />
    </div>
    <${Row} title=${words.settingsPanel.unpaintedParts} description=${describeSource(hold === null, describeHold(effectiveSettings.hold))}>
      <${Choice} label=${words.settingsPanel.unpaintedParts} value=${mode} choices=${HOLDS}
        change=${(/** @type {string} */ newMode) => set('hold')({ auto: null, hold: hold || DEFAULT_HOLD, go: 0 }[newMode])} />
      ${
        mode === 'hold' &&
        html`<${NumberField} label=${words.settingsPanel.strength} value=${hold} min=${0.01} max=${100} step=${0.1}
        unit="×" tip=${words.settingsPanel.n1TheyCountAsMuchAs}
        change=${set('hold')} />`
      }
    </${Row}>
    <${Row} title=${words.settingsPanel.colourSpaceOfTheMatch} description=${describeSource(!settings.space, DESCRIPTIONS.space[effectiveSettings.space])}>
      <${Choice} label=${words.settingsPanel.colourSpaceOfTheMatch} value=${settings.space ?? null} choices=${SPACES}
        change=${set('space')} /></${Row}>
    <${Row} title=${words.settingsPanel.lightColours}
      description=${describeSource(!settings.colors, DESCRIPTIONS.colors[effectiveSettings.colors])}>
      <${Choice} label=${words.settingsPanel.lightColours} value=${settings.colors ?? null}
        choices=${COLOURS} change=${set('colors')} /></${Row}>
    <${Row} title=${words.settingsPanel.readThePaintAs} description=${
      settings.literal
        ? words.settingsPanel.everyStrokeIsExactLinearLight
        : words.settingsPanel.strokesShowWhatShouldChangeThe
    }>
      <${Choice} label=${words.settingsPanel.readThePaintAs} value=${Boolean(settings.literal)} choices=${PAINT_READINGS}
        change=${set('literal')} /></${Row}>
    <${Row} title=${words.settingsPanel.lightsThatMakeLittleDifference} description=${
      pull ? words.settingsPanel.theyStayAsTheyAreNow : words.settingsPanel.theyMayChangeToo
    }>
      <${Choice} label=${words.settingsPanel.lightsThatMakeLittleDifference} value=${pull !== null} choices=${MINOR_LIGHTS}
        change=${(/** @type {boolean} */ isPulled) =>
          set('prefer_current')(isPulled ? (pull ?? DEFAULT_PREFER_CURRENT) : null)} />
      ${
        pull !== null &&
        html`<${NumberField} label=${words.settingsPanel.pull} value=${pull} min=${0.001} max=${10} step=${0.01}
        digits=${3} tip=${words.settingsPanel.n001OnlyWhereThePaint}
        change=${set('prefer_current')} />`
      }
    </${Row}>
    <${Row} title=${words.settingsPanel.numberOfLights} description=${
      settings.sparse
        ? words.settingsPanel.theMostUsefulOnesBesidesLocked
        : words.settingsPanel.noLimit
    }>
      <${NumberField} label=${words.settingsPanel.atMost} value=${settings.sparse ?? null} min=${1} digits=${0}
        max=${ui.lights.length || 1} placeholder=${words.settingsPanel.all} unit=${words.settingsPanel.lights}
        tip=${words.settingsPanel.emptyNoLimit} change=${set('sparse')} /></${Row}>
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
  return html`<div class="panel-head is-page"><h2>${words.settingsPanel.thisPage}</h2></div>
    <${Row} title=${words.settingsPanel.theme} description=${words.settingsPanel.theGreyAroundThePicturesIs}>
      <${Choice} label=${words.settingsPanel.theme} value=${ui.theme} choices=${THEMES}
        change=${(/** @type {import("./theme.js").Theme} */ theme) => app.store.set({ theme })} />
    </${Row}>
    <${Row} title=${words.settingsPanel.tour} description=${words.settingsPanel.tourDescription}>
      <${Button} label=${words.settingsPanel.showTheTour} act=${() => startTour(app.store)} /></${Row}>
    ${
      languageChoices.length > 1 &&
      html`<${Row} title=${words.settingsPanel.language} description=${words.settingsPanel.whenThePageOpensNext}>
        <${Select} label=${words.settingsPanel.language} hidden value=${nextLanguage}
          choices=${languageChoices} change=${chooseLanguage} /></${Row}>`
    }`;
}

/**
 * The panel over the side panels. It takes the focus and returns it when closed; Escape closes it.
 * @param {{labelledby: string, close: () => void, children?: any}} props
 */
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
  return isAuto && text
    ? fill(words.settingsPanel.now, { text })
    : text.charAt(0).toUpperCase() + text.slice(1);
}

/** The setting for unpainted parts. @param {number | null | undefined} hold */
function describeHold(hold) {
  if (hold === undefined || hold === null) return '';
  if (!hold) return words.settingsPanel.freeToChange;
  const weight =
    hold === 1
      ? words.settingsPanel.theSameWeightAs
      : fill(words.settingsPanel.timesTheWeightOf, { number: numberText(hold) });
  return fill(words.settingsPanel.heldNearTheirCurrentLookWith, { weight });
}
