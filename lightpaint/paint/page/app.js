/** The painter in an element: pictures, tools and panels over a host that has the session. */

import { html, render, useEffect, useState } from './vendor/preact.js';
import { refreshProbe } from './ui/brush_cursor.js';
import { ColourPanel } from './ui/colour_panel.js';
import { Fold, Button, reveal } from './ui/controls.js';
import { Dialogs } from './ui/dialogs.js';
import { PreviewDialog } from './ui/advice.js';
import { HistoryPanel } from './ui/history_panel.js';
import { handleKey, listenWithin } from './ui/keyboard.js';
import { LayerDropFrame, LayerImportDialog } from './ui/layers/layer_import.js';
import { LayerCount, LayerPanel, hasLayers } from './ui/layers/layer_panel.js';
import { LightList, LightListActions } from './ui/light_list.js';
import { LookStrip } from './ui/look_strip.js';
import { LookWall } from './ui/look_wall.js';
import {
  storedTool,
  storeChanges,
  storedFolds,
  storedBrushSize,
  storedPreferences,
} from './ui/browser_storage.js';
import { initialState } from './ui/ui_state.js';
import { Banner, Tips, Toasts, RunningTasks } from './ui/notices.js';
import { orderedPanels, dragPanel, stepPanel } from './ui/panels/panel_order.js';
import { RoomPlan } from './ui/room_plan.js';
import { PlanesPanel } from './ui/planes/planes_panel.js';
import { ScopesPanel } from './ui/scopes/scopes_panel.js';
import { SelectionFields } from './ui/selection/selection_fields.js';
import { selectionUpdate } from './ui/selection/selection_settings.js';
import { ReferencePaste } from './ui/references/reference_files.js';
import { ReferencePane } from './ui/references/reference_pane.js';
import { PresetsButton } from './ui/presets_dialog.js';
import { SessionController } from './ui/session_controller.js';
import { SettingsPanel } from './ui/settings_panel.js';
import { Stage } from './ui/picture_stage.js';
import { Store } from './ui/ui_store.js';
import { AdjustPanel, ToolBar, ToolOptions } from './ui/toolbar.js';
import { followTheme } from './ui/theme.js';
import { TopBar } from './ui/topbar.js';
import { startAtFirstVisit, Tour } from './ui/tour.js';
import { AnalysisPanel } from './ui/analysis_panel.js';
import { AnswerLine, PointerStatus } from './ui/answer_line.js';
import { ViewTabs, showView } from './ui/view_tabs.js';
import { watchedPanels } from './ui/watched_panel.js';
import { language, plural, t } from './language/language.js';

/** @import { App, Engine, Host, Ui } from './ui/ui_state.js' */

/** Show the painter in an element.
 *
 * `global`: keys work wherever the focus is, for a page that holds only the painter. `engine`: the
 * picture engine over that host. `isGuided`: the tour starts at the first visit.
 * @param {HTMLElement} element @param {Host} host
 * @param {{global?: boolean, engine: Engine, isGuided?: boolean}} options
 * @returns {Promise<{store: Store<Ui>, session: SessionController, close: () => void}>} */
export async function mount(element, host, { global = false, engine, isGuided = false }) {
  const open = { ...initialState().open, ...storedFolds() };
  const store = new Store({ ...initialState(), ...storedTool(), ...storedPreferences(), open });
  const root = document.createElement('div');
  root.className = 'lightpaint';
  root.lang = language;
  root.dataset.lmSuppressShortcuts = 'true'; // JupyterLab's, which receive keys before the painter
  const stopTheme = followTheme(root, store);
  element.append(root);
  const session = new SessionController(host, store);
  const app = { store, session, engine };
  listen(app);
  const controller = new AbortController();
  const { signal } = controller;
  const showRefused = (/** @type {any} */ event) => session.toast(event.detail, 'warn');
  root.addEventListener('refused', showRefused, { signal });
  if (global) root.dataset.isWholePage = 'true';
  if (global) window.addEventListener('keydown', (event) => handleKey(event, app), { signal });
  else listenWithin(root, app, signal);
  render(html`<${Painter} app=${app} root=${() => root} />`, root);
  const observer = foldWhenNarrow(root, store);
  const stopStoring = storeChanges(store);
  const stopTour = isGuided ? startAtFirstVisit(store, root) : () => {};
  const close = () => {
    controller.abort();
    observer.disconnect();
    stopStoring();
    stopTheme();
    stopTour();
    render(null, root);
    engine.close();
    host.close();
    root.remove();
  };
  return { store, session, close };
}

