/** Talks with the session: what it says becomes state, what a person does becomes messages. */

import { heldOf, holderOf } from './tied_lights.js';
import {
  ENDED,
  IDLE,
  answerOf,
  explainedOf,
  looksOf,
  previewedOf,
  progressOf,
  stateOf,
  verifiedOf,
} from './state_updates.js';
import { within } from './format.js';
import { look } from './tools.js';

/** @typedef {import("./engine_interface.js").Host} Host */
/** @typedef {import("./engine_interface.js").Message} Message */
/** @typedef {import("./engine_interface.js").Requests} Requests */
/** @typedef {import("./engine_interface.js").Heard} Heard */
/** @typedef {import("./engine_interface.js").RGB} RGB */
/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./ui_state.js").Asked} Asked */

/** @type {(keyof Heard)[]} */
const HEARD = [
  'state',
  'waiting',
  'answer',
  'patch',
  'renewed',
  'progress',
  'stopped',
  'say',
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

export class Session {
  /** @param {Host} host @param {import("./ui_state.js").UiStore} store */
  constructor(host, store) {
    this.host = host;
    this.store = store;
    /** Replies come twice: to who asked, and to who listens. @type {WeakSet<Message>} */
    this.done = new WeakSet();
    /** Lights that a hand moves, and where to. @type {Map<number, {rgb: RGB, done: boolean}>} */
    this.hands = new Map();
    /** Until what hands have done is answered, and until looks are kept that are to be.
     * @type {Promise<void> | null} */
    this.moving = null;
    this.keeping = Promise.resolve();
    /** What was asked of a light before a hand moved it. @type {Map<number, Asked>} */
    this.before = new Map();
    /** What is asked of lights by messages on their way. @type {Map<number, Asked>} */
    this.asking = new Map();
    /** How many changes were looked at before they were made. */
    this.previews = 0;
    /** What the session has said last of what is asked, and of what comes of that: what it refuses
     * is shown no longer. @type {Pick<Ui, 'asked' | 'ties' | 'settings' | 'weights'>} */
    this.said = { asked: {}, ties: [], settings: {}, weights: [] };
    for (const kind of HEARD)
      host.on(kind, (message) => this.receive({ ...message, kind }, message));
  }

  /**
   * Say something; what cannot be done is said in a toast.
   * @template {keyof Requests} K @param {K} kind @param {Requests[K]} [fields]
   * @returns {Promise<Message | null>}
   */
  async send(kind, fields) {
    try {
      const reply = await this.host.send(kind, fields);
      this.receive(reply, reply);
      if (reply.kind === 'failed' || reply.kind === 'closed') this.ended(kind);
      return reply;
    } catch (error) {
      this.ended(kind);
      this.toast(error instanceof Error ? error.message : String(error), 'warn');
      return null;
    }
  }

  /** @param {Message} message @param {Message} [origin] */
  receive(message, origin = message) {
    if (this.done.has(origin)) return;
    this.done.add(origin);
    const told = /** @type {Record<string, (message: any) => Partial<Ui> | void>} */ ({
      state: (/** @type {Heard['state']} */ m) => stateOf(m, this.store.value),
      waiting: (/** @type {Heard['waiting']} */ m) => ({
        ready: false,
        state: null,
        waiting: m.text ?? '',
        basis: m.progress ?? null,
        ...IDLE,
      }),
      answer: (/** @type {Heard['answer']} */ m) => answerOf(m, this.store.value),
      patch: (/** @type {Heard['patch']} */ m) => answerOf(m, this.store.value),
      renewed: (/** @type {Heard['renewed']} */ m) => ({
        resources: { ...this.store.value.resources, ...m.resources },
      }),
      progress: (/** @type {Heard['progress']} */ m) => progressOf(m, this.store.value),
      stopped: (/** @type {Heard['stopped']} */ m) => this.ended(m.what),
      say: (/** @type {Heard['say']} */ m) => this.say(m),
      failed: (/** @type {Heard['failed']} */ m) => this.toast(m.text, m.tone ?? 'warn'),
      looks: (/** @type {Heard['looks']} */ m) => looksOf(m, this.store.value),
      exported: (/** @type {Heard['exported']} */ m) => this.exported(m),
      verified: (/** @type {Heard['verified']} */ m) => verifiedOf(m, this.store.value),
      explained: (/** @type {Heard['explained']} */ m) => explainedOf(m, this.store.value),
      previewed: (/** @type {Heard['previewed']} */ m) => previewedOf(m, this.store.value),
      closed: (/** @type {Heard['closed']} */ m) => ({
        closed: { reason: m.reason, text: m.text },
      }),
      connection: (/** @type {Heard['connection']} */ m) => ({ connection: m.state }),
      silence: (/** @type {Heard['silence']} */ m) => ({ isSilent: m.isSilent }),
    })[message.kind]?.(message);
    for (const key of /** @type {const} */ (['asked', 'ties', 'settings', 'weights']))
      if (told?.[key]) Object.assign(this.said, { [key]: told[key] });
    if (told?.weights) told.weights = this.inHand(told.weights);
    if (told) this.store.set(told);
    if (told?.asked) this.forget(told.asked);
  }

  /** Weights, with lights where hands have them. @param {RGB[]} weights @returns {RGB[]} */
  inHand(weights) {
    return weights.map((rgb, k) => this.hands.get(k)?.rgb ?? rgb);
  }

  /** Show what the session has said last, and what it has not answered yet. */
  goBack() {
    const { asked, ties, settings, weights } = this.said;
    const { lights } = this.store.value;
    const asking = [...this.asking].map(([light, its]) => [lights[light].name, its]);
    this.store.set({
      asked: { ...asked, ...Object.fromEntries(asking) },
      ties,
      settings,
      weights: this.inHand(weights),
    });
  }

  /** What lights were before a hand held them, of those that are held no more: undo does that, too.
   * What is said while the session has not heard of the hand does not count.
   * @param {Record<string, Asked>} asked */
  forget(asked) {
    for (const light of this.before.keys()) {
      if (this.hands.has(light) || this.asking.has(light)) continue;
      const now = asked[this.store.value.lights[light]?.name] ?? {};
      if (now.lock === undefined && !now.off) this.before.delete(light);
    }
  }

  /** Nothing more comes of what was asked for. @param {string} kind of the message that did */
  ended(kind) {
    this.store.set(ENDED[kind] ?? {});
    // It would be asked for again and again.
    const isShown = kind === 'explain' && this.store.value.show.overlay === 'beyond';
    if (isShown) look(this.store, { overlay: null });
  }

  /** What goes wrong beside the painting comes so, too. what: which errand that was.
   * @param {{text: string, tone: 'info' | 'warn', what?: string}} said */
  say({ text, tone, what }) {
    if (what) this.ended(what);
    this.toast(text, tone);
  }

  /** What was written; who has closed the window is told so. @param {any} message
   * @returns {Partial<Ui>} */
  exported(message) {
    const { files, is_stopped: isStopped } = message;
    const { dialog, state } = this.store.value;
    const names = files.map((/** @type {string} */ file) => within(file, state?.folder ?? ''));
    if (dialog !== 'export') this.toast(writtenText(names, Boolean(isStopped)));
    return { exported: message, ...ENDED.export };
  }

  /** Write files, or stop that. @param {Requests["export"]["what"]} what none to stop */
  write(what) {
    if (what.length) this.store.set({ isWriting: true, exported: null });
    return this.send('export', { what, run: what.length > 0 });
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

  /**
   * What is asked of a light from now on.
   * @param {number} light @param {Asked} asked @param {boolean} [done] false while a slider moves
   */
  async ask(light, asked, done = true) {
    const kept = Object.fromEntries(
      Object.entries(asked).filter(
        ([, value]) => value !== null && value !== undefined && value !== false,
      ),
    );
    this.store.set((ui) => ({ asked: { ...ui.asked, [ui.lights[light].name]: kept } }));
    this.asking.set(light, kept);
    const reply = await this.send('ask', { light, asked: kept, done });
    const isNewest = this.asking.get(light) === kept;
    if (isNewest) this.asking.delete(light);
    if (reply?.kind === 'failed') this.goBack();
    if (isNewest) this.forget(this.store.value.asked);
    return reply;
  }

  /**
   * Set a light by hand: it is held there, and the others are solved around it. It is shown there
   * at once; one message is on its way, and the newest place of the hand goes with the next.
   * @param {number} light @param {RGB} emission @param {boolean} done
   */
  hold(light, emission, done) {
    const { lights, asked, weights } = this.store.value;
    if (!this.before.has(light)) {
      this.before.set(light, withoutLevel(asked[lights[light].name] ?? {}));
    }
    this.hands.set(light, { rgb: emission, done });
    this.store.set({ weights: weights.map((rgb, k) => (k === light ? emission : rgb)) });
    this.moving ??= this.move();
  }

  async move() {
    /** @type {Map<number, object>} */
    const sent = new Map();
    const waiting = () => [...this.hands].find(([light, hand]) => sent.get(light) !== hand);
    for (let next = waiting(); next; next = waiting()) {
      const [light, hand] = next;
      sent.set(light, hand);
      const isScalar = this.store.value.lights[light].is_scalar;
      const reply = await this.ask(light, { lock: isScalar ? hand.rgb[0] : hand.rgb }, hand.done);
      if (hand.done && this.hands.get(light) === hand) this.hands.delete(light);
      if (reply?.kind === 'failed') this.goBack();
    }
    this.moving = null;
  }

  /** Let the solve have a light again, with what was asked of it before; of several on one dimmer,
   * the one that holds it. @param {number} tied */
  release(tied) {
    const { lights, asked } = this.store.value;
    const light = holderOf(this.store.value, tied);
    this.hands.delete(tied);
    this.hands.delete(light);
    const before = this.before.get(light) ?? withoutLevel(asked[lights[light].name] ?? {});
    this.before.delete(light);
    return this.ask(light, before);
  }

  /** Let the solve have all lights again, each with what was asked of it before: one step. */
  releaseAll() {
    const { lights, asked } = this.store.value;
    const held = heldOf(this.store.value);
    const released = held.map((k) => [
      lights[k].name,
      this.before.get(k) ?? withoutLevel(asked[lights[k].name]),
    ]);
    for (const k of held) {
      this.hands.delete(k);
      this.before.delete(k);
    }
    return this.change('ask_all', { asked: Object.fromEntries(released) });
  }

  /** @param {number} light @param {boolean} off */
  turn(light, off) {
    if (!off) return this.release(light);
    this.hands.delete(light);
    const { lights, asked } = this.store.value;
    if (!this.before.has(light)) {
      this.before.set(light, withoutLevel(asked[lights[light].name] ?? {}));
    }
    return this.ask(light, { off: true });
  }

  /** Put two lights on one dimmer. @param {string} one @param {string} other */
  tie(one, other) {
    const { ties } = this.store.value;
    const joined = ties.filter((tie) => tie.includes(one) || tie.includes(other)).flat();
    const rest = ties.filter((tie) => !tie.includes(one) && !tie.includes(other));
    return this.tieAll([...rest, [...new Set([...joined, one, other])]]);
  }

  /** @param {string} name */
  untie(name) {
    const left = this.store.value.ties.map((tie) => tie.filter((one) => one !== name));
    return this.tieAll(left.filter((tie) => tie.length > 1));
  }

  /** @param {string[][]} ties */
  tieAll(ties) {
    this.store.set({ ties });
    return this.change('tie', { ties });
  }

  /** @param {string} key @param {any} value null for what follows from the painting */
  setting(key, value) {
    this.store.set((ui) => ({ settings: { ...ui.settings, [key]: value } }));
    return this.change('set', { values: { [key]: value } });
  }

  /** @template {"set" | "ask_all" | "tie"} K @param {K} kind @param {Requests[K]} fields */
  async change(kind, fields) {
    const reply = await this.send(kind, fields);
    if (reply?.kind === 'failed') this.goBack();
  }

  /** What a change would do is found before it is made. @param {string} label what it is called
   * @param {import("./ui_state.js").Change} change */
  preview(label, change) {
    this.previews += 1;
    const number = this.previews;
    const unknown = { text: '', isAtCost: false, before: null, after: null };
    this.store.set({ preview: { number, label, change, ...unknown } });
    return this.send('preview', { ...change.fields, number, view: this.store.value.view });
  }

  /** The change that was looked at is made, in one step. */
  makeChange() {
    const { preview } = this.store.value;
    this.store.set({ preview: null });
    if (!preview) return undefined;
    const { kind, fields } = preview.change;
    if (kind === 'set') {
      const [[key, value]] = Object.entries(fields.values);
      return this.setting(key, value);
    }
    return kind === 'tie' ? this.tieAll(fields.ties) : this.change(kind, fields);
  }

  /** Why the view that is shown is not closer. */
  explain() {
    this.store.set({ explaining: true });
    return this.send('explain', { view: this.store.value.view });
  }

  verify(run = true) {
    this.store.set({
      verifying: run ? { what: 'verify', done: 0, total: 0, unit: '' } : null,
    });
    return this.send('verify', { run, view: this.store.value.view });
  }
}

/** What was written, in a sentence. @param {string[]} names @param {boolean} isStopped */
function writtenText(names, isStopped) {
  const written = names.length ? `Exported ${names.join(', ')}.` : 'Nothing was exported.';
  return isStopped ? `Stopped. ${written}` : written;
}

/** @param {Asked} asked @returns {Asked} */
function withoutLevel({ lock, off, ...rest }) {
  return rest;
}
