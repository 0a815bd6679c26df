/** Place, target and cone of a light in numbers, and buttons that point it by a click. */

import { html } from '../vendor/preact.js';
import { Button, NumberField } from './controls.js';
import { directionFrom, onRailAt, skyAngles } from './lamp_geometry.js';
import { placeOf } from './lamp_marks.js';
import { luminance } from './paint_colour.js';
import { fill, words } from '../language/language.js';
import { completePair } from './references/reference_picture.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */

/** Labels of what the next click does to a light. */
const CLICK_MODES = /** @type {const} */ ({
  aim: { label: words.lampFields.aimHere, tip: words.lampFields.clickASurfaceTheLightPoints },
  highlight: {
    label: words.lampFields.highlightHere,
    tip: words.lampFields.clickAShinySurfaceTheLight,
  },
  shadow: {
    label: words.lampFields.shadowEdgeHere,
    tip: words.lampFields.clickTheEdgeThatCastsIt,
  },
});

/** Hint on what to click next. @param {import("./ui_state.js").ClickAction} action
 * @param {Ui["lights"]} lights */
export function pointingHint(action, lights) {
  if (action.mode === 'hang')
    return fill(words.lampFields.clickTheSurfaceThatTheNew, { type: action.type });
  if (action.mode === 'pair') return words.references.pressItsPlaceOrCancel;
  const { mode, edge } = action;
  const name = lights[action.light]?.label ?? '';
  if (mode === 'aim') return fill(words.lampFields.clickWhatIsToPointAt, { name });
  if (mode === 'highlight') return fill(words.lampFields.clickWhereTheHighlightOfIs, { name });
  return edge
    ? words.lampFields.nowClickWhereThatShadowIs
    : fill(words.lampFields.clickTheEdgeOfWhatCasts, { name });
}

/** Handle a click on a picture that a click action waits for. @param {App} app
 * @param {{x: number, y: number} | null} point in pixels of the picture */
export function pointLamp(app, point) {
  const { clickAction, state, view } = app.store.value;
  if (!clickAction || !point) return;
  const [height, width] = state?.size ?? [Infinity, Infinity];
  const isInside = point.x >= 0 && point.y >= 0 && point.x < width && point.y < height;
  if (!isInside) return app.session.toast(words.lampFields.clickInsideThePicture, 'warn');
  if (clickAction.mode === 'pair') return completePair(app, clickAction, point);
  const pixel = /** @type {[number, number]} */ ([point.x, point.y]);
  if (clickAction.mode === 'hang')
    return void app.session.addLight({ type: clickAction.type, pixel, view });
  const { light, mode, edge } = clickAction;
  if (mode === 'shadow' && !edge)
    return app.store.set({ clickAction: { light, mode, edge: pixel } });
  app.store.set({ clickAction: null });
  app.session.lampMoves.queue(light, {
    kind: 'point',
    mode,
    pixel,
    ...(edge ? { edge } : {}),
    view,
  });
}

/** Where a light that is far away stands in the sky.
 * @param {{direction: number[], up: number, move: (direction: number[]) => void}} props direction: in
 * which it shines. move: turns it */
function SunFields({ direction, up, move }) {
  const { elevation, azimuth } = skyAngles(direction, up);
  const turn = (/** @type {Partial<ReturnType<typeof skyAngles>>} */ change) =>
    move(directionFrom({ elevation, azimuth, ...change }, up));
  return html`<div class="ask-fields is-pair">
    <${NumberField} label=${words.lampFields.elevation} unit="°" value=${elevation} min=${-90} max=${90} step=${1}
      digits=${1} tip=${words.lampFields.aboveTheHorizon}
      change=${(/** @type {number} */ x) => turn({ elevation: x })} />
    <${NumberField} label=${words.lampFields.azimuth} unit="°" value=${azimuth} min=${-360} max=${360} step=${1}
      digits=${1} tip=${words.lampFields.aroundTheVertical}
      change=${(/** @type {number} */ x) => turn({ azimuth: x })} />
  </div>`;
}

/** How a coordinate of a light on a rail may be typed. @param {number[][]} rail both ends
 * @param {number} c @param {string} label of the light */
function alongRail(rail, c, label) {
  if (!onRailAt(rail, c, rail[0][c]))
    return { disabled: true, tip: fill(words.lampFields.itsRailKeepsThis, { label }) };
  const ends = rail.map((end) => end[c]);
  return { min: Math.min(...ends), max: Math.max(...ends) };
}

