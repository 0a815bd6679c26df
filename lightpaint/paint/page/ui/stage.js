/** The pictures, and what lies over them: names, the brush, the wipe, a hint for the first stroke. */

import { inView } from '../engine/message_frames.js';
import { html, useEffect, useLayoutEffect, useMemo, useRef, useState } from '../vendor/preact.js';
import { toHex } from './paint_colour.js';
import { point, pointAgain, pointAway, ring } from './brush_cursor.js';
import { counted } from './format.js';
import { isTyping } from './shortcuts.js';
import { betweenOf, gainOf, paintOf, shown } from './ui_state.js';
import { Near } from './pointer_label.js';
import { Outline } from './object_outline.js';
import { Pointer } from './pointer_input.js';
import { firstHintOf, flowOf, look } from './tools.js';
import { Legend } from './analysis_panel.js';
import { Bar } from './progress_bar.js';
import { Button } from './controls.js';

/** @typedef {import("./engine_interface.js").Engine} Engine */
/** @typedef {import("./engine_interface.js").Pane} Pane */
/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./ui_state.js").UiStore} UiStore */
/** @typedef {import("./shortcuts.js").Hands} Hands */

/** @type {Record<string, string>} */
const NAMES = {
  painting: 'Painting',
  solution: 'Answer',
  other: 'Other look',
  verified: 'Render',
  present: 'Now',
};

/** @param {Ui} ui @param {string} kind @returns {string} */
function nameOf(ui, kind) {
  if (kind === 'other' && ui.hovered !== null) {
    const stops = Math.round(Math.log2(gainOf(ui, ui.hovered)));
    return `${ui.lights[ui.hovered].label} alone${stops > 0 ? `, ${counted(stops, 'stop')} brighter` : ''}`;
  }
  if (kind === 'other' && ui.mix) {
    const { b, share } = ui.mix;
    const to = ui.looks.find((one) => one.id === b)?.name;
    return share === 1 && to ? to : betweenOf(ui.looks, ui.mix);
  }
  if (kind === 'solution' && ui.show.instead && ui.mix) {
    return ui.looks.find((one) => one.id === ui.mix?.a)?.name ?? NAMES.solution;
  }
  const waits = kind === 'solution' || kind === 'painting' ? waitingFor(ui, kind) : null;
  if (waits) return `${NAMES[kind]}: ${waits}`;
  if (isPartly(ui, kind)) return `${NAMES.solution}: ${partOf(ui)}`;
  if (kind === 'verified' && ui.verified?.isOld) return 'Render of an earlier answer';
  return NAMES[kind] ?? kind;
}

/** What a picture does not show yet; null where it is what it is called. @param {Ui} ui
 * @param {'solution' | 'painting'} kind */
function waitingFor({ comingTo, loading }, kind) {
  if (comingTo !== null) return `loading ${comingTo} …`;
  const isShort = loading?.isFirst && loading.done < loading.total;
  return kind === 'solution' && isShort ? 'some lights are still loading …' : null;
}

/** Whether a picture shows some of the lights only. @param {Ui} ui @param {string} kind */
function isPartly(ui, kind) {
  return kind === 'solution' && ui.solo.length + ui.mute.length > 0 && ui.hovered === null;
}

/** Which lights are shown, of an answer that has them all. @param {Ui} ui */
function partOf({ solo, mute, lights }) {
  const some = solo.length ? solo : mute;
  const names = some.length > 2 ? `${some.length} lights` : some.map((k) => lights[k]?.label);
  return `${solo.length ? 'only' : 'without'} ${[names].flat().join(' and ')}`;
}

