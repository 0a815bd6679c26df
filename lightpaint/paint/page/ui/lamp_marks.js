/** Lights, marked where they hang in the pictures, with handles on the one that was chosen. */

import { html } from '../vendor/preact.js';
import {
  dragInPlane,
  subtract,
  dragOnRail,
  nudged,
  onRail,
  add,
  project,
  projectDirection,
  dragVertically,
  clampToBox,
} from './lamp_geometry.js';
import { pressLight } from './lamps/light_selection.js';
import { useMarkDrag } from './lamps/mark_drag.js';
import { showsElsewhere } from './look_comparison.js';
import { atFullBrightness, luminance, toHex } from '../../../viewer/drawing/colour.js';
import { distinctPanes } from './pane_canvas.js';
import { t } from '../language/language.js';

/** @import { App, Pane, Ui } from './ui_state.js' */
/** @import { Camera, LightPlace } from '../engine/messages.js' */

/** @typedef {{left: number, top: number, right: number, bottom: number}} Box */
/** @typedef {{x: number, y: number}} Point */

/** CSS pixels between the edge and a mark of a light outside the picture. */
const MARK_MARGIN = 14;

/** Part of the room's diagonal by which an arrow key moves a light. */
const NUDGE_ROOM_SHARE = 0.005;

/** How far keys move a light: to the right, away from the camera, and upwards.
 * @type {Record<string, (isShift: boolean) => [number, number, number]>} */
const NUDGES = {
  ArrowLeft: () => [-1, 0, 0],
  ArrowRight: () => [1, 0, 0],
  ArrowUp: (isShift) => (isShift ? [0, 0, 1] : [0, 1, 0]),
  ArrowDown: (isShift) => (isShift ? [0, 0, -1] : [0, -1, 0]),
};

/** Length of the arrow at a trial place, relative to the room. */
const ARROW_ROOM_SHARE = 0.06;

/** @param {{ui: Ui, app: App, panes: Pane[]}} props */
export function LampMarks({ ui, app, panes }) {
  const camera = ui.areLampsMarked && ui.rig ? ui.rig.cameras[ui.view] : null;
  if (!camera) return null;
  return html`<div class=${`lamps ${ui.clickAction ? 'is-pointing' : ''} ${ui.placementProgress ? 'is-placing' : ''}`}>
    ${distinctPanes(panes.filter((pane) => !showsElsewhere(ui, pane.kind))).map(
      (pane, k) => html`<${PaneMarks} key=${k} ui=${ui} app=${app} pane=${pane} camera=${camera}
      isTwin=${k > 0} />`,
    )}</div>`;
}

/** Return the visible part of a pane's picture. @param {Pane} pane @param {[number, number]} size
 * @returns {Box} */
function boxOf(pane, [height, width]) {
  return {
    left: Math.max(pane.x, pane.left),
    top: Math.max(pane.y, pane.top),
    right: Math.min(pane.x + pane.width, pane.left + width * pane.scale),
    bottom: Math.min(pane.y + pane.height, pane.top + height * pane.scale),
  };
}

/** @param {{ui: Ui, app: App, pane: Pane, camera: Camera, isTwin: boolean}} props isTwin: the keyboard
 * reaches the marks of the other picture */