/** @param {App} app */
function listen(app) {
  const { engine, session, store } = app;
  engine.on('message', (message) => session.receive(message));
  engine.on('frame', () => store.flushFrame());
  engine.on('probed', () => refreshProbe(engine, store));
  engine.on('loading', (loadProgress) => store.set({ loadProgress }));
  engine.on('adjustment', (dragAdjustment) => store.set({ dragAdjustment }));
  engine.on('layers', () => store.set((ui) => layersUpdate(engine.layerState(), ui)));
  engine.on('selection', () => store.set((ui) => selectionUpdate(engine, ui)));
  engine.on('view', ({ view }) => showView(app, view));
  engine.on('lost', ({ count, isStale }) => {
    if (isStale) store.set({ lostStrokes: count });
    else session.toast(droppedText(count), 'warn');
  });
  engine.on('trouble', ({ text }) => session.toast(text, 'warn'));
  let isSized = false;
  store.listen(() => {
    const { state, display } = store.value;
    if (!state || isSized) return;
    isSized = true;
    store.set({
      size: storedBrushSize(state.size[0]),
      display: {
        ...display,
        transform: state.transform?.name ?? display.transform,
        stops: state.transform?.stops ?? 0,
      },
    });
  });
}

/** @param {ReturnType<Engine["layerState"]>} layerState @param {Ui} ui @returns {Partial<Ui>} */
function layersUpdate(layerState, { selectedLayers, hoveredLayer }) {
  const exists = (/** @type {number | null} */ id) =>
    layerState.layers.some((layer) => layer.id === id);
  return {
    ...layerState,
    selectedLayers: selectedLayers.filter(exists),
    hoveredLayer: exists(hoveredLayer) ? hoveredLayer : null,
  };
}

/** Width in pixels below which panels overlay the pictures; styles/windows.css has the same number. */
const NARROW_MAX_PIXELS = 760;

/** Hide panels while there is no room beside the pictures, and show them again when there is.
 * @param {HTMLElement} root @param {Store<Ui>} store */
function foldWhenNarrow(root, store) {
  let isFolded = false;
  let wasNarrow = false;
  const observer = new ResizeObserver(() => {
    const { side } = store.value;
    const isNarrow = root.clientWidth > 0 && root.clientWidth <= NARROW_MAX_PIXELS;
    if (isNarrow === wasNarrow) return;
    wasNarrow = isNarrow;
    if (isNarrow ? side : isFolded) store.set({ side: !isNarrow });
    isFolded = isNarrow && side;
  });
  observer.observe(root);
  return observer;
}

/** @param {number} count */
function droppedText(count) {
  return plural(count, {
    one: 'A stroke in this tab had not been sent when another tab took over. It is dropped, so as not to cover what was painted there.',
    other:
      '{count} strokes in this tab had not been sent when another tab took over. They are dropped, so as not to cover what was painted there.',
  });
}

/** The panels, each of which renders again only for the state that it shows. */
const Watched = watchedPanels({
  TopBar, ToolBar, ToolOptions, ViewTabs, Stage, ReferencePane, LookWall, Banner, Toasts,
  PointerStatus, RunningTasks, AnswerLine, LookStrip, SettingsPanel, Dialogs, PreviewDialog,
  LayerImportDialog, Tour, ColourPanel, AdjustPanel, SelectionFields, LayerPanel, LayerCount,
  HistoryPanel, LightList, LightListActions, RoomPlan, PlanesPanel, ScopesPanel, AnalysisPanel,
});

/** @param {{app: App, root: () => HTMLElement}} props */
function Painter({ app, root }) {
  const { store } = app;
  const [ui, setUi] = useState(store.value);
  useEffect(() => {
    setUi(store.value);
    return store.listen(() => setUi(store.value));
  }, []);
  return html`
    <${SkipLinks} app=${app} />
    <${Watched.TopBar} ui=${ui} app=${app} />
    <${Watched.ToolBar} ui=${ui} app=${app} />
    <main class=${`middle ${ui.side || ui.panel ? '' : 'is-wide'}`} aria-label=${t('Painter')}>
      <${Watched.ToolOptions} ui=${ui} app=${app} />
      <${Watched.ViewTabs} ui=${ui} app=${app} />
      <div class="view"><${Watched.Stage} ui=${ui} app=${app} />
        <${Watched.ReferencePane} ui=${ui} app=${app} />
        <${Watched.LookWall} ui=${ui} app=${app} />
        <${Watched.Banner} ui=${ui} app=${app} />
        <${Watched.Toasts} ui=${ui} app=${app} /></div>
      <div class="status"><${Watched.PointerStatus} ui=${ui} /><${Watched.RunningTasks} ui=${ui} app=${app} /></div>
      <${Watched.AnswerLine} ui=${ui} app=${app} />
      <${Watched.LookStrip} ui=${ui} app=${app} />
    </main>
    ${
      ui.panel
        ? html`<${Watched.SettingsPanel} ui=${ui} app=${app} />`
        : ui.side && html`<${Side} ui=${ui} app=${app} />`
    }
    <${Watched.Dialogs} ui=${ui} app=${app} />
    <${Watched.PreviewDialog} ui=${ui} app=${app} />
    <${Watched.LayerImportDialog} ui=${ui} app=${app} />
    <${LayerDropFrame} app=${app} root=${root} />
    <${ReferencePaste} app=${app} root=${root} />
    <${Watched.Tour} ui=${ui} app=${app} root=${root} />
    <${Tips} root=${root} />`;
}

