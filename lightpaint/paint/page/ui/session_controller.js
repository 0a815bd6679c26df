/** Turns actions of a person into requests to the session. */

import { LampMoves } from './lamp_moves.js';
import { SessionLink } from './session_link.js';
import { lockedLights, lockingLight } from './tied_lights.js';

/** @typedef {import("./engine_interface.js").Requests} Requests */
/** @typedef {import("./engine_interface.js").RGB} RGB */
/** @typedef {import("./ui_state.js").Constraints} Constraints */

export class SessionController extends SessionLink {
  lampMoves = new LampMoves(this);

  /**
   * Set the constraints on a light.
   * @param {number} light @param {Constraints} constraints @param {boolean} [isFinal] false while a slider moves
   */
  async constrainLight(light, constraints, isFinal = true) {
    const kept = Object.fromEntries(
      Object.entries(constraints).filter(
        ([, value]) => value !== null && value !== undefined && value !== false,
      ),
    );
    this.store.set((ui) => ({ constraints: { ...ui.constraints, [ui.lights[light].name]: kept } }));
    this.pendingConstraints.set(light, kept);
    const reply = await this.send('constrain_light', { light, constraints: kept, is_final: isFinal });
    const isNewest = this.pendingConstraints.get(light) === kept;
    if (isNewest) this.pendingConstraints.delete(light);
    if (reply?.kind === 'failed') this.revert();
    if (isNewest) this.forgetUnlocked(this.store.value.constraints);
    return reply;
  }

  /**
   * Set a light by its slider and lock it there; the others are solved around it. The page shows it
   * at once. One message is pending at a time, and the next carries the newest level.
   * @param {number} light @param {RGB} emission @param {boolean} isFinal
   */
  lockLight(light, emission, isFinal) {
    const { lights, constraints, weights } = this.store.value;
    if (!this.unlockedConstraints.has(light)) {
      this.unlockedConstraints.set(light, withoutLevel(constraints[lights[light].name] ?? {}));
    }
    this.moves.set(light, { rgb: emission, isFinal });
    this.store.set({ weights: weights.map((rgb, k) => (k === light ? emission : rgb)) });
    this.moveInProgress ??= this.sendMoves();
  }

  async sendMoves() {
    /** @type {Map<number, object>} */
    const sent = new Map();
    const waiting = () => [...this.moves].find(([light, move]) => sent.get(light) !== move);
    for (let next = waiting(); next; next = waiting()) {
      const [light, move] = next;
      sent.set(light, move);
      const isScalar = this.store.value.lights[light].is_scalar;
      const reply = await this.constrainLight(
        light,
        { lock: isScalar ? move.rgb[0] : move.rgb },
        move.isFinal,
      );
      if (move.isFinal && this.moves.get(light) === move) this.moves.delete(light);
      if (reply?.kind === 'failed') this.revert();
    }
    this.moveInProgress = null;
  }

  /** Unlock a light, or the light that it is tied to, and restore its earlier constraints.
   * @param {number} tied */
  unlockLight(tied) {
    const { lights, constraints } = this.store.value;
    const light = lockingLight(this.store.value, tied);
    this.moves.delete(tied);
    this.moves.delete(light);
    const before =
      this.unlockedConstraints.get(light) ?? withoutLevel(constraints[lights[light].name] ?? {});
    this.unlockedConstraints.delete(light);
    return this.constrainLight(light, before);
  }

  /** Unlock all lights in one step, and restore their earlier constraints. */
  unlockAll() {
    const { lights, constraints } = this.store.value;
    const locked = lockedLights(this.store.value);
    const unlocked = locked.map((k) => [
      lights[k].name,
      this.unlockedConstraints.get(k) ?? withoutLevel(constraints[lights[k].name]),
    ]);
    for (const k of locked) {
      this.moves.delete(k);
      this.unlockedConstraints.delete(k);
    }
    return this.sendChange('constrain_lights', { constraints: Object.fromEntries(unlocked) });
  }

  /** @param {number} light @param {boolean} off */
  switchLight(light, off) {
    if (!off) return this.unlockLight(light);
    this.moves.delete(light);
    const { lights, constraints } = this.store.value;
    if (!this.unlockedConstraints.has(light)) {
      this.unlockedConstraints.set(light, withoutLevel(constraints[lights[light].name] ?? {}));
    }
    return this.constrainLight(light, { off: true });
  }

