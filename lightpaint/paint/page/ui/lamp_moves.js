/**
 * Sends moves of lights: two at a time, and the newest place of each light next, so that a drag never
 * queues. While the page draws the answer to one, the session computes that to the other.
 */

/** @import { SessionController } from './session_controller.js' */
/** @import { Engine } from './ui_state.js' */

/** Milliseconds between answers above which pictures become coarser: ten answers a second. */
const MAX_PERIOD_MS = 100;

/** Answers whose periods are averaged. */
const AVERAGED_COUNT = 3;

/** Largest step between the pixels of a draft, of which a picture of the room is still made out. */
const MAX_STEP = 3;

/** A longer pause is the hand's. */
const MAX_PAUSE_MS = 1000;

export class DraftPace {
  /** Step between the pixels and rows of a draft. */
  step = 1;

  /** Times of the last answers at this step, in milliseconds. @type {number[]} */
  times = [];

  /** Return the step of the next draft. @param {number} minStep that the page can draw in time */
  nextStep(minStep) {
    this.step = Math.max(this.step, minStep);
    return this.step;
  }

  /** Note an answer to a draft. @param {number} time in milliseconds */
  noteAnswer(time) {
    const last = this.times.at(-1) ?? time;
    if (time - last > MAX_PAUSE_MS) this.times = [];
    this.times.push(time);
    if (this.times.length <= AVERAGED_COUNT) return;
    const period = (time - this.times[this.times.length - 1 - AVERAGED_COUNT]) / AVERAGED_COUNT;
    if (period <= MAX_PERIOD_MS || this.step >= MAX_STEP) return;
    this.step += 1;
    this.times = [];
  }
}

/** @typedef {Record<string, any>} Pose */
/** A requested pose of a light, or a place to aim it by; or the end of its drag, which puts it back.
 * @typedef {{kind: "move", pose: Pose} | {kind: "cancel"} | {kind: "point", mode: "aim" | "highlight" | "shadow",
 *   pixel: [number, number], edge?: [number, number], view: number}} LampRequest */

/** step: between the pixels of the light's picture.
 * @typedef {{light: number, request: LampRequest, isFinal: boolean, step: number}} Move */

/** Moves without an answer yet, at most. */
const MAX_PENDING = 2;

export class LampMoves {
  /** @param {SessionController} session */
  constructor(session) {
    this.session = session;
    /** By light. @type {Map<number, Move>} */
    this.nextMoves = new Map();
    this.pendingCount = 0;
    this.pace = new DraftPace();
    /** Answers to moves so far. */
    this.answerCount = 0;
  }

  /** Move a light. Numbers that are typed while others still wait go along with them.
   * @param {number} light @param {LampRequest} request */
  queue(light, request) {
    const isChange = request.kind === 'move' && Object.keys(request.pose).length > 0;
    if (!isChange) this.session.pendingPlaces.delete(light);
    const whole = this.withEarlier(light, request);
    this.nextMoves.set(light, { light, request: whole, isFinal: true, step: 1 });
    this.sendNext();
  }

  /** Return a request together with the numbers that wait to be sent. @param {number} light
   * @param {LampRequest} request @returns {LampRequest} */
  withEarlier(light, request) {
    const earlier = this.nextMoves.get(light);
    if (!earlier?.isFinal || earlier.request.kind !== 'move') return request;
    if (request.kind !== 'move' || !Object.keys(request.pose).length) return request;
    return { kind: 'move', pose: { ...earlier.request.pose, ...request.pose } };
  }

  /** Put a light back that is dragged. @param {number} light */
  cancel(light) {
    this.queue(light, { kind: 'cancel' });
  }

  /** Move a light while it is dragged: its pictures are drafts until it rests.
   * @param {number} light @param {LampRequest} request
   * @param {Engine} engine */
  drag(light, request, engine) {
    const step = this.pace.nextStep(engine.minDraftStep);
    engine.dragLight(step);
    this.nextMoves.set(light, { light, request, isFinal: false, step });
    this.sendNext();
  }

  sendNext() {
    const [move] = this.nextMoves.values();
    if (!move || this.pendingCount >= MAX_PENDING) return;
    this.nextMoves.delete(move.light);
    this.pendingCount += 1;
    void this.send(move).then(() => {
      this.pendingCount -= 1;
      this.answerCount += 1;
      if (!move.isFinal) this.pace.noteAnswer(performance.now());
      this.sendNext();
      if (!this.pendingCount) this.session.pendingPlaces.clear();
    });
  }

  /** @param {Move} move */
  async send({ light, request, isFinal, step }) {
    const { value } = this.session.store;
    const { kind, ...fields } = request;
    const reply =
      kind !== 'point'
        ? await this.session.send('move', {
            poses: kind === 'move' ? { [value.lights[light].name]: request.pose } : {},
            is_final: isFinal,
            view: value.view,
            step,
          })
        : await this.session.send(
            'point',
            /** @type {any} */ ({ light, ...fields, is_final: isFinal, step }),
          );
    if (reply?.kind !== 'failed') return;
    this.session.revert();
    void this.session.send('show_rig');
  }
}
