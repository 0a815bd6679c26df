/** Small pictures of the answers with other light colours, beside the sentence: a click chooses one. */

import { nameInView } from '../engine/message_frames.js';
import { html } from '../vendor/preact.js';
import { option } from './controls.js';
import { numberText } from './format.js';
import { knownShares, percentOf } from './layers/layer_delivery.js';
import { Thumbnail } from './thumbnail.js';
import { t } from '../language/language.js';

/** @import { App, Ui } from './ui_state.js' */
/** @import { AnswerChoice, Events } from '../engine/messages.js' */

/** From the least freedom of the lamps to the most. */
const CHOICES = [
  option(
    'own',
    t('Own colours'),
    t('Lamps keep the colours they have, and only get brighter or dimmer.'),
  ),
  option(
    'gentle',
    t('As painted'),
    t('Lamps take the whites and colours that the painting asks for.'),
  ),
  option('free', t('Bold'), t('Lamps may take any hue that is white, painted or their own.')),
];

/** Take the choices of the session. @param {Events["choices"]} message
 * @param {Ui} ui @returns {Partial<Ui>} */
export function choicesUpdate({ version, choices, resources }, ui) {
  return { choices, choicesVersion: version, resources: { ...ui.resources, ...resources } };
}

/** @param {{ui: Ui, app: App}} props */
export function AnswerChoices({ ui, app }) {
  if (!ui.ready) return null;
  const isUnpainted = ui.deltaE === null && !ui.isLive && ui.isJudgementCurrent;
  const isOld = ui.isLive || ui.version > ui.choicesVersion;
  return html`<div class=${`choices ${isOld ? 'is-old' : ''}`} role="group"
    aria-label=${t('Light colours of the answer')}>
    ${CHOICES.map((choice) => {
      const answer = isUnpainted
        ? undefined
        : ui.choices.find(({ colors }) => colors === choice.value);
      return html`<${ChoiceButton} key=${choice.value} ...${choice} answer=${answer} ui=${ui} app=${app} />`;
    })}
  </div>`;
}

/** @param {{value: string, label: string, tip: string, answer?: AnswerChoice, ui: Ui, app: App}} props */
function ChoiceButton({ value: colors, label, tip, answer, ui, app }) {
  const isChosen = ui.effectiveSettings.colors === colors;
  const picture = nameInView(`choice/${colors}`, ui.view);
  const text = answer ? `${label}. ${deliveredText(answer)}` : `${label}.`;
  const shares = answer ? sharesText(answer) : '';
  const choose = () => {
    if (!isChosen) void app.session.changeSetting('colors', colors);
  };
  return html`<button type="button" class="answer-choice" aria-pressed=${String(isChosen)}
    aria-label=${text} data-tip=${`${text} ${tip}`} onClick=${choose}>
    ${
      answer
        ? html`<${Thumbnail} key="picture" name=${picture} generation=${ui.resources[picture]} app=${app} />`
        : html`<span key="none" class="thumb"></span>`
    }
    ${shares && html`<b class=${answer?.worst ? 'is-short' : ''}>${shares}<i> %</i></b>`}
    <span>${label}</span>
  </button>`;
}

/** Return what came of brightness and of colour in percent, `98 · 43`; `98 · –` if the painting asks for
 * no other colour, '' if it asks for neither. @param {AnswerChoice} answer */
const sharesText = ({ brightness, color }) =>
  brightness === null && color === null
    ? ''
    : [brightness, color].map((share) => (share === null ? '–' : percentOf(share))).join(' · ');

/** Say how much came of the wishes. @param {AnswerChoice} answer */
function askedText({ brightness, color }) {
  const [value, colour] = [percentOf(brightness ?? 0), percentOf(color ?? 0)];
  if (brightness === null) return t('{value} % of the asked colour came.', { value: colour });
  if (color === null) return t('{value} % of the asked brightness came.', { value });
  return t('{brightness} % of the asked brightness and {colour} % of the asked colour came.', {
    brightness: value,
    colour,
  });
}

/** Say how much came, of which wish least, and how far the answer is. @param {AnswerChoice} answer */
function deliveredText(answer) {
  const { delta_e: deltaE, worst } = answer;
  const least = percentOf(Math.min(...knownShares(answer)));
  const worstShare = worst ? percentOf(Math.min(...knownShares(worst))) : least;
  return [
    knownShares(answer).length && askedText(answer),
    worst &&
      worstShare < least &&
      t('Least came of {name}: {value} %.', { name: worst.name, value: worstShare }),
    t('Mean ΔE {number} from the painting.', { number: numberText(deltaE, 2) }),
  ]
    .filter(Boolean)
    .join(' ');
}
