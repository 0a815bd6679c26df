/** The texels of an image, to be painted, locked and released on its map. */

import { Hex, Hsv, MIXERS, Rgb, White } from '../colour_mixers.js';
import { Choice, Slider, useId } from '../controls.js';
import { signedText, whiteText } from '../format.js';
import { stopsOf } from '../level_field.js';
import { atFullBrightness, toHex, toKelvin } from '../paint_colour.js';
import { html, useLayoutEffect, useRef, useState } from '../../vendor/preact.js';
import { fill, words } from '../../language/language.js';
import { drawMap } from './image_map.js';
import { blockAt, firstPlaces, mapStops, wholeLight } from './light_images.js';
import { MAX_STOPS, MIN_STOPS, applyTool, clamp, pick, placeAt, useTexelStroke } from './texel_stroke.js';

/** @typedef {import("../engine_interface.js").RGB} RGB */
/** @typedef {import("../ui_state.js").Ui} Ui */
/** @typedef {import("../shortcuts.js").App} App */
/** @typedef {import("./image_state.js").LightImage} LightImage */
/** @typedef {import("./texel_stroke.js").Place} Place */

const TOOLS = [
  { value: 'paint', label: words.images.paint, tip: words.images.paintTexels },
  { value: 'lock', label: words.images.lock, tip: words.images.lockTexels },
  { value: 'release', label: words.images.release, tip: words.images.releaseTexels },
];

/** @param {{image: LightImage, ui: Ui, app: App, held: number[]}} props */
export function TexelMap({ image, ui, app, held }) {
  const [place, setPlace] = useState(/** @type {Place | null} */ (null));
  return html`<div class="texels">
    <${Grid} image=${image} ui=${ui} app=${app} held=${held} place=${place} setPlace=${setPlace} />
    <p class="faint texel-text">${place ? texelText(image, ui, held, place) : words.images.dragToPaint}</p>
    <${Choice} label=${words.images.drag} value=${ui.texelTool} choices=${TOOLS}
      change=${(/** @type {Ui["texelTool"]} */ texelTool) => app.store.set({ texelTool })} />
    ${ui.texelTool === 'paint' && html`<${Paint} ui=${ui} app=${app} />`}
  </div>`;
}

/** The colour and the brightness of the paint. @param {{ui: Ui, app: App}} props */
function Paint({ ui, app }) {
  const { texelColour: colour, texelMixer: mixer, texelStops } = ui;
  const set = (/** @type {RGB} */ newColour) => {
    if (Math.max(...newColour) > 0) app.store.set({ texelColour: atFullBrightness(newColour) });
  };
  return html`<div class="lamp-colour colour" role="group" aria-label=${words.images.paintOfTexels}>
    <div class="colour-row">
      <span class="dot" aria-hidden="true" style=${{ background: toHex(colour) }}></span>
      <${Hex} colour=${colour} set=${set} />
      <${Choice} label=${words.lampColour.colourModel} value=${mixer} choices=${MIXERS}
        change=${(/** @type {Ui["texelMixer"]} */ texelMixer) => app.store.set({ texelMixer })} />
    </div>
    ${mixer === 'white' && html`<${White} colour=${colour} set=${set} isPure />`}
    ${mixer === 'hsv' && html`<${Hsv} colour=${colour} set=${set} hasValue=${false} />`}
    ${mixer === 'rgb' && html`<${Rgb} colour=${colour} set=${set} />`}
    <${Slider} label=${words.images.brightness} value=${texelStops} min=${MIN_STOPS} max=${MAX_STOPS} step=${0.1}
      digits=${1} resetValue=${0} unit=${words.images.st} tip=${words.images.stopsFromTheMean}
      change=${(/** @type {number} */ stops) => app.store.set({ texelStops: stops })} />
  </div>`;
}

/** The map, on which the pointer and the keys reach each texel.
 * @param {{image: LightImage, ui: Ui, app: App, held: number[], place: Place | null,
 *   setPlace: (place: Place | null) => void}} props */
