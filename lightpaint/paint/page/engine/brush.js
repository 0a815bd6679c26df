/**
 * Brush strokes as round stamps along a path. Positions and sizes are in pixels of the picture.
 */

/** @import { Region } from '../../../viewer/drawing/view.js' */
/** @import { PaintCanvas } from './paint_canvas.js' */
/** @typedef {{x: number, y: number, pressure: number}} Point */
/** size: diameter. hardness: fully covered part of the radius. flow: coverage of one stamp at full
 * pressure.
 * @typedef {{size: number, hardness: number, flow: number}} Brush */

/** Distance between stamps, as a part of the diameter. */
const SPACING = 0.12;

/** Return a stamp's coverage in [0, 1] at a distance from its centre, in radii.
 * @param {number} distance in pixels @param {number} radius @param {number} hardness */
function profile(distance, radius, hardness) {
  // A hard edge is one pixel wide and centred on the radius, which preserves the area.
  const innerRadius = hardness * Math.max(0, radius - 0.5);
  const outerRadius = radius + 0.5 * hardness;
  if (distance <= innerRadius) return 1;
  if (distance >= outerRadius) return 0;
  return 0.5 + 0.5 * Math.cos((Math.PI * (distance - innerRadius)) / (outerRadius - innerRadius));
}

/** Apply one stamp. It moves the existing coverage towards 1.
 * @param {PaintCanvas} canvas @param {Point} point its middle; pixel (0, 0) has its own at ½, ½
 * @param {Brush} brush @returns {Region} */
export function stamp(canvas, { x, y, pressure }, { size, hardness, flow }) {
  const radius = Math.max(0.5, size / 2);
  const reach = radius + 0.5;
  const region = canvas.clip(y - reach, y + reach, x - reach, x + reach);
  const strength = flow * pressure;
  const innerRadius = hardness * Math.max(0, radius - 0.5);
  const [outerSquare, innerSquare] = [(radius + 0.5 * hardness) ** 2, innerRadius ** 2];
  canvas.cover(region, (column, row, coverage) => {
    const [dx, dy] = [column + 0.5 - x, row + 0.5 - y];
    const square = dx * dx + dy * dy;
    if (square >= outerSquare) return coverage;
    const stampCoverage = square <= innerSquare ? 1 : profile(Math.sqrt(square), radius, hardness);
    return coverage + strength * stampCoverage * (1 - coverage);
  });
  return region;
}

/** A path of the brush with stamps at even distances, independent of the spacing of its points. */
export class Path {
  /** @param {PaintCanvas} canvas @param {Brush} brush */
  constructor(canvas, brush) {
    this.canvas = canvas;
    this.brush = brush;
    /** @type {Point | null} */
    this.lastPoint = null;
    this.step = Math.max(0.5, SPACING * brush.size);
    /** Distance left to the next stamp. */
    this.distanceToStamp = 0;
  }

  /** Continue the path to a point. @param {Point} point @returns {Region[]} what is covered anew */
  moveTo(point) {
    const origin = this.lastPoint ?? point;
    const length = Math.hypot(point.x - origin.x, point.y - origin.y);
    const regions = [];
    // The tolerance lets steps with round-off reach the end.
    for (; this.distanceToStamp <= length + 1e-6; this.distanceToStamp += this.step) {
      const t = length > 0 ? this.distanceToStamp / length : 0;
      const position = {
        x: origin.x + t * (point.x - origin.x),
        y: origin.y + t * (point.y - origin.y),
        pressure: origin.pressure + t * (point.pressure - origin.pressure),
      };
      regions.push(stamp(this.canvas, position, this.brush));
    }
    this.distanceToStamp -= length;
    this.lastPoint = point;
    return regions;
  }
}

/** Cover one whole object. @param {PaintCanvas} canvas @param {number} object
 * @param {number} flow @returns {Region} */
export function fill(canvas, object, flow) {
  const { objects, width } = canvas;
  const region = objects ? boundsOf(objects, width, object) : canvas.wholeRegion;
  let count = 0;
  canvas.cover(region, (x, y, coverage) => {
    const isIn = !objects || objects[y * width + x] === object;
    if (isIn) count += 1;
    return isIn ? coverage + flow * (1 - coverage) : coverage;
  });
  canvas.setCoveredShare(count / canvas.importance.length);
  return region;
}

/** Cover everything, or all that is selected. @param {PaintCanvas} canvas @param {number} [flow]
 * @returns {Region} */
export function flood(canvas, flow = 1) {
  const region = canvas.selection?.bounds ?? canvas.wholeRegion;
  canvas.cover(region, (x, y, coverage) => coverage + flow * (1 - coverage));
  canvas.setFullyCovered();
  return region;
}

/** Return the bounding box of an object. @param {Int16Array} objects @param {number} width
 * @param {number} object @returns {Region} */
function boundsOf(objects, width, object) {
  let [top, bottom, distanceToStamp, right] = [Infinity, 0, Infinity, 0];
  for (let p = 0; p < objects.length; p++) {
    if (objects[p] !== object) continue;
    const [y, x] = [Math.floor(p / width), p % width];
    top = Math.min(top, y);
    bottom = y + 1;
    distanceToStamp = Math.min(distanceToStamp, x);
    right = Math.max(right, x + 1);
  }
  return bottom ? [top, bottom, distanceToStamp, right] : [0, 0, 0, 0];
}
