/** Changes of the interface state that follow from messages of the session. */

/** @import { Look, Message, Progress, RGB, Ui } from './ui_state.js' */
/** @import { Events, Rig } from '../engine/messages.js' */

import { stateOfView } from '../engine/message_frames.js';
import { rendersUpdate } from './exports/render_state.js';
import { comparedLooks, resetMix } from './look_comparison.js';
import { withLights } from './images/light_images.js';
import { t } from '../language/language.js';

/** State of requested tasks while none is running.
 * @type {Record<string, Partial<Ui>>} */
export const TASK_RESETS = {
  export: { isExporting: false, exportProgress: null },
  verify: { verificationProgress: null },
  explain: { isExplaining: false },
  preview: { preview: null },
  place: { placementProgress: null, isPlacementEnding: false, trial: null },
  reference: { isReferenceComing: false },
};

/** State while no task is known to be running. */
export const IDLE = {
  ...TASK_RESETS.export,
  ...TASK_RESETS.verify,
  ...TASK_RESETS.explain,
  ...TASK_RESETS.preview,
  ...TASK_RESETS.place,
  samplingProgress: null,
  planesProgress: null,
};

/** @param {Events["state"]} message @returns {Partial<Ui>} */
export function stateUpdate(message, /** @type {Ui} */ previous) {
  const isReconnected = previous.connection !== 'open' || previous.closure !== null;
  const views = message.views ?? [];
  const view = previous.view < views.length ? previous.view : 0;
  const { lights, looks = [], basis } = message;
  return {
    ...renumberLights(previous, lights),
    ready: true,
    state: stateOfView(message, view),
    version: -1,
    view,
    views,
    lights,
    images: withLights(message.images ?? []),
    constraints: message.constraints ?? {},
    earlier: message.earlier ?? {},
    kept: message.kept ?? [],
    isStarted: message.is_started ?? false,
    ties: message.ties ?? [],
    settings: message.settings ?? {},
    effectiveSettings: message.effective_settings ?? {},
    poses: message.poses ?? {},
    addedLights: message.added_lights ?? [],
    places: message.places ?? '',
    master: message.master ?? 1,
    history: message.history,
    looks,
    resources: message.resources ?? {},
    references: message.references ?? [],
    choices: message.choices ?? [],
    choicesVersion: -1,
    console: message.console ?? null,
    planes: message.planes ?? null,
    planesReading: message.reading ?? null,
    ...rendersUpdate(message, previous),
    hint: Boolean(message.is_new),
    areLightsUnknown: basis !== undefined && basis.spp === 0 && !basis.is_complete,
    connection: 'open',
    closure: null,
    // Results in the meantime were missed; tasks that still run will report again.
    ...(isReconnected ? { ...IDLE, reasons: [] } : {}),
    basis:
      basis && !basis.is_complete
        ? { task: 'basis', done: basis.spp, total: basis.target_spp, unit: 'samples' }
        : null,
    ...(isLookMissing(looks, previous) ? resetMix(previous) : {}),
    ...(message.verifications ? verificationsUpdate(message.verifications, view) : {}),
    // At first a scene is shown at the exposure at which it is painted.
    ...(previous.state
      ? {}
      : { display: { ...previous.display, ...transformDisplay(message.transform) } }),
    ...answerFields(message.answer ?? {}, { ...previous, view, views, lightAnswers: [] }),
    ...weightsOf(message),
  };
}

/** Added or removed lights change the numbers of others. @param {Ui} previous
 * @param {Ui["lights"]} lights @returns {Partial<Ui>} */
function renumberLights(previous, lights) {
  const { rig } = previous;
  const newIndex = (/** @type {number} */ k) =>
    lights.findIndex((light) => light.name === previous.lights[k]?.name);
  const renumber = (/** @type {number[]} */ numbers) => numbers.map(newIndex).filter((k) => k >= 0);
  const names = (/** @type {Ui["lights"]} */ list) => list.map(({ name }) => name).join('\n');
  if (!previous.lights.length || names(lights) === names(previous.lights)) return {};
  const lamp = previous.lamp === null ? -1 : newIndex(previous.lamp);
  return {
    solo: renumber(previous.solo),
    mute: renumber(previous.mute),
    openLights: renumber(previous.openLights),
    selectedLights: renumber(previous.selectedLights),
    selectionAnchor: null,
    lamp: lamp < 0 ? null : lamp,
    hoveredLight: null,
    probe: null,
    drag: null,
    // Their places come with the next message.
    rig: rig && {
      ...rig,
      lights: lights.flatMap(({ name }) => rig.lights[indexOf(previous, name)] ?? []),
    },
  };
}

/** @param {Ui} ui @param {string} name */
const indexOf = ({ lights }, name) => lights.findIndex((light) => light.name === name);