function Grid({ image, ui, app, held, place, setPlace }) {
  const id = useId();
  const canvas = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const [key, setKey] = useState(/** @type {Place} */ ([0, 0]));
  const [rows, columns] = [image.places.length, image.places[0].length];
  const stroke = useTexelStroke(image, ui, app, (next) => {
    setKey(next);
    setPlace(next);
  });
  useLayoutEffect(() => {
    if (!canvas.current) return;
    drawMap(canvas.current, image, ui.weights, stroke.stops() ?? mapStops(image, ui.weights));
  });
  const texelAt = (/** @type {Place} */ [row, column]) => image.places[row][column];
  const move = (/** @type {PointerEvent} */ event) => {
    const next = placeAt(event, rows, columns);
    if (String(next) !== String(place)) setPlace(next);
    stroke.move(next);
  };
  const press = (/** @type {KeyboardEvent} */ event) => {
    const step = KEY_STEPS[event.key];
    const isApplied = event.key === 'Enter' || event.key === ' ';
    if (!step && !isApplied) return;
    event.preventDefault();
    event.stopPropagation();
    if (step) {
      const block = blockAt(image, key);
      const next = /** @type {Place} */ ([
        clamp(stepped(key[0], step[0], block.row, block.rows), rows),
        clamp(stepped(key[1], step[1], block.column, block.columns), columns),
      ]);
      setKey(next);
      setPlace(next);
    } else if (event.altKey) pick(image, ui, app, texelAt(key));
    else applyTool(image, ui, app, [texelAt(key)].filter((k) => k >= 0), true);
  };
  const cellId = `${id}-${key.join('-')}`;
  return html`<div class="texel-map" role="grid" tabindex="0" aria-label=${fill(words.images.map, { name: image.name })}
    aria-rowcount=${rows} aria-colcount=${columns} aria-activedescendant=${cellId}
    style=${{ aspectRatio: String(image.aspect) }} onKeyDown=${press}
    onFocus=${() => setPlace(key)} onBlur=${() => setPlace(null)}
    onPointerDown=${stroke.begin} onPointerMove=${move} onPointerUp=${stroke.end} onPointerCancel=${stroke.end}
    onPointerLeave=${() => stroke.stops() === null && setPlace(null)}>
    <canvas class="image-map" ref=${canvas} aria-hidden="true"></canvas>
    <${Locks} image=${image} held=${held} />
    ${place && html`<i class="texel-here" aria-hidden="true" style=${cellStyle(image, place)}></i>`}
    <div role="row" aria-rowindex=${key[0] + 1}>
      <div key=${cellId} id=${cellId} role="gridcell" class="texel-key" aria-colindex=${key[1] + 1}
        aria-label=${texelText(image, ui, held, key)} style=${cellStyle(image, key)}></div>
    </div>
  </div>`;
}

/** A mark on each locked texel. @param {{image: LightImage, held: number[]}} props */
function Locks({ image, held }) {
  const locked = new Set(held);
  return firstPlaces(image)
    .filter(([row, column]) => locked.has(image.places[row][column]))
    .map(
      (place) => html`<i key=${place.join(' ')} class="texel-lock" aria-hidden="true"
        style=${cellStyle(image, place)}></i>`,
    );
}

/** Return where a texel lies on the map. @param {LightImage} image @param {Place} place */
function cellStyle(image, place) {
  const [rows, columns] = [image.places.length, image.places[0].length];
  const block = blockAt(image, place);
  return {
    left: `${(100 * block.column) / columns}%`,
    top: `${(100 * block.row) / rows}%`,
    width: `${(100 * block.columns) / columns}%`,
    height: `${(100 * block.rows) / rows}%`,
  };
}

/** Steps of the keys, in rows and columns. @type {Record<string, Place>} */
const KEY_STEPS = {
  ArrowUp: [-1, 0],
  ArrowDown: [1, 0],
  ArrowLeft: [0, -1],
  ArrowRight: [0, 1],
  Home: [0, -Infinity],
  End: [0, Infinity],
};

/** Return the index some steps away from a texel, which has `count` indices from `first` on.
 * @param {number} index @param {number} step @param {number} first @param {number} count */
function stepped(index, step, first, count) {
  if (step === 0) return index;
  return step > 0 ? first + count - 1 + step : first + step;
}

/** Return a texel in words. @param {LightImage} image @param {Ui} ui @param {number[]} held
 * @param {Place} place */
function texelText(image, ui, held, [row, column]) {
  const k = image.places[row][column];
  const where = { column: column + 1, row: row + 1 };
  if (k < 0) return fill(words.images.notAdjusted, where);
  const rgb = ui.weights[k] ?? ui.lights[k].present;
  const stops = stopsOf(rgb, wholeLight(image, ui.lights));
  const white = toKelvin(rgb);
  const colour = white ? whiteText(white.kelvin, white.green) : toHex(atFullBrightness(rgb));
  const light =
    stops === null
      ? words.lightRow.off
      : `${colour} · ${fill(words.manyLights.st, { signed: signedText(stops) })}`;
  const text = fill(words.images.texel, { ...where, light });
  return held.includes(k) ? fill(words.images.texelLocked, { text }) : text;
}
