/** Scopes of a picture that is shown: histogram, waveform, parade and vectorscope. */

import { html, useEffect, useLayoutEffect, useRef, useState } from '../../vendor/preact.js';
import { Choice, option } from '../controls.js';
import { t } from '../../language/language.js';
import { drawScope, VECTOR_SIZE } from './scope_drawing.js';
import { clippedPart, histogram, percentile, placeOf, SKIN_ANGLE, targets } from './scope_arithmetic.js';

/** @import { App, Ui } from '../ui_state.js' */
/** @import { Codes } from './scope_arithmetic.js' */
/** @import { ScopeKind } from './scope_drawing.js' */

const KINDS = [
  option(
    'histogram',
    t('Histogram'),
    t('How much of the picture has each level, in percent of the display'),
  ),
  option(
    'waveform',
    t('Waveform'),
    t('Levels of luma from left to right of the picture, in percent of the display'),
  ),
  option('parade', t('Parade'), t('Levels of red, green and blue beside each other')),
  option(
    'vectorscope',
    t('Vectorscope'),
    t('Hue around the middle, saturation outwards; targets of bars of 75 %, and the line of skin'),
  ),
];
const PICTURES = [
  option('painting', t('Painting')),
  option('solution', t('Answer')),
  option('present', t('Original'), t('The picture of the scene as it was')),
];

/** Least milliseconds between two scopes, and how many times what one takes lies between them: scopes
 * take a tenth of the time at most, also under a brush. */
const [MIN_PAUSE_MS, PAUSE_FACTOR] = [150, 10];

/** Levels of lines across a waveform, in percent. */
const LINES = [100, 75, 50, 25, 0];

/** Call a function when something changes, as seldom as its time allows. @param {() => void} act
 * @param {unknown[]} changes */
function useThrottled(act, changes) {
  const state = useRef({ timer: 0, next: 0, act });
  state.current.act = act;
  useEffect(() => {
    const { current } = state;
    if (current.timer) return;
    const run = () => {
      current.timer = 0;
      const start = performance.now();
      current.act();
      const end = performance.now();
      current.next = end + Math.max(MIN_PAUSE_MS, PAUSE_FACTOR * (end - start));
    };
    current.timer = window.setTimeout(run, Math.max(0, current.next - performance.now()));
  }, changes);
  useEffect(() => () => window.clearTimeout(state.current.timer), []);
}

/** @param {{ui: Ui, app: App}} props */
export function ScopesPanel({ ui, app }) {
  const { scopeKind: kind, scopePicture: picture } = ui;
  const [codes, setCodes] = useState(/** @type {Codes | null} */ (null));
  useThrottled(() => setCodes(app.engine.displayedCodes(picture)), [
    ...[picture, ui.ready, ui.version, ui.weights, ui.display, ui.master, ui.view, ui.solo, ui.mute],
    ...[ui.layerRevisions, ui.layers, ui.previousWeights, ui.loadProgress],
  ]);
  const name = PICTURES.find(({ value }) => value === picture)?.label ?? '';
  const title = KINDS.find(({ value }) => value === kind)?.label ?? '';
  const text = codes ? levelsText(codes) : t('There is no picture yet.');
  return html`<div class="scopes">
    <${Choice} label=${t('Scope')} value=${kind} choices=${KINDS}
      change=${(/** @type {ScopeKind} */ scopeKind) => app.store.set({ scopeKind })} />
    <${Choice} label=${t('Picture')} value=${picture} choices=${PICTURES}
      change=${(/** @type {Ui["scopePicture"]} */ scopePicture) => app.store.set({ scopePicture })} />
    <${Scope} kind=${kind} codes=${codes} label=${t('{title} of the picture: {name}. {text}', { title, name, text })} />
    <p class="faint">${text}</p>
  </div>`;
}

/** Return the levels of a picture in words. @param {Codes} codes */
function levelsText(codes) {
  const counts = histogram(codes);
  const percent = (/** @type {number} */ value) => `${value.toFixed(value > 0 && value < 9.95 ? 1 : 0)} %`;
  const [low, middle, high] = [0.01, 0.5, 0.99].map((part) => percent(percentile(counts[3], part)));
  const clipped = {
    white: percent(100 * clippedPart(counts, 255)),
    black: percent(100 * clippedPart(counts, 0)),
  };
  return t('Luma {low} to {high}, middle {middle}. White {white}, black {black} of the pixels.', {
    low,
    middle,
    high,
    ...clipped,
  });
}

/** A scope with its lines. @param {{kind: ScopeKind, codes: Codes | null, label: string}} props */
function Scope({ kind, codes, label }) {
  const canvas = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  useLayoutEffect(() => {
    if (canvas.current && codes) drawScope(canvas.current, kind, codes);
  }, [kind, codes]);
  const isVector = kind === 'vectorscope';
  return html`<div class=${`scope is-${kind}`} role="img" aria-label=${label}>
    <canvas ref=${canvas} aria-hidden="true"></canvas>
    ${isVector ? html`<${VectorLines} />` : html`<${LevelLines} isAcross=${kind === 'histogram'} />`}
    ${kind === 'parade' && ['R', 'G', 'B'].map((text, k) => html`<span key=${text} class="scope-channel"
      aria-hidden="true" style=${{ left: `${(100 * k) / 3 + 1}%` }}>${text}</span>`)}
  </div>`;
}

/** Lines of levels in percent: across a waveform, or upright in a histogram.
 * @param {{isAcross: boolean}} props */
const LevelLines = ({ isAcross }) =>
  LINES.map(
    (level) => html`<i key=${level} class=${isAcross ? 'scope-line is-upright' : 'scope-line'} aria-hidden="true"
      style=${isAcross ? { left: `${level}%` } : { top: `${100 - level}%` }}><span>${level}</span></i>`,
  );

/** The targets of a vectorscope, its axes and the line of skin. */
function VectorLines() {
  const size = VECTOR_SIZE;
  const middle = (size - 1) / 2;
  const radians = (Math.PI / 180) * SKIN_ANGLE;
  const skin = { x: middle + middle * Math.cos(radians), y: middle - middle * Math.sin(radians) };
  return html`<svg class="scope-vectors" viewBox=${`0 0 ${size} ${size}`} aria-hidden="true">
    <circle cx=${middle} cy=${middle} r=${middle} /><line x1="0" y1=${middle} x2=${size} y2=${middle} />
    <line x1=${middle} y1="0" x2=${middle} y2=${size} />
    <line class="is-skin" x1=${middle} y1=${middle} x2=${skin.x} y2=${skin.y} />
    ${targets().map(({ name, difference }) => {
      const [x, y] = placeOf(difference, size);
      return html`<g key=${name}><rect x=${x - 5} y=${y - 5} width="10" height="10" />
        <text x=${x + (x > middle ? 8 : -8)} y=${y + 4} text-anchor=${x > middle ? 'start' : 'end'}>${name}</text></g>`;
    })}
  </svg>`;
}
