/** Changes of the interface state that follow from messages of the session. */

/** @typedef {import('./engine_interface.js').Message} Message */
/** @typedef {import('./engine_interface.js').RGB} RGB */
/** @typedef {import('./ui_state.js').Ui} Ui */
/** @typedef {import('../engine/messages.js').Events} Events */

import { stateOfView } from '../engine/message_frames.js';
import { mixedWeights, withoutMix } from './ui_state.js';

/** State of requested tasks while none is running.
 * @type {Record<string, Partial<Ui>>} */
export const TASK_ENDED = {
  export: { isWriting: false, writing: null },
  verify: { verifying: null },
  explain: { explaining: false },
  preview: { preview: null },
  place: { placing: null, trial: null },
};

/** State while no task is known to be running. */
export const IDLE = {
  ...TASK_ENDED.export,
  ...TASK_ENDED.verify,
  ...TASK_ENDED.explain,
  ...TASK_ENDED.preview,
  ...TASK_ENDED.place,
  sampling: null,
};

/** @param {Events["state"]} message @returns {Partial<Ui>} */
export function stateUpdate(message, /** @type {import('./ui_state.js').Ui} */ before) {
  const isBack = before.connection !== 'open' || before.closed !== null;
  const views = message.views ?? [];
  const view = before.view < views.length ? before.view : 0;
  const { lights, constraints, ties, settings, effective_settings, poses, added_lights, history, looks, resources, basis } =
    message;
  return {
    ...lightNumbers(before, lights),
    ready: true,
    state: stateOfView(message, view),
    version: -1,
    view,
    views,
    lights,
    constraints: constraints ?? {},
    ties: ties ?? [],
    settings: settings ?? {},
    effectiveSettings: effective_settings ?? {},
    poses: poses ?? {},
    addedLights: added_lights ?? [],
    history,
    looks: looks ?? [],
    resources: resources ?? {},
    hint: Boolean(message.is_new),
    connection: 'open',
    closed: null,
    // Results in the meantime were missed; tasks that still run will report again.
    ...(isBack ? { ...IDLE, explained: [] } : {}),
    basis:
      basis && !basis.is_complete
        ? { task: 'basis', done: basis.spp, total: basis.target_spp, unit: 'samples' }
        : null,
    ...(isApart(looks ?? [], before) ? withoutMix(before) : {}),
    ...(message.verifications ? rendersUpdate(message.verifications, view) : {}),
    // At first a scene is shown at the exposure at which it is painted.
    ...(before.state ? {} : { show: { ...before.show, ...shownAs(message.transform) } }),
    ...answerFields(message.answer ?? {}, { ...before, view, views, lit: [] }),
    ...weightsOf(message),
  };
}

/** Added or removed lights change the numbers of others. @param {Ui} before
 * @param {Ui["lights"]} lights @returns {Partial<Ui>} */
function lightNumbers(before, lights) {
  const { rig } = before;
  const now = (/** @type {number} */ k) =>
    lights.findIndex((light) => light.name === before.lights[k]?.name);
  const some = (/** @type {number[]} */ numbers) => numbers.map(now).filter((k) => k >= 0);
  const names = (/** @type {Ui["lights"]} */ all) => all.map(({ name }) => name).join('\n');
  if (!before.lights.length || names(lights) === names(before.lights)) return {};
  const lamp = before.lamp === null ? -1 : now(before.lamp);
  return {
    solo: some(before.solo),
    mute: some(before.mute),
    unfolded: some(before.unfolded),
    lamp: lamp < 0 ? null : lamp,
    hovered: null,
    pointed: null,
    dragged: null,
    // Their places come with the next message.
    rig: rig && { ...rig, lights: lights.flatMap(({ name }) => rig.lights[indexOf(before, name)] ?? []) },
  };
}

/** @param {Ui} ui @param {string} name */
const indexOf = ({ lights }, name) => lights.findIndex((light) => light.name === name);

/** @param {any} told @returns {NonNullable<Ui['verified']>} */
const render = ({ is_old: isOld = false, ...about }) => ({ ...about, isOld });

