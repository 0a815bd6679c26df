/**
 * Fetches the pictures of the session, again whenever one is replaced.
 *
 * Planes are clean ones where there are any and they are wanted, else raw ones. A few are on
 * their way at a time, and what is there is not fetched again.
 */

/** @typedef {import("./message_frames.js").Picture} Picture */

/** Pictures on their way at a time. */
const MAX_FETCHES = 4;

/** Milliseconds before what could not be fetched is tried again. */
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
    /** Name of the picture that each slot is to have. @type {Map<string, string>} */
    this.wanted = new Map();
    /** What each slot has: name and generation. @type {Map<string, string>} */
    this.there = new Map();
    /** @type {Set<string>} */
    this.onTheWay = new Set();
    this.total = 0;
    /** Whether nothing is asked for: another page has the session. */
    this.isHeld = false;
    this.isOver = false;
  }

  /** Which pictures there are, by name. @param {Record<string, number>} resources */
  know(resources) {
    this.resources = { ...this.resources, ...resources };
    this.pump();
  }

  /** Which pictures there are, and no others. @param {Record<string, number>} resources */
  begin(resources) {
    this.isHeld = false;
    this.resources = {};
    this.know(resources);
  }

  /** Ask for nothing until the session says again what there is. */
  hold() {
    this.isHeld = true;
  }

  /** Have pictures in slots, and their newer ones. Nothing is fetched before all are named, as it
   * would be what a slot had to have before.
   * @param {[slot: string, name: string | null][]} named null for none any more */
  want(named) {
    for (const [slot, name] of named)
      if (name === null) this.wanted.delete(slot);
      else this.wanted.set(slot, name);
    this.pump();
  }

  /** A picture is another one. @param {string} name */
  renew(name) {
    this.know({ [name]: (this.resources[name] ?? 0) + 0.5 });
  }

  /** All is to be set again, when it is wanted next: the view has lost it.
   * @param {(slot: string) => boolean} [which] */
  forget(which = () => true) {
    for (const slot of [...this.there.keys()]) if (which(slot)) this.there.delete(slot);
  }

  /** Slots that do not have what they are to have. */
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
      // What was refused since another page has the session comes when this one has it again.
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
