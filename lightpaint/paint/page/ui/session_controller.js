/** Turns actions of a person into requests to the session. */

import { exposureOf } from './images/light_images.js';
import { ImageActions } from './images/image_actions.js';
import { LampMoves } from './lamp_moves.js';
import { ManyLights } from './lamps/many_lights.js';
import { SessionLink } from './session_link.js';
import { movablePlaces } from './state_updates.js';
import { lockedLights, lockingLight } from './tied_lights.js';
import { t } from '../language/language.js';

/** @import { Requests } from '../engine/messages.js' */
/** @import { Change, Constraints, RGB, Ui } from './ui_state.js' */

/** Progress of a search for places that has just begun. */
const NO_STEPS = { task: 'place', done: 0, total: 0, unit: 'steps' };

export class SessionController extends SessionLink {
  lampMoves = new LampMoves(this);
  many = new ManyLights(this);
  images = new ImageActions(this);

  /** Set the constraints on a light.
   * @param {number} light @param {Constraints} constraints @param {boolean} [isFinal] false while a slider moves
   */
  async constrainLight(light, constraints, isFinal = true) {
    const validConstraints = Object.fromEntries(
      Object.entries(constraints).filter(
        ([, value]) => value !== null && value !== undefined && value !== false,
      ),
    );
    this.store.set((ui) => ({
      constraints: { ...ui.constraints, [ui.lights[light].name]: validConstraints },
    }));
    this.pendingConstraints.set(light, validConstraints);
    const reply = await this.send('constrain_light', {
      light,
      constraints: validConstraints,
      is_final: isFinal,
    });
    const isNewest = this.pendingConstraints.get(light) === validConstraints;
    if (isNewest) this.pendingConstraints.delete(light);
    if (reply?.kind === 'failed') this.revert();
    if (isNewest) this.forgetUnlocked(this.store.value.constraints);
    return reply;
  }

  /** Set a light by its slider and lock it there; the others are solved around it. The page shows it
   * at once. One message is pending at a time, and the next carries the newest level.
   * @param {number} light @param {RGB} emission @param {boolean} isFinal */
  lockLight(light, emission, isFinal) {
    const { weights } = this.store.value;
    this.noteUnlocked(light);
    this.moves.set(light, { rgb: emission, isFinal });
    this.store.set({ weights: weights.map((rgb, k) => (k === light ? emission : rgb)) });
    this.moveInProgress ??= this.sendMoves();
  }

  /** Note the constraints of a light before it is locked, to restore them. @param {number} light */
  noteUnlocked(light) {
    if (!this.unlockedConstraints.has(light)) {
      this.unlockedConstraints.set(light, this.openConstraints(light));
    }
  }

  /** Return the constraints on a light; of one that is locked or off those from before.
   * @param {number} light @returns {Constraints} */
  openConstraints(light) {
    const { lights, constraints, earlier } = this.store.value;
    const { name } = lights[light];
    const known = this.unlockedConstraints.get(light) ?? earlier[name];
    return known ?? withoutLevel(constraints[name] ?? {});
  }

