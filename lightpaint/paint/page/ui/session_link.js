/** Sends requests to the session, and turns its messages into interface state. */

import {
  TASK_ENDED,
  IDLE,
  answerUpdate,
  explanationUpdate,
  looksUpdate,
  previewUpdate,
  progressUpdate,
  stateUpdate,
  verificationUpdate,
} from './state_updates.js';
import { within } from './format.js';
import { updateShow } from './tools.js';

/** @typedef {import("./engine_interface.js").Host} Host */
/** @typedef {import("./engine_interface.js").Message} Message */
/** @typedef {import("./engine_interface.js").Requests} Requests */
/** @typedef {import("./engine_interface.js").HostEvents} HostEvents */
/** @typedef {import("./engine_interface.js").RGB} RGB */
/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./ui_state.js").Constraints} Constraints */

/** @type {(keyof HostEvents)[]} */
const EVENT_KINDS = [
  'state',
  'waiting',
  'answer',
  'patch',
  'renewed',
  'rig',
  'trial',
  'placed',
  'progress',
  'stopped',
  'notice',
  'failed',
  'looks',
  'exported',
  'verified',
  'explained',
  'previewed',
  'closed',
  'connection',
  'silence',
];

export class SessionLink {
  /** @param {Host} host @param {import("./ui_state.js").UiStore} store */
  constructor(host, store) {
    this.host = host;
    this.store = store;
    /** Messages that were handled: a reply arrives both at its sender and at the listeners. @type {WeakSet<Message>} */
    this.received = new WeakSet();
    /** Levels of lights whose dimmers move. @type {Map<number, {rgb: RGB, isFinal: boolean}>} */
    this.moves = new Map();
    /** Pending work: moves of dimmers, and looks to save.
     * @type {Promise<void> | null} */
    this.moveInProgress = null;
    this.savingLook = Promise.resolve();
    /** Constraints of lights before they were locked. @type {Map<number, Constraints>} */
    this.unlockedConstraints = new Map();
    /** Constraints in requests without a reply yet. @type {Map<number, Constraints>} */
    this.pendingConstraints = new Map();
    /** The number of previews so far. */
    this.previews = 0;
    /** The state that the session has confirmed, to return to when it refuses a request.
     * @type {Pick<Ui, 'constraints' | 'ties' | 'settings' | 'weights'>} */
    this.confirmed = { constraints: {}, ties: [], settings: {}, weights: [] };
    for (const kind of EVENT_KINDS)
      host.on(kind, (message) => this.receive({ ...message, kind }, message));
  }

  /**
   * Send a request. An error is shown as a toast.
   * @template {keyof Requests} K @param {K} kind @param {Requests[K]} [fields]
   * @returns {Promise<Message | null>}
   */
  async send(kind, fields) {
    try {
      const reply = await this.host.send(kind, fields);
      this.receive(reply, reply);
      if (reply.kind === 'failed' || reply.kind === 'closed') this.taskEnded(kind);
      return reply;
    } catch (error) {
      this.taskEnded(kind);
      this.toast(error instanceof Error ? error.message : String(error), 'warn');
      return null;
    }
  }

  /** @param {Message} message @param {Message} [origin] */
  receive(message, origin = message) {
    if (this.received.has(origin)) return;
    this.received.add(origin);
    const changes = /** @type {Record<string, (message: any) => Partial<Ui> | void>} */ ({
      state: (/** @type {HostEvents['state']} */ m) => stateUpdate(m, this.store.value),
      waiting: (/** @type {HostEvents['waiting']} */ m) => ({
        ready: false,
        state: null,
        waiting: m.text ?? '',
        basis: m.progress ?? null,
        ...IDLE,
      }),
      answer: (/** @type {HostEvents['answer']} */ m) => answerUpdate(m, this.store.value),
      patch: (/** @type {HostEvents['patch']} */ m) => answerUpdate(m, this.store.value),
      renewed: (/** @type {HostEvents['renewed']} */ m) => ({
        resources: { ...this.store.value.resources, ...m.resources },
      }),
      rig: (/** @type {HostEvents['rig']} */ m) => ({ rig: m }),
      trial: (/** @type {HostEvents['trial']} */ m) =>
        this.store.value.placing ? { trial: m } : {},
      placed: (/** @type {HostEvents['placed']} */ m) => this.placingEnded(m),
      progress: (/** @type {HostEvents['progress']} */ m) => progressUpdate(m, this.store.value),
      stopped: (/** @type {HostEvents['stopped']} */ m) => this.taskEnded(m.task),
      notice: (/** @type {HostEvents['notice']} */ m) => this.showNotice(m),
      failed: (/** @type {HostEvents['failed']} */ m) => this.toast(m.text, m.tone ?? 'warn'),
      looks: (/** @type {HostEvents['looks']} */ m) => looksUpdate(m, this.store.value),
      exported: (/** @type {HostEvents['exported']} */ m) => this.exportEnded(m),
      verified: (/** @type {HostEvents['verified']} */ m) => verificationUpdate(m, this.store.value),
      explained: (/** @type {HostEvents['explained']} */ m) =>
        explanationUpdate(m, this.store.value),
      previewed: (/** @type {HostEvents['previewed']} */ m) => previewUpdate(m, this.store.value),
      closed: (/** @type {HostEvents['closed']} */ m) => ({
        closed: { reason: m.reason, text: m.text },
      }),
      connection: (/** @type {HostEvents['connection']} */ m) => ({ connection: m.state }),
      silence: (/** @type {HostEvents['silence']} */ m) => ({ isSilent: m.isSilent }),
    })[message.kind]?.(message);
    for (const key of /** @type {const} */ (['constraints', 'ties', 'settings', 'weights']))
      if (changes?.[key]) Object.assign(this.confirmed, { [key]: changes[key] });
    if (changes?.weights) changes.weights = this.withMoves(changes.weights);
    if (changes) this.store.set(changes);
    if (changes?.constraints) this.forgetUnlocked(changes.constraints);
  }

