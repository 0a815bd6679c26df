/** The panel that shows where and why the answer differs, and verifies it with a render. */

import { html, useEffect, useLayoutEffect, useMemo, useRef } from '../vendor/preact.js';
import { Button, Choice, ProgressBar, option } from './controls.js';
import { numberText, progressText, joinUnits } from './format.js';
import { Icon } from './icons.js';
import { overlayOf } from './display_state.js';
import { overlaysOf, updateDisplay } from './tools.js';
import { t } from '../language/language.js';
import { shortcutsOf } from './key_bindings.js';
import { luxLegend } from './planes/plane_overlay.js';
import { SCALE_GRADIENT } from './planes/plane_picture.js';

/** @import { App, Pane, Ui } from './ui_state.js' */

const OVERLAYS = [
  option(null, t('None')),
  option('missed', t('Difference'), t('Where the answer differs from the painting')),
  option('beyond', t('Out of reach'), t('What no setting of these lights can do')),
  option('falsecolor', t('False colour'), t('Brightness in stops')),
  option('importance', t('Importance'), t('What is painted, and how much it counts')),
  option('lux', t('Lux'), t('Illuminance on the measuring planes')),
];

const PAINTED_LABEL = t('painted');

/** Legends of the overlays: colours and hatches. @type {Record<string, string[]>} */
const LEGEND_TEXTS = {
  missed: [t('too dark'), t('matches'), t('too bright')],
  beyond: [t('in reach'), t('out of reach')],
  falsecolor: [t('−6 stops'), t('grey'), '+6'],
  importance: [t('unpainted'), PAINTED_LABEL],
};

/** @param {{ui: Ui, app: App}} props */
export function AnalysisPanel({ ui, app }) {
  const { session, store } = app;
  const choose = (/** @type {any} */ overlay) => updateDisplay(store, { overlay });
  const frame = useRef(/** @type {HTMLElement | null} */ (null));
  // The reasons need more room than the text before them.
  useLayoutEffect(() => {
    const panel = /** @type {HTMLElement | null | undefined} */ (frame.current?.closest('.fold'));
    if (panel && ui.reasons.length && isVisible(panel)) panel.scrollIntoView({ block: 'nearest' });
  }, [ui.reasons]);
  const available = /** @type {(string | null)[]} */ (overlaysOf(ui));
  const choices = OVERLAYS.filter(({ value }) => available.includes(value));
  // The first reason is also below the pictures.
  const sentences = (ui.reasons.length ? ui.reasons : ui.sentences).filter(
    (text) => text !== ui.headline,
  );
  return html`<div class="truth" ref=${frame}>
    <${Choice} label=${t('Overlay')} value=${ui.display.overlay} 
      choices=${choices.map((choice) => ({ ...choice, keys: shortcutsOf(ui, 'overlay') }))}
      change=${choose} />
    ${sentences.map((text) => html`<p key=${text}>${joinUnits(text)}</p>`)}
    <div class="row">
      <${Button} label=${ui.isExplaining ? t('Finding reasons …') : t('Why not closer?')}
        disabled=${ui.isExplaining} act=${() => session.explain()}
        tip=${t('What keeps the answer from matching the painting')} />
      ${ui.isExplaining && html`<${ProgressBar} progress=${{ done: 0, total: 0 }} label=${t('Finding reasons')} />`}
      ${ui.state?.can_render && html`<${VerifyButton} ui=${ui} app=${app} />`}
    </div>
    ${ui.verification && html`<${VerificationResult} ui=${ui} app=${app} />`}
  </div>`;
}

/** Return whether part of a panel is visible in the side bar. @param {HTMLElement} panel */
function isVisible(panel) {
  const [box, visibleBox] = [panel, /** @type {HTMLElement} */ (panel.parentElement)].map(
    (element) => element.getBoundingClientRect(),
  );
  return box.top < visibleBox.bottom - 60 && box.bottom > visibleBox.top + 60;
}

/** CSS pixels: height of a legend, of one on a single line, and the gap to its picture. */
const LEGEND = { width: 210, height: 60, low: 22, gap: 8 };

/** Place it where it covers nothing: below the picture, else beside it; without room for either, on
 * the picture, as a single line. @param {Pane} pane
 * @param {[height: number, width: number]} size */
function placeLegend(pane, [rows, columns]) {
  const { width, height, low, gap } = LEGEND;
  const left = Math.max(pane.x, pane.left);
  // The handle of the wipe lies there.
  const margin = left > Math.max(0, pane.left) ? 3 * gap : gap;
  const right = Math.min(pane.x + pane.width, pane.left + columns * pane.scale);
  const bottom = Math.min(pane.y + pane.height, pane.top + rows * pane.scale);
  const roomBelow = pane.y + pane.height - bottom;
  if (roomBelow >= height + gap) return { left: left + margin, top: bottom + gap };
  if (roomBelow >= low + 4) return { left: left + margin, top: bottom + 2, isLow: true };
  const neededRoom = width + 2 * gap;
  if (pane.x + pane.width - right >= neededRoom) return { left: right + gap, top: bottom - height };
  if (left - pane.x >= neededRoom) return { left: left - gap - width, top: bottom - height };
  return { left: left + margin, top: bottom - low - gap, isLow: true };
}

