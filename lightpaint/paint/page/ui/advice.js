/** A button that removes what keeps the lights from the paint, and a preview of its effect. */

import { html, useEffect, useRef } from '../vendor/preact.js';
import { ANYWHERE, CLICK } from './add_light.js';
import { Button, Dialog } from './controls.js';
import { numberText, shortenName } from './format.js';
import { Icon } from './icons.js';
import { texelsText } from './lamps/light_selection.js';
import { drawPicture } from './thumbnail.js';
import { fill, words } from '../language/language.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./ui_state.js").Advice} Cause */
/** @typedef {import("./ui_state.js").Change} Change */
/** @typedef {import("./shortcuts.js").App} App */

/** Constraint keys of a light that each kind of advice removes. @type {Record<string, string[]>} */
const CONSTRAINT_KEYS = {
  off: ['off'],
  lock: ['lock'],
  limits: ['limits'],
  colour: ['color', 'kelvin', 'primaries', 'duv'],
};

/** Button text for one light and for several. @type {Record<string, [string, string]>} */
const BUTTON_WORDS = {
  off: [words.advice.turnOn, words.advice.turnOn],
  lock: [words.advice.unlock, words.advice.unlock],
  limits: [words.advice.removeTheLimitOf, words.advice.removeTheLimitsOf],
  colour: [words.advice.anyColourFor, words.advice.anyColourFor],
  tie: [words.advice.untie, words.advice.untie],
};

/** Button text for advice on all lights. @type {Record<string, string>} */
const ALL_LIGHTS_WORDS = {
  hold: words.advice.loosen,
  colors: words.advice.anyColour,
  sparse: words.advice.moreLights,
  prefer_current: words.advice.letLightsChange,
  near: words.advice.letLightsChange,
};

/** Characters of a light's name on a button, which shares its line with a sentence. */
const BUTTON_NAME_MAX_LENGTH = 14;

/** Return the button text with the names of its lights. @param {Cause} cause @param {Ui} ui
 * @param {number} [maxLength] characters of a light's name */
function nameOf({ kind, names }, ui, maxLength = Infinity) {
  if (kind in ALL_LIGHTS_WORDS) return ALL_LIGHTS_WORDS[kind];
  const indices = names.map((name) => ui.lights.findIndex((light) => light.name === name));
  const lights =
    names.length === 1
      ? shortenName(names[0], maxLength)
      : (texelsText(ui, indices) ?? fill(words.advice.lights, { count: names.length }));
  return `${BUTTON_WORDS[kind][names.length === 1 ? 0 : 1]} ${lights}`;
}

/** Return the title of the preview. @param {Cause} cause @param {string} name @param {Ui} ui */
function titleOf({ kind, hold }, name, ui) {
  if (kind !== 'hold') return name;
  const now = numberText(ui.effectiveSettings.hold, 2);
  return hold
    ? fill(words.advice.loosenTheHoldTo, { now, number: numberText(hold, 2) })
    : words.advice.ignoreUnpaintedParts;
}

/** Return the request that removes the obstacle; null if this page did not set it, or it is gone
 * already.
 * @param {Cause} cause @param {Ui} ui @param {App["session"]} session @returns {Change | null} */
function changeOf({ kind, names, hold }, ui, session) {
  /** @param {string} key @param {any} value @returns {Change} */
  const settingChange = (key, value) => ({
    kind: 'change_settings',
    fields: { settings: { [key]: value } },
  });
  if (kind === 'hold')
    return ui.effectiveSettings.hold === hold ? null : settingChange('hold', hold);
  if (kind === 'colors')
    return ui.effectiveSettings.colors === 'free' ? null : settingChange('colors', 'free');
  if (kind === 'near') return ui.settings.near === 0 ? null : settingChange('near', 0);
  if (kind === 'sparse' || kind === 'prefer_current')
    return ui.settings[kind] ? settingChange(kind, null) : null;
  if (kind === 'tie') {
    const ties = ui.ties.filter((tie) => !names.some((name) => tie.includes(name)));
    return ties.length < ui.ties.length ? { kind: 'tie', fields: { ties } } : null;
  }
  const keys = CONSTRAINT_KEYS[kind] ?? [];
  if (!names.every((name) => keys.some((key) => key in (ui.constraints[name] ?? {})))) return null;
  const constraints = names.map((name) => [name, remainingConstraints(name, keys, ui, session)]);
  return { kind: 'constrain_lights', fields: { constraints: Object.fromEntries(constraints) } };
}

