/** The lamps of two looks as a table, those that differ most on top. */

import { html } from '../vendor/preact.js';
import { signedText, whiteText } from './format.js';
import { meanOf, wholeLight } from './images/light_images.js';
import { atFullBrightness, luminance, toHex, toKelvin } from '../../../viewer/drawing/colour.js';
import { t } from '../language/language.js';

/** @import { Look, RGB, Ui } from './ui_state.js' */

/** @typedef {{name: string, label: string, emissions: (RGB | null)[], difference: number, text: string}} Row
 *   emissions: in both looks; null where a look has no such lamp */

/** Smallest differences that are listed: of levels in stops, and of whites in mired. */
const [MIN_STOPS, MIN_MIRED] = [0.05, 3];

/** @param {{ui: Ui, first: Look, second: Look}} props */
export function LampTable({ ui, first, second }) {
  const rows = rowsOf(ui, first, second);
  const presents = new Map(ui.lights.map(({ name, present }) => [name, present]));
  for (const image of ui.images) presents.set(image.name, wholeLight(image, ui.lights).present);
  return html`<div class="lamp-table" tabindex="0" role="group" aria-label=${t('Lamps of two looks')}><table>
    <thead><tr><th scope="col">${t('Lamp')}</th><th scope="col">${first.name}</th>
      <th scope="col">${second.name}</th><th scope="col">${t('Difference')}</th></tr></thead>
    <tbody>${rows.map(
      ({ name, label, emissions, text }) => html`<tr key=${name} class=${text ? '' : 'is-equal'}>
        <th scope="row">${label}</th>
        ${emissions.map(
          (emission) => html`<td>${lampText(emission, presents.get(name) ?? null)}</td>`,
        )}
        <td>${text || t('equal')}</td></tr>`,
    )}</tbody>
  </table></div>`;
}

/** @param {Ui} ui @param {Look} first @param {Look} second @returns {Row[]} */
export function rowsOf({ lights, images }, first, second) {
  const names = [
    ...new Set([...lights.map(({ name }) => name), ...first.lights, ...second.lights]),
  ];
  const emission = (/** @type {Look} */ look, /** @type {string} */ name) => {
    const k = look.lights.indexOf(name);
    return k < 0 ? null : look.weights[k];
  };
  const texels = new Set(images.flatMap((image) => image.lights.map((k) => lights[k].name)));
  const rows = names.filter((name) => !texels.has(name)).map((name) => {
    const emissions = [emission(first, name), emission(second, name)];
    const label = lights.find((light) => light.name === name)?.label ?? name;
    return { name, label, emissions, ...differenceOf(emissions) };
  });
  for (const image of images) {
    const emissions = [first, second].map((look) => {
      const texel = (/** @type {number} */ k) => emission(look, lights[k].name);
      if (!image.lights.every(texel)) return null;
      return meanOf(image, (k) => texel(k) ?? [0, 0, 0]);
    });
    const { name } = image;
    rows.push({ name, label: name, emissions, ...differenceOf(emissions) });
  }
  return rows.sort((a, b) => b.difference - a.difference);
}

/** Return the difference of two emissions in words, "" if none is seen, and a number that orders them.
 * @param {(RGB | null)[]} emissions @returns {{difference: number, text: string}} */
export function differenceOf([first, second]) {
  if (!first && !second) return { difference: 0, text: '' };
  if (!first || !second)
    return { difference: Infinity, text: first ? t('is not there') : t('is new') };
  const [before, after] = [luminance(first), luminance(second)];
  if (!(before > 0) && !(after > 0)) return { difference: 0, text: '' };
  if (!(before > 0) || !(after > 0))
    return { difference: Number.MAX_VALUE, text: after > 0 ? t('on') : t('off') };
  const stops = Math.log2(after / before);
  const parts =
    Math.abs(stops) < MIN_STOPS ? [] : [t('{signed} st', { signed: signedText(stops) })];
  const whites = [toKelvin(first), toKelvin(second)];
  const chroma = Math.max(...[0, 1, 2].map((c) => Math.abs(first[c] / before - second[c] / after)));
  if (whites[0] && whites[1]) {
    const mired = 1e6 / whites[1].kelvin - 1e6 / whites[0].kelvin;
    if (Math.abs(mired) >= MIN_MIRED)
      parts.push(t('{signed} mired', { signed: signedText(mired, 0) }));
  } else if (chroma > 0.02) parts.push(t('other colour'));
  return { difference: parts.length ? Math.abs(stops) + chroma : 0, text: parts.join(', ') };
}

/** @param {RGB | null} emission @param {RGB | null} present */
function lampText(emission, present) {
  if (!emission) return '–';
  const level = luminance(emission);
  if (!(level > 0)) return t('off');
  const scene = present ? luminance(present) : 0;
  const white = toKelvin(emission);
  const hex = toHex(atFullBrightness(emission));
  const colour = white ? whiteText(white.kelvin, white.green) : hex;
  const stops =
    scene > 0 ? t('{signed} st, ', { signed: signedText(Math.log2(level / scene)) }) : '';
  return html`<i style=${{ background: hex }}></i> ${stops}${colour}`;
}
