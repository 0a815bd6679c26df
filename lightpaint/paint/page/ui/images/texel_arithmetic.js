/** The arithmetic of a gradient, a fill and a sun on the map of an image. */

import { luminance } from '../../../../viewer/drawing/colour.js';
import { cross, normalize } from '../lamp_geometry.js';
import { scaled } from '../lamps/lamp_colours.js';
import { coverage } from './light_images.js';

/** @import { RGB } from '../ui_state.js' */
/** @import { LightImage } from './light_images.js' */

/** A place of the map in rows and columns; whole numbers are the middles of texels.
 * @typedef {[row: number, column: number]} MapPoint */
/** Colour and brightness, in stops from the mean of the image in the scene.
 * @typedef {{colour: RGB, stops: number}} TexelPaint */

/** Points of a disc for which a sun is spread over texels. */
const DISC_POINTS = 128;

/** Return the radiance of paint. @param {TexelPaint} paint @param {number} mean luminance of the image
 * in the scene @returns {RGB} */
export const radianceOf = ({ colour, stops }, mean) =>
  scaled(colour, (mean * 2 ** stops) / luminance(colour));

/** Return the light of every texel in a gradient between two places: beyond them each paint goes on.
 * Between them the stops change evenly, and the colour at equal brightness.
 * @param {LightImage} image @param {MapPoint} start @param {MapPoint} end
 * @param {[TexelPaint, TexelPaint]} paints @param {number} mean @returns {Map<number, RGB>} */
export function gradientLights(image, start, end, paints, mean) {
  const { places, shares, aspect } = image;
  const [rows, columns] = [places.length, places[0].length];
  const toPlane = (/** @type {MapPoint} */ [row, column]) => [(aspect * column) / columns, row / rows];
  const [[x0, y0], [x1, y1]] = [toPlane(start), toPlane(end)];
  const lengthSquared = (x1 - x0) ** 2 + (y1 - y0) ** 2;
  const [first, second] = paints.map(({ colour }) => scaled(colour, 1 / luminance(colour)));
  const lightAt = (/** @type {MapPoint} */ place) => {
    const [x, y] = toPlane(place);
    const along = ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / (lengthSquared || 1);
    const t = lengthSquared ? Math.min(1, Math.max(0, along)) : 0;
    const level = mean * 2 ** (paints[0].stops + t * (paints[1].stops - paints[0].stops));
    return first.map((value, c) => level * (value + t * (second[c] - value)));
  };
  // A texel with several places shows their mean.
  const sums = new Map(image.lights.map((k) => [k, [0, 0, 0]]));
  places.forEach((row, y) =>
    row.forEach((k, x) => {
      const sum = sums.get(k);
      if (sum) lightAt([y, x]).forEach((value, c) => (sum[c] += shares[y][x] * value));
    }),
  );
  const parts = coverage(image);
  return new Map(
    [...sums].map(([k, sum]) => [k, scaled(/** @type {RGB} */ (sum), 1 / (parts.get(k) || 1))]),
  );
}

/** Return the texels on the side of the horizon that a place is on; of an image without one, all.
 * @param {LightImage} image @param {MapPoint} place
 * @param {((place: MapPoint) => boolean) | null} isAbove whether a place is above the horizon
 * @returns {number[]} */
export function texelsToFill(image, place, isAbove) {
  if (!isAbove) return image.lights;
  const side = isAbove(place);
  const counts = new Map(image.lights.map((k) => [k, 0]));
  image.places.forEach((row, y) =>
    row.forEach((k, x) => {
      const share = image.shares[y][x] || 1e-12;
      if (k >= 0) counts.set(k, (counts.get(k) ?? 0) + (isAbove([y, x]) === side ? share : -share));
    }),
  );
  return image.lights.filter((k) => (counts.get(k) ?? 0) > 0);
}

/** Return the unit vector from the scene to a place of a sky, in the map's own axes.
 * @param {MapPoint} place @param {number} rows @param {number} columns @returns {[number, number, number]} */
export function skyDirection([row, column], rows, columns) {
  const [azimuth, polar] = [(2 * Math.PI * (column + 0.5)) / columns, (Math.PI * row) / (rows - 1)];
  const sine = Math.sin(polar);
  return [sine * Math.sin(azimuth), Math.cos(polar), -sine * Math.cos(azimuth)];
}

/** Return the place of a direction on a sky. @param {number[]} direction in the map's own axes
 * @param {number} rows @param {number} columns @returns {MapPoint} */
export function skyPlace([x, y, z], rows, columns) {
  const length = Math.hypot(x, y, z) || 1;
  const turn = ((Math.atan2(x, -z) / (2 * Math.PI)) % 1) + 1;
  const polar = Math.acos(Math.min(1, Math.max(-1, y / length)));
  return [(polar / Math.PI) * (rows - 1), (turn % 1) * columns - 0.5];
}

/** Return what a sun adds to texels. It lights a surface that faces it as much as an even sky of the
 * paint does, whatever its diameter; texels share its light so that their sum comes from its place.
 * @param {LightImage} image of a sky @param {MapPoint} place of its middle
 * @param {number} diameter in degrees @param {TexelPaint} paint @param {number} mean
 * @returns {Map<number, RGB>} */
export function sunLights(image, place, diameter, paint, mean) {
  const [rows, columns] = [image.places.length, image.places[0].length];
  /** @type {Map<number, number>} */
  const parts = new Map();
  for (const direction of discDirections(skyDirection(place, rows, columns), diameter)) {
    const [row, column] = skyPlace(direction, rows, columns);
    const [top, left] = [Math.min(rows - 2, Math.max(0, Math.floor(row))), Math.floor(column)];
    const [below, beside] = [row - top, column - left];
    for (const [dy, dx] of [[0, 0], [0, 1], [1, 0], [1, 1]]) {
      const k = image.places[top + dy][(left + dx + columns) % columns];
      const part = (dy ? below : 1 - below) * (dx ? beside : 1 - beside);
      if (k >= 0 && part > 0) parts.set(k, (parts.get(k) ?? 0) + part / DISC_POINTS);
    }
  }
  const radiance = radianceOf(paint, mean);
  const covered = coverage(image);
  // π L of an even sky on a surface below it, over the 4π of all directions.
  return new Map([...parts].map(([k, part]) => [k, scaled(radiance, part / (4 * (covered.get(k) ?? 1)))]));
}

/** Return directions that fill a disc evenly. @param {number[]} middle @param {number} diameter in
 * degrees @returns {[number, number, number][]} */
function discDirections(middle, diameter) {
  const [x, y, z] = middle;
  // Two axes across; by the middle's smallest component, so that they are never parallel to it.
  const helper = Math.abs(y) < 0.9 ? [0, 1, 0] : [1, 0, 0];
  const across = normalize(cross(middle, helper));
  const upwards = cross(across, middle);
  const cap = 1 - Math.cos((Math.PI / 360) * diameter);
  return Array.from({ length: DISC_POINTS }, (_, i) => {
    const cosine = 1 - (cap * (i + 0.5)) / DISC_POINTS;
    const [sine, turn] = [Math.sqrt(Math.max(0, 1 - cosine * cosine)), i * Math.PI * (3 - Math.sqrt(5))];
    const [a, b] = [sine * Math.cos(turn), sine * Math.sin(turn)];
    return /** @type {[number, number, number]} */ (
      [x, y, z].map((value, c) => cosine * value + a * across[c] + b * upwards[c])
    );
  });
}
