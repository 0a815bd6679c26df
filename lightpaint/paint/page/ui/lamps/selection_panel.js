/** What is done to all selected lights, each time as one step. */

import { Button } from '../controls.js';
import { lightCountText, signedText, stopsText } from '../format.js';
import { gradient } from '../kelvin_slider.js';
import { stopsOf } from '../level_field.js';
import { fromKelvin } from '../paint_colour.js';
import { findTie } from '../tied_lights.js';
import { html, useState } from '../../vendor/preact.js';
import { LampColour } from './lamp_colour.js';
import { adjustableLights, colouredLights, isHeld } from './many_lights.js';
import { RelativeSlider, parseMired, parseStops } from './relative_dimmer.js';
import { fill, words } from '../../language/language.js';

/** @typedef {import("../shortcuts.js").App} App */
/** @typedef {import("../ui_state.js").Ui} Ui */

/** Ends of the sliders, in stops and in mireds. */
const [DIM_RANGE, WARM_RANGE] = [4, 100];

/** Cooler to warmer, as light around 4000 K looks. */
const WARM_TRACK = gradient([9000, 5600, 4000, 3000, 2300].map((kelvin) => fromKelvin(kelvin)));

/** A slider that dims lights by stops, and keeps their ratio.
 * @param {{app: App, lights: number[], label: string, isPlain?: boolean, disabled?: boolean}} props */
export function GroupDimmer({ app, lights, label, isPlain, disabled }) {
  return html`<${RelativeSlider} label=${label} range=${DIM_RANGE} step=${0.1} isPlain=${isPlain}
    disabled=${disabled} text=${(/** @type {number} */ stops) => fill(words.selectionPanel.st, { signed: signedText(stops) })} parse=${parseStops}
    tip=${words.selectionPanel.dimsTheseLightsTogetherWhich}
    hint=${words.selectionPanel.typeStops} say=${(/** @type {string} */ text) => app.session.toast(text)}
    change=${(/** @type {number} */ stops, /** @type {boolean} */ isFinal) =>
      app.session.many.dim(lights, 2 ** stops, isFinal)} />`;
}

/** @param {{ui: Ui, app: App}} props */
export function SelectionPanel({ ui, app }) {
  const [hasColour, setHasColour] = useState(false);
  const { selectedLights: lights } = ui;
  if (!lights.length) return null;
  const { many } = app.session;
  const coloured = colouredLights(ui, lights);
  const fixedCount = lights.length - adjustableLights(ui, lights).length;
  return html`<section class="lamp-selection" aria-label=${words.selectionPanel.selectedLights}>
    <div class="row">
      <strong role="status">${fill(words.selectionPanel.selected, { count: lightCountText(lights.length) })}</strong>
      <span class="faint">${levelsText(ui, lights)}</span><span class="spring"></span>
      <${Button} icon="close" tip=${words.selectionPanel.selectNone} keys="Escape" act=${() => app.store.set({ selectedLights: [] })} />
    </div>
    <${GroupDimmer} app=${app} lights=${lights} label=${words.selectionPanel.dim} disabled=${fixedCount === lights.length} />
    <${RelativeSlider} label=${words.selectionPanel.warm} range=${WARM_RANGE} step=${5} disabled=${!coloured.length} track=${WARM_TRACK}
      text=${(/** @type {number} */ mired) => fill(words.selectionPanel.mired, { signed: signedText(mired, 0) })} parse=${parseMired}
      tip=${words.selectionPanel.warmerToTheRightInMireds} hint=${words.selectionPanel.typeMireds}
      say=${(/** @type {string} */ text) => app.session.toast(text)}
      change=${(/** @type {number} */ mired, /** @type {boolean} */ isFinal) =>
        many.warm(lights, mired, isFinal)} />
    <${Actions} ui=${ui} app=${app} hasColour=${hasColour} showColour=${setHasColour} />
    ${
      hasColour &&
      (coloured.length
        ? html`<${LampColour} ui=${ui} app=${app} lights=${coloured} />`
        : html`<p class="faint">${words.selectionPanel.tiedLightsAndLightsWithOne}</p>`)
    }
    ${fixedCount > 0 && html`<p class="faint">${fill(words.selectionPanel.ofTheseCannotBeSet, { count: lightCountText(fixedCount) })}</p>`}
  </section>`;
}

/** @param {{ui: Ui, app: App, hasColour: boolean, showColour: (isShown: boolean) => void}} props */
function Actions({ ui, app, hasColour, showColour }) {
  const { selectedLights: lights, constraints, solo } = ui;
  const { many } = app.session;
  const adjustable = adjustableLights(ui, lights);
  const areHeld = adjustable.length > 0 && adjustable.every((k) => isHeld(ui, k));
  const areOff =
    adjustable.length > 0 && adjustable.every((k) => constraints[ui.lights[k].name]?.off);
  const tie = findTie(ui, lights[0]);
  const areTied = tie !== undefined && lights.every((k) => tie.includes(ui.lights[k].name));
  const isSolo = lights.every((k) => solo.includes(k));
  const toggleSolo = () =>
    app.store.set({
      solo: isSolo ? solo.filter((k) => !lights.includes(k)) : [...new Set([...solo, ...lights])],
    });
  return html`<div class="row">
    <${Button} label=${words.selectionPanel.colour} pressed=${hasColour} tip=${words.selectionPanel.setTheColourOfAllWhite}
      act=${() => showColour(!hasColour)} />
    <${Button} label=${areHeld ? words.selectionPanel.unlock : words.selectionPanel.lock} disabled=${!adjustable.length}
      tip=${areHeld ? words.selectionPanel.letTheSolveSetThemAgain : words.selectionPanel.lockAllAsTheyAreIn}
      act=${() => void (areHeld ? many.unlock(lights) : many.lock(lights))} />
    <${Button} label=${areOff ? words.selectionPanel.on : words.selectionPanel.off} disabled=${!adjustable.length}
      tip=${areOff ? words.selectionPanel.switchAllOnAgain : words.selectionPanel.switchAllOffInEveryAnswer}
      act=${() => void (areOff ? many.unlock(lights) : many.switchOff(lights))} />
    <${Button} label=${areTied ? words.selectionPanel.untie : words.selectionPanel.tie} disabled=${adjustable.length < 2}
      tip=${areTied ? words.selectionPanel.giveEachItsOwnDimmer : words.selectionPanel.putAllOnOneDimmer}
      act=${() => void (areTied ? many.untie(lights) : many.tie(lights))} />
    <${Button} label=${words.selectionPanel.solo} pressed=${isSolo} tip=${words.selectionPanel.showTheseAloneTheAnswerDoes}
      act=${toggleSolo} />
  </div>`;
}

/** Return the levels of lights, from the lowest to the highest. @param {Ui} ui
 * @param {number[]} lights */
export function levelsText(ui, lights) {
  const levels = lights.map((k) => stopsOf(ui.weights[k] ?? ui.lights[k].present, ui.lights[k]));
  const stops = levels.filter((level) => level !== null);
  if (!stops.length) return words.selectionPanel.allOff;
  const [low, high] = [Math.min(...stops), Math.max(...stops)];
  const isEqual = stopsText(low) === stopsText(high);
  const text = isEqual
    ? stopsText(low)
    : fill(words.selectionPanel.toSt, { signed: signedText(low), signed2: signedText(high) });
  return stops.length < levels.length ? fill(words.selectionPanel.someOff, { text }) : text;
}