function PaneMarks({ ui, app, pane, camera, isTwin }) {
  const box = boxOf(pane, ui.state.size);
  const innerBox = {
    left: box.left + MARK_MARGIN,
    top: box.top + MARK_MARGIN,
    right: box.right - MARK_MARGIN,
    bottom: box.bottom - MARK_MARGIN,
  };
  /** @param {{x: number, y: number, isAhead: boolean}} projection in pixels of the picture */
  const toPage = (projection) => ({
    ...projection,
    x: pane.left + projection.x * pane.scale,
    y: pane.top + projection.y * pane.scale,
  });
  /** Return where the mark of a place is, or null behind the camera. @param {LightPlace} place */
  const positionOf = (place) => {
    const projection = markAt(camera, place);
    return projection && clampToBox(toPage(projection), innerBox);
  };
  const places = /** @type {LightPlace[]} */ (ui.rig?.lights ?? []);
  return html`
    <${Trials} ui=${ui} camera=${camera} box=${box} toPage=${toPage} />
    <${Ghosts} ui=${ui} camera=${camera} box=${box} toPage=${toPage} />
    ${ui.lamp !== null && places[ui.lamp] && html`<${Beam} place=${placeOf(ui, ui.lamp)} camera=${camera} box=${box} toPage=${toPage} />`}
    ${places.map((_, k) => {
      const place = placeOf(ui, k);
      if (!positionOf(place)) return null;
      return html`<${Mark} key=${k} ui=${ui} app=${app} light=${k} place=${place} pane=${pane}
        camera=${camera} positionOf=${positionOf} isTwin=${isTwin} />`;
    })}
    ${
      ui.lamp !== null &&
      places[ui.lamp] &&
      html`<${AimHandle} ui=${ui} app=${app} light=${ui.lamp} pane=${pane} camera=${camera} innerBox=${innerBox}
      toPage=${toPage} isTwin=${isTwin} />`
    }`;
}

/** Return the place of a light; during a drag, the pointer's. @param {Ui} ui @param {number} k
 * @returns {LightPlace} */
export function placeOf({ rig, drag }, k) {
  const place = /** @type {LightPlace} */ (rig?.lights[k]);
  return drag?.light === k ? { ...place, ...drag.place } : place;
}

/** Return what a move to a position changes: a light keeps its direction. @param {LightPlace} place
 * @param {number[]} position @returns {Partial<LightPlace>} */
export function shiftedTo({ position: start, target }, position) {
  if (!start || !target) return { position };
  return { position, target: add(target, subtract(position, start)) };
}

/** Return the place of a light's mark; for an infinitely distant light, the direction that its
 * light comes from. @param {Camera} camera @param {LightPlace} place */
function markAt(camera, { position, direction }) {
  if (position) return project(camera, position);
  if (!direction) return null;
  return projectDirection(
    camera,
    direction.map((x) => -x),
  );
}

/** @param {{ui: Ui, app: App, light: number, place: LightPlace, pane: Pane, camera: Camera,
 *   positionOf: (place: LightPlace) => {x: number, y: number, isInside: boolean, angle: number},
 *   isTwin: boolean}} props */
