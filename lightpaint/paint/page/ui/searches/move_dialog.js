/** The dialog before lights move: what the search will do, and about how long it takes. */

import { html, useEffect, useState } from '../../vendor/preact.js';
import { Button, Dialog } from '../controls.js';
import { durationText } from '../format.js';
import { fill, words } from '../../language/language.js';

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
  return html`<${Dialog} title=${words.advice.letLightsMove} close=${close} class="move">
    <p role="status">${estimate ? estimate.text : words.searches.estimating}</p>
    ${estimate && html`<p><strong>${timeText(estimate)}</strong></p>`}
    <p class="faint">${words.searches.goesOn}</p>
    <div class="row"><${Button} label=${words.advice.cancel} act=${close} />
      <${Button} icon="search" label=${words.searches.begin} primary disabled=${!estimate} act=${begin} /></div>
  </${Dialog}>`;
}

/** @param {Estimate} estimate */
function timeText({ seconds, is_measured: isMeasured }) {
  const [low, high] = seconds.map(durationText);
  const text = isMeasured ? words.searches.measured : words.searches.about;
  return low === high
    ? fill(text, { time: low })
    : fill(text, { time: fill(words.searches.fromTo, { low, high }) });
}
