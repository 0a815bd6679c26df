/**
 * Brush strokes as round stamps along a path. Positions and sizes are in pixels of the picture.
 */

/** @typedef {import("./message_frames.js").Region} Region */
/** @typedef {import("./paint_canvas.js").PaintCanvas} PaintCanvas */
/** @typedef {{x: number, y: number, pressure: number}} Point */
/** size: diameter. hardness: part of the radius that is covered whole. flow: how far one stamp
 * covers, at full pressure.
 * @typedef {{size: number, hardness: number, flow: number}} Brush */

/** Part of the diameter from one stamp to the next. */
export const SPACING = 0.12;

/** How far a stamp covers, in [0, 1], by the distance from its middle over the radius.
 * @param {number} distance in pixels @param {number} radius @param {number} hardness */
export function profile(distance, radius, hardness) {
  // A hard edge is one pixel wide, half of it beyond the radius, so that its area is right.
  const inner = hardness * Math.max(0, radius - 0.5);
  const outer = radius + 0.5 * hardness;
  if (distance <= inner) return 1;
  if (distance >= outer) return 0;
  return 0.5 + 0.5 * Math.cos((Math.PI * (distance - inner)) / (outer - inner));
}

/** One stamp. Coverage that is there grows towards 1 by what the stamp covers.
 * @param {PaintCanvas} canvas @param {Point} point its middle; pixel (0, 0) has its own at ½, ½
 * @param {Brush} brush @returns {Region} */
export function stamp(canvas, { x, y, pressure }, { size, hardness, flow }) {
  const radius = Math.max(0.5, size / 2);
  const reach = radius + 0.5;
  const region = canvas.clipped(y - reach, y + reach, x - reach, x + reach);
  const strength = flow * pressure;
  const inner = hardness * Math.max(0, radius - 0.5);
  const [most, least] = [(radius + 0.5 * hardness) ** 2, inner ** 2];
  canvas.cover(region, (column, row, before) => {
    const [dx, dy] = [column + 0.5 - x, row + 0.5 - y];
    const square = dx * dx + dy * dy;
    if (square >= most) return before;
    const covered = square <= least ? 1 : profile(Math.sqrt(square), radius, hardness);
    return before + strength * covered * (1 - before);
  });
  return region;
}

/** A way of the brush, on which it stamps at even distances, whatever points it goes through. */
export class Path {
  /** @param {PaintCanvas} canvas @param {Brush} brush */
  constructor(canvas, brush) {
    this.canvas = canvas;
    this.brush = brush;
    /** @type {Point | null} */
    this.last = null;
    this.step = Math.max(0.5, SPACING * brush.size);
    /** Distance to the next stamp. */
    this.left = 0;
  }

  /** Go on to a point. @param {Point} point @returns {Region[]} what is covered anew */
  moveTo(point) {
    const from = this.last ?? point;
    const length = Math.hypot(point.x - from.x, point.y - from.y);
    const regions = [];
    // Steps that do not add up to the last bit still reach its end.
    for (; this.left <= length + 1e-6; this.left += this.step) {
      const t = length > 0 ? this.left / length : 0;
      const between = {
        x: from.x + t * (point.x - from.x),
        y: from.y + t * (point.y - from.y),
        pressure: from.pressure + t * (point.pressure - from.pressure),
      };
      regions.push(stamp(this.canvas, between, this.brush));
    }
    this.left -= length;
    this.last = point;
    return regions;
  }
}

/** Cover one object, whole. @param {PaintCanvas} canvas @param {number} object
 * @param {number} flow @returns {Region} */
export function fill(canvas, object, flow) {
  const { objects, width } = canvas;
  const region = objects ? boundsOf(objects, width, object) : canvas.whole;
  let count = 0;
  canvas.cover(region, (x, y, before) => {
    const isIn = !objects || objects[y * width + x] === object;
    if (isIn) count += 1;
    return isIn ? before + flow * (1 - before) : before;
  });
  canvas.covers(count / canvas.importance.length);
  return region;
}

/** Cover everything. @param {PaintCanvas} canvas @returns {Region} */
export function flood(canvas) {
  canvas.cover(canvas.whole, () => 1);
  canvas.coversAll();
  return canvas.whole;
}

/** Where an object is seen. @param {Int16Array} objects @param {number} width
 * @param {number} object @returns {Region} */
function boundsOf(objects, width, object) {
  let [top, bottom, left, right] = [Infinity, 0, Infinity, 0];
  for (let p = 0; p < objects.length; p++) {
    if (objects[p] !== object) continue;
    const [y, x] = [Math.floor(p / width), p % width];
    top = Math.min(top, y);
    bottom = y + 1;
    left = Math.min(left, x);
    right = Math.max(right, x + 1);
  }
  return bottom ? [top, bottom, left, right] : [0, 0, 0, 0];
}
