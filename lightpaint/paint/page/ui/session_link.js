/** Sends requests to the session, and turns its messages into interface state. */

import {
  TASK_RESETS,
  IDLE,
  answerUpdate,
  explanationUpdate,
  looksUpdate,
  movablePlaces,
  previewUpdate,
  progressUpdate,
  stateUpdate,
  verificationUpdate,
} from './state_updates.js';
import { endedTexts, rendersUpdate } from './exports/render_state.js';
import { relativePath } from './format.js';
import { choicesUpdate } from './answer_choices.js';
import { referencesUpdate } from './references/reference_state.js';
import { updateDisplay } from './tools.js';
import { t } from '../language/language.js';

/** @import { Constraints, Host, Message, RGB, Ui, UiStore } from './ui_state.js' */
/** @import { LightPlace, Requests } from '../engine/messages.js' */
/** @import { HostEvents } from '../engine/socket_host.js' */

/** What each message changes in the state of the interface.
 * @type {{[K in keyof HostEvents]?:
 *   (message: HostEvents[K], ui: Ui, link: SessionLink) => Partial<Ui> | void}} */
const UPDATES = {
  state: stateUpdate,
  waiting: ({ text, progress }) => ({
    ...{ ready: false, state: null, waitReason: text ?? '', basis: progress ?? null },
    ...IDLE,
  }),
  answer: answerUpdate,
  patch: answerUpdate,
  selected: ({ history }) => (history ? { history } : {}),
  renewed: ({ resources }, ui) => ({ resources: { ...ui.resources, ...resources } }),
  rig: (rig, _, link) => link.takeRig(rig),
  trial: (trial, ui) => (ui.placementProgress ? { trial } : {}),
  placed: (message, _, link) => link.takePlacement(message),
  progress: progressUpdate,
  stopped: ({ task }, _, link) => link.resetTask(task),
  notice: (message, _, link) => link.showNotice(message),
  failed: ({ text, tone }, _, link) => link.toast(text, tone ?? 'warn'),
  looks: looksUpdate,
  references: referencesUpdate,
  choices: choicesUpdate,
  exported: (message, _, link) => link.takeExport(message),
  renders: (message, _, link) => link.takeRenders(message),
  console: ({ console }) => ({ console }),
  verified: verificationUpdate,
  explained: explanationUpdate,
  previewed: previewUpdate,
  closed: ({ reason, text }) => ({ closure: { reason, text } }),
  connection: ({ state }) => ({ connection: state }),
  silence: ({ isSilent }) => ({ isSilent }),
};

/** State that a refused request returns to. */
const CONFIRMED_KEYS = /** @type {const} */ (['constraints', 'ties', 'settings', 'weights', 'master']);

export class SessionLink {
  /** @param {Host} host @param {UiStore} store */
  constructor(host, store) {
    this.host = host;
    this.store = store;
    /** Messages that were handled: a reply arrives both at its sender and at the listeners. @type {WeakSet<Message>} */
    this.handledMessages = new WeakSet();
    /** Levels of lights whose dimmers move. @type {Map<number, {rgb: RGB, isFinal: boolean}>} */
    this.moves = new Map();
    /** Levels of lights that move together. @type {Map<number, RGB>} */
    this.groupMoves = new Map();
    /** The level of the master dimmer, until the session has it. @type {number | null} */
    this.masterInHand = null;
    /** Pending work: moves of dimmers, and looks to save.
     * @type {Promise<void> | null} */
    this.moveInProgress = null;
    this.lookInProgress = Promise.resolve();
    /** Constraints of lights before they were locked. @type {Map<number, Constraints>} */
    this.unlockedConstraints = new Map();
    /** Constraints in requests without a reply yet. @type {Map<number, Constraints>} */
    this.pendingConstraints = new Map();
    /** Typed places in requests without a reply yet. @type {Map<number, Partial<LightPlace>>} */
    this.pendingPlaces = new Map();
    /** The number of previews so far. */
    this.previewCount = 0;
    /** The state that the session has confirmed, to return to when it refuses a request.
     * @type {Pick<Ui, typeof CONFIRMED_KEYS[number]>} */
    this.confirmedState = { constraints: {}, ties: [], settings: {}, weights: [], master: 1 };
    for (const kind of /** @type {(keyof HostEvents)[]} */ (Object.keys(UPDATES)))
      host.on(kind, (/** @type {any} */ message) => this.receive({ ...message, kind }, message));
  }

  /** Send a request. An error is shown as a toast.
   * @template {keyof Requests} K @param {K} kind @param {Requests[K]} [fields]
   * @returns {Promise<Message | null>} */
  async send(kind, fields) {
    try {
      const reply = await this.host.send(kind, fields);
      this.receive(reply, reply);
      if (reply.kind === 'failed' || reply.kind === 'closed') this.resetTask(kind);
      return reply;
    } catch (error) {
      this.resetTask(kind);
      this.toast(error instanceof Error ? error.message : String(error), 'warn');
      return null;
    }
  }

  /** @param {Message} message @param {Message} [origin] */
  receive(message, origin = message) {
    if (this.handledMessages.has(origin)) return;
    this.handledMessages.add(origin);
    const update = UPDATES[/** @type {keyof HostEvents} */ (message.kind)];
    const changes = update?.(/** @type {any} */ (message), this.store.value, this);
    for (const key of CONFIRMED_KEYS)
      if (changes?.[key] !== undefined) Object.assign(this.confirmedState, { [key]: changes[key] });
    if (changes?.weights) changes.weights = this.applyMoves(changes.weights);
    if (changes?.master !== undefined) changes.master = this.masterInHand ?? changes.master;
    // Several messages answer each move of a light. Under a brush the pictures come first.
    if (changes && this.store.value.drag) this.store.setForFrame(changes);
    else if (changes?.isLive) this.store.setWithNext(changes);
    else if (changes) this.store.set(changes);
    if (changes?.constraints) this.forgetUnlocked(changes.constraints);
  }

