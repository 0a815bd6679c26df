/**
 * The pictures with their overlays: names, brush cursor, wipe, and a hint for the first stroke.
 */

import { nameInView } from '../engine/message_frames.js';
import { html, useEffect, useLayoutEffect, useMemo, useRef, useState } from '../vendor/preact.js';
import { toHex } from '../../../viewer/drawing/colour.js';
import { reportProbe, refreshProbe, drawRings } from './brush_cursor.js';
import { lightCountText, percentText } from './format.js';
import { useStageInput } from './stage_input.js';
import { comparedLooks, isPending, mixName } from './look_comparison.js';
import { gainOf, paintOf, effectiveDisplay } from './display_state.js';
import { PointerLabel } from './pointer_label.js';
import { InsetFrame, aroundInset, splitPanes } from './inset_picture.js';
import { LayerMask } from './layers/layer_mask.js';
import { MaskNote } from './layers/layer_panel.js';
import { ObjectOutline } from './object_outline.js';
import { Pointer } from './pointer_input.js';
import { GradientHandles } from './selection/gradient_handles.js';
import { gradientOf } from './selection/gradient_options.js';
import { SelectionOutline } from './selection/selection_outline.js';
import { firstHint, flowOf, updateDisplay } from './tools.js';
import { LampMarks } from './lamp_marks.js';
import { PlanesOverlay } from './planes/plane_overlay.js';
import { PairMarks } from './references/reference_picture.js';
import { LampLasso } from './lamps/lamp_lasso.js';
import { Legend } from './analysis_panel.js';
import { Button, ProgressBar } from './controls.js';
import { plural, t } from '../language/language.js';

/** @import { App, Look, Pane, Tool, Ui } from './ui_state.js' */

/** @type {Record<string, string>} */
const NAMES = {
  painting: t('Painting'),
  solution: t('Answer'),
  other: t('Other look'),
  verified: t('Render'),
  present: t('Now'),
};

/** @param {Ui} ui @param {string} kind @returns {string} */
function nameOf(ui, kind) {
  if (kind === 'other' && ui.hoveredLight !== null) {
    const stops = Math.round(Math.log2(gainOf(ui, ui.hoveredLight)));
    const name = ui.lights[ui.hoveredLight].label;
    return stops > 0
      ? plural(
          stops,
          {
            one: '{name} alone, {count} stop brighter',
            other: '{name} alone, {count} stops brighter',
          },
          { name },
        )
      : t('{name} alone', { name });
  }
  if (kind === 'other' && ui.mix) {
    const look = comparedLooks(ui, ui.mix)?.[1];
    return ui.mix.share === 1 && look ? lookText(ui, look) : mixName(ui.looks, ui.mix);
  }
  if (kind === 'solution' && ui.display.right === 'other' && ui.mix) {
    const look = comparedLooks(ui, ui.mix)?.[0];
    return look ? lookText(ui, look) : NAMES.solution;
  }
  if (kind === 'solution' && ui.previousWeights) return t('Answer before the last step');
  if (kind === 'present' && ui.isOriginalHeld) return t('Original scene');
  const gap = kind === 'solution' || kind === 'painting' ? missingText(ui, kind) : null;
  if (gap) return `${NAMES[kind]}: ${gap}`;
  if (isPartial(ui, kind)) return `${NAMES.solution}: ${visibleNames(ui)}`;
  if (kind === 'solution' && !ui.mix && ui.master !== 1)
    return t('Answer, master {percent}', { percent: percentText(ui.master) });
  if (kind === 'verified' && ui.verification?.isOld) return t('Render of an earlier answer');
  return NAMES[kind] ?? kind;
}

/** Return the name of a look, and whether its lights are still shown where they hang now.
 * @param {Ui} ui @param {Look} look */
const lookText = (ui, look) =>
  isPending(ui, look) ? t('{name}: moving its lights …', { name: look.name }) : look.name;

/** Return what a picture does not show yet; null if it is complete. @param {Ui} ui
 * @param {'solution' | 'painting'} kind */
function missingText({ areLightsUnknown, loadingLook, loadProgress }, kind) {
  if (loadingLook !== null) return t('loading {look} …', { look: loadingLook });
  if (kind === 'solution' && areLightsUnknown) return t('the lights are being rendered …');
  const isIncomplete = loadProgress?.isFirst && loadProgress.done < loadProgress.total;
  return kind === 'solution' && isIncomplete ? t('some lights are still loading …') : null;
}

/** Return whether a picture shows only some of the lights. @param {Ui} ui @param {string} kind */
function isPartial(ui, kind) {
  return kind === 'solution' && ui.solo.length + ui.mute.length > 0 && ui.hoveredLight === null;
}

/** Return the names of the lights shown, if not all are. @param {Ui} ui */
function visibleNames({ solo, mute, lights }) {
  const indices = solo.length ? solo : mute;
  const labels =
    indices.length > 2 ? lightCountText(indices.length) : indices.map((k) => lights[k]?.label);
  const names = [labels].flat().join(t(' and '));
  return solo.length ? t('only {names}', { names }) : t('without {names}', { names });
}

