/** Lights, marked where they hang in the pictures, with handles on the one that was chosen. */

import { html, useRef } from '../vendor/preact.js';
import {
  inPlane,
  minus,
  onRail,
  plus,
  seenAt,
  seenTowards,
  upAndDown,
  within,
} from './lamp_geometry.js';
import { toHex } from './paint_colour.js';
import { atFull, luminance } from './paint_colour.js';

/** @typedef {import("./engine_interface.js").Pane} Pane */
/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */
/** @typedef {import("../engine/messages.js").LightPlace} LightPlace */
/** @typedef {import("../engine/messages.js").Camera} Camera */
/** @typedef {{left: number, top: number, right: number, bottom: number}} Box */

/** CSS pixels between the edge and a mark of a light outside the picture. */
const MARGIN = 14;

/** Length of the arrow at a trial place, relative to the room. */
const ARROW = 0.06;

/** @param {{ui: Ui, app: App, panes: Pane[]}} props */
export function LampMarks({ ui, app, panes }) {
  const camera = ui.lamps && ui.rig ? ui.rig.cameras[ui.view] : null;
  if (!camera) return null;
  return html`<div class=${`lamps ${ui.pointing ? 'is-pointing' : ''} ${ui.placing ? 'is-placing' : ''}`}>
    ${apart(panes).map(
      (pane, k) => html`<${PaneMarks} key=${k} ui=${ui} app=${app} pane=${pane} camera=${camera}
      isTwin=${k > 0} />`,
    )}</div>`;
}

/** Return the panes side by side; of overlapping ones the first. @param {Pane[]} panes */
function apart(panes) {
  return panes.filter(
    (pane, k) => panes.findIndex((x) => x.left === pane.left && x.top === pane.top) === k,
  );
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
  const inner = {
    left: box.left + MARGIN,
    top: box.top + MARGIN,
    right: box.right - MARGIN,
    bottom: box.bottom - MARGIN,
  };
  /** @param {{x: number, y: number, isAhead: boolean}} seen in pixels of the picture */
  const onPage = (seen) => ({
    ...seen,
    x: pane.left + seen.x * pane.scale,
    y: pane.top + seen.y * pane.scale,
  });
  const places = /** @type {LightPlace[]} */ (ui.rig?.lights ?? []);
  return html`
    <${Trials} ui=${ui} camera=${camera} box=${box} onPage=${onPage} />
    <${Ghosts} ui=${ui} camera=${camera} box=${box} onPage=${onPage} />
    ${ui.lamp !== null && places[ui.lamp] && html`<${Beam} place=${placeOf(ui, ui.lamp)} camera=${camera} box=${box} onPage=${onPage} />`}
    ${places.map((_, k) => {
      const place = placeOf(ui, k);
      const seen = markAt(camera, place);
      if (!seen) return null;
      return html`<${Mark} key=${k} ui=${ui} app=${app} light=${k} place=${place} pane=${pane}
        camera=${camera} at=${within(onPage(seen), inner)} isTwin=${isTwin} />`;
    })}
    ${ui.lamp !== null && places[ui.lamp] && html`<${AimHandle} ui=${ui} app=${app} light=${ui.lamp} pane=${pane} camera=${camera} inner=${inner}
      onPage=${onPage} isTwin=${isTwin} />`}`;
}

/** Return the place of a light; during a drag, the pointer's. @param {Ui} ui @param {number} k
 * @returns {LightPlace} */
export function placeOf({ rig, dragged }, k) {
  const place = /** @type {LightPlace} */ (rig?.lights[k]);
  return dragged?.light === k ? { ...place, ...dragged.place } : place;
}

/** Return the place of a light's mark; for an infinitely distant light, the direction that its
 * light comes from. @param {Camera} camera @param {LightPlace} place */
function markAt(camera, { position, direction }) {
  if (position) return seenAt(camera, position);
  if (!direction) return null;
  return seenTowards(
    camera,
    direction.map((x) => -x),
  );
}

/**
 * @param {{ui: Ui, app: App, light: number, place: LightPlace, pane: Pane, camera: Camera,
 *   at: {x: number, y: number, isInside: boolean, angle: number}, isTwin: boolean}} props
 */
