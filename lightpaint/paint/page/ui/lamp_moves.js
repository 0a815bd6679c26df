/**
 * Sends moves of lights: two at a time, and the newest place next, so that a drag never queues. While
 * the page draws the answer to one, the session computes that to the other.
 */

/** @typedef {import("./session_controller.js").SessionController} SessionController */
/** @typedef {Record<string, any>} Pose */
/** A requested pose of a light, or a place to aim it by.
 * @typedef {{kind: "move", pose: Pose} | {kind: "point", mode: "aim" | "highlight" | "shadow",
 *   pixel: [number, number], edge?: [number, number], view: number}} LampRequest */

/** @typedef {{light: number, request: LampRequest, isFinal: boolean, step: number}} Move */

/** Moves without an answer yet, at most. */
const MAX_PENDING = 2;

export class LampMoves {
  /** @param {SessionController} session */
  constructor(session) {
    this.session = session;
    /** @type {Move | null} */
    this.nextMove = null;
    this.pendingCount = 0;
    /** Answers to moves so far. */
    this.answerCount = 0;
  }

  /** @param {number} light @param {LampRequest} request @param {boolean} [isFinal] false while it is
   * dragged @param {number} [step] between the pixels of its picture while it is dragged */
  queue(light, request, isFinal = true, step = 1) {
    this.nextMove = { light, request, isFinal, step };
    this.sendNext();
  }

  sendNext() {
    if (!this.nextMove || this.pendingCount >= MAX_PENDING) return;
    const move = this.nextMove;
    this.nextMove = null;
    this.pendingCount += 1;
    void this.send(move).then(() => {
      this.pendingCount -= 1;
      this.answerCount += 1;
      this.sendNext();
    });
  }

  /** @param {Move} move */
  async send({ light, request, isFinal, step }) {
    const { value } = this.session.store;
    const { kind, ...fields } = request;
    const reply =
      kind === 'move'
        ? await this.session.send('move', {
            poses: { [value.lights[light].name]: request.pose },
            is_final: isFinal,
            view: value.view,
            step,
          })
        : await this.session.send(
            'point',
            /** @type {any} */ ({ light, ...fields, is_final: isFinal, step }),
          );
    if (reply?.kind === 'failed') this.session.revert();
  }
}
