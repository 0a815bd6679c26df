/**
 * Fetches the pictures of the session, again whenever one is replaced.
 *
 * It prefers denoised planes if they exist and are wanted, else it takes raw ones. It fetches a few
 * at a time, and none twice.
 */

/** @import { Picture } from '../../../viewer/drawing/lattice.js' */

/** Concurrent fetches. */
const MAX_FETCHES = 4;

/** Milliseconds before a failed fetch is retried. */
const RETRY_MS = 2000;

export class PictureLoader {
  /** @param {import("./socket_host.js").Host} host
   * @param {(slot: string, name: string, picture: Picture, isLive?: boolean) => void} use a picture
   *   for its slot; isLive: an answer follows at once
   * @param {(done: number, total: number, isFirst: boolean) => void} onProgress isFirst: some light has no
   *   picture yet */
  constructor(host, use, onProgress) {
    this.host = host;
    this.use = use;
    this.onProgress = onProgress;
    /** @type {Record<string, number>} */
    this.resources = {};
    /** Name of the picture wanted in each slot. @type {Map<string, string>} */
    this.wantedNames = new Map();
    /** Name and generation of the picture in each slot. @type {Map<string, string>} */
    this.loadedVersions = new Map();
    /** @type {Set<string>} */
    this.activeFetches = new Set();
    this.total = 0;
    /** The progress that was reported last. */
    this.reported = '';
    /** Whether fetching is paused, since another page has the session. */
    this.isPaused = false;
    this.isOver = false;
  }

  /** Existing pictures by name. @param {Record<string, number>} resources */
  addResources(resources) {
    this.resources = { ...this.resources, ...resources };
    this.pump();
  }

  /** Note that the newest picture of a slot came unasked, so that it is not fetched. Returns its name,
   * or null if another picture is wanted. @param {string} slot
   * @param {Record<string, number>} resources its names @returns {string | null} */
  notePicture(slot, resources) {
    const name = this.wantedNames.get(slot);
    const isWanted = name !== undefined && name in resources;
    this.resources = { ...this.resources, ...resources };
    if (isWanted) this.loadedVersions.set(slot, this.versionOf(name));
    this.pump();
    return isWanted ? name : null;
  }

  /** Replace the list of existing pictures. @param {Record<string, number>} resources */
  begin(resources) {
    this.isPaused = false;
    this.resources = {};
    this.addResources(resources);
  }

  /** Pause until the session lists its pictures again. */
  pause() {
    this.isPaused = true;
  }

  /** Set the wanted pictures of slots, and keep them up to date. Fetching begins once all are
   * named, since it could otherwise fetch a slot's earlier picture.
   * @param {[slot: string, name: string | null][]} names null for none any more */
  setWanted(names) {
    for (const [slot, name] of names)
      if (name === null) this.wantedNames.delete(slot);
      else this.wantedNames.set(slot, name);
    this.pump();
  }

  /** Note that a picture has changed. @param {string} name */
  renew(name) {
    this.addResources({ [name]: (this.resources[name] ?? 0) + 0.5 });
  }

  /** Forget the pictures in slots, which the view has lost.
   * @param {(slot: string) => boolean} [isLost] */
  forget(isLost = () => true) {
    for (const slot of [...this.loadedVersions.keys()])
      if (isLost(slot)) this.loadedVersions.delete(slot);
  }

  /** Return the slots without their wanted picture. */
  missingSlots() {
    return [...this.wantedNames].filter(
      ([slot, name]) =>
        name in this.resources && this.loadedVersions.get(slot) !== this.versionOf(name),
    );
  }

  /** @param {string} name */
  versionOf(name) {
    return `${this.resources[name]} ${name}`;
  }

  pump() {
    if (this.isOver || this.isPaused) return;
    const slots = this.missingSlots();
    this.total = slots.length ? Math.max(this.total, slots.length) : 0;
    const isFirst = slots.some(
      ([slot]) => slot.startsWith('plane ') && !this.loadedVersions.has(slot),
    );
    this.report(this.total - slots.length, isFirst);
    for (const [slot, name] of slots) {
      if (this.activeFetches.size >= MAX_FETCHES) return;
      if (!this.activeFetches.has(slot)) this.load(slot, name);
    }
  }

  /** Report progress that differs from the last. @param {number} done @param {boolean} isFirst */
  report(done, isFirst) {
    const progress = `${done} ${this.total} ${isFirst}`;
    if (progress === this.reported) return;
    this.reported = progress;
    this.onProgress(done, this.total, isFirst);
  }

  /** @param {string} slot @param {string} name */
  async load(slot, name) {
    this.activeFetches.add(slot);
    const versionOf = this.versionOf(name);
    let delay = 0;
    try {
      const picture = await this.host.fetch(name);
      if (this.wantedNames.get(slot) === name && !this.isOver) {
        this.loadedVersions.set(slot, versionOf);
        this.use(slot, name, picture);
      }
    } catch (error) {
      // If it was refused since another page has the session, it comes when this page has it again.
      if (!this.isPaused) {
        delay = RETRY_MS;
        console.warn(error);
      }
    }
    if (delay) await new Promise((resolve) => setTimeout(resolve, delay));
    this.activeFetches.delete(slot);
    this.pump();
  }

  close() {
    this.isOver = true;
  }
}
