/** The texels of an image, to be painted, locked and released on its map. */

import { ColourMixer } from '../colour_mixers.js';
import { Button, Choice, Slider, useId, option } from '../controls.js';
import { signedText, whiteText } from '../format.js';
import { stopsOf } from '../level_field.js';
import { atFullBrightness, toHex, toKelvin } from '../../../../viewer/drawing/colour.js';
import {
  html,
  useEffect,
  useLayoutEffect,
  useMemo,
  useRef,
  useState,
} from '../../vendor/preact.js';
import { t } from '../../language/language.js';
import { drawMap } from './image_map.js';
import { blockAt, exposureOf, firstPlaces, mapStops, wholeLight } from './light_images.js';
import { SkyMarks, directionText, skyViewOf } from './sky_marks.js';
import {
  MAX_STOPS,
  MIN_STOPS,
  applyTool,
  clamp,
  pick,
  placeAt,
  pointAt,
  useTexelStroke,
} from './texel_stroke.js';

/** @import { App, RGB, Ui } from '../ui_state.js' */
/** @import { LightImage } from './light_images.js' */
/** @import { Place } from './texel_stroke.js' */
/** @import { MapPoint } from './texel_arithmetic.js' */
/** @import { SkyView } from './sky_marks.js' */

const TOOLS = [
  option('paint', t('Paint'), t('Give texels the colour below, and lock them there')),
  option('fill', t('Fill'), t('Give all texels above the horizon, or below it, the colour below')),
  option(
    'gradient',
    t('Gradient'),
    t('Drag from where the colour below begins to where it has become the second one'),
  ),
  option(
    'sun',
    t('Sun'),
    t('Add a sun: at 0 stops it gives a surface as much light as an even sky of the mean does'),
  ),
  option('lock', t('Lock'), t('Lock texels as they are in the answer')),
  option('release', t('Release'), t('Let the solve set texels again')),
];

/** The tools that use paint. @type {Ui["texelTool"][]} */
const PAINT_TOOLS = ['paint', 'fill', 'gradient', 'sun'];

/** Return the tools of an image: a sun is for skies, around which directions go. @param {boolean} isSky */
const toolsOf = (isSky) => TOOLS.filter(({ value }) => isSky || value !== 'sun');

/** @param {{image: LightImage, ui: Ui, app: App, held: number[]}} props */
export function TexelMap({ image, ui, app, held }) {
  const [place, setPlace] = useState(/** @type {Place | null} */ (null));
  const sky = useMemo(() => skyViewOf(ui, image), [ui.rig, ui.view, image]);
  const isSky = ui.rig ? sky !== null : image.aspect === 2;
  useEffect(() => {
    app.session.keepExposure(image);
    app.session.showRig();
  }, []);
  return html`<div class="texels">
    <${Grid} image=${image} ui=${ui} app=${app} held=${held} place=${place} setPlace=${setPlace} sky=${sky} />
    <p class="faint texel-text">${place ? texelText(image, ui, held, place, sky) : t('Drag over the map. Alt and a press take the light of a texel.')}</p>
    <${MapExposure} image=${image} ui=${ui} app=${app} />
    <${Choice} label=${t('Drag over the map')} value=${ui.texelTool} choices=${toolsOf(isSky)}
      change=${(/** @type {Ui["texelTool"]} */ texelTool) => app.store.set({ texelTool })} />
    ${PAINT_TOOLS.includes(ui.texelTool) && html`<${Paint} ui=${ui} app=${app} />`}
    ${ui.texelTool === 'gradient' && html`<${SecondPaint} ui=${ui} app=${app} />`}
    ${
      ui.texelTool === 'sun' &&
      html`<${Slider} label=${t('Diameter')} value=${ui.sunDiameter} min=${0.5} max=${60} step=${0.5}
      digits=${1} resetValue=${4} unit="°" tip=${t('Diameter of the sun: a wider one casts softer shadows, and is as strong')} curve=${RATIO}
      change=${(/** @type {number} */ sunDiameter) => app.store.set({ sunDiameter })} />`
    }
  </div>`;
}

/** Diameters are seen as ratios. */
const RATIO = {
  toPosition: (/** @type {number} */ x) => Math.log2(x),
  toValue: (/** @type {number} */ x) => Math.round(2 * 2 ** x) / 2,
};

