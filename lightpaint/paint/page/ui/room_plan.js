/** A small plan of the room from above, camera upwards, in which lights can be dragged. */

import { html, useRef } from '../vendor/preact.js';
import { AddLight } from './add_light.js';
import { MoveButton } from './advice.js';
import { dot, subtract, add, normalize } from './lamp_geometry.js';
import { placeOf } from './lamp_marks.js';
import { atFullBrightness, luminance, toHex } from './paint_colour.js';
import { words } from '../language/language.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */
/** @typedef {import("./lamp_geometry.js").Vector} Vector */

/** Height of the plan and its margin, in CSS pixels; its width follows from the panel. */
const [WIDTH, HEIGHT, MARGIN] = [270, 130, 10];

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

/** @param {{ui: Ui, app: App}} props */
export function RoomPlan({ ui, app }) {
  const frame = useRef(/** @type {SVGElement | null} */ (null));
  const draggedLight = useRef(/** @type {number | null} */ (null));
  const plan = planOf(ui);
  if (!plan || !ui.rig) return html`<p class="faint">${words.roomPlan.loadingTheScene}</p>`;
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
  const dragLight = (/** @type {PointerEvent} */ event, /** @type {boolean} */ isFinal) => {
    const light = draggedLight.current;
    if (light === null || !frame.current) return;
    const box = frame.current.getBoundingClientRect();
    const place = rig.lights[light];
    if (!place.position) return;
    const zoom = WIDTH / box.width;
    const [x, y] = [(event.clientX - box.left) * zoom, (event.clientY - box.top) * zoom];
    const position = plan.toScene(x, y, place.position[rig.up]);
    const request = /** @type {const} */ ({ kind: 'move', pose: { position } });
    if (!isFinal) {
      app.store.setForFrame({ drag: { light, place: { position } } });
      return app.session.lampMoves.drag(light, request, app.engine);
    }
    app.store.set({ drag: null });
    app.engine.dragLight(null);
    app.session.lampMoves.queue(light, request);
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
    void app.session.addLight({ type: ui.clickAction.type, position: place, view: ui.view });
  };
  const endDrag = (/** @type {PointerEvent} */ event) => {
    if (app.store.value.drag) dragLight(event, true);
    draggedLight.current = null;
  };
  return html`<div class="room-plan">
    <svg ref=${frame} viewBox=${`0 0 ${WIDTH} ${HEIGHT}`} role="group"
      aria-label=${words.roomPlan.planOfTheRoomFromAbove} class=${isHanging ? 'is-pointing' : ''}
      onPointerDown=${hang} onPointerMove=${(/** @type {any} */ e) => dragLight(e, false)}
      onPointerUp=${endDrag} onPointerCancel=${endDrag}>
      <polygon class="room" points=${outline} />
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
              if (place.immovable_reason || place.rail) return;
              draggedLight.current = k;
              frame.current?.setPointerCapture(event.pointerId);
            }}><title>${label}</title></circle></g>`;
      })}
    </svg>
    <${AddLight} ui=${ui} app=${app} />
    <${MoveButton} ui=${ui} app=${app} />
  </div>`;
}
