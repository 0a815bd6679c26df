/** How much of a layer's wish came: a bar each for brightness and for colour, on its row. */

import { html } from '../../vendor/preact.js';
import { t } from '../../language/language.js';

/** @import { Ui } from '../ui_state.js' */
/** @import { Layer } from '../../engine/messages.js' */

/** Least share of a change that has to come, as in `MIN_DELIVERED` of delivery.py. */
const MIN_DELIVERED = 0.75;

/** Return the entry of a layer or a group; undefined if there is none.
 * @param {Ui} ui @param {Layer} layer */
function deliveryOf({ deliveries, layers }, layer) {
  if (layer.kind !== 'group')
    return deliveries.find(({ kind, layers: ids }) => kind === 'layer' && ids[0] === layer.id);
  const members = layers.filter(({ group }) => group === layer.id).map(({ id }) => id);
  return deliveries.find(
    ({ kind, layers: ids }) => kind === 'group' && ids.some((id) => members.includes(id)),
  );
}

/** @param {{ui: Ui, layer: Layer}} props */
export function LayerDelivery({ ui, layer }) {
  const delivery = layer.is_visible ? deliveryOf(ui, layer) : undefined;
  if (!delivery) return null;
  const { brightness, color } = delivery;
  if (brightness === null && color === null) return null;
  const text = deliveryText(delivery);
  return html`<span class=${`layer-came ${ui.isJudgementCurrent ? '' : 'is-old'}`} role="img"
    aria-label=${text} data-tip=${text}>
    ${brightness !== null && html`<${Bar} share=${brightness} />`}
    ${color !== null && html`<${Bar} share=${color} isColour />`}
  </span>`;
}

/** @param {{share: number, isColour?: boolean}} props */
function Bar({ share, isColour = false }) {
  const kind = [isColour && 'is-colour', share < MIN_DELIVERED && 'is-short'];
  const width = `${100 * Math.min(Math.max(share, 0), 1)}%`;
  return html`<i class=${kind.filter(Boolean).join(' ')}><b style=${{ width }}></b></i>`;
}

/** @typedef {{brightness: number | null, color: number | null}} Shares */

/** Return a delivered share in whole percent; 0 if it went the other way. @param {number} share */
export const percentOf = (share) => Math.max(Math.round(100 * share), 0);

/** Return the shares that something was asked of, brightness first. @param {Shares} shares */
export const knownShares = ({ brightness, color }) =>
  [brightness, color].filter((share) => share !== null);

/** Share from which too much came, as in `OVERDONE` of delivery.py. */
const OVERDONE = 1.25;

/** Say by how much too much came. @param {Shares & {is_darker?: boolean}} delivery */
function overdoneTexts({ brightness, color, is_darker: isDarker }) {
  const [lit, coloured] = [brightness ?? 0, color ?? 0].map((share) => share.toFixed(1));
  const texts = [];
  if ((brightness ?? 0) >= OVERDONE)
    texts.push(
      isDarker
        ? t('darkened {number} times as much as painted', { number: lit })
        : t('brightened {number} times as much as painted', { number: lit }),
    );
  else if (brightness !== null)
    texts.push(t('{value} % of the brightness came', { value: percentOf(brightness) }));
  if ((color ?? 0) >= OVERDONE)
    texts.push(t('coloured {number} times as much as painted', { number: coloured }));
  else if (color !== null)
    texts.push(t('{value} % of the colour came', { value: percentOf(color) }));
  return texts.join(', ');
}

/** Say how much came: `98 % of the brightness and 43 % of the colour came`.
 * @param {Shares & {is_darker?: boolean}} delivery */
function deliveryText(delivery) {
  const { brightness, color } = delivery;
  if (Math.max(brightness ?? 0, color ?? 0) >= OVERDONE) return overdoneTexts(delivery);
  const [value, colour] = [percentOf(brightness ?? 0), percentOf(color ?? 0)];
  if (brightness === null) return t('{value} % of the change of colour came', { value: colour });
  if (color === null) return t('{value} % of the change of brightness came', { value });
  return t(
    'Of what it asks for, {brightness} % of the brightness and {colour} % of the colour came',
    { brightness: value, colour },
  );
}
