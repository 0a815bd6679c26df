/** The dialog before lights move: what the search will do, and about how long it takes. */

import { html, useEffect, useState } from '../../vendor/preact.js';
import { Button, Dialog } from '../controls.js';
import { durationText } from '../format.js';
import { t } from '../../language/language.js';

/** @typedef {import("../shortcuts.js").App} App */
/** @typedef {import("../../engine/messages.js").Events["place_estimate"]} Estimate */

/** @param {{app: App, close: () => void}} props */
export function MoveDialog({ app, close }) {
  const { session } = app;
  const [estimate, setEstimate] = useState(/** @type {Estimate | null} */ (null));
  useEffect(() => {
    let isClosed = false;
    void session.send('estimate_place').then((reply) => {
      if (isClosed) return;
      if (reply?.kind === 'place_estimate') setEstimate(/** @type {any} */ (reply));
      else close(); // a toast says why
    });
    return () => {
      isClosed = true;
    };
  }, []);
  const begin = () => {
    close();
    void session.placeLights();
  };
  return html`<${Dialog} title=${t('Let lights move')} close=${close} class="move">
    <p role="status">${estimate ? estimate.text : t('Estimating the time …')}</p>
    ${estimate && html`<p><strong>${timeText(estimate)}</strong></p>`}
    <p class="faint">${t('You can go on looking and painting meanwhile, and stop at any time: with the best so far, or with every light where it is.')}</p>
    <div class="row"><${Button} label=${t('Cancel')} act=${close} />
      <${Button} icon="search" label=${t('Begin')} primary disabled=${!estimate} act=${begin} /></div>
  </${Dialog}>`;
}

/** @param {Estimate} estimate */
function timeText({ seconds, is_measured: isMeasured }) {
  const [low, high] = seconds.map(durationText);
  const time = low === high ? low : t('{low} to {high}', { low, high });
  return isMeasured
    ? t('About {time}, as an earlier search here.', { time })
    : t('About {time}.', { time });
}
