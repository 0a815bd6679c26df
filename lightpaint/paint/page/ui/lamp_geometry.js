/** Projection of scene points to the picture, and from a pointer back to the scene. */

/** @import { Camera } from '../engine/messages.js' */
/** @typedef {[number, number, number]} Vector */

/** Sine of the angle between ray and plane below which their intersection is too uncertain. */
const GRAZING = 0.04;

/** @param {number[]} a @param {number[]} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** a + t b. @param {number[]} a @param {number[]} b @param {number} [t] @returns {Vector} */
export const add = (a, b, t = 1) => [a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]];

/** @param {number[]} a @param {number[]} b @returns {Vector} */
export const subtract = (a, b) => add(a, b, -1);

/** @param {number[]} a @param {number[]} b @returns {Vector} */
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

/** @param {number[]} a @returns {Vector} */
export function normalize(a) {
  const length = Math.hypot(...a) || 1;
  return [a[0] / length, a[1] / length, a[2] / length];
}

/** Return the coefficients of a vector in a basis of three others. @param {number[]} a
 * @param {number[]} b
 * @param {number[]} c @param {number[]} v @returns {Vector} */
function coefficients(a, b, c, v) {
  const determinant = dot(a, cross(b, c));
  return [
    dot(v, cross(b, c)) / determinant,
    dot(a, cross(v, c)) / determinant,
    dot(a, cross(b, v)) / determinant,
  ];
}

/** Return a point's place in pixels of the picture, and whether it is in front of the camera. For a
 * point behind it, the place belongs to the opposite direction.
 * @param {Camera} camera @param {number[]} point @returns {{x: number, y: number, isAhead: boolean}} */
export function project(camera, point) {
  const [x, y, s] = coefficients(
    camera.x_axis,
    camera.y_axis,
    camera.forward,
    subtract(point, camera.origin),
  );
  if (camera.is_parallel) return { x, y, isAhead: s > 0 };
  return { x: x / s, y: y / s, isAhead: s > 0 };
}

/** Depth of the plane before the camera at which polygons are cut, relative to their deepest corner. */
const NEAR_SHARE = 1e-3;

/** Return the corners of a polygon in pixels of the picture, without the part behind the camera.
 * @param {Camera} camera @param {number[][]} corners in the scene @returns {[number, number][]} fewer
 *   or more than there were; none if all of it lies behind the camera */
export function projectPolygon(camera, corners) {
  const { origin, x_axis: xAxis, y_axis: yAxis, forward, is_parallel: isParallel } = camera;
  const seen = corners.map((point) =>
    coefficients(xAxis, yAxis, forward, subtract(point, origin)),
  );
  const near = NEAR_SHARE * Math.max(...seen.map(([, , depth]) => depth));
  if (!(near > 0)) return [];
  return seen.flatMap((corner, k) => {
    const next = seen[(k + 1) % seen.length];
    const kept = corner[2] >= near ? [corner] : [];
    if (corner[2] >= near !== next[2] >= near) {
      const share = (near - corner[2]) / (next[2] - corner[2]);
      kept.push(add(corner, subtract(next, corner), share));
    }
    return kept.map(([x, y, s]) => /** @type {[number, number]} */ (isParallel ? [x, y] : [x / s, y / s]));
  });
}

/** Return the same for a direction: a point that is infinitely far away. @param {Camera} camera
 * @param {number[]} direction */
export function projectDirection(camera, direction) {
  const distance = 1e6 * (Math.hypot(...camera.origin) + 1);
  return project(camera, add(camera.origin, normalize(direction), distance));
}

/** Return the camera ray of a pixel. @param {Camera} camera @param {number} x @param {number} y
 * @returns {{origin: Vector, direction: Vector}} */
function rayAt({ origin, x_axis: xAxis, y_axis: yAxis, forward, is_parallel: isParallel }, x, y) {
  const offset = add(add([0, 0, 0], xAxis, x), yAxis, y);
  return isParallel
    ? { origin: add(origin, offset), direction: normalize(forward) }
    : { origin: add(origin, [0, 0, 0]), direction: normalize(add(offset, forward)) };
}

/** Return the place to which a pointer drags a light in its horizontal plane. If the plane is seen
 * edge-on, the light moves parallel to the picture instead, at its distance.
 * @param {Camera} camera @param {number[]} place of the light @param {number} up axis
 * @param {number} x @param {number} y in pixels of the picture @returns {Vector} */
export function dragInPlane(camera, place, up, x, y) {
  const { origin, direction } = rayAt(camera, x, y);
  const depth = dot(subtract(place, origin), direction);
  const distance = (place[up] - origin[up]) / direction[up];
  const isHit = Math.abs(direction[up]) > GRAZING && distance > 0 && distance < 8 * Math.abs(depth);
  const point = add(origin, direction, isHit ? distance : depth);
  point[up] = place[up];
  return point;
}

/** Return the point of a line that is nearest to a pointer's ray. @param {Camera} camera
 * @param {number[]} start @param {number[]} axis @param {number} x @param {number} y
 * @returns {number} as a multiple of `along` from `start` */
function nearestOnLine(camera, start, axis, x, y) {
  const { origin, direction } = rayAt(camera, x, y);
  const offset = subtract(start, origin);
  const [a, b, c] = [dot(axis, axis), dot(axis, direction), dot(direction, direction)];
  const determinant = a * c - b * b;
  if (determinant < 1e-9 * a * c) return 0;
  return (b * dot(direction, offset) - c * dot(axis, offset)) / determinant;
}