function Mark({ ui, app, light, place, pane, camera, positionOf, isTwin }) {
  const position = positionOf(place);
  const { label } = ui.lights[light];
  const rgb = ui.weights[light] ?? ui.lights[light].present;
  const isOn = luminance(rgb) > 0;
  const canDrag = place.immovable_reason === '' && place.position !== null;
  const isSelected = ui.selectedLights.includes(light);
  const choose = () => app.store.set({ lamp: light });
  const nudge = (/** @type {KeyboardEvent} */ event) => {
    const [right, away, upwards] = NUDGES[event.key]?.(event.shiftKey) ?? [0, 0, 0];
    if (!canDrag || !place.position || !ui.rig || !(right || away || upwards)) return;
    event.preventDefault();
    event.stopPropagation();
    const amounts = [right, away, upwards].map((x) => x * NUDGE_ROOM_SHARE * sizeOf(ui));
    const position = nudged(camera, place.position, ui.rig.up, amounts);
    app.session.moveLamp(light, { position: place.rail ? onRail(place.rail, position) : position });
  };
  const tip = place.immovable_reason
    ? t('{label} {reason}: it stays where it is', {
        label,
        reason: place.immovable_reason,
      })
    : canDrag
      ? t('{label}: drag to move it, with Shift up and down', { label })
      : t('{label} is far away: turn it by its fields, a highlight or a shadow edge', { label });
  const drag = useMarkDrag(app, pane, (x, y, isShift, start) => {
    if (!canDrag || !place.position || !ui.rig) return null;
    const startPosition = /** @type {number[]} */ (start.place.position);
    const newPosition = place.rail
      ? dragOnRail(camera, place.rail, x, y)
      : isShift
        ? dragVertically(camera, startPosition, ui.rig.up, x, y)
        : dragInPlane(camera, startPosition, ui.rig.up, x, y);
    return {
      place: shiftedTo(start.place, newPosition),
      mark: positionOf({ ...place, position: newPosition }),
      request: { kind: 'move', pose: { position: newPosition } },
    };
  });
  return html`<button type="button" class=${[
    'lamp',
    position.isInside ? '' : 'is-outside',
    ui.lamp === light ? 'is-chosen' : '',
    isSelected ? 'is-selected' : '',
    place.immovable_reason ? 'is-fixed' : '',
    isOn ? '' : 'is-off',
  ].join(' ')} style=${{
    left: `${position.x}px`,
    top: `${position.y}px`,
    '--lit': isOn ? toHex(atFullBrightness(rgb)) : 'transparent',
    '--outwards': `${position.angle}rad`,
  }} aria-label=${isSelected ? t('{label}, selected', { label }) : label} aria-pressed=${String(ui.lamp === light)} tabindex=${isTwin ? -1 : 0}
    aria-hidden=${isTwin ? 'true' : undefined} data-tip=${tip} data-lamp=${label}
    onClick=${(/** @type {MouseEvent} */ event) => {
      if (hasControl(event)) return pressLight(app.store, light, event);
      // The end of a drag is a click as well, and open rows cost time of the next one.
      const isByPointer = event.detail > 0;
      return isByPointer && drag.wasDragged.current ? choose() : showLight(app, light, event);
    }} onKeyDown=${nudge}
    onPointerDown=${(/** @type {PointerEvent} */ event) => {
      if (ui.clickAction) return; // the click goes to the picture behind it
      if (hasControl(event)) return event.stopPropagation(); // the click selects it
      choose();
      drag.down(event, light, place);
    }} onPointerMove=${drag.move} onPointerUp=${drag.up} onPointerCancel=${drag.up}></button>`;
}

/** Choose a light, and open its row. @param {App} app @param {number} light
 * @param {MouseEvent} event on its mark */
function showLight({ store }, light, { currentTarget }) {
  const { name } = store.value.lights[light];
  const root = /** @type {HTMLElement} */ (currentTarget).closest('.lightpaint');
  store.set(({ openLights }) => ({ lamp: light, openLights: [...new Set([...openLights, light])] }));
  requestAnimationFrame(() =>
    root?.querySelector(`.light[data-light="${CSS.escape(name)}"]`)?.scrollIntoView({ block: 'nearest' }),
  );
}

/** Return whether a press on a mark selects it; Shift moves it up and down.
 * @param {MouseEvent} event */
const hasControl = ({ ctrlKey, metaKey }) => ctrlKey || metaKey;

/** @param {{ui: Ui, app: App, light: number, pane: Pane, camera: Camera, innerBox: Box,
 *   toPage: (projection: any) => any, isTwin: boolean}} props */
function AimHandle({ ui, app, light, pane, camera, innerBox, toPage, isTwin }) {
  const place = placeOf(ui, light);
  const positionOf = (/** @type {{x: number, y: number, isAhead: boolean}} */ projection) =>
    clampToBox(toPage(projection), innerBox);
  const [height, width] = ui.state.size;
  const drag = useMarkDrag(app, pane, (pointerX, pointerY) => {
    // Beyond the edge of the picture there is nothing to aim at.
    const x = Math.min(Math.max(pointerX, 0), width - 1);
    const y = Math.min(Math.max(pointerY, 0), height - 1);
    return {
      place: {},
      aimPixel: [x, y],
      mark: positionOf({ x, y, isAhead: true }),
      request: { kind: 'point', mode: 'aim', pixel: [x, y], view: ui.view },
    };
  });
  if (!place.position || !place.direction || !place.target || place.immovable_reason) return null;
  const aimPixel = ui.drag?.light === light ? ui.drag.aimPixel : undefined;
  const projection = aimPixel
    ? { x: aimPixel[0], y: aimPixel[1], isAhead: true }
    : project(camera, place.target);
  const position = positionOf(projection);
  const { label } = ui.lights[light];
  return html`<button type="button" class=${`lamp-aim ${position.isInside ? '' : 'is-outside'}`}
    style=${{ left: `${position.x}px`, top: `${position.y}px` }} tabindex=${isTwin ? -1 : 0}
    aria-hidden=${isTwin ? 'true' : undefined} aria-label=${t('Aim of {label}', { label })}
    data-tip=${t('Drag what {label} points at', { label })}
    onPointerDown=${(/** @type {PointerEvent} */ event) =>
      ui.clickAction ? undefined : drag.down(event, light, place)}
    onPointerMove=${drag.move} onPointerUp=${drag.up} onPointerCancel=${drag.up}></button>`;
}