function Mark({ ui, app, light, place, pane, camera, at, isTwin }) {
  const { label } = ui.lights[light];
  const rgb = ui.weights[light] ?? ui.lights[light].present;
  const isOn = luminance(rgb) > 0;
  const canDrag = place.immovable_reason === '' && place.position !== null;
  const choose = () => app.store.set({ lamp: light });
  const tip = place.immovable_reason
    ? `${label} ${place.immovable_reason}: it stays where it is`
    : `${label}: drag to move it, with Shift up and down`;
  const drag = useDrag(app, pane, (x, y, isShift, start) => {
    if (!canDrag || !place.position || !ui.rig) return null;
    const from = /** @type {number[]} */ (start.place.position);
    const moved = place.rail
      ? onRail(camera, place.rail, x, y)
      : isShift
        ? upAndDown(camera, from, ui.rig.up, x, y)
        : inPlane(camera, from, ui.rig.up, x, y);
    return { place: { position: moved }, request: { kind: 'move', pose: { position: moved } } };
  });
  return html`<button type="button" class=${[
    'lamp',
    at.isInside ? '' : 'is-outside',
    ui.lamp === light ? 'is-chosen' : '',
    place.immovable_reason ? 'is-fixed' : '',
    isOn ? '' : 'is-off',
  ].join(' ')} style=${{
    left: `${at.x}px`,
    top: `${at.y}px`,
    '--lit': isOn ? toHex(atFull(rgb)) : 'transparent',
    '--outwards': `${at.angle}rad`,
  }} aria-label=${label} aria-pressed=${String(ui.lamp === light)} tabindex=${isTwin ? -1 : 0}
    aria-hidden=${isTwin ? 'true' : undefined} data-tip=${tip} data-lamp=${label} onClick=${choose}
    onPointerDown=${(/** @type {PointerEvent} */ event) => {
      if (ui.pointing) return; // the click goes to the picture behind it
      choose();
      drag.down(event, light, place);
    }} onPointerMove=${drag.move} onPointerUp=${drag.up} onPointerCancel=${drag.up}></button>`;
}

/**
 * @param {{ui: Ui, app: App, light: number, pane: Pane, camera: Camera, inner: Box,
 *   onPage: (seen: any) => any, isTwin: boolean}} props
 */
function AimHandle({ ui, app, light, pane, camera, inner, onPage, isTwin }) {
  const place = placeOf(ui, light);
  const drag = useDrag(app, pane, (x, y) => ({
    place: {},
    at: [x, y],
    request: { kind: 'point', mode: 'aim', pixel: [x, y], view: ui.view },
  }));
  if (!place.position || !place.direction || !place.target || place.immovable_reason) return null;
  const dragged = ui.dragged?.light === light ? ui.dragged.at : undefined;
  const seen = dragged
    ? { x: dragged[0], y: dragged[1], isAhead: true }
    : seenAt(camera, place.target);
  const at = within(onPage(seen), inner);
  const { label } = ui.lights[light];
  return html`<button type="button" class=${`lamp-aim ${at.isInside ? '' : 'is-outside'}`}
    style=${{ left: `${at.x}px`, top: `${at.y}px` }} tabindex=${isTwin ? -1 : 0}
    aria-hidden=${isTwin ? 'true' : undefined} aria-label=${`Aim of ${label}`}
    data-tip=${`Drag what ${label} points at`}
    onPointerDown=${(/** @type {PointerEvent} */ event) =>
      ui.pointing ? undefined : drag.down(event, light, place)}
    onPointerMove=${drag.move} onPointerUp=${drag.up} onPointerCancel=${drag.up}></button>`;
}

/** The places that a search is trying. @param {{ui: Ui, camera: Camera, box: Box,
 *   onPage: (seen: any) => {x: number, y: number, isAhead: boolean}}} props */
function Trials({ ui, camera, box, onPage }) {
  if (!ui.trial) return null;
  const { left, top, right, bottom } = box;
  const style = { left: `${left}px`, top: `${top}px` };
  const { positions, directions } = ui.trial;
  const marks = Object.entries(positions).flatMap(([name, position]) => {
    const at = onPage(seenAt(camera, position));
    const way = directions[name];
    const to = way && onPage(seenAt(camera, plus(position, way, ARROW * sizeOf(ui))));
    return at.isAhead ? [{ name, at, to: to?.isAhead ? to : null }] : [];
  });
  return html`<svg class="lamp-beam is-trial" style=${style} width=${right - left}
    height=${bottom - top} aria-hidden="true">${marks.map(
      ({ name, at, to }) => html`<g key=${name}>
        ${to && html`<line x1=${at.x - left} y1=${at.y - top} x2=${to.x - left} y2=${to.y - top} />`}
        <circle cx=${at.x - left} cy=${at.y - top} r="8" /></g>`,
    )}</svg>`;
}

