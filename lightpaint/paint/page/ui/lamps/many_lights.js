/** Changes of several lights at once: each is one step of undo, and one solve. */

import { gelOn } from '../../../../viewer/gels/gel_list.js';
import { gelName } from '../../../../viewer/gels/gels.js';
import { luminance } from '../../../../viewer/drawing/colour.js';
import { lightCountText, signedText } from '../format.js';
import { findTie, lockedLights, lockingLight } from '../tied_lights.js';
import { atLevelOf, ownWhite, scaled, warmed, withGel } from './lamp_colours.js';
import { lightsText } from './light_selection.js';
import { t } from '../../language/language.js';

/** @import { Constraints, RGB, Ui } from '../ui_state.js' */
/** @import { SessionController } from '../session_controller.js' */
/** @import { Gel } from '../../../../viewer/gels/gels.js' */

/** @typedef {{lights: Map<number, RGB>, label: string, isFinal: boolean}} Change */

export class ManyLights {
  /** @param {SessionController} session */
  constructor(session) {
    this.session = session;
    /** The answer when a slider began to move; sliders change it, and not their own last value.
     * @type {RGB[] | null} */
    this.startWeights = null;
    /** @type {Change | null} */
    this.nextChange = null;
    /** Whether the session has yet to drop the changes of a drag. */
    this.isCancelled = false;
    /** @type {Promise<void> | null} */
    this.inProgress = null;
  }

  get store() {
    return this.session.store;
  }

  /** Dim lights by a factor, which keeps their ratio. @param {number[]} lights
   * @param {number} factor @param {boolean} isFinal false while a slider moves */
  dim(lights, factor, isFinal) {
    const stops =
      factor > 0 ? t('{signed} st', { signed: signedText(Math.log2(factor)) }) : t('off');
    return this.move(lights, (rgb) => scaled(rgb, factor), stops, isFinal, true);
  }

  /** Make lights warmer by some mireds. @param {number[]} lights @param {number} mired
   * @param {boolean} isFinal */
  warm(lights, mired, isFinal) {
    const text = t('{signed} mired', { signed: signedText(mired, 0) });
    return this.move(lights, (rgb) => warmed(rgb, mired), text, isFinal);
  }

  /** Give lights a colour, each at its own level. @param {number[]} lights @param {RGB} colour
   * @param {boolean} isFinal */
  colour(lights, colour, isFinal) {
    return this.move(lights, (rgb) => atLevelOf(colour, rgb), t('colour'), isFinal);
  }

  /** Put a filter on lights, instead of the one that is there; null takes it off.
   * @param {number[]} lights @param {Gel | null} gel */
  gel(lights, gel) {
    const { lights: all, gelCodes } = this.store.value;
    const isDone = this.move(
      lights,
      (rgb, k) => {
        const present = gelOn(rgb, ownWhite(all[k]), gelCodes[all[k].name]);
        return withGel(rgb, all[k], gel, present);
      },
      gel ? gelName(gel) : t('no filter'),
      true,
    );
    const codes = lights.map((k) => [all[k].name, gel?.code ?? '']);
    if (isDone) this.store.set({ gelCodes: { ...gelCodes, ...Object.fromEntries(codes) } });
  }

  /** Set lights by hand and lock them there; the others are solved around them.
   * @param {number[]} lights @param {(rgb: RGB, light: number) => RGB} change
   * @param {string} label what it does to them @param {boolean} isFinal
   * @param {boolean} [isLevel] whether it changes their levels alone, which tied lights share
   * @returns {boolean} whether there was something to do */
  move(lights, change, label, isFinal, isLevel = false) {
    const ui = this.store.value;
    const weights = (this.startWeights ??= ui.weights);
    if (isFinal) this.startWeights = null;
    const candidates = isLevel ? adjustableLights(ui, lights) : colouredLights(ui, lights);
    const lit = candidates.filter((k) => luminance(weights[k]) > 0);
    if (!lit.length) {
      if (isFinal) this.session.toast(refusalText(candidates, isLevel));
      return false;
    }
    /** @type {Map<number, RGB>} */
    const changed = new Map();
    const moves = new Map(this.session.groupMoves);
    for (const k of leaders(ui, lit)) {
      const rgb = change(weights[k], k);
      changed.set(k, rgb);
      moves.set(k, rgb);
      const factor = luminance(rgb) / luminance(weights[k]);
      for (const name of findTie(ui, k) ?? []) {
        const other = ui.lights.findIndex((light) => light.name === name);
        if (other !== k) moves.set(other, scaled(weights[other], factor));
      }
    }
    this.queue({ lights: changed, label: `${lightsText(ui, lit)}, ${label}`, isFinal }, moves);
    return true;
  }

  /** @param {Change} change @param {Map<number, RGB>} moves */
  queue(change, moves) {
    const { session, store } = this;
    for (const k of change.lights.keys()) session.noteUnlocked(k);
    session.groupMoves = moves;
    this.nextChange = change;
    store.set(({ weights }) => ({ weights: weights.map((rgb, k) => moves.get(k) ?? rgb) }));
    this.inProgress ??= this.send();
  }

