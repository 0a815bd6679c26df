/** Sends moves of lights: one at a time, and the newest place next, so that a drag never queues. */

/** @typedef {import("./session_controller.js").SessionController} SessionController */
/** @typedef {Record<string, any>} Pose */
/** A requested pose of a light, or a place to aim it by.
 * @typedef {{kind: "move", pose: Pose} | {kind: "point", mode: "aim" | "highlight" | "shadow",
 *   pixel: [number, number], edge?: [number, number], view: number}} LampRequest */

export class LampMoves {
  /** @param {SessionController} session */
  constructor(session) {
    this.session = session;
    /** @type {{light: number, request: LampRequest, isFinal: boolean} | null} */
    this.nextMove = null;
    this.isSending = false;
    /** Answers to moves so far. */
    this.answerCount = 0;
  }

  /** @param {number} light @param {LampRequest} request @param {boolean} [isFinal] false while it is dragged */
  queue(light, request, isFinal = true) {
    this.nextMove = { light, request, isFinal };
    if (!this.isSending) void this.send();
  }

  async send() {
    this.isSending = true;
    while (this.nextMove) {
      const { light, request, isFinal } = this.nextMove;
      this.nextMove = null;
      const name = this.session.store.value.lights[light].name;
      const { kind, ...fields } = request;
      const reply =
        kind === 'move'
          ? await this.session.send('move', {
              poses: { [name]: request.pose },
              is_final: isFinal,
              view: this.session.store.value.view,
            })
          : await this.session.send(
              'point',
              /** @type {any} */ ({ light, ...fields, is_final: isFinal }),
            );
      if (reply?.kind === 'failed') this.session.revert();
      this.answerCount += 1;
    }
    this.isSending = false;
  }
}