/** The diagonal of the room. @param {Ui} ui */
function sizeOf({ rig }) {
  return rig ? Math.hypot(...minus(rig.high, rig.low)) : 1;
}

/** The places of lights before a search moved them. @param {{ui: Ui, camera: Camera, box: Box,
 *   onPage: (seen: any) => {x: number, y: number, isAhead: boolean}}} props */
function Ghosts({ ui, camera, box, onPage }) {
  const { left, top, right, bottom } = box;
  const style = { left: `${left}px`, top: `${top}px` };
  const moves = ui.lights.flatMap(({ name }, k) => {
    const [before, now] = [ui.ghosts[name], placeOf(ui, k)?.position];
    if (!before || !now || !(name in ui.poses)) return [];
    const [from, to] = [before, now].map((point) => onPage(seenAt(camera, point)));
    return from.isAhead && to.isAhead ? [{ name, from, to }] : [];
  });
  if (!moves.length) return null;
  return html`<svg class="lamp-beam is-ghost" style=${style} width=${right - left}
    height=${bottom - top} aria-hidden="true">${moves.map(
      ({ name, from, to }) => html`<g key=${name}>
        <line x1=${from.x - left} y1=${from.y - top} x2=${to.x - left} y2=${to.y - top} />
        <circle cx=${from.x - left} cy=${from.y - top} r="7" /></g>`,
    )}</svg>`;
}

/** The line from a light to its target. @param {{place: LightPlace, camera: Camera, box: Box,
 *   onPage: (seen: any) => {x: number, y: number, isAhead: boolean}}} props */
function Beam({ place, camera, box, onPage }) {
  if (!place.position || !place.target) return null;
  const [from, to] = [place.position, place.target].map((point) => onPage(seenAt(camera, point)));
  if (!from.isAhead || !to.isAhead) return null;
  const { left, top, right, bottom } = box;
  const style = { left: `${left}px`, top: `${top}px` };
  return html`<svg class="lamp-beam" style=${style} width=${right - left} height=${bottom - top}
    aria-hidden="true"><line x1=${from.x - left} y1=${from.y - top} x2=${to.x - left}
      y2=${to.y - top} /></svg>`;
}

/**
 * A drag of a mark: it requests a place at every move, and keeps the last.
 * @param {App} app @param {Pane} pane
 * @param {(x: number, y: number, isShift: boolean, start: {place: LightPlace}) =>
 *   {place: Partial<LightPlace>, at?: [number, number],
 *    request: import("./lamp_moves.js").LampRequest} | null} of the pointer, in pixels of the picture
 */
function useDrag(app, pane, of) {
  const start = useRef(
    /** @type {{light: number, place: LightPlace, dx: number, dy: number, isMoved: boolean,
     *   last: import("./lamp_moves.js").LampRequest | null} | null} */ (null),
  );
  const inPicture = (/** @type {PointerEvent} */ event) => {
    const { left, top } = app.engine.element.getBoundingClientRect();
    return [
      (event.clientX - left - pane.left) / pane.scale,
      (event.clientY - top - pane.top) / pane.scale,
    ];
  };
  const down = (
    /** @type {PointerEvent} */ event,
    /** @type {number} */ light,
    /** @type {LightPlace} */ place,
  ) => {
    if (event.button !== 0) return;
    event.stopPropagation();
    const button = /** @type {HTMLElement} */ (event.currentTarget);
    button.setPointerCapture(event.pointerId);
    const { left, top, width, height } = button.getBoundingClientRect();
    // The mark keeps its offset from the pointer.
    const grasp = { dx: event.clientX - left - width / 2, dy: event.clientY - top - height / 2 };
    start.current = { light, place, ...grasp, isMoved: false, last: null };
  };
  const move = (/** @type {PointerEvent} */ event) => {
    const its = start.current;
    if (!its) return;
    event.stopPropagation();
    const [x, y] = inPicture(event);
    const made = of(x - its.dx / pane.scale, y - its.dy / pane.scale, event.shiftKey, its);
    if (!made) return;
    its.isMoved = true;
    its.last = made.request;
    app.store.set({ dragged: { light: its.light, place: made.place, at: made.at } });
    app.session.lampMoves.ask(its.light, made.request, false);
  };
  const up = (/** @type {PointerEvent} */ event) => {
    const its = start.current;
    if (!its) return;
    event.stopPropagation();
    start.current = null;
    if (its.isMoved && its.last)
      app.session.lampMoves.ask(its.light, its.last, true);
    app.store.set({ dragged: null });
  };
  return { down, move, up };
}