  /** Cancel the changes of a drag, none of which was final. @param {RGB[]} weights the answer before */
  cancel(weights) {
    const { session, store } = this;
    this.nextChange = null;
    this.isCancelled = true;
    session.groupMoves = new Map();
    session.revert();
    store.set({ weights });
    this.inProgress ??= this.send();
  }

  /** Send the newest change until there is none left. */
  async send() {
    while (this.isCancelled || this.nextChange) {
      if (this.isCancelled || !this.nextChange) {
        this.isCancelled = false;
        await this.session.send('drop_stroke', {});
        continue;
      }
      const { lights, label, isFinal } = this.nextChange;
      this.nextChange = null;
      const ui = this.store.value;
      const entries = [...lights].map(([k, rgb]) => [
        ui.lights[k].name,
        { lock: ui.lights[k].is_scalar ? rgb[0] : rgb },
      ]);
      const reply = await this.constrain(Object.fromEntries(entries), label, isFinal);
      if (this.nextChange) continue;
      if (!isFinal && reply?.kind !== 'failed') continue;
      this.session.groupMoves = new Map();
      if (reply?.kind === 'failed') this.session.revert();
    }
    this.inProgress = null;
  }

  /** Set the constraints on lights, by name. @param {Record<string, Constraints>} constraints
   * @param {string} label @param {boolean} [isFinal]
   * @param {Record<string, Constraints>} [earlier] constraints of held lights, for when they are released */
  async constrain(constraints, label, isFinal = true, earlier = {}) {
    const { session, store } = this;
    const pending = store.value.lights.flatMap(({ name }, k) =>
      constraints[name] ? [/** @type {const} */ ([k, constraints[name]])] : [],
    );
    store.set((ui) => ({ constraints: { ...ui.constraints, ...constraints } }));
    for (const [k, entry] of pending) session.pendingConstraints.set(k, entry);
    const reply = await session.send('constrain_lights', {
      constraints,
      label,
      is_final: isFinal,
      ...(Object.keys(earlier).length ? { earlier } : {}),
    });
    for (const [k, entry] of pending)
      if (session.pendingConstraints.get(k) === entry) session.pendingConstraints.delete(k);
    if (reply?.kind === 'failed') session.revert();
    session.forgetUnlocked(store.value.constraints);
    return reply;
  }

  /** Lock lights as they are in the answer. @param {number[]} lights */
  lock(lights) {
    const ui = this.store.value;
    const open = leaders(ui, adjustableLights(ui, lights)).filter((k) => !isHeld(ui, k));
    if (!open.length) return;
    this.queue(
      {
        lights: new Map(open.map((k) => [k, ui.weights[k]])),
        label: t('lock {lights}', { lights: lightsText(ui, open) }),
        isFinal: true,
      },
      this.session.groupMoves,
    );
  }

  /** Unlock lights, and switch them on again. @param {number[]} lights */
  unlock(lights) {
    const ui = this.store.value;
    const held = leaders(ui, adjustableLights(ui, lights)).filter((k) => isHeld(ui, k));
    return this.session.unlockLights(held, t('unlock {lights}', { lights: lightsText(ui, held) }));
  }

  /** Switch lights off. @param {number[]} lights */
  switchOff(lights) {
    const ui = this.store.value;
    const lit = leaders(ui, adjustableLights(ui, lights));
    for (const k of lit) this.session.noteUnlocked(k);
    const entries = lit.map((k) => [ui.lights[k].name, { off: true }]);
    return this.constrain(
      Object.fromEntries(entries),
      t('{lights} off', { lights: lightsText(ui, lit) }),
    );
  }
}

/** Return the ones of some lights that can be set. @param {Ui} ui @param {number[]} lights */
export const adjustableLights = (ui, lights) => lights.filter((k) => !ui.lights[k].is_fixed);

/** Return those whose colour can be set: tied lights keep theirs. @param {Ui} ui
 * @param {number[]} lights */
export const colouredLights = (ui, lights) =>
  adjustableLights(ui, lights).filter((k) => !ui.lights[k].is_scalar && !findTie(ui, k));

/** Return whether a light is locked or off. @param {Ui} ui @param {number} k */
export const isHeld = (ui, k) => lockedLights(ui).includes(lockingLight(ui, k));

/** Return one light of each dimmer: the one whose lock holds it, if there is one. @param {Ui} ui
 * @param {number[]} lights */
function leaders(ui, lights) {
  /** @type {number[]} */
  const chosen = [];
  for (const k of lights) {
    const tie = findTie(ui, k);
    const isTaken = chosen.some((other) => tie?.includes(ui.lights[other].name));
    if (!isTaken) chosen.push(lockingLight(ui, k));
  }
  return chosen;
}

/** @param {number[]} candidates @param {boolean} isLevel */
function refusalText(candidates, isLevel) {
  if (candidates.length)
    return t('{count} off: switch on first.', { count: lightCountText(candidates.length) });
  return isLevel
    ? t('These lights stay as they are in the scene.')
    : t('Tied lights, and lights with one number for all channels, keep their colours.');
}