/** @param {{ui: Ui, hands: Hands}} props */
export function Stage({ ui, hands }) {
  const { engine, store } = hands;
  const frame = useRef(/** @type {HTMLElement | null} */ (null));
  const rings = useRef(/** @type {HTMLElement | null} */ (null));
  const [, resized] = useState(0);
  const [pointer] = useState(
    () =>
      new Pointer(
        engine,
        store,
        (x, y) => {
          ring(rings.current, engine, store.value, x, y);
          point(engine, store, x, y);
        },
        (text) => hands.session.toast(text),
      ),
  );
  useLayoutEffect(() => frame.current?.prepend(engine.element), []);
  useEffect(
    () =>
      watch(frame.current, (width, height) => {
        engine.resize(width, height);
        resized((count) => count + 1);
      }),
    [],
  );
  // At once, so that names lie where the pictures will.
  useMemo(
    () => engine.show(shown(ui)),
    [ui.show, ui.tool, ui.solo, ui.mute, ui.hovered, ui.mix, ui.ready, ui.weights, ui.view],
  );
  const hasAlbedo = ui.resources[inView('albedo', ui.view)] !== undefined;
  // Before the next press of a pointer.
  useLayoutEffect(
    () =>
      engine.use({
        tool: ui.tool,
        rgb: paintOf(ui),
        as: hasAlbedo ? ui.as : 'look',
        size: ui.size,
        hardness: ui.hardness,
        flow: flowOf(ui),
        importance: ui.importance,
        about: ui.about,
      }),
    [
      ui.tool,
      ui.colour,
      ui.stops,
      ui.as,
      ui.size,
      ui.hardness,
      flowOf(ui),
      ui.importance,
      ui.about,
      hasAlbedo,
    ],
  );
  useEffect(() => pointAgain(engine, store), [ui.weights, ui.version, ui.show, ui.view, ui.as]);
  useEffect(() => ring(rings.current, engine, ui), [ui.size, ui.tool, ui.hardness, ui.show]);
  useSurface(frame, pointer, hands);
  const panes = ui.ready ? engine.panes() : [];
  const fit = panes.length ? panes[0].scale / ui.show.zoom : null;
  useLayoutEffect(() => store.set({ fit }), [fit?.toPrecision(6)]);
  return html`<div class=${`stage is-${ui.tool} ${ui.asking ? 'is-asking' : ''}`} ref=${frame} tabindex="0" role="application"
    aria-label="Pictures. Arrow keys move the brush, Enter paints, Shift Enter a line." aria-describedby="lp-status">
    ${ui.ready && html`<${Outline} ui=${ui} engine=${engine} panes=${panes} />`}
    <div class="rings" ref=${rings} hidden aria-hidden="true">
      <i class="ring" style=${{ '--paint': toHex(ui.colour) }}></i><i class="ring is-twin"></i>
    </div>
    ${panes.map(
      (pane, k) => html`<${Tag} key=${k} ui=${ui} hands=${hands} pane=${pane} panes=${panes} />`,
    )}
    ${ui.ready && html`<${Legend} ui=${ui} hands=${hands} panes=${panes} />`}
    ${ui.show.layout === 'wipe' && ui.ready && html`<${Wipe} ui=${ui} hands=${hands} />`}
    ${ui.hint && ui.ready && !ui.history.undo.length && html`<${Hint} panes=${panes} tool=${ui.tool} />`}
    ${ui.ready && html`<${Near} ui=${ui} engine=${engine} rings=${rings} />`}
    ${!ui.ready && html`<${Waiting} ui=${ui} />`}
  </div>`;
}

/** Before there is anything to see. @param {{ui: Ui}} props */
function Waiting({ ui }) {
  const { basis, closed, connection } = ui;
  // Nothing comes; why, the banner says.
  if (closed || connection === 'stale') return null;
  const text = ui.waiting || (basis ? 'Rendering the first picture …' : 'Opening the scene …');
  return html`<div class="waiting" role="status"><span>${text}</span>
    ${!ui.waiting && html`<${Bar} progress=${basis ?? { done: 0, total: 0 }} label=${text} />`}
  </div>`;
}

/** @param {{ui: Ui, hands: Hands, pane: Pane, panes: Pane[]}} props */
function Tag({ ui, hands, pane, panes }) {
  const isRight = ui.show.layout === 'wipe' && pane === panes[0] && panes.length > 1;
  const size = /** @type {[number, number]} */ ([...ui.state.size].reverse());
  if (pane.width < 90) return null;
  const [w] = size;
  const right = Math.min(pane.x + pane.width, pane.left + w * pane.scale);
  const style = {
    top: `${Math.min(Math.max(pane.y, pane.top), pane.y + pane.height - 30) + 8}px`,
    left: `${(isRight ? right : Math.max(pane.x, pane.left)) + (isRight ? -8 : 8)}px`,
    transform: isRight ? 'translateX(-100%)' : '',
    maxWidth: `${Math.max(74, pane.width - 16)}px`,
  };
  const isPart = isPartly(ui, pane.kind);
  const all = () => hands.store.set({ solo: [], mute: [] });
  return html`<span class=${`tag ${isPart ? 'is-part' : ''}`} style=${style}>
    <span>${nameOf(ui, pane.kind)}</span>
    ${
      isPart &&
      html`<span onPointerDown=${(/** @type {Event} */ event) => event.stopPropagation()}>
        <${Button} icon="close" tip="Show all lights" act=${all} /></span>`
    }</span>`;
}

/** @param {{panes: Pane[], tool: import("./engine_interface.js").Tool}} props */
function Hint({ panes, tool }) {
  const pane = panes.find((one) => one.kind === 'painting');
  if (!pane) return null;
  const { title, text } = firstHintOf(tool);
  return html`<div class="hint" style=${{
    left: `${pane.x + pane.width / 2}px`,
    top: `${pane.y + pane.height / 2}px`,
    maxWidth: `${Math.min(320, pane.width - 24)}px`,
  }}>
    <strong>${title}</strong><span>${text}</span>
  </div>`;
}

