/** Sends moves of lights: one at a time, and the newest place next, so that a drag never queues. */

/** @typedef {import("./session_controller.js").SessionController} SessionController */
/** @typedef {Record<string, any>} Pose */
/** A requested pose of a light, or a place to aim it by.
 * @typedef {{kind: "move", pose: Pose} | {kind: "point", how: "aim" | "highlight" | "shadow",
 *   at: [number, number], edge?: [number, number], view: number}} Asked */

export class LampMoves {
  /** @param {SessionController} session */
  constructor(session) {
    this.session = session;
    /** @type {{light: number, asked: Asked, done: boolean} | null} */
    this.next = null;
    this.isSending = false;
    /** Answers to moves so far. */
    this.answers = 0;
  }

  /** @param {number} light @param {Asked} asked @param {boolean} [done] false while it is dragged */
  ask(light, asked, done = true) {
    this.next = { light, asked, done };
    if (!this.isSending) void this.send();
  }

  async send() {
    this.isSending = true;
    while (this.next) {
      const { light, asked, done } = this.next;
      this.next = null;
      const name = this.session.store.value.lights[light].name;
      const { kind, ...fields } = asked;
      const reply =
        kind === 'move'
          ? await this.session.send('move', { poses: { [name]: asked.pose }, done })
          : await this.session.send('point', /** @type {any} */ ({ light, ...fields, done }));
      if (reply?.kind === 'failed') this.session.revert();
      this.answers += 1;
    }
    this.isSending = false;
  }
}