/** How bright the map is shown, which stays so while the image changes. @param {{image: LightImage, ui: Ui, app: App}} props */
function MapExposure({ image, ui, app }) {
  const stops = exposureOf(ui, image);
  // In stops from what shows the image of the scene, so that 0 is where it begins.
  const base = mapStops(image, ui.lights.map(({ present }) => present));
  const set = (/** @type {number} */ value) =>
    app.store.set(({ mapExposures }) => ({ mapExposures: { ...mapExposures, [image.name]: value } }));
  return html`<div class="row map-exposure">
    <${Slider} label=${t('Map')} value=${stops - base} min=${-8} max=${8} step=${0.1} digits=${1}
      unit=${t('st')} resetValue=${0} tip=${t('Exposure of the map, which changes no light and stays as it is')}
      change=${(/** @type {number} */ value) => set(base + value)} />
    <${Button} label=${t('Fit')} tip=${t('Show the image as it is now, all but its brightest texels')}
      act=${() => set(mapStops(image, ui.weights))} />
  </div>`;
}

/** What a gradient becomes at its end. @param {{ui: Ui, app: App}} props */
function SecondPaint({ ui, app }) {
  const { texelColour: colour, texelStops: stops, secondTexelPaint: second } = ui;
  const swap = () =>
    app.store.set({
      texelColour: second.colour,
      texelStops: second.stops,
      secondTexelPaint: { colour, stops },
    });
  return html`<div class="row second-paint"><span class="faint">${t('Becomes')}</span>
    <span class="dot" aria-hidden="true" style=${{ background: toHex(second.colour) }}></span>
    <span>${t('{signed} st', { signed: signedText(second.stops) })}</span>
    <span class="spring"></span>
    <${Button} label=${t('Swap')} act=${swap} tip=${t('Swap the two ends of gradients')} /></div>`;
}

/** The colour and the brightness of the paint. @param {{ui: Ui, app: App}} props */
function Paint({ ui, app }) {
  const { texelColour: colour, texelMixer: mixer, texelStops } = ui;
  const set = (/** @type {RGB} */ newColour) => {
    if (Math.max(...newColour) > 0) app.store.set({ texelColour: atFullBrightness(newColour) });
  };
  return html`<div class="lamp-colour colour" role="group" aria-label=${t('Paint of texels')}>
    <${ColourMixer} colour=${colour} set=${set} mixer=${mixer} isLamp
      swatch=${html`<span class="dot" aria-hidden="true" style=${{ background: toHex(colour) }}></span>`}
      choose=${(/** @type {Ui["texelMixer"]} */ texelMixer) => app.store.set({ texelMixer })} />
    <${Slider} label=${t('Brightness')} value=${texelStops} min=${MIN_STOPS} max=${MAX_STOPS} step=${0.1}
      digits=${1} resetValue=${0} unit=${t('st')} tip=${t('Stops from the mean of the image in the scene')}
      change=${(/** @type {number} */ stops) => app.store.set({ texelStops: stops })} />
  </div>`;
}

/** The map, on which the pointer and the keys reach each texel.
 * @param {{image: LightImage, ui: Ui, app: App, held: number[], place: Place | null,
 *   setPlace: (place: Place | null) => void, sky: SkyView | null}} props */
