/** Colour filters for the selected lights of a mixer. */

import { luminance } from '../drawing/chromaticity.js';
import { filtered, findGels, gelName, lossInStops } from '../gels/gels.js';
import { createElement } from './page_elements.js';

/** @import { RGB } from '../drawing/chromaticity.js' */
/** @import { Row } from './mixer_light.js' */
/** @import { Gel } from '../gels/gels.js' */

/** Share of its light that a filter lets through, and the colour that it gives, by row.
 * @type {WeakMap<Row, {passed: number, hue: RGB}>} */
const filters = new WeakMap();

let count = 0;

/** Add a field for the filter of the selected lights.
 * @param {import("./mixer_selection.js").Selection} selection @param {Gel[]} gels */
export function addGels(selection, gels) {
  const field = createElement('input');
  Object.assign(field, { type: 'search', placeholder: 'Gel: 201, R80, amber' });
  field.ariaLabel = 'Gel of the selected lights: a number or a name; empty for none';
  field.title = 'Filters of Lee (L) and Rosco (R), with the light that passes as their makers say';
  const list = createElement('datalist');
  list.id = `gels-${(count += 1)}`;
  field.setAttribute('list', list.id);
  list.append(...gels.map(({ code, name, percent }) => new Option(`${name}, ${percent} %`, code)));
  const output = createElement('span');
  output.setAttribute('role', 'status');
  field.addEventListener('change', () => {
    const gel = field.value.trim() ? findGels(gels, field.value)[0] : null;
    output.textContent = gel === undefined ? 'no such gel' : '';
    if (gel === undefined) return;
    const rows = selection.selected.filter(({ light }) => !light.isScalar);
    for (const row of rows) setGel(row, gel);
    if (gel && rows.length) {
      const loss = lossInStops(gel, ownWhite(rows[0])).toFixed(1);
      output.textContent = `${gelName(gel)}, \u2212${loss} st`;
    }
  });
  selection.addControl(field);
  selection.element.append(output, list);
}

/** A light's own white: its colour in the scene. @param {Row} row @returns {RGB} */
const ownWhite = ({ light }) => (luminance(light.present) > 0 ? light.present : [1, 1, 1]);

/** Put a filter on a light, which takes the place of its last one. @param {Row} row
 * @param {Gel | null} gel */
function setGel(row, gel) {
  const white = ownWhite(row);
  const last = filters.get(row);
  // A colour that was chosen since does not come from a filter.
  const isLast = last !== undefined && isSameHue(last.hue, row.rgb);
  const open = luminance(row.rgb) / luminance(white) / (isLast ? last.passed : 1);
  const hue = gel ? filtered(gel, white) : white;
  row.set(/** @type {RGB} */ (hue.map((x) => x * open)), gel ? null : row.light.kelvin.present);
  filters.set(row, { passed: luminance(hue) / luminance(white), hue });
}

/** @param {RGB} a @param {RGB} b */
function isSameHue(a, b) {
  const [first, second] = [luminance(a), luminance(b)];
  return first > 0 && a.every((x, c) => Math.abs(x * second - b[c] * first) <= 1e-6 * first * second);
}
