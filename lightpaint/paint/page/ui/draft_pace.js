/**
 * How coarse the pictures of a dragged light are: as fine as the answers keep up with the hand.
 */

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