/** @param {any} message @returns {NonNullable<Ui['verification']>} */
const toVerification = ({ is_old: isOld = false, ...message }) => ({ ...message, isOld });

/** Take renders from before the page opened. @param {any[]} messages @param {number} view
 * @returns {Partial<Ui>} */
function verificationsUpdate(messages, view) {
  const verifications = Object.fromEntries(
    messages.map((message) => [message.view, toVerification(message)]),
  );
  return { verifications, verification: verifications[view] ?? null };
}

/** Update the list of looks. @param {Events["looks"]} message @param {Ui} ui
 * @returns {Partial<Ui>} */
export function looksUpdate({ looks, resources }, ui) {
  return {
    looks,
    resources: { ...ui.resources, ...resources },
    ...(isLookMissing(looks, ui) ? resetMix(ui) : {}),
  };
}

/** Return whether a compared look no longer exists.
 * @param {Look[]} looks @param {Ui} ui */
function isLookMissing(looks, ui) {
  return ui.mix !== null && !comparedLooks({ ...ui, looks }, ui.mix);
}

/** @param {{name: string, stops: number} | undefined} transform */
function transformDisplay(transform) {
  return transform ? { transform: transform.name, stops: transform.stops } : {};
}

/** Take an exact answer. Its sentences follow later; until then the last sentences stay.
 * @param {any} answer @param {Ui} previous @returns {Partial<Ui>} */
function answerFields(answer, previous) {
  const { headline, lights, shares = null, closeness = null, deliveries = [] } = answer;
  /** @type {Partial<Ui>} */
  const changes = { isLive: false, isJudgementCurrent: headline !== undefined };
  if (headline !== undefined)
    Object.assign(changes, { closeness, deliveries }, closenessUpdate({ ...answer, closeness }, previous));
  // Without paint there are no error bars and no reasons.
  const resetFields = changes.deltaE === null && !closeness ? UNKNOWN : {};
  if (lights) {
    changes.shares = shares;
    changes.lightAnswers = lights.map((/** @type {any} */ light, /** @type {number} */ k) => ({
      ...previous.lightAnswers[k],
      ...resetFields,
      ...light,
      share: shares?.[previous.view]?.[k] ?? light.share,
    }));
  }
  return changes;
}

/** Update how close the current view is. @param {any} answer @param {Ui} ui
 * @returns {Partial<Ui>} */
function closenessUpdate(answer, { view, views }) {
  const isSingle = views.length < 2;
  const viewCloseness = isSingle || !answer.closeness ? answer : answer.closeness[view];
  if (!viewCloseness)
    return { headline: UNPAINTED, advice: null, deltaE: null, deltaPresent: null, sentences: [] };
  return {
    headline: viewCloseness.headline,
    advice: viewCloseness.help ?? null,
    deltaE: viewCloseness.delta_e ?? null,
    deltaPresent: viewCloseness.delta_e_present ?? null,
    sentences: viewCloseness.sentences ?? [],
  };
}

const UNPAINTED = t('Nothing is painted in this view. It follows the others.');

const UNKNOWN = { error: null, is_constrained: false, is_unreached: false };

/** Return the state that changes with the current view. @param {Ui} ui @param {number} view
 * @returns {Partial<Ui>} */
export function viewUpdate(ui, view) {
  const verification = ui.verifications[view] ?? null;
  const losesVerification = ui.display.right === 'verified' && !verification;
  const hasSameSize = String(ui.views[view].size) === String(ui.views[ui.view].size);
  /** @type {Ui['display']} */
  const display = {
    ...ui.display,
    ...(losesVerification ? { left: 'painting', right: 'solution' } : {}),
    ...(hasSameSize ? {} : { zoom: 1, pan: [0, 0] }),
  };
  const { closeness, shares } = ui;
  return {
    view,
    state: stateOfView(ui.state, view),
    verification,
    reasons: [],
    probe: null,
    display,
    ...(closeness ? closenessUpdate({ closeness }, { ...ui, view }) : {}),
    lightAnswers: ui.lightAnswers.map((light, k) => ({
      ...light,
      share: shares?.[view]?.[k] ?? light.share,
    })),
  };
}

/** Take a verification render of a view. @param {Events["verified"]} message @param {Ui} ui
 * @returns {Partial<Ui>} */
export function verificationUpdate(message, ui) {
  const { view = 0 } = message;
  const verification = toVerification(message);
  const changes = {
    verifications: { ...ui.verifications, [view]: verification },
    verificationProgress: null,
  };
  return view === ui.view ? { ...changes, verification } : changes;
}

/** Take the reasons why the answer is not closer, unless painting has continued.
 * @param {any} message @param {Ui} ui
 * @returns {Partial<Ui>} */
