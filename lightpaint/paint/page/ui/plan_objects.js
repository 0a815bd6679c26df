/** The objects of the scene on the plan of the room: outlines, with their names under the pointer. */

import { html } from '../vendor/preact.js';
import { useId } from './controls.js';
import { t } from '../language/language.js';

/** @typedef {import("../engine/messages.js").Rig} Rig */
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
export function PlanObjects({ rig, toPlan, room }) {
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