/** @param {{k: number, ui: Ui, app: App}} props */
export function LampFields({ k, ui, app }) {
  const { session, store } = app;
  if (!ui.state?.can_render) return null;
  if (!ui.rig?.lights[k])
    return html`<div class="lamp-fields"><${Button} label=${words.lampFields.placeAndAim} class="wide"
      tip=${words.lampFields.markTheLightsInThePictures} act=${() => session.toggleLamps()} /></div>`;
  const place = placeOf(ui, k);
  const { name, label } = ui.lights[k];
  const isAdded = ui.addedLights.includes(name);
  if (place.immovable_reason)
    return html`<p class="faint lamp-fields">${fill(words.lampFields.itStaysWhereItIs, { label, immovable_reason: place.immovable_reason })}</p>`;
  const vectorFields = (
    /** @type {"position" | "target"} */ key,
    /** @type {string} */ title,
    /** @type {number[] | null} */ value,
    /** @type {number[][] | null} */ rail = null,
  ) =>
    value &&
    html`<div class="lamp-vector" role="group" aria-label=${fill(words.lampFields.of, { title, label })}>
      <span class="name">${title}</span>
      ${['x', 'y', 'z'].map(
        (
          axis,
          c,
        ) => html`<${NumberField} key=${axis} label=${`${title} ${axis}`} hidden value=${value[c]}
        figures=${4} step=${0.05} ...${rail && alongRail(rail, c, label)}
        change=${(/** @type {number} */ x) =>
          session.moveLamp(k, {
            [key]: rail
              ? onRailAt(rail, c, x)
              : value.map((coordinate, i) => (i === c ? x : coordinate)),
          })} />`,
      )}</div>`;
  const pointButton = (/** @type {"aim" | "highlight" | "shadow"} */ mode) => {
    const isOn =
      ui.clickAction?.mode === mode && 'light' in ui.clickAction && ui.clickAction.light === k;
    return html`<${Button} key=${mode} label=${CLICK_MODES[mode].label} tip=${CLICK_MODES[mode].tip} pressed=${isOn}
      act=${() =>
        store.set({
          areLampsMarked: true,
          lamp: k,
          clickAction: isOn ? null : { light: k, mode },
        })} />`;
  };
  const isUnwanted = luminance(ui.weights[k] ?? [1, 1, 1]) === 0 && !ui.constraints[name]?.off;
  return html`<div class="lamp-fields" data-numbers>
    <h3>${words.lampFields.place}</h3>
    ${isUnwanted && html`<p class="faint">${words.lampFields.theAnswerNeedsNone}</p>`}
    ${vectorFields('position', words.lampFields.position, place.position, place.rail)}
    ${place.position && place.direction && vectorFields('target', words.lampFields.target, place.target)}
    ${
      place.cutoff !== null &&
      html`<div class="ask-fields is-pair">
        <${NumberField} label=${words.lampFields.cone} unit="°" value=${place.cutoff} min=${1} max=${89} step=${1}
          digits=${1} change=${(/** @type {number} */ x) =>
            session.moveLamp(k, { cutoff: x, beam: Math.min(x, place.beam ?? x) })} />
        <${NumberField} label=${words.lampFields.beam} unit="°" value=${place.beam} min=${0.5} max=${place.cutoff}
          step=${1} digits=${1} change=${(/** @type {number} */ x) =>
            session.moveLamp(k, { beam: x, cutoff: place.cutoff })} />
      </div>`
    }
    ${!place.position && place.direction && ui.rig && html`<${SunFields} direction=${place.direction} up=${ui.rig.up} move=${(/** @type {number[]} */ target) => session.moveLamp(k, { target })} />`}
    <div class="lamp-ways" role="group" aria-label=${fill(words.lampFields.pointByAClick, { label })}>
      ${place.position && place.direction && pointButton('aim')}
      ${pointButton('highlight')}${pointButton('shadow')}
      ${name in ui.poses && html`<${Button} label=${words.lampFields.putBack} tip=${isAdded ? words.lampFields.backToWhereYouHungIt : words.lampFields.backToWhereTheSceneHasIt} act=${() => session.resetPlace(k)} />`}
      ${isAdded && html`<${Button} label=${words.lampFields.remove} icon="trash" tip=${fill(words.lampFields.removeUndoBringsItBack, { label })} act=${() => session.removeLight(name)} />`}
    </div></div>`;
}
