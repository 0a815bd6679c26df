/**
 * Fetches the pictures of the session, again whenever one is replaced.
 *
 * It prefers denoised planes if they exist and are wanted, else it takes raw ones. It fetches a few
 * at a time, and none twice.
 */

/** @typedef {import("./message_frames.js").Picture} Picture */

/** Concurrent fetches. */
const MAX_FETCHES = 4;

/** Milliseconds before a failed fetch is retried. */
const RETRY_MS = 2000;

export class PictureLoader {
  /** @param {import("./socket_host.js").Host} host
   * @param {(slot: string, name: string, picture: Picture) => void} use a picture for its slot
   * @param {(done: number, total: number, isFirst: boolean) => void} onProgress isFirst: some light has no
   *   picture yet */
  constructor(host, use, onProgress) {
    this.host = host;
    this.use = use;
    this.onProgress = onProgress;
    /** @type {Record<string, number>} */
    this.resources = {};
    /** Name of the picture wanted in each slot. @type {Map<string, string>} */
    this.wanted = new Map();
    /** Name and generation of the picture in each slot. @type {Map<string, string>} */
    this.there = new Map();
    /** @type {Set<string>} */
    this.onTheWay = new Set();
    this.total = 0;
    /** Whether fetching is paused, since another page has the session. */
    this.isHeld = false;
    this.isOver = false;
  }

  /** Existing pictures by name. @param {Record<string, number>} resources */
  know(resources) {
    this.resources = { ...this.resources, ...resources };
    this.pump();
  }

  /** Replace the list of existing pictures. @param {Record<string, number>} resources */
  begin(resources) {
    this.isHeld = false;
    this.resources = {};
    this.know(resources);
  }

  /** Pause until the session lists its pictures again. */
  hold() {
    this.isHeld = true;
  }

  /** Set the wanted pictures of slots, and keep them up to date. Fetching begins once all are
   * named, since it could otherwise fetch a slot's earlier picture.
   * @param {[slot: string, name: string | null][]} names null for none any more */
  want(names) {
    for (const [slot, name] of names)
      if (name === null) this.wanted.delete(slot);
      else this.wanted.set(slot, name);
    this.pump();
  }

  /** Note that a picture has changed. @param {string} name */
  renew(name) {
    this.know({ [name]: (this.resources[name] ?? 0) + 0.5 });
  }

  /** Forget the pictures in slots, which the view has lost.
   * @param {(slot: string) => boolean} [isLost] */
  forget(isLost = () => true) {
    for (const slot of [...this.there.keys()]) if (isLost(slot)) this.there.delete(slot);
  }

  /** Return the slots without their wanted picture. */
  missing() {
    return [...this.wanted].filter(
      ([slot, name]) => name in this.resources && this.there.get(slot) !== this.version(name),
    );
  }

  /** @param {string} name */
  version(name) {
    return `${this.resources[name]} ${name}`;
  }

  pump() {
    if (this.isOver || this.isHeld) return;
    const missing = this.missing();
    this.total = missing.length ? Math.max(this.total, missing.length) : 0;
    const isFirst = missing.some(([slot]) => slot.startsWith('plane ') && !this.there.has(slot));
    this.onProgress(this.total - missing.length, this.total, isFirst);
    for (const [slot, name] of missing) {
      if (this.onTheWay.size >= MAX_FETCHES) return;
      if (!this.onTheWay.has(slot)) this.load(slot, name);
    }
  }

  /** @param {string} slot @param {string} name */
  async load(slot, name) {
    this.onTheWay.add(slot);
    const version = this.version(name);
    let wait = 0;
    try {
      const picture = await this.host.fetch(name);
      if (this.wanted.get(slot) === name && !this.isOver) {
        this.there.set(slot, version);
        this.use(slot, name, picture);
      }
    } catch (error) {
      // If it was refused since another page has the session, it comes when this page has it again.
      if (!this.isHeld) {
        wait = RETRY_MS;
        console.warn(error);
      }
    }
    if (wait) await new Promise((resolve) => setTimeout(resolve, wait));
    this.onTheWay.delete(slot);
    this.pump();
  }

  close() {
    this.isOver = true;
  }
}