/** Take renders from before the page opened. @param {any[]} verified @param {number} view
 * @returns {Partial<Ui>} */
function rendersUpdate(verified, view) {
  const verifiedOf = Object.fromEntries(verified.map((one) => [one.view, render(one)]));
  return { verifiedOf, verified: verifiedOf[view] ?? null };
}

/** Update the list of looks. @param {Events["looks"]} message @param {Ui} ui
 * @returns {Partial<Ui>} */
export function looksUpdate({ looks, resources }, ui) {
  return {
    looks,
    resources: { ...ui.resources, ...resources },
    ...(isApart(looks, ui) ? withoutMix(ui) : {}),
  };
}

/** Return whether a compared look no longer exists.
 * @param {import('./ui_state.js').Look[]} looks @param {Ui} ui */
function isApart(looks, ui) {
  return ui.mix !== null && !mixedWeights({ ...ui, looks }, ui.mix);
}

/** @param {{name: string, stops: number} | undefined} transform */
function shownAs(transform) {
  return transform ? { transform: transform.name, stops: transform.stops } : {};
}

/**
 * Take an exact answer. Its sentences follow later; until then those of the last answer stay.
 * @param {any} answer @param {Ui} before @returns {Partial<Ui>}
 */
function answerFields(answer, before) {
  const { headline, lights, shares = null, closeness = null } = answer;
  /** @type {Partial<Ui>} */
  const made = { isLive: false, isJudged: headline !== undefined };
  if (headline !== undefined)
    Object.assign(made, { closeness }, closenessUpdate({ ...answer, closeness }, before));
  // Without paint there are no error bars and no reasons.
  const unknown = made.deltaE === null && !closeness ? UNKNOWN : {};
  if (lights) {
    made.shares = shares;
    made.lit = lights.map((/** @type {any} */ one, /** @type {number} */ k) => ({
      ...before.lit[k],
      ...unknown,
      ...one,
      share: shares?.[before.view]?.[k] ?? one.share,
    }));
  }
  return made;
}

/** Update how close the current view is. @param {any} answer @param {Ui} ui
 * @returns {Partial<Ui>} */
function closenessUpdate(answer, { view, views }) {
  const isOne = views.length < 2;
  const its = isOne || !answer.closeness ? answer : answer.closeness[view];
  if (!its)
    return { headline: UNPAINTED, help: null, deltaE: null, deltaPresent: null, sentences: [] };
  return {
    headline: its.headline,
    help: its.help ?? null,
    deltaE: its.delta_e ?? null,
    deltaPresent: its.delta_e_present ?? null,
    sentences: its.sentences ?? [],
  };
}

const UNPAINTED = 'Nothing is painted in this view. It follows the others.';

const UNKNOWN = { error: null, is_constrained: false, is_unreached: false };

/** Return the state that changes with the current view. @param {Ui} ui @param {number} view
 * @returns {Partial<Ui>} */
export function viewUpdate(ui, view) {
  const verified = ui.verifiedOf[view] ?? null;
  const isRender = ui.show.right === 'verified' && !verified;
  const isAsLarge = String(ui.views[view].size) === String(ui.views[ui.view].size);
  /** @type {Ui['show']} */
  const show = {
    ...ui.show,
    ...(isRender ? { left: 'painting', right: 'solution' } : {}),
    ...(isAsLarge ? {} : { zoom: 1, pan: [0, 0] }),
  };
  const { closeness, shares } = ui;
  return {
    view,
    state: stateOfView(ui.state, view),
    verified,
    explained: [],
    pointed: null,
    show,
    ...(closeness ? closenessUpdate({ closeness }, { ...ui, view }) : {}),
    lit: ui.lit.map((one, k) => ({ ...one, share: shares?.[view]?.[k] ?? one.share })),
  };
}

/** Take a verification render of a view. @param {Events["verified"]} message @param {Ui} ui
 * @returns {Partial<Ui>} */
