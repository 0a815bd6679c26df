/** Place, target and cone of a light in numbers, and buttons that point it by a click. */

import { html } from '../vendor/preact.js';
import { Button, NumberField } from './controls.js';
import { directionFrom, onRailAt, skyAngles } from './lamp_geometry.js';
import { placeOf } from './lamp_marks.js';
import { luminance } from '../../../viewer/drawing/colour.js';
import { t } from '../language/language.js';
import { completePair } from './references/reference_picture.js';

/** @import { App, ClickAction, Ui } from './ui_state.js' */

/** Labels of what the next click does to a light. */
const CLICK_MODES = /** @type {const} */ ({
  aim: { label: t('Aim here'), tip: t('Click a surface: the light points there') },
  highlight: {
    label: t('Highlight here'),
    tip: t('Click a shiny surface: the light hangs where its reflection is seen there'),
  },
  shadow: {
    label: t('Shadow edge here'),
    tip: t('Click the edge that casts it, then where its shadow ends'),
  },
});

/** Hint on what to click next. @param {ClickAction} action
 * @param {Ui["lights"]} lights */
export function pointingHint(action, lights) {
  if (action.mode === 'hang')
    return t(
      'Click the surface that the new {type} hangs on, or its place in the plan. Esc cancels.',
      { type: action.type },
    );
  if (action.mode === 'pair')
    return t('Press the place in the picture that should look like it. Esc cancels.');
  const { mode, edge } = action;
  const name = lights[action.light]?.label ?? '';
  if (mode === 'aim') return t('Click what {name} is to point at. Esc cancels.', { name });
  if (mode === 'highlight')
    return t('Click where the highlight of {name} is to be seen. Esc cancels.', { name });
  return edge
    ? t('Now click where that shadow is to end. Esc cancels.')
    : t('Click the edge of what casts the shadow of {name}. Esc cancels.', { name });
}

/** Handle a click on a picture that a click action waits for. @param {App} app
 * @param {{x: number, y: number} | null} point in pixels of the picture */
export function pointLamp(app, point) {
  const { clickAction, state, view } = app.store.value;
  if (!clickAction || !point) return;
  const [height, width] = state?.size ?? [Infinity, Infinity];
  const isInside = point.x >= 0 && point.y >= 0 && point.x < width && point.y < height;
  if (!isInside)
    return app.session.toast(t('That is outside the picture: click inside it'), 'warn');
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
    <${NumberField} label=${t('Elevation')} unit="°" value=${elevation} min=${-90} max=${90} step=${1}
      digits=${1} tip=${t('How high it stands, in degrees above the horizon')}
      change=${(/** @type {number} */ x) => turn({ elevation: x })} />
    <${NumberField} label=${t('Azimuth')} unit="°" value=${azimuth} min=${-360} max=${360} step=${1}
      digits=${1} tip=${t('Its direction around the vertical, in degrees')}
      change=${(/** @type {number} */ x) => turn({ azimuth: x })} />
  </div>`;
}

/** How a coordinate of a light on a rail may be typed. @param {number[][]} rail both ends
 * @param {number} c @param {string} label of the light */
function alongRail(rail, c, label) {
  if (!onRailAt(rail, c, rail[0][c]))
    return {
      disabled: true,
      tip: t('{label} slides along its rail, where this coordinate is the same everywhere', {
        label,
      }),
    };
  const ends = rail.map((end) => end[c]);
  return { min: Math.min(...ends), max: Math.max(...ends) };
}

/** @param {{k: number, ui: Ui, app: App}} props */
export function LampFields({ k, ui, app }) {
  const { session, store } = app;
  if (!ui.state?.can_render) return null;
  if (!ui.rig?.lights[k])
    return html`<div class="lamp-fields"><${Button} label=${t('Place and aim')} class="wide"
      tip=${t('Mark the lights in the pictures, and move them')} act=${() => session.toggleLamps()} /></div>`;
  const place = placeOf(ui, k);
  const { name, label } = ui.lights[k];
  const isAdded = ui.addedLights.includes(name);
  if (place.immovable_reason)
    return html`<p class="faint lamp-fields">${t('{label} {reason}: it stays where it is.', {
      label,
      reason: place.immovable_reason,
    })}</p>`;
  const vectorFields = (
    /** @type {"position" | "target"} */ key,
    /** @type {string} */ title,
    /** @type {number[] | null} */ value,
    /** @type {number[][] | null} */ rail = null,
  ) =>
    value &&
    html`<div class="lamp-vector" role="group" aria-label=${t('{title} of {label}', { title, label })}>
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
    <h3>${t('Place')}</h3>
    ${isUnwanted && html`<p class="faint">${t('Off in this answer, which needs no light from there. Lock its level to keep it on.')}</p>`}
    ${vectorFields('position', t('Position'), place.position, place.rail)}
    ${place.position && place.direction && vectorFields('target', t('Target'), place.target)}
    ${
      place.cutoff !== null &&
      html`<div class="ask-fields is-pair">
        <${NumberField} label=${t('Cone')} unit="°" value=${place.cutoff} min=${1} max=${89} step=${1}
          digits=${1} change=${(/** @type {number} */ x) =>
            session.moveLamp(k, { cutoff: x, beam: Math.min(x, place.beam ?? x) })} />
        <${NumberField} label=${t('Beam')} unit="°" value=${place.beam} min=${0.5} max=${place.cutoff}
          step=${1} digits=${1} change=${(/** @type {number} */ x) =>
            session.moveLamp(k, { beam: x, cutoff: place.cutoff })} />
      </div>`
    }
    ${!place.position && place.direction && ui.rig && html`<${SunFields} direction=${place.direction} up=${ui.rig.up} move=${(/** @type {number[]} */ target) => session.moveLamp(k, { target })} />`}
    <div class="lamp-ways" role="group" aria-label=${t('Point {label} by a click', { label })}>
      ${place.position && place.direction && pointButton('aim')}
      ${pointButton('highlight')}${pointButton('shadow')}
      ${
        name in ui.poses &&
        html`<${Button} label=${t('Put back')} act=${() => session.resetPlace(k)}
          tip=${isAdded ? t('Back to where you hung it') : t('Back to where the scene has it')} />`
      }
      ${isAdded && html`<${Button} label=${t('Remove')} icon="trash" tip=${t('Remove {label}. Undo brings it back.', { label })} act=${() => session.removeLight(name)} />`}
    </div></div>`;
}