/** @param {{ui: Ui, app: App}} props */
export function Stage({ ui, app }) {
  const { engine, store } = app;
  const frame = useRef(/** @type {HTMLElement | null} */ (null));
  const rings = useRef(/** @type {HTMLElement | null} */ (null));
  const [, rerender] = useState(0);
  const [pointer] = useState(
    () =>
      new Pointer(
        engine,
        store,
        (x, y) => {
          drawRings(rings.current, engine, store.value, x, y);
          reportProbe(engine, store, x, y);
        },
        (text) => app.session.toast(text),
      ),
  );
  useLayoutEffect(() => frame.current?.prepend(engine.element), []);
  useEffect(
    () =>
      watch(frame.current, (width, height) => {
        engine.resize(width, height);
        rerender((count) => count + 1);
      }),
    [],
  );
  // At once, so that the names are at the pictures' places.
  useMemo(
    () => engine.show(effectiveDisplay(ui)),
    [
      ui.display,
      ui.tool,
      ui.solo,
      ui.mute,
      ui.hoveredLight,
      ui.mix,
      ui.previousWeights,
      ui.isOriginalHeld,
      ui.ready,
      ui.weights,
      ui.master,
      ui.view,
      ui.places,
      ui.looks,
      ui.resources,
    ],
  );
  const hasAlbedo = ui.resources[nameInView('albedo', ui.view)] !== undefined;
  // Set before the next press of a pointer.
  useLayoutEffect(
    () =>
      engine.setTool({
        tool: ui.tool,
        rgb: paintOf(ui),
        paintMode: hasAlbedo ? ui.paintMode : 'colour',
        size: ui.size,
        hardness: ui.hardness,
        flow: flowOf(ui),
        importance: ui.importance,
        adjustedArea: ui.adjustedArea,
        gradient: gradientOf(ui),
      }),
    [
      ui.tool,
      ui.colour,
      ui.stops,
      ui.paintMode,
      ui.size,
      ui.hardness,
      flowOf(ui),
      ui.importance,
      ui.adjustedArea,
      ui.gradient,
      ui.second,
      hasAlbedo,
    ],
  );
  // Under a pointer that drags a light, the pictures are read once it rests.
  const answer = ui.drag ? null : ui.weights;
  useEffect(
    () => void (ui.drag || refreshProbe(engine, store)),
    [answer, ui.drag ? null : ui.version, ui.display, ui.view, ui.paintMode],
  );
  useEffect(
    () => drawRings(rings.current, engine, ui),
    [ui.size, ui.tool, ui.hardness, ui.display],
  );
  useStageInput(frame, pointer, app);
  const allPanes = ui.ready ? engine.panes() : [];
  const { main: panes, inset } = splitPanes(ui.display, allPanes);
  const fit = panes.length ? panes[0].scale / ui.display.zoom : null;
  useLayoutEffect(() => store.set({ fit }), [fit?.toPrecision(6)]);
  return html`<div class=${`stage is-${ui.tool} ${ui.dragAdjustment ? 'is-asking' : ''} ${ui.clickAction ? 'is-pointing' : ''} ${ui.drag ? 'is-dragging' : ''} ${inset ? 'has-inset' : ''}`} ref=${frame} style=${aroundInset(inset)} tabindex="0" role="application" inert=${Boolean(ui.mix?.more)}
    aria-label=${t('Pictures. Arrow keys move the brush, Enter paints, Shift Enter a line.')} aria-describedby="lp-status">
    ${ui.ready && html`<${PlanesOverlay} ui=${ui} panes=${panes} />`}
    ${ui.ready && html`<${ObjectOutline} ui=${ui} engine=${engine} panes=${panes} />`}
    ${ui.ready && html`<${SelectionOutline} ui=${ui} engine=${engine} panes=${panes} />`}
    ${ui.ready && html`<${LayerMask} ui=${ui} engine=${engine} panes=${panes} />`}
    ${ui.ready && html`<${MaskNote} ui=${ui} app=${app} />`}
    <div class="rings" ref=${rings} hidden aria-hidden="true">
      <i class="ring" style=${{ '--paint': toHex(ui.colour) }}></i><i class="ring is-twin"></i>
    </div>
    ${inset && html`<${InsetFrame} inset=${inset} name=${nameOf(ui, inset.kind)} corner=${ui.display.corner} store=${store} />`}
    ${allPanes.map(
      (pane, k) => html`<${Tag} key=${k} ui=${ui} app=${app} pane=${pane} panes=${allPanes} />`,
    )}
    ${ui.ready && html`<${GradientHandles} ui=${ui} app=${app} panes=${panes} />`}
    ${ui.ready && html`<${LampMarks} ui=${ui} app=${app} panes=${panes} />`}
    ${ui.ready && html`<${PairMarks} ui=${ui} panes=${panes} />`}
    ${ui.ready && html`<${LampLasso} ui=${ui} app=${app} />`}
    ${ui.ready && html`<${Legend} ui=${ui} app=${app} panes=${panes} />`}
    ${ui.display.layout === 'wipe' && ui.ready && html`<${Wipe} ui=${ui} app=${app} />`}
    ${ui.hint && ui.tour === null && ui.ready && !ui.areLampsMarked && !ui.history.undo.length && html`<${Hint} panes=${panes} tool=${ui.tool} />`}
    ${ui.ready && html`<${PointerLabel} ui=${ui} engine=${engine} rings=${rings} />`}
    ${!ui.ready && html`<${WaitingScreen} ui=${ui} />`}
  </div>`;
}