export function verificationUpdate(message, ui) {
  const { view = 0 } = message;
  const verified = render(message);
  const made = { verifiedOf: { ...ui.verifiedOf, [view]: verified }, verifying: null };
  return view === ui.view ? { ...made, verified } : made;
}

/** Take the reasons why the answer is not closer, unless painting has continued.
 * @param {any} message @param {Ui} ui
 * @returns {Partial<Ui>} */
export function explanationUpdate({ view = 0, sentences, is_old: isOld = false }, ui) {
  const isIts = view === ui.view && !isOld && !ui.isLive;
  return { explaining: false, explained: isIts ? sentences : [] };
}

/** Take the preview of a change, unless another preview has been requested. @param {any} message
 * @param {Ui} ui @returns {Partial<Ui>} */
export function previewUpdate({ number, text, is_at_cost: isAtCost, arrays }, { preview }) {
  if (!preview || preview.number !== number) return {};
  return { preview: { ...preview, text, isAtCost, before: arrays.before, after: arrays.after } };
}

/** @param {Message} message @returns {Partial<Ui>} */
function weightsOf(message) {
  const flat = message.arrays?.weights?.data;
  if (!flat) return {};
  /** @type {RGB[]} */
  const weights = [];
  for (let at = 0; at < flat.length; at += 3) weights.push([flat[at], flat[at + 1], flat[at + 2]]);
  return { weights };
}

/** Take the state in an answer or a patch, unless it is older than an earlier message, like an
 * exact answer found during an undo. @param {any} message @param {Ui} ui @returns {Partial<Ui>} */
export function answerUpdate(message, ui) {
  if (message.version < ui.version) return {};
  const made = /** @type {Partial<Ui>} */ (weightsOf(message));
  made.version = message.version ?? ui.version;
  for (const key of /** @type {const} */ (['history', 'constraints', 'ties', 'settings', 'poses'])) {
    if (message[key]) made[key] = message[key];
  }
  if (message.effective_settings) made.effectiveSettings = message.effective_settings;
  if (message.added_lights) made.addedLights = message.added_lights;
  if (message.lights) Object.assign(made, answerFields(message, ui));
  else if (!message.exact) {
    made.isLive = true;
    made.isJudged = false;
    // Earlier statements no longer hold once something is painted.
    if (ui.deltaE === null) made.headline = '';
  }
  if (made.weights) {
    const old = Object.entries(ui.verifiedOf).map(([view, one]) => [view, { ...one, isOld: true }]);
    made.verifiedOf = Object.fromEntries(old);
    if (ui.verified) made.verified = { ...ui.verified, isOld: true };
  }
  // The reasons belong to the previous answer.
  if (made.isLive && ui.explained.length) made.explained = [];
  return made;
}

/** @param {Events["progress"]} message @param {Ui} ui @returns {Partial<Ui>} */
export function progressUpdate({ task, done, total, unit }, ui) {
  const made = { task, done, total, unit };
  if (task === 'export') return { writing: timed(made, ui.writing), isWriting: true };
  if (task === 'place') return ui.placing ? { placing: timed(made, ui.placing) } : {};
  // The brush interrupts it, so the remaining time is unknown.
  if (task === 'sampling') return { sampling: done < total ? made : null };
  if (/verif/i.test(task)) return { verifying: timed(made, ui.verifying) };
  return { basis: total && done >= total ? null : timed(made, ui.basis) };
}

/** Seconds of work before the remaining time is shown. */
const KNOWN_S = 2;

/** Extrapolate from the progress since the first report.
 * @param {import('./ui_state.js').Progress} now
 * @param {import('./ui_state.js').Progress | null} before @returns {import('./ui_state.js').Progress} */
function timed(now, before) {
  const ms = performance.now();
  const isSame = before?.since && before.total === now.total && before.done <= now.done;
  const since = (isSame && before.since) || { ms, done: now.done };
  const [seconds, done] = [(ms - since.ms) / 1000, now.done - since.done];
  const left_s =
    seconds > KNOWN_S && done > 0 ? (seconds / done) * (now.total - now.done) : undefined;
  return { ...now, since, left_s };
}
