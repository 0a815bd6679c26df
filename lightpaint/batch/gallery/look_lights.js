/** The table of all lights, with a row for each look. */
import { createElement } from '../../viewer/mixer/page_elements.js';
import {
  elementOf,
  headRow,
  inputOf,
  lightCell,
  lightsOf,
  looks,
  luminanceText,
  stopsText,
  titleOf,
} from './gallery_data.js';

/** @import { Look } from './gallery_data.js' */

/** Stops below its brightest value at which a light's bar has no length. */
const BAR_STOPS = 10;

export class LightsTable {
  constructor() {
    this.looks = new Set(looks.filter((look) => look.lights));
    /** The largest luminance of each light in any look. @type {Map<string, number>} */
    this.brightest = new Map();
    for (const look of this.looks)
      for (const { name, y } of lightsOf(look))
        this.brightest.set(name, Math.max(y, this.brightest.get(name) ?? 0));
    /** @type {Map<Look, HTMLElement>} */
    this.rows = new Map();
  }

  /** @param {Look[]} visibleLooks */
  fill(visibleLooks) {
    elementOf('lights-head').replaceChildren(headRow(['look', ...this.brightest.keys()]));
    const rows = visibleLooks
      .filter((look) => this.looks.has(look))
      .map((look) => this.rowOf(look));
    elementOf('lights-body').replaceChildren(...rows);
  }

  /** Delete the rows, which have another unit. */
  clear() {
    this.rows.clear();
  }

  /** @param {Look} look */
  rowOf(look) {
    const cachedRow = this.rows.get(look);
    if (cachedRow) return cachedRow;
    const row = createElement('tr');
    const head = createElement('th', '', titleOf(look));
    head.title = titleOf(look);
    head.scope = 'row';
    row.append(head);
    const lights = new Map(lightsOf(look).map((light) => [light.name, light]));
    const isStops = inputOf('unit').value === 'stops';
    for (const [name, brightest] of this.brightest) {
      const light = lights.get(name);
      if (!light) {
        row.append(createElement('td'));
        continue;
      }
      const stops = light.stops === undefined ? '' : stopsText(light.stops);
      const text = isStops ? (light.y === 0 ? 'off' : stops) : luminanceText(light.y);
      const cell = lightCell(light, text);
      if (light.kelvin) cell.title = `${Math.round(light.kelvin)} K`;
      const share = light.y > 0 ? 1 + Math.log2(light.y / brightest) / BAR_STOPS : 0;
      cell.style.setProperty('--v', Math.max(0, share).toFixed(3));
      row.append(cell);
    }
    this.rows.set(look, row);
    return row;
  }
}
