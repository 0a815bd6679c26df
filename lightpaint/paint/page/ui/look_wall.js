/** Two to four looks at full size, side by side, with one zoom and one exposure; a click takes one. */

import { t } from '../language/language.js';
import { html, useLayoutEffect, useRef, useState } from '../vendor/preact.js';
import { currentLook, loadLook } from './look_actions.js';
import { comparedLooks, isPending, resetMix } from './look_comparison.js';
import { updateDisplay } from './tools.js';

/** @import { App, Look, Ui } from './ui_state.js' */
/** @typedef {{width: number, height: number}} Size in CSS pixels */
/** @typedef {{x: number, y: number}} Place in the window */

/** Space between pictures, in pixels. */
const GAP = 4;

/** Pixels that a pointer moves before a press pans, and takes no look. */
const MIN_PAN = 4;

/** Show looks side by side. @param {App} app @param {number[]} ids two to four */
export function showWall({ store }, [a, b, ...more]) {
  store.set({ mix: { a, b, share: 1, more }, dialog: null });
  updateDisplay(store, { left: 'solution', right: 'other', zoom: 1, pan: [0, 0] });
}

/** Return the looks that are side by side; none if they are not. @param {Ui} ui @returns {Look[]} */
const wallLooks = (ui) => (ui.mix?.more && comparedLooks(ui, ui.mix)) || [];

/** Return the columns with which pictures are largest. @param {Size} frame @param {number} count
 * @param {[height: number, width: number]} picture */
function bestColumns(frame, count, [height, width]) {
  const scales = Array.from({ length: count }, (_, k) => {
    const pane = paneSize(frame, count, k + 1);
    return Math.min(pane.width / width, pane.height / height);
  });
  return 1 + scales.indexOf(Math.max(...scales));
}

/** @param {Size} frame @param {number} count @param {number} columns @returns {Size} */
function paneSize({ width, height }, count, columns) {
  const rows = Math.ceil(count / columns);
  return {
    width: Math.max(1, Math.floor((width - GAP * (columns - 1)) / columns)),
    height: Math.max(1, Math.floor((height - GAP * (rows - 1)) / rows)),
  };
}

/** @param {{ui: Ui, app: App}} props */
export function LookWall({ ui, app }) {
  const looks = wallLooks(ui);
  return looks.length && ui.ready ? html`<${Wall} ui=${ui} app=${app} looks=${looks} />` : null;
}

/** @param {{ui: Ui, app: App, looks: Look[]}} props */
function Wall({ ui, app, looks }) {
  const { store, engine } = app;
  const frame = useRef(/** @type {HTMLElement | null} */ (null));
  const [size, setSize] = useState(/** @type {Size | null} */ (null));
  useLayoutEffect(() => {
    const element = frame.current;
    if (!element) return undefined;
    const measure = () => setSize({ width: element.clientWidth, height: element.clientHeight });
    measure();
    const observer = new ResizeObserver(measure);
    observer.observe(element);
    element.querySelector('button')?.focus({ preventScroll: true });
    return () => {
      observer.disconnect();
      engine.showLooks([], 1, 1);
    };
  }, []);
  const columns = size ? bestColumns(size, looks.length, ui.state.size) : 1;
  const pane = size && paneSize(size, looks.length, columns);
  useLayoutEffect(() => {
    if (!pane || !frame.current) return;
    engine.showLooks([...frame.current.querySelectorAll('canvas')], pane.width, pane.height);
  }, [pane?.width, pane?.height, looks.length]);
  const isDragged = usePanning(frame, app);
  const take = (/** @type {number} */ id) => {
    if (isDragged()) return;
    store.set(resetMix);
    void loadLook(app, id);
  };
  const press = (/** @type {KeyboardEvent} */ event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1, ArrowDown: columns, ArrowUp: -columns }[event.key];
    const buttons = [...(frame.current?.querySelectorAll('button') ?? [])];
    const next = buttons[buttons.indexOf(/** @type {any} */ (event.target)) + (step ?? 0)];
    if (event.key === 'Escape') store.set(resetMix);
    else if (step) next?.focus();
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  const current = currentLook(ui);
  return html`<div class="look-wall" ref=${frame} role="group"
    aria-label=${t('Looks side by side. Arrow keys go from one to another, Enter takes it, Escape goes back.')}
    style=${{ '--columns': String(columns) }} onKeyDown=${press}>
    ${looks.map(
      (look) => html`<button type="button" key=${look.id} class="look-pane"
      aria-label=${t('Take {name}', { name: look.name })}
      aria-current=${look.id === current ? 'true' : undefined} onClick=${() => take(look.id)}>
      <canvas aria-hidden="true"></canvas><span class="tag" aria-hidden="true">${
        isPending(ui, look) ? t('{name}: moving its lights …', { name: look.name }) : look.name
      }</span></button>`,
    )}</div>`;
}