/** Return the place to which a pointer drags a light up and down. @param {Camera} camera
 * @param {number[]} place @param {number} up @param {number} x @param {number} y @returns {Vector} */
export function dragVertically(camera, place, up, x, y) {
  const axis = /** @type {Vector} */ ([0, 0, 0].map((_, k) => (k === up ? 1 : 0)));
  return add(place, axis, nearestOnLine(camera, place, axis, x, y));
}

/** Return the place on its rail to which a pointer drags a light. @param {Camera} camera
 * @param {number[][]} rail both ends @param {number} x @param {number} y @returns {Vector} */
export function dragOnRail(camera, [start, end], x, y) {
  const axis = subtract(end, start);
  const share = nearestOnLine(camera, start, axis, x, y);
  return add(start, axis, Math.min(1, Math.max(0, share)));
}

/** Return where light comes from that shines in a direction: its elevation and its azimuth in
 * degrees, around the vertical from the axis after it. @param {number[]} direction @param {number} up */
export function skyAngles(direction, up) {
  const [x, y, z] = [1, 2, 3].map((k) => -direction[(up + k) % 3]);
  const elevation = degrees(Math.atan2(z, Math.hypot(x, y)));
  return { elevation, azimuth: degrees(Math.atan2(y, x)) };
}

/** Return the direction of light from such a place in the sky.
 * @param {{elevation: number, azimuth: number}} angles @param {number} up @returns {Vector} */
export function directionFrom({ elevation, azimuth }, up) {
  const [height, turn] = [radians(elevation), radians(azimuth)];
  const direction = /** @type {Vector} */ ([0, 0, 0]);
  direction[(up + 1) % 3] = -Math.cos(height) * Math.cos(turn);
  direction[(up + 2) % 3] = -Math.cos(height) * Math.sin(turn);
  direction[up] = -Math.sin(height);
  return direction;
}

const degrees = (/** @type {number} */ angle) => (angle * 180) / Math.PI;
const radians = (/** @type {number} */ angle) => (angle * Math.PI) / 180;

/** Return the point of a rail that is nearest to a point. @param {number[][]} rail both ends
 * @param {number[]} point @returns {Vector} */
export function onRail([start, end], point) {
  const axis = subtract(end, start);
  const share = dot(subtract(point, start), axis) / (dot(axis, axis) || 1);
  return add(start, axis, Math.min(1, Math.max(0, share)));
}

/** Return the point of a rail at which one coordinate has a value between its ends; null if
 * that coordinate is the same all along. @param {number[][]} rail both ends @param {number} c
 * @param {number} value @returns {Vector | null} */
export function onRailAt([start, end], c, value) {
  const axis = subtract(end, start);
  const length = Math.hypot(...axis);
  if (Math.abs(axis[c]) <= 1e-6 * length) return null;
  return add(start, axis, (value - start[c]) / axis[c]);
}

/** Return a place moved to the right, away from the camera and upwards, by these amounts.
 * @param {Camera} camera @param {number[]} place @param {number} up axis @param {number[]} amounts
 * @returns {Vector} */
export function nudged(camera, place, up, [right, away, upwards]) {
  const vertical = /** @type {Vector} */ ([0, 0, 0].map((_, k) => (k === up ? 1 : 0)));
  const rightAxis = normalize(camera.x_axis.map((x, k) => (k === up ? 0 : x)));
  // Across both: it points away from a camera that looks straight down, too.
  const across = cross(vertical, rightAxis);
  const sign = dot(across, camera.forward) < dot(across, camera.y_axis) ? -1 : 1;
  return add(add(add(place, rightAxis, right), across, sign * away), vertical, upwards);
}

/** Return a place clamped to a rectangle, along the line to its centre.
 * @param {{x: number, y: number, isAhead: boolean}} seen
 * @param {{left: number, top: number, right: number, bottom: number}} box
 * @returns {{x: number, y: number, isInside: boolean, angle: number}} angle: in radians, outwards */
export function clampToBox({ x, y, isAhead }, { left, top, right, bottom }) {
  const [cx, cy] = [(left + right) / 2, (top + bottom) / 2];
  const isInside = isAhead && x >= left && x <= right && y >= top && y <= bottom;
  const sign = isAhead ? 1 : -1;
  const [dx, dy] = [sign * (x - cx), sign * (y - cy)];
  const angle = Math.atan2(dy, dx);
  if (isInside) return { x, y, isInside, angle };
  const t = Math.min(
    (right - left) / 2 / Math.max(Math.abs(dx), 1e-9),
    (bottom - top) / 2 / Math.max(Math.abs(dy), 1e-9),
  );
  return { x: cx + t * dx, y: cy + t * dy, isInside, angle };
}

/** Return whether a polygon has a point, by the sides that a ray to the right crosses.
 * @param {[number, number][]} corners @param {number} x @param {number} y */
export function isInside(corners, x, y) {
  let isIn = false;
  corners.forEach(([ax, ay], k) => {
    const [bx, by] = corners[(k + 1) % corners.length];
    if (ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax)) isIn = !isIn;
  });
  return isIn;
}