  /** Replace the weights of lights whose dimmers move. @param {RGB[]} weights @returns {RGB[]} */
  applyMoves(weights) {
    return weights.map((rgb, k) => this.moves.get(k)?.rgb ?? this.groupMoves.get(k) ?? rgb);
  }

  /** Show the confirmed state, with pending requests. */
  revert() {
    const { constraints, ties, settings, weights, master } = this.confirmedState;
    const { lights } = this.store.value;
    const pendingEntries = [...this.pendingConstraints].map(([light, pending]) => [
      lights[light].name,
      pending,
    ]);
    this.store.set({
      constraints: { ...constraints, ...Object.fromEntries(pendingEntries) },
      ties,
      settings,
      master,
      weights: this.applyMoves(weights),
    });
  }

  /** Forget the earlier constraints of lights that are no longer locked; undo unlocks lights, too.
   * Messages that precede the session's receipt of the lock do not count.
   * @param {Record<string, Constraints>} constraints */
  forgetUnlocked(constraints) {
    for (const light of this.unlockedConstraints.keys()) {
      if (this.moves.has(light) || this.groupMoves.has(light)) continue;
      if (this.pendingConstraints.has(light)) continue;
      const current = constraints[this.store.value.lights[light]?.name] ?? {};
      if (current.lock === undefined && !current.off) this.unlockedConstraints.delete(light);
    }
  }

  /** Reset the state of a task that has ended. @param {string} kind of its request */
  resetTask(kind) {
    this.store.set(TASK_RESETS[kind] ?? {});
    // Otherwise the overlay would request it again and again.
    const isShown = kind === 'explain' && this.store.value.display.overlay === 'beyond';
    if (isShown) updateDisplay(this.store, { overlay: null });
  }

  /** Show a notice. task: the one that it ends.
   * @param {{text: string, tone: 'info' | 'warn', task?: string}} notice */
  showNotice({ text, tone, task }) {
    if (task) this.resetTask(task);
    this.toast(text, tone);
  }

  /** Report the exported files, in a toast if the dialog is closed. @param {any} message
   * @returns {Partial<Ui>} */
  takeExport(message) {
    const { files, is_stopped: isStopped } = message;
    const { dialog, state } = this.store.value;
    const names = files.map((/** @type {string} */ file) =>
      relativePath(file, state?.folder ?? ''),
    );
    if (dialog !== 'export') this.toast(exportText(names, Boolean(isStopped)));
    return { exportResult: message, ...TASK_RESETS.export };
  }

  /** Take the final renders, and report those that have ended, unless their dialog does.
   * @param {HostEvents["renders"]} message @returns {Partial<Ui>} */
  takeRenders(message) {
    const { value } = this.store;
    for (const { text, tone } of value.dialog === 'render' ? [] : endedTexts(message.renders, value))
      this.toast(text, tone);
    return rendersUpdate(message, value);
  }

  /** Take the places of lights. A search that began before they were known shows where lights were.
   * @param {HostEvents["rig"]} rig @returns {Partial<Ui>} */
  takeRig(rig) {
    const ghosts = this.awaitsGhosts ? { ghosts: movablePlaces(rig, this.store.value.lights) } : {};
    this.awaitsGhosts = false;
    const lights = rig.lights.map((place, k) => ({ ...place, ...this.pendingPlaces.get(k) }));
    return { rig: { ...rig, lights }, ...ghosts };
  }

  /** Take the result of a search for places, and the earlier places of lights.
   * @param {HostEvents["placed"]} message @returns {Partial<Ui>} */
  takePlacement({ text }) {
    this.toast(text);
    return { ...TASK_RESETS.place, searchCount: this.store.value.searchCount + 1 };
  }

  /** Export files, or stop the export. @param {Requests["export"]["outputs"]} outputs empty to stop
   * @param {string} [name] of the new folder for them */
  exportFiles(outputs, name = '') {
    if (outputs.length) this.store.set({ isExporting: true, exportResult: null });
    return this.send('export', { outputs, run: outputs.length > 0, ...(name && { name }) });
  }

  /** @param {string} text @param {'info' | 'warn'} [tone] */
  toast(text, tone = 'info') {
    const id = Date.now() + Math.random();
    const otherToasts = this.store.value.toasts.filter((toast) => toast.text !== text).slice(-2);
    this.store.set({ toasts: [...otherToasts, { id, text, tone }] });
    const durationMs = Math.min(15000, 4000 + 60 * text.length);
    setTimeout(() => this.dismiss(id), tone === 'warn' ? 2 * durationMs : durationMs);
  }

  /** @param {number} id */
  dismiss(id) {
    this.store.set((ui) => ({ toasts: ui.toasts.filter((toast) => toast.id !== id) }));
  }
}

/** Return a sentence on the exported files. @param {string[]} names @param {boolean} isStopped */
function exportText(names, isStopped) {
  const sentence = names.length
    ? t('Exported {value}.', { value: names.join(', ') })
    : t('Nothing was exported.');
  return isStopped ? t('Stopped. {sentence}', { sentence }) : sentence;
}