/** Pan all pictures by a drag, and zoom them by two fingers or by Ctrl and the wheel.
 * @param {{current: HTMLElement | null}} frame @param {App} app
 * @returns {() => boolean} whether the last press has moved the pictures */
function usePanning(frame, { store, engine }) {
  const hasMoved = useRef(false);
  useLayoutEffect(() => {
    const element = frame.current;
    if (!element) return undefined;
    const root = /** @type {Document | ShadowRoot} */ (element.getRootNode());
    const pan = (/** @type {number} */ x, /** @type {number} */ y) => {
      const scale = engine.panes()[0]?.scale ?? 1;
      const [px, py] = store.value.display.pan;
      updateDisplay(store, { pan: [px - x / scale, py - y / scale] });
    };
    const zoom = (/** @type {Place} */ { x, y }, /** @type {number} */ factor) => {
      const pane = root.elementFromPoint(x, y) ?? element;
      const box = (pane.closest('.look-pane') ?? element).getBoundingClientRect();
      updateDisplay(store, engine.zoomAt(x - box.left, y - box.top, factor));
    };
    /** @type {Map<number, Place>} */
    const fingers = new Map();
    const press = (/** @type {PointerEvent} */ event) => {
      if (!fingers.size) hasMoved.current = false;
      fingers.set(event.pointerId, placeOf(event));
    };
    const move = (/** @type {PointerEvent} */ event) => {
      const [before, place] = [fingers.get(event.pointerId), placeOf(event)];
      if (!before) return;
      const [dx, dy] = [place.x - before.x, place.y - before.y];
      if (!hasMoved.current && Math.hypot(dx, dy) < MIN_PAN) return;
      hasMoved.current = true;
      const other = [...fingers].find(([id]) => id !== event.pointerId)?.[1];
      fingers.set(event.pointerId, place);
      if (!other) return pan(dx, dy);
      pan(dx / 2, dy / 2);
      const middle = { x: (place.x + other.x) / 2, y: (place.y + other.y) / 2 };
      zoom(middle, distance(place, other) / Math.max(1, distance(before, other)));
    };
    const release = (/** @type {PointerEvent} */ event) => fingers.delete(event.pointerId);
    const wheel = (/** @type {WheelEvent} */ event) => {
      event.preventDefault();
      if (event.ctrlKey || event.metaKey) zoom(placeOf(event), 2 ** (-event.deltaY / 300));
      else pan(-event.deltaX, -event.deltaY);
    };
    const controller = new AbortController();
    const { signal } = controller;
    element.addEventListener('pointerdown', press, { signal });
    window.addEventListener('pointermove', move, { signal });
    window.addEventListener('pointerup', release, { signal });
    window.addEventListener('pointercancel', release, { signal });
    element.addEventListener('wheel', wheel, { signal, passive: false });
    return () => controller.abort();
  }, []);
  return () => hasMoved.current;
}

/** @param {MouseEvent} event @returns {Place} */
const placeOf = ({ clientX: x, clientY: y }) => ({ x, y });

/** @param {Place} a @param {Place} b */
const distance = (a, b) => Math.hypot(a.x - b.x, a.y - b.y);