  /** Replace the weights of lights whose dimmers move. @param {RGB[]} weights @returns {RGB[]} */
  withMoves(weights) {
    return weights.map((rgb, k) => this.moves.get(k)?.rgb ?? rgb);
  }

  /** Show the confirmed state, with pending requests. */
  revert() {
    const { constraints, ties, settings, weights } = this.confirmed;
    const { lights } = this.store.value;
    const asking = [...this.pendingConstraints].map(([light, its]) => [lights[light].name, its]);
    this.store.set({
      constraints: { ...constraints, ...Object.fromEntries(asking) },
      ties,
      settings,
      weights: this.withMoves(weights),
    });
  }

  /** Forget the earlier constraints of lights that are no longer locked; undo unlocks lights, too.
   * Messages that precede the session's receipt of the lock do not count.
   * @param {Record<string, Constraints>} constraints */
  forgetUnlocked(constraints) {
    for (const light of this.unlockedConstraints.keys()) {
      if (this.moves.has(light) || this.pendingConstraints.has(light)) continue;
      const now = constraints[this.store.value.lights[light]?.name] ?? {};
      if (now.lock === undefined && !now.off) this.unlockedConstraints.delete(light);
    }
  }

  /** Reset the state of a task that has ended. @param {string} kind of its request */
  taskEnded(kind) {
    this.store.set(TASK_ENDED[kind] ?? {});
    // Otherwise the overlay would request it again and again.
    const isShown = kind === 'explain' && this.store.value.show.overlay === 'beyond';
    if (isShown) updateShow(this.store, { overlay: null });
  }

  /** Show a notice. task: the one that it ends.
   * @param {{text: string, tone: 'info' | 'warn', task?: string}} said */
  showNotice({ text, tone, task }) {
    if (task) this.taskEnded(task);
    this.toast(text, tone);
  }

  /** Report the exported files, in a toast if the dialog is closed. @param {any} message
   * @returns {Partial<Ui>} */
  exportEnded(message) {
    const { files, is_stopped: isStopped } = message;
    const { dialog, state } = this.store.value;
    const names = files.map((/** @type {string} */ file) => within(file, state?.folder ?? ''));
    if (dialog !== 'export') this.toast(writtenText(names, Boolean(isStopped)));
    return { exported: message, ...TASK_ENDED.export };
  }

  /** Take the result of a search for places, and the earlier places of lights.
   * @param {HostEvents["placed"]} message @returns {Partial<Ui>} */
  placingEnded({ text }) {
    this.toast(text);
    return TASK_ENDED.place;
  }

  /** Export files, or stop the export. @param {Requests["export"]["outputs"]} outputs empty to stop */
  write(outputs) {
    if (outputs.length) this.store.set({ isWriting: true, exported: null });
    return this.send('export', { outputs, run: outputs.length > 0 });
  }

  /** @param {string} text @param {'info' | 'warn'} [tone] */
  toast(text, tone = 'info') {
    const id = Date.now() + Math.random();
    const others = this.store.value.toasts.filter((one) => one.text !== text).slice(-2);
    this.store.set({ toasts: [...others, { id, text, tone }] });
    const stays = Math.min(15000, 4000 + 60 * text.length);
    setTimeout(() => this.dismiss(id), tone === 'warn' ? 2 * stays : stays);
  }

  /** @param {number} id */
  dismiss(id) {
    this.store.set((ui) => ({ toasts: ui.toasts.filter((one) => one.id !== id) }));
  }
}

/** Return a sentence on the exported files. @param {string[]} names @param {boolean} isStopped */
function writtenText(names, isStopped) {
  const written = names.length ? `Exported ${names.join(', ')}.` : 'Nothing was exported.';
  return isStopped ? `Stopped. ${written}` : written;
}
