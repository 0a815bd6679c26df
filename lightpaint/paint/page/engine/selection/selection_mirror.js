/**
 * The page's copy of what is selected in the current view: changed at once by what a person does,
 * and fetched where the session has another selection, after undo or when the page opens.
 */
import { boundsOf, cropped } from './mask_operations.js';

/** @import { Region } from '../../../../viewer/drawing/view.js' */
/** @import { SelectionInfo } from '../messages.js' */
/** @import { Size } from './polygon_mask.js' */
/** What strokes keep to. mask: (h, w), the share of each pixel in 255ths. bounds: of what is above 0.
 * @typedef {{mask: Uint8Array, bounds: Region}} Selection */

export class SelectionMirror {
  /** @param {import("../socket_host.js").Host} host @param {() => void} onChange
   * @param {(text: string) => void} onError */
  constructor(host, onChange, onError) {
    this.host = host;
    this.onChange = onChange;
    this.onError = onError;
    /** @type {Selection | null} */
    this.current = null;
    /** @type {Size} */
    this.size = [1, 1];
    /** Index of the current view. */
    this.view = 0;
    /** The last selection that the session has sent. @type {SelectionInfo | null} */
    this.known = null;
    /** Revision of the session's selection that the page has. @type {number | null} */
    this.revision = null;
    /** How often it has changed here. */
    this.changes = 0;
    /** Number of own selections without an answer yet. */
    this.pendingCount = 0;
    host.on('state', ({ selection }) => {
      this.revision = null;
      this.remember(selection);
    });
    host.on('answer', ({ selection }) => this.remember(selection));
    host.on('patch', ({ selection }) => this.remember(selection));
    host.on('selected', ({ selection }) => this.remember(selection));
  }

  /** Begin with a view, whose selection is not known yet. @param {Size} size @param {number} view */
  open(size, view) {
    this.size = size;
    this.view = view;
    this.set(null);
    this.revision = null;
    this.adopt();
  }

  /** @param {SelectionInfo | undefined} selection of a message */
  remember(selection) {
    if (!selection) return;
    this.known = selection;
    this.adopt();
  }

  /** Fetch the session's selection where the page has another one. */
  adopt() {
    const { known, view } = this;
    if (!known || this.pendingCount || this.revision === known.revision) return;
    this.revision = known.revision;
    const region = known.regions[view] ?? [0, 0, 0, 0];
    if (region[0] >= region[1] || region[2] >= region[3]) this.set(null);
    else void this.fetch(region, known);
  }

  /** @param {Region} region @param {SelectionInfo} known */
  async fetch(region, known) {
    const { view, size } = this;
    try {
      const { data } = await this.host.fetch(`selection/${view}`);
      // A newer one is on its way, or here already.
      const isCurrent = known.revision === this.known?.revision && view === this.view;
      if (!isCurrent || this.pendingCount) return;
      const [top, bottom, left, right] = region;
      if (data.length !== (bottom - top) * (right - left)) return;
      const mask = new Uint8Array(size[0] * size[1]);
      for (let y = top, from = 0; y < bottom; y++, from += right - left)
        mask.set(data.subarray(from, from + right - left), y * size[1] + left);
      this.set(mask);
    } catch (error) {
      this.revision = null;
      this.onError(error instanceof Error ? error.message : String(error));
    }
  }

  /** @param {Uint8Array | null} mask */
  set(mask) {
    const bounds = mask && boundsOf(mask, this.size);
    this.current = mask && bounds ? { mask, bounds } : null;
    this.changes += 1;
    this.onChange();
  }

  /** Select at once, and in the session. @param {Uint8Array | null} mask @param {string} label
   * @param {import("../stroke_sender.js").StrokeSender} strokes */
  change(mask, label, strokes) {
    this.set(mask);
    const region = this.current?.bounds ?? /** @type {Region} */ ([0, 0, 0, 0]);
    const data = mask ? cropped(mask, this.size, region) : new Uint8Array(0);
    const shape = [region[1] - region[0], region[3] - region[2]];
    this.pendingCount += 1;
    strokes.select({ region, label, view: this.view }, { mask: { data, shape } }, (isTaken) => {
      this.pendingCount -= 1;
      this.revision = isTaken && !this.pendingCount ? (this.known?.revision ?? null) : null;
      if (!isTaken) this.adopt();
    });
  }
}