/** @param {{ui: Ui, app: App}} props */
function Side({ ui, app }) {
  const { store } = app;
  const renderFold = (
    /** @type {string} */ name,
    /** @type {string} */ title,
    /** @type {any} */ content,
    /** @type {any} */ extra = null,
    isOpen = Boolean(ui.open[name]),
  ) =>
    html`<${Fold} key=${name} name=${name} title=${title} class=${`is-${name}`} open=${isOpen} extra=${extra}
      toggle=${() => store.set({ open: { ...ui.open, [name]: !isOpen } })}>${content}</${Fold}>`;
  const panels = html`
    ${renderFold('colour', t('Colour'), html`<${Watched.ColourPanel} ui=${ui} app=${app} />`)}
    ${renderFold('ask', t('Adjust by numbers'), html`<${Watched.AdjustPanel} ui=${ui} app=${app} />`)}
    ${
      (ui.tool === 'select' || ui.selection.current) &&
      renderFold('select', t('Selection'), html`<${Watched.SelectionFields} ui=${ui} app=${app} />`)
    }
    ${renderFold(
      'layers',
      t('Layers'),
      html`<${Watched.LayerPanel} ui=${ui} app=${app} />`,
      html`<${Watched.LayerCount} ui=${ui} /><${PresetsButton} app=${app} />`,
      ui.open.layers ?? hasLayers(ui),
    )}
    ${renderFold(
      'lights',
      t('Lights'),
      html`<${Watched.LightList} ui=${ui} app=${app} />`,
      html`<${Watched.LightListActions} ui=${ui} app=${app} />`,
    )}
    ${ui.areLampsMarked && renderFold('plan', t('Plan'), html`<${Watched.RoomPlan} ui=${ui} app=${app} />`)}
    ${ui.planes && renderFold('planes', t('Planes'), html`<${Watched.PlanesPanel} ui=${ui} app=${app} />`)}
    ${renderFold('history', t('History'), html`<${Watched.HistoryPanel} ui=${ui} app=${app} />`)}
    ${renderFold('scopes', t('Scopes'), html`<${Watched.ScopesPanel} ui=${ui} app=${app} />`)}
    ${renderFold('truth', t('Analysis'), html`<${Watched.AnalysisPanel} ui=${ui} app=${app} />`)}`;
  return html`<aside class="side" aria-label=${t('Panels')}
    onPointerDown=${(/** @type {PointerEvent} */ event) => dragPanel(event, store)}
    onKeyDown=${(/** @type {KeyboardEvent} */ event) => stepPanel(event, store)}>
    ${orderedPanels(panels, ui.panelOrder)}
    <span class="only-read" role="status">${ui.panelNote}</span>
  </aside>`;
}

/** @param {{app: App}} props */
function SkipLinks({ app: { store } }) {
  const buttonOf = (/** @type {MouseEvent} */ event) =>
    /** @type {HTMLElement} */ (event.currentTarget);
  const skipToLights = (/** @type {MouseEvent} */ event) => {
    const button = buttonOf(event);
    store.set(({ open }) => ({ side: true, panel: null, open: { ...open, lights: true } }));
    reveal(button, '.lights :is(.group-name, .light-name)', true);
  };
  return html`<nav class="skips" aria-label=${t('Skip links')}>
    <${Button} label=${t('Skip to the pictures')} act=${(/** @type {MouseEvent} */ event) =>
      reveal(buttonOf(event), '.stage', true)} />
    <${Button} label=${t('Skip to the lights')} act=${skipToLights} />
  </nav>`;
}