  /** Tie two lights. @param {string} one @param {string} other */
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
    return this.sendChange('tie', { ties });
  }

  /** @param {string} key @param {any} value null for automatic */
  changeSetting(key, value) {
    this.store.set((ui) => ({ settings: { ...ui.settings, [key]: value } }));
    return this.sendChange('change_settings', { settings: { [key]: value } });
  }

  /** @template {"change_settings" | "constrain_lights" | "tie"} K @param {K} kind @param {Requests[K]} fields */
  async sendChange(kind, fields) {
    const reply = await this.send(kind, fields);
    if (reply?.kind === 'failed') this.revert();
  }

  /** Request a preview of a change. @param {string} label its name
   * @param {import("./ui_state.js").Change} change */
  preview(label, change) {
    this.previews += 1;
    const number = this.previews;
    const unknown = { text: '', isAtCost: false, before: null, after: null };
    this.store.set({ preview: { number, label, change, ...unknown } });
    return this.send('preview', { ...change.fields, number, view: this.store.value.view });
  }

  /** Make the previewed change, in one step. */
  makeChange() {
    const { preview } = this.store.value;
    this.store.set({ preview: null });
    if (!preview) return undefined;
    const { kind, fields } = preview.change;
    if (kind === 'change_settings') {
      const [[key, value]] = Object.entries(fields.settings);
      return this.changeSetting(key, value);
    }
    return kind === 'tie' ? this.tieAll(fields.ties) : this.sendChange(kind, fields);
  }

  /** Show or hide the marks of lights. Their places are requested the first time. */
  toggleLamps() {
    const { lamps, rig } = this.store.value;
    this.store.set({ lamps: !lamps, pointing: null });
    if (!lamps && !rig) void this.send('show_rig');
  }

  /** Move a light. @param {number} light @param {Record<string, any>} change of its pose
   * @param {boolean} [isFinal] false while it is dragged */
  moveLamp(light, change, isFinal = true) {
    this.lampMoves.ask(light, { kind: 'move', pose: change }, isFinal);
  }

  /** Start or stop the search for places of lights. @param {boolean} [run] */
  placeLights(run = true) {
    const { rig, lights, lamps } = this.store.value;
    if (!run) return this.send('place', { run });
    if (!lamps) this.toggleLamps();
    /** @type {Record<string, number[]>} */
    const ghosts = {};
    rig?.lights.forEach(({ position, immovable_reason: reason }, k) => {
      if (position && !reason) ghosts[lights[k].name] = position;
    });
    this.store.set({ placing: { task: 'place', done: 0, total: 0, unit: 'steps' }, ghosts });
    return this.send('place', { run });
  }

  /** Add a light, and choose it. @param {Requests["add_light"]} fields */
  async addLight(fields) {
    this.store.set({ pointing: null });
    const reply = await this.send('add_light', fields);
    if (reply?.kind !== 'state') return;
    const lamp = this.store.value.lights.length - 1;
    this.store.set(({ unfolded }) => ({ lamps: true, lamp, unfolded: [...unfolded, lamp] }));
  }

  /** @param {string} name of a light that was added */
  removeLight(name) {
    return this.send('remove_light', { name });
  }

  /** Search for places of new lights. @param {import("./ui_state.js").Ui["adding"]} adding */
  findLights({ type, where, count }) {
    const { lamps } = this.store.value;
    if (!lamps) this.toggleLamps();
    this.store.set({ placing: { task: 'place', done: 0, total: 0, unit: 'steps' }, ghosts: {} });
    const surfaces = where === 'anywhere' ? [] : [where];
    return this.send('place', { run: true, new_type: type, max_count: count, surfaces });
  }

  /** Restore a light's place from the scene. @param {number} light */
  putBack(light) {
    this.lampMoves.ask(light, { kind: 'move', pose: {} });
  }

  /** Request the reasons why the current view is not closer. */
  explain() {
    this.store.set({ explaining: true });
    return this.send('explain', { view: this.store.value.view });
  }

  verify(run = true) {
    this.store.set({
      verifying: run ? { task: 'verify', done: 0, total: 0, unit: '' } : null,
    });
    return this.send('verify', { run, view: this.store.value.view });
  }
}

/** @param {Constraints} constraints @returns {Constraints} */
function withoutLevel({ lock, off, ...rest }) {
  return rest;
}
