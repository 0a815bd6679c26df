/** Tabs for the views of a session. One lighting serves all views. */

import { nameInView } from '../engine/message_frames.js';
import { html } from '../vendor/preact.js';
import { numberText } from './format.js';
import { viewUpdate } from './state_updates.js';
import { Thumbnail } from './thumbnail.js';
import { t } from '../language/language.js';
import { shortcutsOf } from './key_bindings.js';

/** @import { App, Ui } from './ui_state.js' */

/** Switch to another view. @param {App} app @param {number} view */
export function showView({ store, engine }, view) {
  if (!store.value.ready || view === store.value.view) return;
  engine.showView(view);
  store.set((ui) => viewUpdate(ui, view));
}

/** Switch to the next view. @param {App} app */
export function showNextView(app) {
  const { views, view } = app.store.value;
  if (views.length > 1) showView(app, (view + 1) % views.length);
}

/** @param {{ui: Ui, app: App}} props */
export function ViewTabs({ ui, app }) {
  if (ui.views.length < 2) return null;
  return html`<div class="views" role="group" aria-label=${t('Views')}>
    ${ui.views.map(({ name }, k) => {
      const picture = nameInView('look', k);
      const closeness = ui.closeness?.[k];
      const note = closeness
        ? t('ΔE {number}', { number: numberText(closeness.delta_e, 2) })
        : ui.closeness && t('not painted');
      return html`<button type="button" class=${`view-tab ${k === ui.view ? 'is-on' : ''}`}
        key=${name} aria-pressed=${String(k === ui.view)} data-tip=${t('Show and paint {name}', { name })}
        data-keys=${shortcutsOf(ui, 'nextView')} onClick=${() => showView(app, k)}>
        <${Thumbnail} name=${picture} generation=${ui.resources[picture]} app=${app} />
        <span class="view-name">${name}</span>
        <span class="faint">${note}</span>
      </button>`;
    })}
  </div>`;
}
