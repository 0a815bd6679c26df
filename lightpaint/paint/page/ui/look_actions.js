/** Saving and loading of looks, and which look equals the current state. */

/** @typedef {import("./engine_interface.js").RGB} RGB */
/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./ui_state.js").Look} Look */
/** @typedef {import("./ui_state.js").UiStore} UiStore */
/** @typedef {import("./shortcuts.js").App} App */

/** Difference of lights, of the brightest of them, up to which two answers are the same: round-off
 * of sums in another order. */
const SAME = 1e-6;

/** Keep painting and answer, as hands have left the lights, under a name that no other look has.
 * @param {App} app */
export function saveLook(app) {
  const { session } = app;
  session.savingLook = session.savingLook.then(() => session.moveInProgress).then(() => keep(app));
  return session.savingLook;
}

/** @param {App} app */
async function keep({ session, store }) {
  const reply = await session.send('save_look', { name: unused(store.value.looks) });
  if (reply?.kind === 'looks') mark(store, Math.max(...reply.looks.map(idOf)));
}

/** Go on from a look: a step that can be undone. @param {App} app @param {number} look */
export async function loadLook({ session, store }, look) {
  const name = store.value.looks.find(({ id }) => id === look)?.name ?? null;
  // Until it is there, the pictures are of what was there before.
  store.set({ comingTo: name });
  const reply = await session.send('load_look', { look });
  if (store.value.comingTo === name) store.set({ comingTo: null });
  if (reply?.kind === 'patch' || reply?.kind === 'state') mark(store, look);
}

/**
 * The look that painting and answer are now: the one last kept or gone on from, while nothing has
 * changed since; else one that has the lights of the answer, as after undo.
 * @param {Ui} ui @returns {number | null}
 */
export function currentLook({ looks, lastLook: last, version, history, weights }) {
  // A page that has just been opened, or is back, knows of no version.
  const isKnown = version >= 0 && last?.version === version;
  if (last && isKnown && looks.some(({ id }) => id === last.look)) return last.look;
  // Where its lights are held, somebody has painted on, and they are the same.
  const isPaintedOn = (/** @type {number} */ id) =>
    id === last?.look && stepsOf(history) !== last.steps;
  const found = looks.filter((one) => !isPaintedOn(one.id) && isSame(one.weights, weights));
  return (found.find(({ id }) => id === last?.look) ?? found[0])?.id ?? null;
}

/**
 * Of two looks that are compared the one that the answer is, too: what is said of the answer is said
 * of it. Null where neither is, or none are compared.
 * @param {Ui} ui @returns {Look | null}
 */
export function comparedAnswer(ui) {
  const current = ui.mix && currentLook(ui);
  if (!ui.mix || current === null) return null;
  const isShown = current === ui.mix.a || (current === ui.mix.b && ui.mix.share === 1);
  return (isShown && ui.looks.find(({ id }) => id === current)) || null;
}

/** Whether the answer is not shown, since looks are compared that it is not. @param {Ui} ui */
export const isAnswerHidden = (ui) => ui.mix !== null && !comparedAnswer(ui);

/** @param {UiStore} store @param {number} look */
function mark(store, look) {
  store.set(({ version, history }) => ({ lastLook: { look, version, steps: stepsOf(history) } }));
}

/** @param {Ui['history']} history */
const stepsOf = ({ undo, count }) => count ?? undo.length;

/** @param {Look} look */
const idOf = ({ id }) => id;

/** @param {Look[]} looks */
function unused(looks) {
  let number = looks.length + 1;
  while (looks.some(({ name }) => name === `Look ${number}`)) number += 1;
  return `Look ${number}`;
}

/** @param {RGB[]} one @param {RGB[]} other */
function isSame(one, other) {
  const most = SAME * Math.max(...one.flat());
  return (
    one.length === other.length &&
    one.every((rgb, k) => rgb.every((x, c) => Math.abs(x - other[k][c]) <= most))
  );
}