function Grid({ image, ui, app, held, place, setPlace, sky }) {
  const id = useId();
  const canvas = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const [key, setKey] = useState(/** @type {Place} */ ([0, 0]));
  const [point, setPoint] = useState(/** @type {MapPoint | null} */ (null));
  // By key, Enter sets where a gradient begins, then where it ends.
  const [gradientStart, setGradientStart] = useState(/** @type {Place | null} */ (null));
  const [rows, columns] = [image.places.length, image.places[0].length];
  const stroke = useTexelStroke(image, ui, app, (next) => {
    setKey(next);
    setPlace(next);
  });
  useLayoutEffect(() => {
    if (!canvas.current) return;
    drawMap(canvas.current, image, ui.weights, exposureOf(ui, image));
  });
  const texelAt = (/** @type {Place} */ [row, column]) => image.places[row][column];
  const move = (/** @type {PointerEvent} */ event) => {
    const next = placeAt(event, rows, columns);
    if (String(next) !== String(place)) setPlace(next);
    stroke.move(next, event);
    setPoint(pointAt(event, rows, columns));
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
    else if (ui.texelTool === 'gradient' && !gradientStart) setGradientStart(key);
    else {
      const texels = [texelAt(key)].filter((k) => k >= 0);
      applyTool(image, ui, app, { texels, start: gradientStart ?? key, end: key }, true);
      setGradientStart(null);
    }
  };
  const cellId = `${id}-${key.join('-')}`;
  return html`<div class="texel-map" role="grid" tabindex="0" aria-label=${t('Texels of {name}', { name: image.name })}
    aria-rowcount=${rows} aria-colcount=${columns} aria-activedescendant=${cellId}
    style=${{ aspectRatio: String(image.aspect) }} onKeyDown=${press}
    onFocus=${() => setPlace(key)} onBlur=${() => setPlace(null)}
    onPointerDown=${stroke.begin} onPointerMove=${move} onPointerUp=${stroke.end} onPointerCancel=${stroke.end}
    onPointerLeave=${() => {
      if (stroke.current()) return;
      setPlace(null);
      setPoint(null);
    }}>
    <canvas class="image-map" ref=${canvas} aria-hidden="true"></canvas>
    ${ui.texelTool === 'sun' && point && html`<i class="texel-sun" aria-hidden="true" style=${sunStyle(point, rows, columns, ui.sunDiameter)}></i>`}
    ${ui.texelTool === 'gradient' && html`<${GradientLine} start=${stroke.current()?.start ?? gradientStart} end=${stroke.current()?.end ?? key} rows=${rows} columns=${columns} />`}
    <${Locks} image=${image} held=${held} />
    <${SkyMarks} sky=${sky} image=${image} />
    ${place && html`<i class="texel-here" aria-hidden="true" style=${cellStyle(image, place)}></i>`}
    <div role="row" aria-rowindex=${key[0] + 1}>
      <div key=${cellId} id=${cellId} role="gridcell" class="texel-key" aria-colindex=${key[1] + 1}
        aria-label=${texelText(image, ui, held, key, sky)} style=${cellStyle(image, key)}></div>
    </div>
  </div>`;
}

/** The line of a gradient that is drawn. @param {{start: MapPoint | null, end: MapPoint, rows: number,
 *   columns: number}} props */
function GradientLine({ start, end, rows, columns }) {
  if (!start) return null;
  const [x1, y1, x2, y2] = [start, end].flatMap(([row, column]) => [
    (100 * (column + 0.5)) / columns,
    (100 * (row + 0.5)) / rows,
  ]);
  return html`<svg class="sky-marks texel-gradient" viewBox="0 0 100 100" preserveAspectRatio="none" aria-hidden="true">
    <line x1=${x1} y1=${y1} x2=${x2} y2=${y2} /></svg>`;
}

/** Return where a sun lies on the map, wider towards the poles as the map is. @param {MapPoint} place
 * @param {number} rows @param {number} columns @param {number} diameter in degrees */
function sunStyle([row, column], rows, columns, diameter) {
  const sine = Math.sin((Math.PI * Math.min(rows - 1.1, Math.max(0.1, row))) / (rows - 1));
  return {
    left: `${(100 * (column + 0.5)) / columns}%`,
    top: `${(100 * (row + 0.5)) / rows}%`,
    width: `${Math.min(100, diameter / 3.6 / Math.max(0.05, sine))}%`,
    height: `${(diameter / 1.8) * ((rows - 1) / rows)}%`,
  };
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
 * @param {Place} place @param {SkyView | null} sky */
function texelText(image, ui, held, [row, column], sky) {
  const k = image.places[row][column];
  const where = { column: column + 1, row: row + 1 };
  const direction = directionText(sky, image, [row, column]);
  if (k < 0) return t('Column {column}, row {row}: not adjusted alone', where);
  const rgb = ui.weights[k] ?? ui.lights[k].present;
  const stops = stopsOf(rgb, wholeLight(image, ui.lights));
  const white = toKelvin(rgb);
  const colour = white ? whiteText(white.kelvin, white.green) : toHex(atFullBrightness(rgb));
  const light =
    stops === null ? t('off') : `${colour} · ${t('{signed} st', { signed: signedText(stops) })}`;
  const parts = [light, direction].filter(Boolean).join(' · ');
  const text = t('Column {column}, row {row}: {light}', { ...where, light: parts });
  return held.includes(k) ? t('{text}, locked', { text }) : text;
}
