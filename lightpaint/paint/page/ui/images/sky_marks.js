/** Marks on the map of a sky: the horizon, what the camera sees, and what is left, right and behind. */

import { html } from '../../vendor/preact.js';
import { add, dot, normalize, subtract } from '../lamp_geometry.js';
import { t } from '../../language/language.js';
import { skyDirection, skyPlace } from './texel_arithmetic.js';

/** @import { Ui } from '../ui_state.js' */
/** @import { LightImage } from './light_images.js' */
/** @import { MapPoint } from './texel_arithmetic.js' */
/** @import { Vector } from '../lamp_geometry.js' */
/** How a sky lies around the camera. fromWorld: rows of a matrix to the map's axes; up: the vertical
 * there; forward, right: horizontal directions of the camera, frame: of the edge of its picture.
 * @typedef {{up: Vector, forward: Vector | null, right: Vector | null, frame: Vector[]}} SkyView */

/** Points along each side of the camera's picture, and along the horizon. */
const [SIDE_POINTS, HORIZON_POINTS] = [10, 96];

/** Return how a sky lies around the camera of the view, in the map's axes; null before it is known, and
 * for images that are not skies. @param {Ui} ui @param {LightImage} image @returns {SkyView | null} */
export function skyViewOf({ rig, view, state }, { name }) {
  const axes = rig?.skies.find((sky) => sky.name === name)?.from_world;
  if (!rig || !axes) return null;
  const toMap = (/** @type {number[]} */ v) => normalize(axes.map((row) => dot(row, v)));
  const up = /** @type {Vector} */ ([0, 1, 2].map((axis) => Number(axis === rig.up)));
  const camera = rig.cameras[view] ?? rig.cameras[0];
  if (!camera) return { up: toMap(up), forward: null, right: null, frame: [] };
  const [height, width] = state.size;
  const rayTo = (/** @type {number} */ x, /** @type {number} */ y) =>
    camera.is_parallel
      ? normalize(camera.forward)
      : add(add(camera.forward, camera.x_axis, x), camera.y_axis, y);
  const level = (/** @type {number[]} */ v) => normalize(subtract(v, up.map((x) => x * dot(v, up))));
  const steps = Array.from({ length: SIDE_POINTS }, (_, k) => k / SIDE_POINTS);
  const edge = [
    ...steps.map((x) => rayTo(x * width, 0)),
    ...steps.map((x) => rayTo(width, x * height)),
    ...steps.map((x) => rayTo((1 - x) * width, height)),
    ...steps.map((x) => rayTo(0, (1 - x) * height)),
  ];
  return {
    up: toMap(up),
    forward: toMap(level(rayTo(width / 2, height / 2))),
    right: toMap(level(camera.x_axis)),
    frame: camera.is_parallel ? [] : [...edge, edge[0]].map(toMap),
  };
}

/** Return whether a place of a sky is above the horizon. @param {SkyView | null} sky
 * @param {LightImage} image @returns {((place: MapPoint) => boolean) | null} null where it is unknown */
export function aboveHorizon(sky, { places }) {
  if (!sky) return null;
  return (place) => dot(skyDirection(place, places.length, places[0].length), sky.up) > -1e-9;
}

/** Return where a place lies as seen from the camera, in words; '' where that is unknown.
 * @param {SkyView | null} sky @param {LightImage} image @param {MapPoint} place */
export function directionText(sky, { places }, place) {
  if (!sky?.forward || !sky.right) return '';
  const direction = skyDirection(place, places.length, places[0].length);
  const degrees = (/** @type {number} */ radians) => Math.round((180 / Math.PI) * radians);
  const height = degrees(Math.asin(Math.min(1, Math.max(-1, dot(direction, sky.up)))));
  const turn = degrees(Math.atan2(dot(direction, sky.right), dot(direction, sky.forward)));
  const isPole = Math.abs(height) > 85;
  const side =
    turn === 0 || isPole
      ? ''
      : turn < 0
        ? t('{degrees}° left of the view', { degrees: -turn })
        : t('{degrees}° right of the view', { degrees: turn });
  const level =
    height < 0
      ? t('{degrees}° down', { degrees: -height })
      : t('{degrees}° up', { degrees: height });
  return [side, level].filter(Boolean).join(', ');
}

/** Return a place of the map as percentages from its left and its top. @param {Vector} direction
 * @param {number} rows @param {number} columns @returns {[x: number, y: number]} */
function percentAt(direction, rows, columns) {
  const [row, column] = skyPlace(direction, rows, columns);
  return [(100 * (column + 0.5)) / columns, (100 * (row + 0.5)) / rows];
}

/** Return lines that do not cross the map where they leave it at one side and go on at the other.
 * @param {[number, number][]} points in percent @returns {[number, number][][]} */
function unwrappedLines(points) {
  /** @type {[number, number][][]} */
  const lines = [[]];
  points.forEach((point, k) => {
    if (k && Math.abs(point[0] - points[k - 1][0]) > 50) lines.push([]);
    lines[lines.length - 1].push(point);
  });
  return lines.filter((line) => line.length > 1);
}

/** Return the horizon of a sky, from left to right, in its axes; empty where it is too steep.
 * @param {SkyView} sky @returns {Vector[]} */
export function horizonOf({ up: [ux, uy, uz] }) {
  if (Math.abs(uy) < 0.05) return [];
  return Array.from({ length: HORIZON_POINTS + 1 }, (_, k) => {
    const azimuth = (2 * Math.PI * (k + 1e-6)) / (HORIZON_POINTS + 2e-6);
    const slope = -(ux * Math.sin(azimuth) - uz * Math.cos(azimuth)) / uy;
    const polar = Math.PI / 2 - Math.atan(slope);
    const sine = Math.sin(polar);
    return [sine * Math.sin(azimuth), Math.cos(polar), -sine * Math.cos(azimuth)];
  });
}

/** @param {{sky: SkyView | null, image: LightImage}} props */
export function SkyMarks({ sky, image }) {
  if (!sky) return null;
  const [rows, columns] = [image.places.length, image.places[0].length];
  const at = (/** @type {Vector} */ direction) => percentAt(direction, rows, columns);
  const lines = (/** @type {Vector[]} */ directions, /** @type {string} */ name) =>
    unwrappedLines(directions.map(at)).map(
      (line, k) => html`<polyline key=${`${name} ${k}`} class=${name} points=${line.join(' ')} />`,
    );
  const opposite = (/** @type {Vector} */ v) => /** @type {Vector} */ (v.map((x) => -x));
  const { forward, right } = sky;
  const labels =
    forward && right
      ? [
          { text: t('left'), place: at(opposite(right)) },
          { text: t('right'), place: at(right) },
          { text: t('behind'), place: at(opposite(forward)) },
          ...(sky.frame.length ? [] : [{ text: t('front'), place: at(forward) }]),
        ]
      : [];
  const cornerOf = sky.frame.length ? at(sky.frame[0]) : null;
  return html`<svg class="sky-marks" viewBox="0 0 100 100" preserveAspectRatio="none" aria-hidden="true">
      ${lines(horizonOf(sky), 'sky-horizon')}${lines(sky.frame, 'sky-frame')}</svg>
    ${[...labels, ...(cornerOf ? [{ text: t('camera'), place: cornerOf }] : [])].map(
      ({
        text,
        place: [x, y],
      }) => html`<span key=${text} class=${`sky-label ${text === t('camera') ? 'is-camera' : ''}`}
        aria-hidden="true" style=${{ left: `${Math.min(text === t('camera') ? 84 : 93, Math.max(7, x))}%`, top: `${y}%` }}>${text}</span>`,
    )}`;
}
