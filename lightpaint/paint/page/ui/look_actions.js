/** Saving and loading of looks, and which look equals the current state. */

import { isElsewhere, weightsIn } from './look_comparison.js';
import { t } from '../language/language.js';

/** @import { App, Look, RGB, Ui, UiStore } from './ui_state.js' */

/** Largest difference between equal answers, relative to the brightest light: round-off of sums in
 * another order. */
const MAX_ROUND_OFF = 1e-6;

/** Save painting, answer and locked lights under a new name.
 * @param {App} app */
export function saveLook(app) {
  const { session } = app;
  session.lookInProgress = session.lookInProgress
    .then(() => session.moveInProgress)
    .then(() => session.many.inProgress)
    .then(() => sendLook(app));
  return session.lookInProgress;
}

/** @param {App} app */
async function sendLook({ session, store }) {
  const reply = await session.send('save_look', { name: unusedName(store.value.looks) });
  if (reply?.kind === 'looks') noteLastLook(store, Math.max(...reply.looks.map(idOf)));
}

/** Load a look, as a step that can be undone. @param {App} app @param {number} look */
export async function loadLook({ session, store }, look) {
  const name = store.value.looks.find(({ id }) => id === look)?.name ?? null;
  // Until it arrives, the pictures show the earlier state.
  store.set({ loadingLook: name });
  const reply = await session.send('load_look', { look });
  if (store.value.loadingLook === name) store.set({ loadingLook: null });
  if (reply?.kind === 'patch' || reply?.kind === 'state') noteLastLook(store, look);
}

/** Return the look that equals the current state: the one last saved or loaded, if nothing has
 * changed since; else one with the answer's lights, as after undo.
 * @param {Ui} ui @returns {number | null} */
export function currentLook(ui) {
  const { looks, lastLook, version, history } = ui;
  const weights = outputWeights(ui);
  // A page that has just opened or reconnected knows no version.
  const isKnown = version >= 0 && lastLook?.version === version;
  if (lastLook && isKnown && looks.some(({ id }) => id === lastLook.look)) return lastLook.look;
  // If its lights are locked, they stay equal while the painting changes.
  const isPaintedOn = (/** @type {number} */ id) =>
    id === lastLook?.look && stepsOf(history) !== lastLook.steps;
  const candidates = looks.filter(
    (look) =>
      !isPaintedOn(look.id) &&
      !isElsewhere(ui, look) &&
      areWeightsEqual(weightsIn(ui, look), weights),
  );
  return (candidates.find(({ id }) => id === lastLook?.look) ?? candidates[0])?.id ?? null;
}

/** Return which of two compared looks equals the answer, so that statements on the answer apply to
 * it. Null if neither does, or none are compared.
 * @param {Ui} ui @returns {Look | null} */
export function comparedAnswer(ui) {
  const current = ui.mix && currentLook(ui);
  if (!ui.mix || current === null) return null;
  const { a, b, share, more } = ui.mix;
  const isShown = current === a || (current === b && share === 1) || more?.includes(current);
  return (isShown && ui.looks.find(({ id }) => id === current)) || null;
}

/** Return whether two other looks are compared, so that the answer is not visible.
 * @param {Ui} ui */
export const isAnswerHidden = (ui) => ui.mix !== null && !comparedAnswer(ui);

/** Return the weights that lights shine at, under the master dimmer. @param {Ui} ui @returns {RGB[]} */
const outputWeights = ({ weights, lights, master }) =>
  weights.map(([r, g, b], k) =>
    lights[k]?.is_fixed ? [r, g, b] : [master * r, master * g, master * b],
  );

/** @param {UiStore} store @param {number} look */
function noteLastLook(store, look) {
  store.set(({ version, history }) => ({ lastLook: { look, version, steps: stepsOf(history) } }));
}

/** @param {Ui['history']} history */
const stepsOf = ({ undo, count }) => count ?? undo.length;

/** @param {Look} look */
const idOf = ({ id }) => id;

/** @param {Look[]} looks */
function unusedName(looks) {
  let count = looks.length + 1;
  while (looks.some(({ name }) => name === t('Look {count}', { count }))) count += 1;
  return t('Look {count}', { count });
}

/** @param {RGB[]} weights @param {RGB[]} otherWeights */
function areWeightsEqual(weights, otherWeights) {
  const tolerance = MAX_ROUND_OFF * Math.max(...weights.flat());
  return (
    weights.length === otherWeights.length &&
    weights.every((rgb, k) => rgb.every((x, c) => Math.abs(x - otherWeights[k][c]) <= tolerance))
  );
}