/** Shown before the first picture. @param {{ui: Ui}} props */
function WaitingScreen({ ui }) {
  const { basis, closure, connection } = ui;
  // Nothing will come; the banner says why.
  if (closure || connection === 'stale') return null;
  const text =
    ui.waitReason || (basis ? t('Rendering the first picture …') : t('Opening the scene …'));
  return html`<div class="waiting" role="status"><span>${text}</span>
    ${!ui.waitReason && html`<${ProgressBar} progress=${basis ?? { done: 0, total: 0 }} label=${text} />`}
  </div>`;
}

/** @param {{ui: Ui, app: App, pane: Pane, panes: Pane[]}} props */
function Tag({ ui, app, pane, panes }) {
  const isRight = ui.display.layout === 'wipe' && pane === panes[0] && panes.length > 1;
  const size = /** @type {[number, number]} */ ([...ui.state.size].reverse());
  if (pane.width < 90) return null;
  const [columns] = size;
  const left = Math.max(pane.x, pane.left);
  const right = Math.min(pane.x + pane.width, pane.left + columns * pane.scale);
  const style = {
    top: `${Math.min(Math.max(pane.y, pane.top), pane.y + pane.height - 30) + 8}px`,
    left: `${isRight ? right - 8 : left + 8}px`,
    transform: isRight ? 'translateX(-100%)' : '',
    maxWidth: `${Math.max(74, right - left - 16)}px`,
  };
  const hasHidden = isPartial(ui, pane.kind);
  const showAll = () => app.store.set({ solo: [], mute: [] });
  return html`<span class=${`tag ${hasHidden ? 'is-part' : ''} ${ui.isOriginalHeld && pane.kind === 'present' ? 'is-original' : ''}`} style=${style}>
    <span>${nameOf(ui, pane.kind)}</span>
    ${
      hasHidden &&
      html`<span onPointerDown=${(/** @type {Event} */ event) => event.stopPropagation()}>
        <${Button} icon="close" tip=${t('Show all lights')} act=${showAll} /></span>`
    }</span>`;
}

/** @param {{panes: Pane[], tool: Tool}} props */
function Hint({ panes, tool }) {
  const pane = panes.find((candidate) => candidate.kind === 'painting');
  if (!pane) return null;
  const { title, text } = firstHint(tool);
  return html`<div class="hint" style=${{
    left: `${pane.x + pane.width / 2}px`,
    top: `${pane.y + pane.height / 2}px`,
    maxWidth: `${Math.min(320, pane.width - 24)}px`,
  }}>
    <strong>${title}</strong><span>${text}</span>
  </div>`;
}

/** @param {{ui: Ui, app: App}} props */
function Wipe({ ui, app }) {
  const { store, engine } = app;
  const ref = useRef(/** @type {HTMLElement | null} */ (null));
  const setWipe = (/** @type {number} */ wipe) =>
    updateDisplay(store, { wipe: Math.min(1, Math.max(0, wipe)) });
  const drag = (/** @type {PointerEvent} */ event) => {
    if (!event.buttons) return;
    event.stopPropagation();
    const { left, width } = engine.element.getBoundingClientRect();
    setWipe((event.clientX - left) / width);
  };
  const grab = (/** @type {PointerEvent} */ event) => {
    event.stopPropagation();
    ref.current?.setPointerCapture(event.pointerId);
  };
  const press = (/** @type {KeyboardEvent} */ event) => {
    const sign = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!sign) return;
    event.preventDefault();
    event.stopPropagation();
    setWipe(ui.display.wipe + sign * 0.02);
  };
  return html`<div class="wipe" ref=${ref} role="slider" tabindex="0" aria-label=${t('Wipe')}
    aria-valuemin="0" aria-valuemax="100" aria-valuenow=${Math.round(100 * ui.display.wipe)}
    style=${{ left: `${100 * ui.display.wipe}%` }} onPointerDown=${grab} onPointerMove=${drag}
    onKeyDown=${press}><i></i></div>`;
}

/** @param {HTMLElement | null} element @param {(width: number, height: number) => void} onResize */
function watch(element, onResize) {
  if (!element) return undefined;
  const observer = new ResizeObserver(() => onResize(element.clientWidth, element.clientHeight));
  observer.observe(element);
  return () => observer.disconnect();
}
