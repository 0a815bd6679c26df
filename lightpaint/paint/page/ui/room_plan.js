/** A small plan of the room from above, camera upwards, in which lights can be dragged. */

import { html, useRef } from '../vendor/preact.js';
import { AddLight } from './add_light.js';
import { MoveButton } from './advice.js';
import { dot, subtract, add, normalize, onRail } from './lamp_geometry.js';
import { placeOf, shiftedTo } from './lamp_marks.js';
import { DRAG_MIN_PIXELS, endOnEscape } from './lamps/mark_drag.js';
import { atFullBrightness, luminance, toHex } from '../../../viewer/drawing/colour.js';
import { t } from '../language/language.js';
import { useId } from './controls.js';

/** @import { App, Ui } from './ui_state.js' */
/** @import { Vector } from './lamp_geometry.js' */
/** @import { LightPlace, Rig } from '../engine/messages.js' */

/** @typedef {(point: number[]) => [number, number]} ToPlan */

/** Width of a letter of a name on the plan, and height of a line, in CSS pixels. */
const [LETTER, LINE] = [5.2, 9];

/** Return the outline of an object on the plan. @param {[number, number][]} corners in the two axes
 * beside the upward one @param {number} up @param {ToPlan} toPlan @returns {[number, number][]} */
function outlineOnPlan(corners, up, toPlan) {
  const [a, b] = [0, 1, 2].filter((axis) => axis !== up);
  return corners.map((corner) => {
    const point = [0, 0, 0];
    [point[a], point[b]] = corner;
    return toPlan(point);
  });
}

/** Return where a name has room within its outline; null without room. @param {string} name
 * @param {[number, number][]} outline */
function labelPlace(name, outline) {
  const [xs, ys] = [0, 1].map((c) => outline.map((corner) => corner[c]));
  const [left, right] = [Math.min(...xs), Math.max(...xs)];
  const [top, bottom] = [Math.min(...ys), Math.max(...ys)];
  const hasRoom = right - left > LETTER * name.length + 4 && bottom - top > LINE;
  return hasRoom ? { x: (left + right) / 2, y: (top + bottom) / 2 + 0.3 * LINE } : null;
}