/** The legend at a picture with an overlay. The overlay of what is out of reach is requested again
 * when it is visible and the answer has changed.
 * @param {{ui: Ui, app: App, panes: Pane[]}} props */
export function Legend({ ui, app, panes }) {
  const overlay = overlayOf(ui);
  const isOutdated = overlay === 'beyond' && ui.deltaE !== null && !ui.isLive && !ui.reasons.length;
  useEffect(() => {
    if (isOutdated && !ui.isExplaining) app.session.explain();
  }, [isOutdated, ui.isExplaining]);
  const showsImportance = overlay === 'importance';
  const maxWeight = useMemo(
    () => (showsImportance ? app.engine.maxImportance() : 1),
    [showsImportance, ui.version, ui.weights, ui.view],
  );
  const legendKind = overlay === 'importance' ? 'painting' : 'solution';
  const pane =
    panes.find(({ kind }) => kind === legendKind) ??
    (overlay === 'falsecolor' ? panes[0] : undefined);
  if (!overlay || !pane) return null;
  const { title, texts } = legendTexts(ui, overlay, maxWeight);
  const isOld = overlay === 'beyond' && !ui.reasons.length;
  const { left, top, isLow } = placeLegend(pane, ui.state.size);
  return html`<div class=${`legend ${isLow ? 'is-low' : ''}`}
    style=${{ top: `${top}px`, left: `${left}px` }}>
    <b>${title}${isOld && ui.deltaE !== null ? t(': computing …') : ''}</b>
    <i class=${`is-${overlay}`} style=${overlay === 'lux' ? { background: SCALE_GRADIENT } : {}}></i>
    ${texts.map((text, k) => html`<span key=${k}>${text}</span>`)}
  </div>`;
}

/** Return the title of a legend and what stands at its colours. @param {Ui} ui
 * @param {string} overlay @param {number} maxWeight the greatest importance */
function legendTexts(ui, overlay, maxWeight) {
  if (overlay === 'lux') return luxLegend(ui);
  const title = OVERLAYS.find(({ value }) => value === overlay)?.label ?? '';
  const texts = LEGEND_TEXTS[overlay].map((text) =>
    text === PAINTED_LABEL && maxWeight > 1
      ? t('weight {number} ×', { number: numberText(maxWeight, 2) })
      : text,
  );
  return { title, texts };
}

/** @param {{ui: Ui, app: App}} props */
function VerifyButton({ ui, app }) {
  const { session } = app;
  if (!ui.verificationProgress) {
    // Ignore the second click of a double click on "Analysis", under which the button appears.
    const begin = (/** @type {MouseEvent} */ { detail }) => detail < 2 && session.verify();
    return html`<${Button} label=${t('Verify')} icon="camera" act=${begin}
      tip=${t('Render the scene with this lighting, and compare')} />`;
  }
  return html`<${Button} label=${t('Stop')} icon="close" act=${() => session.verify(false)} />
    <${ProgressBar} progress=${ui.verificationProgress} label=${t('Verifying')} />
    <span class="faint">${progressText(ui.verificationProgress)}</span>`;
}

/** @param {{ui: Ui, app: App}} props */
function VerificationResult({ ui, app }) {
  const { verification, display } = ui;
  const frame = useRef(/** @type {HTMLElement | null} */ (null));
  // Scroll to it: it may be outside the visible part.
  useLayoutEffect(() => frame.current?.scrollIntoView?.({ block: 'nearest' }), [verification]);
  if (!verification) return null;
  const isShown = display.left === 'solution' && display.right === 'verified';
  const compare = () => {
    app.store.set({ mix: null });
    updateDisplay(
      app.store,
      isShown
        ? { left: 'painting', right: 'solution', layout: 'side' }
        : { left: 'solution', right: 'verified', layout: 'wipe', solutionWeights: null },
    );
  };
  return html`<div ref=${frame} class=${`verified ${verification.agrees ? 'is-good' : 'is-bad'}`}>
    <p><${Icon} name=${verification.agrees ? 'check' : 'warn'} /><span>${verification.text}${
      verification.isOld ? t(' (of an earlier answer)') : ''
    }</span></p>
    <${Button} label=${t('Answer | Render')} icon="wipe" pressed=${isShown} act=${compare} />
  </div>`;
}