/** The places that a search is trying. @param {{ui: Ui, camera: Camera, box: Box,
 *   toPage: (projection: any) => {x: number, y: number, isAhead: boolean}}} props */
function Trials({ ui, camera, box, toPage }) {
  if (!ui.trial) return null;
  const { positions, directions } = ui.trial;
  const marks = Object.entries(positions).flatMap(([name, position]) => {
    const start = toPage(project(camera, position));
    const direction = directions[name];
    const end =
      direction && toPage(project(camera, add(position, direction, ARROW_ROOM_SHARE * sizeOf(ui))));
    return start.isAhead ? [{ name, start, end: end?.isAhead ? end : null }] : [];
  });
  return html`<${Lines} class="is-trial" box=${box} lines=${marks} radius=${8} />`;
}

/** The diagonal of the room. @param {Ui} ui */
function sizeOf({ rig }) {
  return rig ? Math.hypot(...subtract(rig.high, rig.low)) : 1;
}

/** The places of lights before a search moved them. @param {{ui: Ui, camera: Camera, box: Box,
 *   toPage: (projection: any) => {x: number, y: number, isAhead: boolean}}} props */
function Ghosts({ ui, camera, box, toPage }) {
  const moves = ui.lights.flatMap(({ name }, k) => {
    const [oldPosition, newPosition] = [ui.ghosts[name], placeOf(ui, k)?.position];
    if (!oldPosition || !newPosition || !(name in ui.poses)) return [];
    const [start, end] = [oldPosition, newPosition].map((point) => toPage(project(camera, point)));
    return start.isAhead && end.isAhead ? [{ name, start, end }] : [];
  });
  if (!moves.length) return null;
  return html`<${Lines} class="is-ghost" box=${box} lines=${moves} radius=${7} />`;
}

/** The line from a light to its target. @param {{place: LightPlace, camera: Camera, box: Box,
 *   toPage: (projection: any) => {x: number, y: number, isAhead: boolean}}} props */
function Beam({ place, camera, box, toPage }) {
  if (!place.position || !place.target) return null;
  const [start, end] = [place.position, place.target].map((point) =>
    toPage(project(camera, point)),
  );
  if (!start.isAhead || !end.isAhead) return null;
  return html`<${Lines} box=${box} lines=${[{ name: '', start, end }]} />`;
}

/** Lines over the picture, from places of lights; with a radius, circles there.
 * @param {{box: Box, lines: {name: string, start: Point, end: Point | null}[], class?: string,
 *   radius?: number}} props */
function Lines({ box, lines, class: kind = '', radius }) {
  const { left, top, right, bottom } = box;
  return html`<svg class=${`lamp-beam ${kind}`} style=${{ left: `${left}px`, top: `${top}px` }}
    width=${right - left} height=${bottom - top} aria-hidden="true">${lines.map(
      ({ name, start, end }) => html`<g key=${name}>
        ${end && html`<line x1=${start.x - left} y1=${start.y - top} x2=${end.x - left} y2=${end.y - top} />`}
        ${radius && html`<circle cx=${start.x - left} cy=${start.y - top} r=${radius} />`}</g>`,
    )}</svg>`;
}
