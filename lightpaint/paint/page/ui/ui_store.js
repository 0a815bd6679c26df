/** A store for the interface state, which notifies listeners of changes. */

/**
 * @template {object} T
 */
export class Store {
  /** @param {T} value */
  constructor(value) {
    this.value = value;
    /** @type {Set<() => void>} */
    this.listeners = new Set();
    this.isScheduled = false;
  }

  /**
   * Change part of the state. `value` changes at once; listeners are notified once, before the next
   * frame.
   * @param {Partial<T> | ((value: T) => Partial<T>)} changes
   */
  set(changes) {
    const newValues = typeof changes === 'function' ? changes(this.value) : changes;
    this.value = { ...this.value, ...newValues };
    if (!this.isScheduled) {
      this.isScheduled = true;
      queueMicrotask(() => {
        this.isScheduled = false;
        for (const listener of this.listeners) listener();
      });
    }
  }

  /**
   * @param {() => void} listener
   * @returns {() => void} what ends it
   */
  listen(listener) {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
}
