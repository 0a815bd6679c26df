/** The lines below the pictures: how close the answer is, and the light under the pointer. */

import { html } from '../vendor/preact.js';
import { AdviceButton } from './advice.js';
import { AnswerChoices } from './answer_choices.js';
import { Button, TruncatedText, reveal } from './controls.js';
import { lightText, numberText, shortenName } from './format.js';
import { imageOf } from './images/light_images.js';
import { luxAtPointer } from './planes/plane_overlay.js';
import { pointingHint } from './lamp_fields.js';
import { isAnswerHidden, saveLook } from './look_actions.js';
import { toolHint } from './tools.js';
import { exposureOf } from './display_state.js';
import { t } from '../language/language.js';
import { shortcutsOf } from './key_bindings.js';

/** @import { App, Ui } from './ui_state.js' */

const DELTA_E_TIP = t(
  'Mean colour difference from the painting (ΔE 2000), and what it was with the current lighting. 1 is just visible, 5 is obvious.',
);

const MASTER_TIP = t(
  'The master dimmer changes the pictures and what is exported. The sentence describes the answer without it.',
);

/** States of the sentence. */
const STATES = { live: t('live'), analysing: t('analysing'), hidden: t('answer not shown') };

const STATE_TIPS = {
  live: t('A quick answer while you paint. The exact one follows.'),
  analysing: t('The lights are solved. The sentence still describes the previous answer.'),
  hidden: t('The sentence describes the answer, which is neither of the looks compared.'),
};

/** One sentence below the pictures: how close the answer is.
 * @param {{ui: Ui, app: App}} props */
export function AnswerLine({ ui, app }) {
  const { store } = app;
  const text = ui.headline || (ui.ready ? t('Solving …') : '');
  const isOpen = ui.side && !ui.panel && ui.open.truth;
  const isOld = ui.headline !== '' && !ui.isJudgementCurrent;
  const progressState = ui.isLive ? 'live' : isOld ? 'analysing' : null;
  const isHidden = isAnswerHidden(ui);
  const state = isHidden && text ? 'hidden' : progressState;
  const toggleAnalysis = (/** @type {MouseEvent} */ event) => {
    const button = /** @type {HTMLElement} */ (event.currentTarget);
    store.set({ side: true, panel: null, open: { ...ui.open, truth: !isOpen } });
    if (!isOpen) reveal(button, '.is-truth');
  };
  return html`<div class="answer">
    <p class=${`headline ${isOld || isHidden ? 'is-old' : ''}`} role="status">
      <${TruncatedText} class="said" text=${text} maxLength=${100} />
      ${
        // Always in the same place, so that the sentence does not rewrap.
        state &&
        html`<span class="live" data-tip=${STATE_TIPS[state]}><b>${STATES[state]}</b></span>`
      }
      ${
        !state &&
        ui.deltaE !== null &&
        html`<span class="faint" data-tip=${DELTA_E_TIP}>${t('ΔE')} ${numberText(ui.deltaE, 2)}${
          ui.deltaPresent !== null &&
          html`<span class="was">${t(', was {number}', { number: numberText(ui.deltaPresent, 2) })}</span>`
        }</span>`
      }
      ${
        ui.master !== 1 &&
        html`<span class="faint" data-tip=${MASTER_TIP}>${t('before the master')}</span>`
      }
    </p>
    <${AdviceButton} ui=${ui} app=${app} />
    <${AnswerChoices} ui=${ui} app=${app} />
    ${
      ui.ready &&
      html`<${Button} label=${t('Save look')} icon="plus" keys=${shortcutsOf(ui, 'saveLook')}
      tip=${t('Save painting and answer as a look')}
      act=${() => saveLook(app)} />`
    }
    ${
      // The button keeps its place when pressed, so that nothing else slides under the pointer.
      ui.ready && html`<${Button} label=${t('Analysis')} pressed=${isOpen} act=${toggleAnalysis} />`
    }
  </div>`;
}

/** The light under the pointer and the lights that contribute to it, or else the tool's hint.
 * @param {{ui: Ui}} props */
export function PointerStatus({ ui }) {
  if (ui.clickAction) {
    const text = pointingHint(ui.clickAction, ui.lights);
    return html`<p class="here" id="lp-status" role="status"><strong>${text}</strong></p>`;
  }
  if (ui.isLassoing) {
    const text = ui.rig
      ? t('Draw around the marks of the lights to select them. Escape ends it.')
      : t('Looking where the lights hang …');
    return html`<p class="here" id="lp-status" role="status"><strong>${text}</strong></p>`;
  }
  if (!ui.probe) {
    const text = ui.ready ? toolHint(ui.tool) : ''; // there is nothing to drag on yet
    return html`<p class="here" id="lp-status"><span class="hint-text">${text}</span></p>`;
  }
  const { object, shares, light } = ui.probe;
  const exposedLight = light.map((x) => x * 2 ** exposureOf(ui.state));
  const largestShares = sharesByName(ui, isAnswerHidden(ui) ? [] : shares)
    .filter(({ share }) => share >= 0.01)
    .sort((a, b) => b.share - a.share)
    .slice(0, 5);
  const lux = luxAtPointer(ui);
  return html`<p class="here" id="lp-status">${lux && html`<strong>${lux}</strong>`}${object && html`<span class="object">${shortenName(object, 40)}</span>`}
    <span class="light-here">${lightText(exposedLight)}${
      ui.tool === 'pick' && html` · RGB ${exposedLight.map((x) => numberText(x, 3)).join(' ')}`
    }</span>
    ${largestShares.map(
      ({ share, key, name }) => html`<span key=${key}>${shortenName(name, 24)}
      <b>${Math.round(100 * share)} %</b></span>`,
    )}</p>`;
}

/** Return the share of each light, and of each image the sum over its texels.
 * @param {Ui} ui @param {number[]} shares */
function sharesByName(ui, shares) {
  /** @type {Map<unknown, {key: string, name: string, share: number}>} */
  const sums = new Map();
  const { images, lights } = ui;
  shares.forEach((share, k) => {
    const image = share ? imageOf(images, k) : null;
    const sum = sums.get(image ?? k);
    if (sum) sum.share += share;
    else if (share) {
      const name = image?.name ?? lights[k]?.label ?? '';
      sums.set(image ?? k, { key: image ? `image ${name}` : `${k}`, name, share });
    }
  });
  return [...sums.values()];
}
