/** Which lights are selected, for one action on all of them. */

import { imageOf } from '../images/light_images.js';
import { listedLights } from './listed_lights.js';
import { lightCountText, shortenName } from '../format.js';
import { t } from '../../language/language.js';

/** @import { Ui, UiStore } from '../ui_state.js' */

/** Keys that are held while a light is pressed.
 * @typedef {{ctrlKey: boolean, metaKey: boolean, shiftKey: boolean}} Modifiers */

/** Return whether a press selects, instead of what it does else. @param {Modifiers} event */
export const isSelecting = (event) => event.ctrlKey || event.metaKey || event.shiftKey;

/** Select a light or take it out again; with Shift all listed lights from the last one to it.
 * @param {UiStore} store @param {number} light @param {Modifiers} event */
export function pressLight(store, light, event) {
  const ui = store.value;
  const { selectedLights, selectionAnchor } = ui;
  const listed = listedLights(ui);
  const [first, last] = [listed.indexOf(selectionAnchor ?? -1), listed.indexOf(light)];
  if (event.shiftKey && first >= 0 && last >= 0) {
    const range = listed.slice(Math.min(first, last), Math.max(first, last) + 1);
    store.set({ selectedLights: [...new Set([...selectedLights, ...range])] });
    return;
  }
  const isSelected = selectedLights.includes(light);
  const others = selectedLights.filter((other) => other !== light);
  store.set({
    selectedLights: isSelected ? others : [...selectedLights, light],
    selectionAnchor: light,
  });
}

/** Select all of some lights; if all of them are, none of them.
 * @param {UiStore} store @param {number[]} lights */
export function toggleLights(store, lights) {
  const { selectedLights } = store.value;
  const others = selectedLights.filter((k) => !lights.includes(k));
  const areSelected = lights.every((k) => selectedLights.includes(k));
  store.set({ selectedLights: areSelected ? others : [...others, ...lights] });
}

/** Return lights in words: two by name, more by their number, an image by its name.
 * @param {Ui} ui @param {number[]} lights */
export function lightsText(ui, lights) {
  const texels = texelsText(ui, lights);
  if (texels !== null) return texels;
  if (lights.length > 2) return lightCountText(lights.length);
  return lights.map((k) => shortenName(ui.lights[k].label, 24)).join(t(' and '));
}

/** Return several texels of one image in words: all by its name. @param {Ui} ui
 * @param {number[]} lights @returns {string | null} null for other lights */
export function texelsText({ images }, lights) {
  const image = imageOf(images, lights[0]);
  if (!image || lights.length < 2 || lights.some((k) => imageOf(images, k) !== image)) return null;
  const name = shortenName(image.name, 24);
  if (lights.length === image.lights.length) return name;
  return t('{count} texels of {name}', { count: lights.length, name });
}