  async sendMoves() {
    /** @type {Map<number, object>} */
    const sentMoves = new Map();
    const findUnsent = () => [...this.moves].find(([light, move]) => sentMoves.get(light) !== move);
    for (let next = findUnsent(); next; next = findUnsent()) {
      const [light, move] = next;
      sentMoves.set(light, move);
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
   * @param {number} tiedLight */
  unlockLight(tiedLight) {
    const light = lockingLight(this.store.value, tiedLight);
    this.moves.delete(tiedLight);
    this.moves.delete(light);
    const earlierConstraints = this.openConstraints(light);
    this.unlockedConstraints.delete(light);
    return this.constrainLight(light, earlierConstraints);
  }

  /** Unlock all lights in one step, and restore their earlier constraints. */
  unlockAll() {
    const lights = lockedLights(this.store.value);
    return this.unlockLights(lights, t('unlock {count} lights', { count: lights.length }));
  }

  /** @param {number[]} lockedIndices of lights that are locked or off @param {string} label */
  unlockLights(lockedIndices, label) {
    const { lights } = this.store.value;
    const entries = lockedIndices.map((k) => [lights[k].name, this.openConstraints(k)]);
    for (const k of lockedIndices) {
      this.moves.delete(k);
      this.unlockedConstraints.delete(k);
    }
    return this.sendChange('constrain_lights', { constraints: Object.fromEntries(entries), label });
  }

  /** @param {number} light @param {boolean} isOff */
  switchLight(light, isOff) {
    if (!isOff) return this.unlockLight(light);
    this.moves.delete(light);
    this.noteUnlocked(light);
    return this.constrainLight(light, { off: true });
  }

  /** Put lights, and all that is tied to them, on one dimmer. @param {string[]} names */
  tie(names) {
    const { ties } = this.store.value;
    const isJoined = (/** @type {string[]} */ tie) => tie.some((name) => names.includes(name));
    const joined = [...new Set([...ties.filter(isJoined).flat(), ...names])];
    return this.tieAll([...ties.filter((tie) => !isJoined(tie)), joined]);
  }

  /** Take lights off their dimmers. @param {string[]} names */
  untie(names) {
    const ties = this.store.value.ties.map((tie) => tie.filter((name) => !names.includes(name)));
    return this.tieAll(ties.filter((tie) => tie.length > 1));
  }

  /** @param {string[][]} ties */
  tieAll(ties) {
    this.store.set({ ties });
    return this.sendChange('tie', { ties });
  }

  /** Set the master dimmer. @param {number} level a factor @param {boolean} isFinal false while its
   * slider moves, which the page alone shows */
  async setMaster(level, isFinal) {
    this.masterInHand = level;
    this.store.set({ master: level });
    if (!isFinal) return;
    const reply = await this.send('set_master', { level });
    if (this.masterInHand === level) this.masterInHand = null;
    if (reply?.kind === 'failed') this.revert();
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
   * @param {Change} change */
  preview(label, change) {
    this.previewCount += 1;
    const number = this.previewCount;
    const emptyResult = { text: '', isAtCost: false, before: null, after: null };
    this.store.set({ preview: { number, label, change, ...emptyResult } });
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
    const { areLampsMarked, rig } = this.store.value;
    this.store.set({ areLampsMarked: !areLampsMarked, clickAction: null });
    if (!areLampsMarked && !rig) void this.send('show_rig');
  }

  /** Have the places of lights and cameras sent, if there is a scene and they are not known. */
  showRig() {
    const { rig, state } = this.store.value;
    if (!rig && state?.can_render) void this.send('show_rig');
  }

  /** Keep the exposure at which the map of an image is shown, unless it is kept already.
   * @param {import("./images/light_images.js").LightImage} image */
  keepExposure(image) {
    this.store.set((ui) => ({
      mapExposures: { ...ui.mapExposures, [image.name]: exposureOf(ui, image) },
    }));
  }

  /** Move a light. The page shows the numbers at once, so that the next one goes with them, and
   * until the session has answered, whatever else comes from there.
   * @param {number} light @param {Record<string, any>} change of its pose */
  moveLamp(light, change) {
    const { rig } = this.store.value;
    if (rig) {
      // The target of a light that is infinitely far away is the direction of its light.
      const isFar = !rig.lights[light].position && change.target;
      const shown = isFar ? { direction: change.target } : change;
      this.pendingPlaces.set(light, { ...this.pendingPlaces.get(light), ...shown });
      const lights = rig.lights.map((place, k) => (k === light ? { ...place, ...shown } : place));
      this.store.set({ rig: { ...rig, lights } });
    }
    this.lampMoves.queue(light, { kind: 'move', pose: change });
  }

  /** Start or stop the search for places of lights. @param {boolean} [run] */
  placeLights(run = true) {
    const { rig, lights, areLampsMarked } = this.store.value;
    if (!run) return this.send('place', { run });
    if (!areLampsMarked) this.toggleLamps();
    this.awaitsGhosts = !rig;
    this.store.set({ placementProgress: NO_STEPS, ghosts: rig ? movablePlaces(rig, lights) : {} });
    return this.send('place', { run });
  }

  /** End the search for places with the best so far. */
  endPlacing() {
    this.store.set({ isPlacementEnding: true });
    return this.send('place', { run: false, keeps_best: true });
  }

  /** Add a light, and choose it. @param {Requests["add_light"]} fields */
  async addLight(fields) {
    this.store.set({ clickAction: null });
    const reply = await this.send('add_light', fields);
    if (reply?.kind !== 'state') return;
    const lamp = this.store.value.lights.length - 1;
    this.store.set(({ openLights }) => ({
      areLampsMarked: true,
      lamp,
      openLights: [...openLights, lamp],
    }));
  }

  /** @param {string} name of a light that was added */
  removeLight(name) {
    return this.send('remove_light', { name });
  }

  /** Search for places of new lights. @param {Ui["newLight"]} newLight */
  findLights({ type, surface, count }) {
    const { areLampsMarked } = this.store.value;
    if (!areLampsMarked) this.toggleLamps();
    this.store.set({ placementProgress: NO_STEPS, ghosts: {} });
    const surfaces = surface === 'anywhere' ? [] : [surface];
    return this.send('place', { run: true, new_type: type, max_count: count, surfaces });
  }

  /** Restore a light's place from the scene. @param {number} light */
  resetPlace(light) {
    this.lampMoves.queue(light, { kind: 'move', pose: {} });
  }

  /** Request the reasons why the current view is not closer. */
  explain() {
    this.store.set({ isExplaining: true });
    return this.send('explain', { view: this.store.value.view });
  }

  verify(run = true) {
    this.store.set({
      verificationProgress: run ? { task: 'verify', done: 0, total: 0, unit: '' } : null,
    });
    return this.send('verify', { run, view: this.store.value.view });
  }
}

/** @param {Constraints} constraints @returns {Constraints} */
function withoutLevel({ lock, off, ...otherConstraints }) {
  return otherConstraints;
}