/** @param {{ui: Ui, hands: Hands}} props */
function Wipe({ ui, hands }) {
  const { store, engine } = hands;
  const ref = useRef(/** @type {HTMLElement | null} */ (null));
  const to = (/** @type {number} */ wipe) => look(store, { wipe: Math.min(1, Math.max(0, wipe)) });
  const drag = (/** @type {PointerEvent} */ event) => {
    if (!event.buttons) return;
    event.stopPropagation();
    const { left, width } = engine.element.getBoundingClientRect();
    to((event.clientX - left) / width);
  };
  const grab = (/** @type {PointerEvent} */ event) => {
    event.stopPropagation();
    ref.current?.setPointerCapture(event.pointerId);
  };
  const press = (/** @type {KeyboardEvent} */ event) => {
    const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!way) return;
    event.preventDefault();
    event.stopPropagation();
    to(ui.show.wipe + way * 0.02);
  };
  return html`<div class="wipe" ref=${ref} role="slider" tabindex="0" aria-label="Wipe"
    aria-valuemin="0" aria-valuemax="100" aria-valuenow=${Math.round(100 * ui.show.wipe)}
    style=${{ left: `${100 * ui.show.wipe}%` }} onPointerDown=${grab} onPointerMove=${drag}
    onKeyDown=${press}><i></i></div>`;
}

/** @param {HTMLElement | null} element @param {(width: number, height: number) => void} tell */
function watch(element, tell) {
  if (!element) return undefined;
  const observer = new ResizeObserver(() => tell(element.clientWidth, element.clientHeight));
  observer.observe(element);
  return () => observer.disconnect();
}

/** @param {import("../vendor/preact.js").Ref<HTMLElement | null>} frame @param {Pointer} pointer
 * @param {Hands} hands */
function useSurface(frame, pointer, hands) {
  useEffect(() => {
    const element = frame.current;
    if (!element) return undefined;
    const { store, engine } = hands;
    const ends = new AbortController();
    const on = (/** @type {string} */ name, /** @type {(event: any) => void} */ hear) =>
      element.addEventListener(name, hear, { signal: ends.signal, passive: false });
    // Whoever came by a pointer sees where they are; the outline is for the keyboard.
    on('pointerdown', (event) => {
      element.dataset.by = 'pointer';
      pointer.down(event);
    });
    on('blur', () => delete element.dataset.by);
    on('pointermove', (event) => pointer.move(event));
    on('pointerup', (event) => pointer.up(event));
    on('pointercancel', (event) => pointer.up(event));
    on('wheel', (event) => pointer.wheel(event));
    on('contextmenu', (event) => event.preventDefault());
    on('pointerleave', () => {
      pointAway(store);
      const rings = /** @type {HTMLElement | null} */ (element.querySelector('.rings'));
      if (rings && !pointer.doing) rings.hidden = true;
    });
    on('keydown', (event) => byKeys(event, pointer, engine, store));
    const pan = (/** @type {boolean} */ isSpace) => {
      pointer.isSpace = isSpace;
      element.classList.toggle('is-panning', isSpace);
    };
    const over = (/** @type {KeyboardEvent} */ event) => {
      const inner = /** @type {HTMLElement} */ (event.composedPath()[0]);
      if (event.code !== 'Space' || isTyping(event)) return;
      const isHere = element.matches(':hover') || inner === element;
      pan(event.type === 'keydown' && isHere);
      if (isHere) event.preventDefault();
    };
    // On its way there, since the painter keeps its keys from what is around it.
    const early = { signal: ends.signal, capture: true };
    window.addEventListener('keydown', over, early);
    window.addEventListener('keyup', over, early);
    // Where the key is let go in another window, this one does not hear of it.
    window.addEventListener('blur', () => pan(false), { signal: ends.signal });
    return () => ends.abort();
  }, []);
}

/** The brush by keys: arrows move it, Enter paints a dab, or with Shift a line. @param {KeyboardEvent} event
 * @param {Pointer} pointer @param {Engine} engine @param {UiStore} store */
function byKeys(event, pointer, engine, store) {
  const way = /** @type {Record<string, [number, number]>} */ ({
    ArrowLeft: [-1, 0],
    ArrowRight: [1, 0],
    ArrowUp: [0, -1],
    ArrowDown: [0, 1],
  })[event.key];
  if ((!way && event.key !== 'Enter') || event.target !== event.currentTarget) return;
  event.preventDefault();
  const element = /** @type {HTMLElement} */ (event.currentTarget);
  const rings = /** @type {HTMLElement} */ (element.querySelector('.rings'));
  const pane = engine.panes()[0];
  const step = event.shiftKey ? 1 : 12;
  rings.hidden = false;
  const x = Number(rings.dataset.x ?? pane.x + pane.width / 2) + (way ? way[0] * step : 0);
  const y = Number(rings.dataset.y ?? pane.y + pane.height / 2) + (way ? way[1] * step : 0);
  pointer.moved(x, y);
  if (event.key === 'Enter') pointer.dab(x, y, event.shiftKey);
}