/** Return the remaining constraints of a light; for one locked by hand, those from before.
 * @param {string} name @param {string[]} keys @param {Ui} ui @param {App["session"]} session */
function remainingConstraints(name, keys, ui, session) {
  const light = ui.lights.findIndex((info) => info.name === name);
  const removesLevel = keys.includes('off') || keys.includes('lock');
  const constraints =
    (removesLevel && session.openConstraints(light)) || ui.constraints[name];
  return Object.fromEntries(Object.entries(constraints).filter(([key]) => !keys.includes(key)));
}

/** @param {{ui: Ui, app: App}} props */
export function AdviceButton({ ui, app }) {
  const { advice } = ui;
  if (advice?.kind === 'reach') return html`<${MoveButton} ui=${ui} app=${app} />`;
  if (advice?.kind === 'light') return html`<${NewLightButton} ui=${ui} app=${app} />`;
  const change = advice && changeOf(advice, ui, app.session);
  if (!advice || !change) return null;
  const name = nameOf(advice, ui);
  // The numbers beside the sentence: ΔE as it is, and as it will be.
  const [before, after] = (advice.delta_e ?? []).map((x) => numberText(x, 2));
  /** @param {string} text */
  const withGain = (text) =>
    after === undefined || after === before ? '' : fill(text, { before, after });
  const gain = withGain(words.advice.deltaeInsteadOf);
  return html`<${Button} label=${`${nameOf(advice, ui, BUTTON_NAME_MAX_LENGTH)}${gain}`} class="help"
    tip=${fill(words.advice.showsAPreviewFirst, {
      name,
      gain: withGain(words.advice.bringsTheMeanDeltae),
    })}
    act=${() => app.session.preview(titleOf(advice, name, ui), change)} />`;
}

/** The button that lets lights move, where their current places come no closer.
 * @param {{ui: Ui, app: App}} props */
export function MoveButton({ ui, app }) {
  if (!ui.state?.can_render || ui.placementProgress) return null;
  return html`<${Button} label=${words.advice.letLightsMove} class="help"
    tip=${words.advice.searchForPlacesAndDirectionsOf}
    act=${() => app.store.set({ dialog: 'move' })} />`;
}

/** The button that leads to a new light, where all that reach the paint light the rest, too.
 * @param {{ui: Ui, app: App}} props */
function NewLightButton({ ui, app }) {
  if (!ui.state?.can_render || ui.placementProgress) return null;
  const show = () => {
    const { newLight, areLampsMarked, open } = app.store.value;
    if (!areLampsMarked) app.session.toggleLamps();
    const surface = newLight.surface === CLICK ? ANYWHERE : newLight.surface;
    app.store.set({
      side: true,
      panel: null,
      open: { ...open, plan: true },
      newLight: { ...newLight, surface },
      isNewLightSought: true,
    });
  };
  return html`<${Button} label=${words.addLight.addALight} class="help" icon="plus"
    tip=${words.advice.findAPlaceForALight} act=${show} />`;
}

/** The answer before and after a change, for the user to apply or cancel.
 * @param {{ui: Ui, app: App}} props */
export function PreviewDialog({ ui, app }) {
  const { preview } = ui;
  if (!preview) return null;
  const close = () => app.store.set({ preview: null });
  const { label, text, isAtCost, before, after } = preview;
  return html`<${Dialog} title=${label} close=${close} class="preview">
    <div class="pair">
      <${PreviewPicture} picture=${before} caption="Before" /><${PreviewPicture} picture=${after} caption="After" />
    </div>
    <p class=${isAtCost ? 'is-bad' : ''} role="status">
      ${isAtCost && html`<${Icon} name="warn" />`}
      <span>${text || words.advice.computingThePreview}</span></p>
    <div class="row"><${Button} label=${words.advice.cancel} act=${close} />
      <${Button} label=${words.advice.apply} primary disabled=${!text} act=${() => app.session.makeChange()} />
    </div>
  </${Dialog}>`;
}

/** @param {{picture: import("./engine_interface.js").Picture | null, caption: string}} props */
function PreviewPicture({ picture, caption }) {
  const ref = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  useEffect(() => {
    if (picture && ref.current) drawPicture(ref.current, picture);
  }, [picture]);
  return html`<figure><canvas ref=${ref} width="16" height="9" role="img"
    aria-label=${caption === 'Before' ? words.advice.theAnswerBeforeTheChange : words.advice.theAnswerAfterIt}></canvas>
    <figcaption>${caption}</figcaption></figure>`;
}
