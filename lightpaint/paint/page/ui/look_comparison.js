/**
 * Two to four looks side by side. A look whose lights hang as they do now is a mix of their planes;
 * of any other the session makes a picture, which counts as a plane behind the lights' planes.
 */

import { nameInView } from '../engine/message_frames.js';
import { COMPARED_COUNT } from '../engine/picture_slots.js';
import { t } from '../language/language.js';

/** @import { Display, Look, RGB, Ui } from './ui_state.js' */
/** Two looks, by their ids, with a crossfade between them; more: further ones, with which they are
 * side by side without one.
 * @typedef {{a: number, b: number, share: number, more?: number[]}} Mix */

/** @type {RGB} */
const OFF = [0, 0, 0];

/** @type {RGB} */
const WHOLE = [1, 1, 1];

/** The display of looks side by side, each alone in its pane. @type {Partial<Display>} */
const WALL_DISPLAY = { layout: 'blink', blink: 'right', right: 'other', overlay: null };

/** Reset the comparison of looks. @param {Ui} ui @returns {Partial<Ui>} */
export function resetMix({ display }) {
  const pair = /** @type {const} */ ({ left: 'painting', right: 'solution' });
  return { mix: null, display: { ...display, ...pair, solutionWeights: null, otherWeights: null } };
}

/** Return the compared looks; null if one of them no longer exists. @param {Ui} ui
 * @param {Mix} mix @returns {[Look, Look, ...Look[]] | null} */
export function comparedLooks({ looks }, { a, b, more = [] }) {
  const compared = [a, b, ...more].flatMap((id) => looks.find((look) => look.id === id) ?? []);
  const isWhole = compared.length === 2 + more.length;
  return isWhole ? /** @type {[Look, Look, ...Look[]]} */ (compared) : null;
}

/** Return whether a look has lights at other places than now. @param {Ui} ui @param {Look} look */
export const isElsewhere = (ui, look) => look.places !== ui.places;

/** Return the compared looks with lights at other places than now. @param {Ui} ui
 * @returns {Look[]} */
export function looksElsewhere(ui) {
  /** @type {Look[]} */
  const looks = (ui.mix && comparedLooks(ui, ui.mix)) ?? [];
  return looks.filter((look, k) => isElsewhere(ui, look) && looks.indexOf(look) === k);
}

/** Return whether a picture shows lights at other places than now. @param {Ui} ui
 * @param {string} kind of the picture */
export function showsElsewhere(ui, kind) {
  const looks = ui.mix && comparedLooks(ui, ui.mix);
  if (!looks || (kind !== 'solution' && kind !== 'other')) return false;
  return isElsewhere(ui, looks[kind === 'solution' ? 0 : 1]);
}

/** Return whether a look is shown with its lights where they hang now, until its picture arrives.
 * @param {Ui} ui @param {Look} look */
export const isPending = (ui, look) =>
  isElsewhere(ui, look) && !(nameInView(`look_clean/${look.id}`, ui.view) in ui.resources);

/** Return the pictures of a session without looks that are not compared any more.
 * @param {Ui["resources"]} resources @param {number[]} ids of the compared looks */
export function withoutLooks(resources, ids) {
  const isKept = (/** @type {string} */ name) => {
    const look = /^look_(?:clean|plane)\/(\d+)/.exec(name);
    return !look || ids.includes(Number(look[1]));
  };
  return Object.fromEntries(Object.entries(resources).filter(([name]) => isKept(name)));
}

/** Return the emission of each current light in a look. @param {Ui} ui @param {Look} look
 * @returns {RGB[]} */
export function weightsIn({ lights }, look) {
  return lights.map(({ name }) => look.weights[look.lights.indexOf(name)] ?? OFF);
}

/** Return what two compared looks change in the display. @param {Ui} ui
 * @returns {Partial<Display>} */
export function comparedDisplay(ui) {
  const looks = ui.mix && comparedLooks(ui, ui.mix);
  if (!ui.mix || !looks) return {};
  const hasPicture = looks.map((look) => isElsewhere(ui, look) && !isPending(ui, look));
  const pictureCount = hasPicture.some(Boolean) ? COMPARED_COUNT : 0;
  const weights = looks.map((look, k) => [
    ...(hasPicture[k] ? ui.lights.map(() => OFF) : weightsIn(ui, look)),
    ...Array.from({ length: pictureCount }, (_, picture) =>
      hasPicture[k] && picture === k ? WHOLE : OFF,
    ),
  ]);
  const wall = ui.mix.more ? { ...WALL_DISPLAY, lookMixes: weights } : {};
  return {
    solutionWeights: blended(weights, 0),
    otherWeights: blended(weights, ui.mix.share),
    lookPictures: pictureCount ? looks.map(({ id }, k) => (hasPicture[k] ? id : null)) : null,
    ...wall,
  };
}

/** Light adds up, so this is also right for the pictures of lights at different places.
 * @param {RGB[][]} weights @param {number} share @returns {RGB[]} */
function blended([first, second], share) {
  return first.map((rgb, k) => {
    const [r, g, b] = rgb.map((x, c) => (1 - share) * x + share * second[k][c]);
    return [r, g, b];
  });
}

/** Name of a mix of two looks. @param {Look[]} looks @param {Mix} mix @returns {string} */
export function mixName(looks, { a, b, share }) {
  const [first, second] = [a, b].map((id) => looks.find((look) => look.id === id)?.name ?? '');
  return `${first} → ${second}, ${Math.round(100 * share)} %`;
}

/** Return why a mix of two looks cannot be saved; null if it can. @param {Ui} ui @param {Mix} mix */
export function whyNotSaved(ui, mix) {
  const looks = comparedLooks(ui, mix);
  if (!looks || looks[0].places === looks[1].places) return null;
  const [first, second] = looks.map(({ name }) => name);
  return t('{first} and {second} hang lights in different places: no lighting lies between them', {
    first,
    second,
  });
}

/** Return the lights that a look has and now are not there, or that it lacks, in words.
 * @param {Ui} ui @param {Look} look */
export function placesText(ui, look) {
  const names = ui.lights.map(({ name }) => name);
  const extra = look.lights.filter((name) => !names.includes(name));
  const missing = names.filter((name) => !look.lights.includes(name));
  const parts = [
    ...(isElsewhere(ui, look) ? [t('its lights in their own places')] : []),
    ...(extra.length ? [t('with {value}', { value: extra.join(', ') })] : []),
    ...(missing.length ? [t('without {value}', { value: missing.join(', ') })] : []),
  ];
  return parts.length ? `${look.name}: ${parts.join(', ')}` : look.name;
}
