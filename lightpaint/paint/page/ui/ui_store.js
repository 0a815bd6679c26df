/** A store for the interface state, which notifies listeners of changes. */

/** Milliseconds until listeners are notified of a change that need not be shown at once. */
const MAX_DELAY_MS = 100;

/** Return a list with an entry or, where it has it, without. @template T @param {readonly T[]} list
 * @param {T} entry @returns {T[]} */
export const toggled = (list, entry) =>
  list.includes(entry) ? list.filter((other) => other !== entry) : [...list, entry];

/** @template {object} T */
export class Store {
  /** @param {T} value */
  constructor(value) {
    this.value = value;
    /** @type {Set<() => void>} */
    this.listeners = new Set();
    /** Whether listeners wait to be notified. */
    this.isPending = false;
    this.isScheduled = false;
    this.isFrameRequested = false;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
  }

  /** Change part of the state. `value` changes at once; listeners are notified once, before the next
   * frame.
   * @param {Partial<T> | ((value: T) => Partial<T>)} changes */
  set(changes) {
    this.change(changes);
    if (this.isScheduled) return;
    this.isScheduled = true;
    queueMicrotask(() => {
      this.isScheduled = false;
      this.flush();
    });
  }

  /** Change part of the state, and notify listeners together with what else changes until the next
   * frame. @param {Partial<T>} changes */
  setForFrame(changes) {
    this.change(changes);
    if (this.isFrameRequested) return;
    this.isFrameRequested = true;
    requestAnimationFrame(() => this.flushFrame());
  }

  /** Notify listeners of changes that wait for the frame. */
  flushFrame() {
    if (!this.isFrameRequested) return;
    this.isFrameRequested = false;
    this.flush();
  }

  /** Change part of the state, and notify listeners with the next change, or soon.
   * @param {Partial<T>} changes */
  setWithNext(changes) {
    this.change(changes);
    this.timer ??= setTimeout(() => this.flush(), MAX_DELAY_MS);
  }

  /** @param {Partial<T> | ((value: T) => Partial<T>)} changes */
  change(changes) {
    const newValues = typeof changes === 'function' ? changes(this.value) : changes;
    this.value = { ...this.value, ...newValues };
    this.isPending = true;
  }

  /** Notify listeners of changes that wait. */
  flush() {
    if (!this.isPending) return;
    this.isPending = false;
    clearTimeout(this.timer);
    this.timer = undefined;
    for (const listener of this.listeners) listener();
  }

  /** @param {() => void} listener
   * @returns {() => void} what ends it */
  listen(listener) {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
}
