/** A button that removes what keeps the lights from the paint, and a preview of its effect. */

import { html, useEffect, useRef } from '../vendor/preact.js';
import { ANYWHERE, CLICK } from './add_light.js';
import { Button, Dialog } from './controls.js';
import { lightCountText, numberText, shortenName } from './format.js';
import { Icon } from './icons.js';
import { texelsText } from './lamps/light_selection.js';
import { drawPicture } from './thumbnail.js';
import { t } from '../language/language.js';

/** @import { Advice as Cause, App, Change, Picture, Ui } from './ui_state.js' */

/** Constraint keys of a light that each kind of advice removes. @type {Record<string, string[]>} */
const CONSTRAINT_KEYS = {
  off: ['off'],
  lock: ['lock'],
  limits: ['limits'],
  colour: ['color', 'kelvin', 'primaries', 'duv'],
};

/** Button text for one light and for several. @type {Record<string, [string, string]>} */
const BUTTON_WORDS = {
  off: [t('Turn on'), t('Turn on')],
  lock: [t('Unlock'), t('Unlock')],
  limits: [t('Remove the limit of'), t('Remove the limits of')],
  colour: [t('Any colour for'), t('Any colour for')],
  tie: [t('Untie'), t('Untie')],
};

/** Button text for advice on all lights. @type {Record<string, string>} */
const ALL_LIGHTS_WORDS = {
  hold: t('Loosen'),
  colors: t('Any colour'),
  sparse: t('More lights'),
  prefer_current: t('Let lights change'),
  near: t('Let lights change'),
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
      : (texelsText(ui, indices) ?? lightCountText(names.length));
  return `${BUTTON_WORDS[kind][names.length === 1 ? 0 : 1]} ${lights}`;
}

/** Return the title of the preview. @param {Cause} cause @param {string} name @param {Ui} ui */
function titleOf({ kind, hold }, name, ui) {
  if (kind !== 'hold') return name;
  const now = numberText(ui.effectiveSettings.hold, 2);
  return hold
    ? t('Loosen the hold from {now} to {number}', { now, number: numberText(hold, 2) })
    : t('Ignore unpainted parts');
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
  const isGain = after !== undefined && after !== before;
  const gain = isGain ? t(': ΔE {after} instead of {before}', { before, after }) : '';
  return html`<${Button} label=${`${nameOf(advice, ui, BUTTON_NAME_MAX_LENGTH)}${gain}`} class="help"
    tip=${t('{name}{gain}. Shows a preview first.', {
      name,
      gain: isGain
        ? t(' brings the mean ΔE over the paint from {before} to {after}', { before, after })
        : '',
    })}
    act=${() => app.session.preview(titleOf(advice, name, ui), change)} />`;
}

/** The button that lets lights move, where their current places come no closer.
 * @param {{ui: Ui, app: App}} props */
export function MoveButton({ ui, app }) {
  if (!ui.state?.can_render || ui.placementProgress) return null;
  return html`<${Button} label=${t('Let lights move')} class="help"
    tip=${t('Search for places and directions of the lights that come closer. One step that undo takes back.')}
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
  return html`<${Button} label=${t('Add a light')} class="help" icon="plus"
    tip=${t('A new light: choose where it hangs, and let a search find its place and direction.')} act=${show} />`;
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
      <${PreviewPicture} picture=${before} caption=${t('Before')} label=${t('The answer before the change')} />
      <${PreviewPicture} picture=${after} caption=${t('After')} label=${t('The answer after it')} />
    </div>
    <p class=${isAtCost ? 'is-bad' : ''} role="status">
      ${isAtCost && html`<${Icon} name="warn" />`}
      <span>${text || t('Computing the preview …')}</span></p>
    <div class="row"><${Button} label=${t('Cancel')} act=${close} />
      <${Button} label=${t('Apply')} primary disabled=${!text} act=${() => app.session.makeChange()} />
    </div>
  </${Dialog}>`;
}

/** @param {{picture: Picture | null, caption: string, label: string}} props */
function PreviewPicture({ picture, caption, label }) {
  const ref = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  useEffect(() => {
    if (picture && ref.current) drawPicture(ref.current, picture);
  }, [picture]);
  return html`<figure><canvas ref=${ref} width="16" height="9" role="img" aria-label=${label}></canvas>
    <figcaption>${caption}</figcaption></figure>`;
}
