/** The looks of a gallery, from JSON in the page, and the formats of their numbers. */
import { createElement } from '../../viewer/mixer/page_elements.js';

/** @import { RGB } from '../../viewer/drawing/colour.js' */
/** @typedef {import("../../viewer/mixer/mixer_data.js").Data["transform"]} Transform */
/** @typedef {{name: string, y: number, emission?: RGB, hex?: string, kelvin?: number, duv?: number,
 *   stops?: number, share?: number}} LookLight */
/** links: name and address. basis: of its mixer. view: transform and stops.
 * @typedef {{look: string, state: 'failed' | 'waiting' | 'done', folder: string, why?: string,
 *   sensor?: string, scene?: string, target?: string, variation?: string, delta_e?: number,
 *   agrees?: boolean, lights?: LookLight[], size: [number, number], picture?: string,
 *   links: [string, string][], basis?: string, view?: [string, number]}} Look */

/** @param {string} id */
export const elementOf = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
/** @param {string} id */
export const inputOf = (id) => /** @type {HTMLInputElement} */ (elementOf(id));
/** @param {string} id @returns {any} */
const jsonOf = (id) => JSON.parse(elementOf(id).textContent ?? '');

/** @type {Look[]} */
export const looks = jsonOf('looks');
/** @type {Record<string, Transform>} */
export const transforms = jsonOf('transforms');

/** Lights of a look as its tables list them. @type {Map<Look, LookLight[]>} */
const listedLights = new Map();

/** Return the lights of a look for a table: of an image one, the mean over what it covers.
 * @param {Look} look */
export function lightsOf(look) {
  const known = listedLights.get(look);
  if (known) return known;
  /** @type {Map<string, LookLight[]>} */
  const groups = new Map();
  for (const light of look.lights ?? []) {
    const name = light.name.replace(/(\.sun\d)?\.x\d+\.y\d+$/, '');
    const key = name === light.name ? `${name} alone` : name;
    groups.set(key, [...(groups.get(key) ?? []), light]);
  }
  const listed = [...groups].map(([name, lights]) => {
    if (lights.length < 2) return lights[0];
    const sum = (/** @type {(light: LookLight) => number} */ value) =>
      lights.reduce((total, light) => total + value(light), 0);
    const y = sum((light) => light.y * (light.share ?? 1)) / sum(({ share }) => share ?? 1);
    return { name, y };
  });
  listedLights.set(look, listed);
  return listed;
}

/** @param {Look} look */
export const titleOf = (look) =>
  look.folder === look.look ? look.look : `${look.look} · ${look.sensor ?? look.folder}`;
/** @param {Look} look */
export const aspectOf = (look) => `${look.size[0]} / ${look.size[1]}`;
/** @param {number} y */
export const luminanceText = (y) => (y === 0 ? 'off' : String(Number(y.toPrecision(3))));
/** @param {number} stops */
export const stopsText = (stops) => `${stops < 0 ? '−' : '+'}${Math.abs(stops).toFixed(1)}`;

/** A cell of a table with the colour of a light. @param {LookLight} light @param {string} text */
export function lightCell(light, text) {
  const cell = createElement('td', light.y === 0 ? 'is-off' : '');
  if (light.hex && light.y > 0) {
    const swatch = createElement('span', 'swatch');
    swatch.style.background = light.hex;
    cell.append(swatch);
  }
  cell.append(text);
  return cell;
}

/** The heading row of a table. @param {string[]} texts */
export function headRow(texts) {
  const row = createElement('tr');
  for (const text of texts) {
    const cell = createElement('th', '', text);
    cell.scope = 'col';
    row.append(cell);
  }
  return row;
}
