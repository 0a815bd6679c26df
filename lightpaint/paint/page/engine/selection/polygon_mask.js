/** Masks of polygons: rectangles, ellipses and what a lasso encloses, with smooth edges. */

/** Full selection of a pixel. */
export const FULL = 255;

/** Rows of samples in each row of pixels; across, coverage is exact. */
const SUBROWS = 8;

/** Sides of an ellipse for each pixel of its larger radius, and the fewest. */
const [SIDES_PER_PIXEL, MIN_SIDES] = [6, 64];

/** @typedef {[x: number, y: number]} Corner in pixels; pixel (0, 0) has its middle at ½, ½ */
/** @typedef {[height: number, width: number]} Size */

/** Return the corners of a rectangle between two places. @param {Corner} a @param {Corner} b
 * @returns {Corner[]} */
export function rectangle([ax, ay], [bx, by]) {
  const [x0, x1, y0, y1] = [Math.min(ax, bx), Math.max(ax, bx), Math.min(ay, by), Math.max(ay, by)];
  return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
}

/** Return the corners of an ellipse that touches the sides of a rectangle. @param {Corner} a
 * @param {Corner} b @returns {Corner[]} */
export function ellipse([ax, ay], [bx, by]) {
  const [rx, ry] = [Math.abs(bx - ax) / 2, Math.abs(by - ay) / 2];
  const count = Math.max(MIN_SIDES, Math.ceil(SIDES_PER_PIXEL * Math.max(rx, ry)));
  return Array.from({ length: count }, (_, k) => {
    const angle = (2 * Math.PI * k) / count;
    return [(ax + bx) / 2 + rx * Math.cos(angle), (ay + by) / 2 + ry * Math.sin(angle)];
  });
}

/** Return the mask of a polygon, (h, w). Where it crosses itself all that it winds around is inside.
 * @param {Corner[]} corners @param {Size} size @returns {Uint8Array} */
export function polygonMask(corners, [height, width]) {
  const mask = new Uint8Array(height * width);
  const rows = corners.map(([, y]) => y);
  const top = Math.max(0, Math.floor(Math.min(...rows)));
  const bottom = Math.min(height, Math.ceil(Math.max(...rows)));
  const covered = new Float64Array(width + 2);
  for (let y = top; y < bottom; y++) {
    covered.fill(0);
    for (let k = 0; k < SUBROWS; k++)
      for (const [from, to] of insideSpans(corners, y + (k + 0.5) / SUBROWS))
        addSpan(covered, from, to, width);
    // `covered` has the changes from pixel to pixel.
    for (let x = 0, sum = 0; x < width; x++) {
      sum += covered[x];
      mask[y * width + x] = Math.round((FULL * Math.min(SUBROWS, Math.max(0, sum))) / SUBROWS);
    }
  }
  return mask;
}

/** Return where a horizontal line is inside a polygon. @param {Corner[]} corners @param {number} y
 * @returns {[from: number, to: number][]} */
function insideSpans(corners, y) {
  /** @type {[x: number, way: number][]} */
  const crossings = [];
  for (let k = 0; k < corners.length; k++) {
    const [ax, ay] = corners[k];
    const [bx, by] = corners[(k + 1) % corners.length];
    if (ay <= y === by <= y) continue;
    crossings.push([ax + ((y - ay) * (bx - ax)) / (by - ay), by > ay ? 1 : -1]);
  }
  crossings.sort((a, b) => a[0] - b[0]);
  /** @type {[number, number][]} */
  const spans = [];
  let winding = 0;
  for (const [k, [x, way]] of crossings.entries()) {
    if (winding) spans.push([crossings[k - 1][0], x]);
    winding += way;
  }
  return spans;
}

/** Add the coverage of a span to the coverage of a row's pixels, as changes from each to the next.
 * @param {Float64Array} changes @param {number} from @param {number} to @param {number} width */
function addSpan(changes, from, to, width) {
  addEdge(changes, Math.min(width, Math.max(0, from)), 1);
  addEdge(changes, Math.min(width, Math.max(0, to)), -1);
}

/** @param {Float64Array} changes @param {number} x @param {number} sign */
function addEdge(changes, x, sign) {
  const pixel = Math.floor(x);
  const part = pixel + 1 - x;
  changes[pixel] += sign * part;
  changes[pixel + 1] += sign * (1 - part);
}
