/** The painter in an element: pictures, tools and panels over a host that has the session. */

import { html, render, useEffect, useState } from './vendor/preact.js';
import { ColourPanel } from './ui/colour_panel.js';
import { Fold } from './ui/controls.js';
import { Dialogs } from './ui/dialogs.js';
import { PreviewDialog } from './ui/advice.js';
import { counted } from './ui/format.js';
import { hearWithin, press } from './ui/shortcuts.js';
import { LightsPanel, OfAll } from './ui/light_list.js';
import { Looks } from './ui/look_strip.js';
import { handBefore, keep, openBefore, sizeBefore } from './ui/browser_storage.js';
import { first } from './ui/ui_state.js';
import { Banner, Tips, Toasts, Working } from './ui/notices.js';
import { Session } from './ui/session_controller.js';
import { SettingsPanel } from './ui/settings_panel.js';
import { Skips } from './ui/skip_links.js';
import { Stage } from './ui/stage.js';
import { Store } from './ui/ui_store.js';
import { Ask, ToolBar, ToolOptions } from './ui/toolbar.js';
import { TopBar } from './ui/topbar.js';
import { AnswerLine, Here, TruthPanel } from './ui/analysis_panel.js';
import { Views, see } from './ui/view_tabs.js';

/** @typedef {import("./ui/engine_interface.js").Host} Host */
/** @typedef {import("./ui/engine_interface.js").Engine} Engine */
/** @typedef {import("./ui/ui_state.js").Ui} Ui */
/** @typedef {import("./ui/shortcuts.js").Hands} Hands */

/**
 * Show the painter in an element.
 *
 * `global`: keys work wherever the focus is, for a page that is nothing else. `engine`: the picture
 * engine over that host.
 * @param {HTMLElement} element @param {Host} host
 * @param {{global?: boolean, engine: Engine}} options
 * @returns {Promise<{store: Store<Ui>, session: Session, close: () => void}>}
 */
export async function mount(element, host, { global = false, engine }) {
  const open = { ...first().open, ...openBefore() };
  const store = new Store({ ...first(), ...handBefore(), open });
  const root = document.createElement('div');
  root.className = 'lightpaint';
  root.dataset.lmSuppressShortcuts = 'true'; // of JupyterLab, which hears keys before the painter
  element.append(root);
  const session = new Session(host, store);
  const hands = { store, session, engine };
  listen(hands);
  const ends = new AbortController();
  const { signal } = ends;
  if (global) window.addEventListener('keydown', (event) => press(event, hands), { signal });
  else hearWithin(root, hands, signal);
  render(html`<${Painter} hands=${hands} root=${() => root} />`, root);
  const folding = foldByItself(root, store);
  const forget = keep(store);
  const close = () => {
    ends.abort();
    folding.disconnect();
    forget();
    render(null, root);
    engine.close();
    host.close();
    root.remove();
  };
  return { store, session, close };
}

/** @param {Hands} hands */
function listen(hands) {
  const { engine, session, store } = hands;
  engine.on('message', (message) => session.receive(message));
  engine.on('loading', (loading) => store.set({ loading }));
  engine.on('asking', (asking) => store.set({ asking }));
  engine.on('view', ({ view }) => see(hands, view));
  engine.on('lost', ({ count, isStale }) => {
    if (isStale) store.set({ unheard: count });
    else session.toast(given(count), 'warn');
  });
  engine.on('trouble', ({ text }) => session.toast(text, 'warn'));
  let isSized = false;
  store.listen(() => {
    const { state, show } = store.value;
    if (!state || isSized) return;
    isSized = true;
    store.set({
      size: sizeBefore(state.size[0]),
      show: {
        ...show,
        transform: state.transform?.name ?? show.transform,
        stops: state.transform?.stops ?? 0,
      },
    });
  });
}

/** Pixels below which panels lie over the pictures: style.css says it, too. */
const NARROW = 760;

/** Panels fold where there is no room beside the pictures, and come back when there is.
 * @param {HTMLElement} root @param {Store<Ui>} store */
function foldByItself(root, store) {
  let isFolded = false;
  let wasNarrow = false;
  const observer = new ResizeObserver(() => {
    const { side } = store.value;
    const isNarrow = root.clientWidth > 0 && root.clientWidth <= NARROW;
    if (isNarrow === wasNarrow) return;
    wasNarrow = isNarrow;
    if (isNarrow ? side : isFolded) store.set({ side: !isNarrow });
    isFolded = isNarrow && side;
  });
  observer.observe(root);
  return observer;
}

/** @param {number} count */
function given(count) {
  const [strokes, they] =
    count === 1 ? ['A stroke', 'It is'] : [counted(count, 'stroke'), 'They are'];
  return `${strokes} in this tab had not been sent when another tab took over. ${they} dropped, so as
    not to cover what was painted there.`.replace(/\s+/g, ' ');
}

/** @param {{hands: Hands, root: () => HTMLElement}} props */
function Painter({ hands, root }) {
  const { store } = hands;
  const [ui, setUi] = useState(store.value);
  useEffect(() => {
    setUi(store.value);
    return store.listen(() => setUi(store.value));
  }, []);
  return html`
    <${Skips} hands=${hands} />
    <${TopBar} ui=${ui} hands=${hands} />
    <${ToolBar} ui=${ui} hands=${hands} />
    <main class=${`middle ${ui.side || ui.panel ? '' : 'is-wide'}`} aria-label="Painter">
      <${ToolOptions} ui=${ui} hands=${hands} />
      <${Views} ui=${ui} hands=${hands} />
      <div class="view"><${Stage} ui=${ui} hands=${hands} />
        <${Banner} ui=${ui} hands=${hands} />
        <${Toasts} ui=${ui} hands=${hands} /></div>
      <div class="status"><${Here} ui=${ui} /><${Working} ui=${ui} hands=${hands} /></div>
      <${AnswerLine} ui=${ui} hands=${hands} />
      <${Looks} ui=${ui} hands=${hands} />
    </main>
    ${
      ui.panel
        ? html`<${SettingsPanel} ui=${ui} hands=${hands} />`
        : ui.side && html`<${Side} ui=${ui} hands=${hands} />`
    }
    <${Dialogs} ui=${ui} hands=${hands} />
    <${PreviewDialog} ui=${ui} hands=${hands} />
    <${Tips} root=${root} />`;
}

/** @param {{ui: Ui, hands: Hands}} props */
function Side({ ui, hands }) {
  const { store } = hands;
  const fold = (
    /** @type {string} */ name,
    /** @type {string} */ title,
    /** @type {any} */ made,
    /** @type {any} */ extra = null,
  ) =>
    html`<${Fold} title=${title} class=${`is-${name}`} open=${Boolean(ui.open[name])} extra=${extra}
      toggle=${() => store.set({ open: { ...ui.open, [name]: !ui.open[name] } })}>${made}</${Fold}>`;
  return html`<aside class="side" aria-label="Panels">
    ${fold('colour', 'Colour', html`<${ColourPanel} ui=${ui} hands=${hands} />`)}
    ${fold('ask', 'Adjust by numbers', html`<${Ask} ui=${ui} hands=${hands} />`)}
    ${fold(
      'lights',
      'Lights',
      html`<${LightsPanel} ui=${ui} hands=${hands} />`,
      html`<${OfAll} ui=${ui} hands=${hands} />`,
    )}
    ${fold('truth', 'Analysis', html`<${TruthPanel} ui=${ui} hands=${hands} />`)}
  </aside>`;
}