/** @param {{rig: Rig, toPlan: ToPlan, room: string}} props room: its outline, which cuts off others */
function PlanObjects({ rig, toPlan, room }) {
  const id = useId();
  if (!rig.objects.length) return null;
  const names = [...new Set(rig.objects.map(({ name }) => name))].join(', ');
  const outlines = rig.objects.map(({ name, corners }) => ({
    name,
    outline: outlineOnPlan(corners, rig.up, toPlan),
  }));
  const labels = labelsOf(outlines);
  return html`<clipPath id=${id}><polygon points=${room} /></clipPath>
  <g class="plan-objects" clip-path=${`url(#${id})`} role="img" aria-label=${t('Objects: {names}', { names })}>
    ${outlines.map(
      ({ name, outline }, k) =>
        html`<polygon key=${k} points=${outline.join(' ')} data-tip=${name} />`,
    )}
    ${labels.map(({ name, x, y }) => html`<text key=${name} x=${x} y=${y}>${name}</text>`)}
  </g>`;
}

/** Return the names that have room, each once and none over another.
 * @param {{name: string, outline: [number, number][]}[]} outlines the largest first */
function labelsOf(outlines) {
  /** @type {{name: string, x: number, y: number}[]} */
  const labels = [];
  for (const { name, outline } of outlines) {
    const place = labelPlace(name, outline);
    const isFree = labels.every(
      (other) =>
        other.name !== name &&
        (!place ||
          Math.abs(place.y - other.y) > LINE ||
          2 * Math.abs(place.x - other.x) > LETTER * (name.length + other.name.length)),
    );
    if (place && isFree) labels.push({ name, ...place });
  }
  return labels;
}

/** A drag of a light: where it hung, where the pointer pressed, and where the light is now.
 * @typedef {{light: number, place: LightPlace, x: number, y: number, position: Vector | null,
 *   stop: () => void}} PlanDrag */

/** Height of the plan and its margin, in CSS pixels; its width follows from the panel. */
const [WIDTH, HEIGHT, MARGIN] = [270, 170, 10];

/** Height of a light added in the plan, relative to the room's. */
const NEW_LIGHT_HEIGHT = 0.85;

/** Length of the arrow of a light's direction, in CSS pixels. */
const ARROW_PIXELS = 16;

/** Return the axes of the plan: to the right and away from the camera, along the floor.
 * @param {Ui} ui @returns {{toPlan: (point: number[]) => [number, number],
 *   toScene: (x: number, y: number, height: number) => Vector, toPlanDirection: (v: number[]) => [number, number]} | null} */
function planOf({ rig, view, state }) {
  const camera = rig?.cameras[view] ?? rig?.cameras[0];
  if (!rig || !camera) return null;
  const [height, width] = state.size;
  const viewDirection = add(
    add(camera.forward, camera.x_axis, width / 2),
    camera.y_axis,
    height / 2,
  );
  const flatten = (/** @type {number[]} */ v) => {
    const vector = /** @type {Vector} */ ([...v]);
    vector[rig.up] = 0;
    return normalize(vector);
  };
  const depthAxis = flatten(camera.is_parallel ? camera.forward : viewDirection);
  const widthAxis = flatten(
    subtract(
      camera.x_axis,
      depthAxis.map((x) => x * dot(camera.x_axis, depthAxis)),
    ),
  );
  const corners = [0, 1, 2, 3].map((k) => {
    const corner = [...rig.low];
    const [a, b] = [0, 1, 2].filter((axis) => axis !== rig.up);
    if (k & 1) corner[a] = rig.high[a];
    if (k & 2) corner[b] = rig.high[b];
    return corner;
  });
  const places = corners.map((corner) => [dot(corner, widthAxis), dot(corner, depthAxis)]);
  const [xs, ys] = [0, 1].map((c) => places.map((place) => place[c]));
  const [left, maxDepth] = [Math.min(...xs), Math.max(...ys)];
  const scale = Math.min(
    (WIDTH - 2 * MARGIN) / (Math.max(...xs) - left || 1),
    (HEIGHT - 2 * MARGIN) / (maxDepth - Math.min(...ys) || 1),
  );
  const shift = (WIDTH - scale * (Math.max(...xs) - left)) / 2;
  return {
    toPlan: (point) => [
      shift + scale * (dot(point, widthAxis) - left),
      MARGIN + scale * (maxDepth - dot(point, depthAxis)),
    ],
    toScene: (x, y, height) => {
      const offset = left + (x - shift) / scale;
      const depth = maxDepth - (y - MARGIN) / scale;
      const point = add(add([0, 0, 0], widthAxis, offset), depthAxis, depth);
      point[rig.up] = height;
      return point;
    },
    toPlanDirection: (v) => [dot(v, widthAxis), -dot(v, depthAxis)],
  };
}

/** The camera, at the edge of the plan if it is outside. @param {{ui: Ui,
 *   toPlan: (point: number[]) => [number, number]}} props */
function CameraMark({ ui, toPlan }) {
  const camera = ui.rig?.cameras[ui.view] ?? ui.rig?.cameras[0];
  if (!camera || camera.is_parallel) return null;
  const [x, y] = toPlan(camera.origin).map((value, c) =>
    Math.min(Math.max(value, MARGIN), (c ? HEIGHT : WIDTH) - MARGIN / 2),
  );
  const corners = [[x, y], [x - 6, y - 9], [x + 6, y - 9]];
  return html`<polygon class="camera" points=${corners.join(' ')} data-tip=${t('Camera')}>
    <title>${t('Camera')}</title></polygon>`;
}

/** @param {{ui: Ui, app: App}} props */
export function RoomPlan({ ui, app }) {
  const frame = useRef(/** @type {SVGElement | null} */ (null));
  const drag = useRef(/** @type {PlanDrag | null} */ (null));
  const plan = planOf(ui);
  if (!plan || !ui.rig) return html`<p class="faint">${t('Loading the scene …')}</p>`;
  const { rig } = ui;
  const [a, b] = [0, 1, 2].filter((axis) => axis !== rig.up);
  const corner = (/** @type {number} */ x, /** @type {number} */ z) => {
    const vector = [0, 0, 0];
    vector[a] = x;
    vector[b] = z;
    return plan.toPlan(vector).join(',');
  };
  const { low, high } = rig;
  const outline = [
    corner(low[a], low[b]),
    corner(high[a], low[b]),
    corner(high[a], high[b]),
    corner(low[a], high[b]),
  ].join(' ');
  const dragLight = (/** @type {PointerEvent} */ event) => {
    const { current } = drag;
    if (!current || !frame.current) return;
    // From where the drag began: the plan itself may shift on the page meanwhile.
    const [dx, dy] = [event.clientX - current.x, event.clientY - current.y];
    if (!current.position && Math.hypot(dx, dy) < DRAG_MIN_PIXELS) return;
    const zoom = WIDTH / frame.current.getBoundingClientRect().width;
    const { light, place } = current;
    const start = /** @type {number[]} */ (place.position);
    const [x, y] = plan.toPlan(start);
    const free = plan.toScene(x + zoom * dx, y + zoom * dy, start[rig.up]);
    const position = place.rail ? onRail(place.rail, free) : free;
    current.position = position;
    app.store.setForFrame({ drag: { light, place: shiftedTo(place, position) } });
    app.session.lampMoves.drag(light, { kind: 'move', pose: { position } }, app.engine);
  };
  const endDrag = () => {
    const { current } = drag;
    if (!current) return;
    current.stop();
    drag.current = null;
    app.store.set({ drag: null });
    app.engine.dragLight(null);
    const pose = current.position && { position: current.position };
    if (pose) app.session.lampMoves.queue(current.light, { kind: 'move', pose });
  };
  const cancelDrag = () => {
    const { current } = drag;
    if (current?.position) app.session.lampMoves.cancel(current.light);
    if (current) current.position = null;
    endDrag();
  };
  const isHanging = ui.clickAction?.mode === 'hang';
  const hang = (/** @type {PointerEvent} */ event) => {
    if (ui.clickAction?.mode !== 'hang' || !frame.current) return;
    const box = frame.current.getBoundingClientRect();
    const zoom = WIDTH / box.width;
    const height = rig.low[rig.up] + NEW_LIGHT_HEIGHT * (rig.high[rig.up] - rig.low[rig.up]);
    const place = plan.toScene(
      (event.clientX - box.left) * zoom,
      (event.clientY - box.top) * zoom,
      height,
    );
    if ([a, b].some((axis) => place[axis] < low[axis] || place[axis] > high[axis]))
      return app.session.toast(t('That is outside the room: click inside its outline'), 'warn');
    void app.session.addLight({ type: ui.clickAction.type, position: place, view: ui.view });
  };
  return html`<div class="room-plan">
    <svg ref=${frame} viewBox=${`0 0 ${WIDTH} ${HEIGHT}`} role="group"
      aria-label=${t('Plan of the room from above')} class=${isHanging ? 'is-pointing' : ''}
      onPointerDown=${hang} onPointerMove=${dragLight}
      onPointerUp=${endDrag} onPointerCancel=${endDrag}>
      <polygon class="room" points=${outline} />
      <${PlanObjects} rig=${rig} toPlan=${plan.toPlan} room=${outline} />
      <${CameraMark} ui=${ui} toPlan=${plan.toPlan} />
      ${Object.entries(ui.trial?.positions ?? {}).map(([name, position]) => {
        const [x, y] = plan.toPlan(position);
        const [dx, dy] = plan.toPlanDirection(ui.trial?.directions[name] ?? [0, 0, 0]);
        return html`<g key=${`trial ${name}`} class="is-trial"><line x1=${x} y1=${y} x2=${x + ARROW_PIXELS * dx}
          y2=${y + ARROW_PIXELS * dy} /><circle cx=${x} cy=${y} r="6" /></g>`;
      })}
      ${rig.lights.map((_, k) => {
        const place = placeOf(ui, k);
        if (!place.position) return null;
        const [x, y] = plan.toPlan(place.position);
        const [dx, dy] = place.direction ? plan.toPlanDirection(place.direction) : [0, 0];
        const rgb = ui.weights[k] ?? ui.lights[k].present;
        const { label } = ui.lights[k];
        return html`<g key=${k} class=${`${ui.lamp === k ? 'is-chosen' : ''} ${place.immovable_reason ? 'is-fixed' : ''}`}>
          <line x1=${x} y1=${y} x2=${x + ARROW_PIXELS * dx} y2=${y + ARROW_PIXELS * dy} />
          <circle cx=${x} cy=${y} r="5" fill=${luminance(rgb) > 0 ? toHex(atFullBrightness(rgb)) : 'none'}
            data-tip=${label} onPointerDown=${(/** @type {PointerEvent} */ event) => {
              if (isHanging) return;
              app.store.set({ lamp: k });
              if (place.immovable_reason || event.button !== 0) return;
              const { clientX: pointerX, clientY: pointerY } = event;
              drag.current = { light: k, place, x: pointerX, y: pointerY, position: null, stop: endOnEscape(cancelDrag) };
              frame.current?.setPointerCapture(event.pointerId);
            }}><title>${label}</title></circle></g>`;
      })}
    </svg>
    <${AddLight} ui=${ui} app=${app} />
    <${MoveButton} ui=${ui} app=${app} />
  </div>`;
}