export function explanationUpdate({ view = 0, sentences, is_old: isOld = false }, ui) {
  const isCurrent = view === ui.view && !isOld && !ui.isLive;
  return { isExplaining: false, reasons: isCurrent ? sentences : [] };
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
  for (let i = 0; i < flat.length; i += 3) weights.push([flat[i], flat[i + 1], flat[i + 2]]);
  return { weights };
}

/** Take the state in an answer or a patch, unless it is older than an earlier message, like an
 * exact answer found during an undo. @param {any} message @param {Ui} ui @returns {Partial<Ui>} */
export function answerUpdate(message, ui) {
  if (message.version < ui.version) return {};
  // Undo of a selection: it changes no light, and no exact answer follows.
  const isSameAnswer = message.version === ui.version && !message.exact;
  const changes = /** @type {Partial<Ui>} */ (isSameAnswer ? {} : weightsOf(message));
  changes.version = message.version ?? ui.version;
  for (const key of /** @type {const} */ ([
    'history',
    'constraints',
    'earlier',
    'kept',
    'ties',
    'settings',
    'poses',
  ])) {
    if (message[key]) changes[key] = message[key];
  }
  if (message.is_started !== undefined) changes.isStarted = message.is_started;
  if (message.master !== undefined) changes.master = message.master ?? 1;
  if (message.effective_settings) changes.effectiveSettings = message.effective_settings;
  if (message.added_lights) changes.addedLights = message.added_lights;
  if (message.reading) changes.planesReading = message.reading;
  if (message.places !== undefined) changes.places = message.places ?? '';
  if (message.lights) Object.assign(changes, answerFields(message, ui));
  else if (!message.exact && !isSameAnswer && !ui.areLightsUnknown) {
    changes.isLive = true;
    changes.isJudgementCurrent = false;
    if (message.drives) changes.lightAnswers = withDrives(ui.lightAnswers, message.drives);
    // Earlier statements no longer hold once something is painted.
    if (ui.deltaE === null) changes.headline = '';
  }
  if (changes.weights) {
    const outdatedEntries = Object.entries(ui.verifications).map(([view, verification]) => [
      view,
      { ...verification, isOld: true },
    ]);
    changes.verifications = Object.fromEntries(outdatedEntries);
    if (ui.verification) changes.verification = { ...ui.verification, isOld: true };
  }
  // The reasons belong to the previous answer.
  if (changes.isLive && ui.reasons.length) changes.reasons = [];
  return changes;
}

/** The answers with drives of emitters that are known under the brush.
 * @param {Ui["lightAnswers"]} answers @param {readonly (number[] | null)[]} drives */
const withDrives = (answers, drives) =>
  answers.map((answer, k) =>
    // How far a slot is off is known at the end of a stroke.
    drives[k] ? { ...answer, drives: drives[k], slot_delta_e: undefined } : answer,
  );

/** @param {Events["progress"]} message @param {Ui} ui @returns {Partial<Ui>} */
export function progressUpdate({ task, done, total, unit }, ui) {
  const changes = { task, done, total, unit };
  if (task === 'export')
    return { exportProgress: estimateTime(changes, ui.exportProgress), isExporting: true };
  if (task === 'place')
    return ui.placementProgress
      ? { placementProgress: estimateTime(changes, ui.placementProgress) }
      : {};
  if (task === 'final') return { renderProgress: estimateTime(changes, ui.renderProgress) };
  if (task === 'planes')
    return { planesProgress: done < total ? estimateTime(changes, ui.planesProgress) : null };
  // The brush interrupts it, so the remaining time is unknown.
  if (task === 'sampling') return { samplingProgress: done < total ? changes : null };
  if (/verif/i.test(task))
    return { verificationProgress: estimateTime(changes, ui.verificationProgress) };
  return { basis: total && done >= total ? null : estimateTime(changes, ui.basis) };
}

/** Seconds of work before the remaining time is shown. */
const MIN_TIMED_SECONDS = 2;

/** Extrapolate from the progress since the first report.
 * @param {Progress} progress
 * @param {Progress | null} previous @returns {Progress} */
function estimateTime(progress, previous) {
  const ms = performance.now();
  const isSameTask =
    previous?.since && previous.total === progress.total && previous.done <= progress.done;
  const since = (isSameTask && previous.since) || { ms, done: progress.done };
  const [seconds, done] = [(ms - since.ms) / 1000, progress.done - since.done];
  const remainingSeconds =
    seconds > MIN_TIMED_SECONDS && done > 0
      ? (seconds / done) * (progress.total - progress.done)
      : undefined;
  return { ...progress, since, remainingSeconds };
}

/** Return the places of the lights that can move, by name. @param {Rig} rig
 * @param {Ui["lights"]} lights @returns {Record<string, number[]>} */
export function movablePlaces(rig, lights) {
  return Object.fromEntries(
    rig.lights.flatMap(({ position, immovable_reason: reason }, k) =>
      position && !reason ? [[lights[k].name, position]] : [],
    ),
  );
}
