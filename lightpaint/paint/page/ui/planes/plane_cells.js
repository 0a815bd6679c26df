/** The cells of measuring planes as the picture of a view shows them. */

import { add, isInside, projectPolygon } from '../lamp_geometry.js';

/** @import { Camera, MeasuredPlane, PlanesInfo } from '../../engine/messages.js' */
/**
 * A cell that nothing covers. corners: in pixels of the picture; a single one for a listed point.
 * plane, point: indices.
 * @typedef {{plane: number, point: number, corners: [number, number][]}} PlaneCell */

/** Radius of the dot of a listed point, in CSS pixels. */
export const DOT_RADIUS = 6;

/** Cells of the views of a session, found once for each. @type {WeakMap<PlanesInfo, PlaneCell[][]>} */
const cellsOfViews = new WeakMap();

/** Return the cells that a view shows in the order in which they are drawn: planes of fine grids, such
 * as desks, over the cells of wide ones, such as floors, and listed points over all. @param {PlanesInfo} info
 * @param {number} view @returns {PlaneCell[]} none if its camera is not a pinhole */
export function cellsInView(info, view) {
  const known = cellsOfViews.get(info) ?? [];
  cellsOfViews.set(info, known);
  const camera = info.cameras[view];
  if (!camera) return [];
  const drawingOrder = info.planes
    .map((plane, index) => ({ plane, index, width: widthOf(plane) }))
    .sort((a, b) => b.width - a.width);
  known[view] ??= drawingOrder.flatMap(({ plane, index }) =>
    cellsOf(plane, index, plane.seen[view], camera),
  );
  return known[view];
}

/** Return the width of a plane's first cell in units of the scene. @param {MeasuredPlane} plane */
const widthOf = ({ sides }) => (sides ? Math.hypot(...sides[0].slice(0, 3)) : 0);

/** @param {MeasuredPlane} plane @param {number} index @param {readonly number[]} seen
 * @param {Camera} camera @returns {PlaneCell[]} */
function cellsOf({ points, sides }, index, seen, camera) {
  return seen.flatMap((point) => {
    const corners = projectPolygon(camera, cornersOf(points[point], sides?.[point]));
    return corners.length ? [{ plane: index, point, corners }] : [];
  });
}

/** Return the corners of a cell in the scene, one after the other. @param {readonly number[]} middle
 * @param {readonly number[] | undefined} sides across and along; the middle alone without them */
function cornersOf(middle, sides) {
  if (!sides) return [[...middle]];
  const [across, along] = [sides.slice(0, 3), sides.slice(3)];
  return [
    [-1, -1],
    [1, -1],
    [1, 1],
    [-1, 1],
  ].map(([i, j]) => add(add([...middle], across, i / 2), along, j / 2));
}

/** Return the cell that is drawn last at a place of the picture. @param {PlaneCell[]} cells
 * @param {number} x @param {number} y @param {number} radius of dots, in pixels of the picture */
export function cellAt(cells, x, y, radius) {
  return [...cells]
    .reverse()
    .find(({ corners }) =>
      corners.length === 1
        ? Math.hypot(corners[0][0] - x, corners[0][1] - y) <= radius
        : isInside(corners, x, y),
    );
}
