/** The state of the interface: data from the session, and settings of the page itself. */

import { ofKelvin } from './paint_colour.js';

/** @typedef {import("./engine_interface.js").RGB} RGB */
/** @typedef {import("./engine_interface.js").Show} Show */
/** @typedef {import("./engine_interface.js").Tool} Tool */

/** @typedef {import("../engine/messages.js").LightInfo} Light */
/** @typedef {import("../engine/messages.js").LightAnswer} LightAnswer */
/** @typedef {import("../engine/messages.js").LookInfo} Look */
/** @typedef {Record<string, any>} Constraints */
/** @typedef {import("../engine/messages.js").Advice} Advice */
/** A request that changes settings or constraints.
 * @typedef {{[K in "change_settings" | "constrain_lights" | "tie"]:
 *   {kind: K, fields: import("../engine/messages.js").Requests[K]}}["change_settings" | "constrain_lights" | "tie"]}
 *   Change */
/** A preview of a change: its name and the known part of its effect.
 * @typedef {{number: number, label: string, change: Change, text: string, isAtCost: boolean,
 *   before: import("./engine_interface.js").Picture | null, after: import("./engine_interface.js").Picture | null}}
 *   Preview */
/** @typedef {import("../engine/messages.js").Closeness} Seen */
/** The effect of the next click: aim a light or hang a new one. edge: the place that casts the
 * shadow, once clicked.
 * @typedef {{light: number, mode: "aim" | "highlight" | "shadow", edge?: [number, number]}
 *   | {mode: "hang", type: NewKind}} Pointing */
/** @typedef {"spot" | "point" | "panel"} NewKind */
/** since: time of the first report, in ms, and the progress then; left_s: estimated seconds left,
 * once known.
 * @typedef {{task: string, done: number, total: number, unit: string,
 *   since?: {ms: number, done: number}, left_s?: number}} Progress */
/** @typedef {{id: number, text: string, tone: "info" | "warn"}} Toast */

/**
 * @typedef {object} Ui
 * @property {boolean} ready whether the session has said what there is
 * @property {string} waiting why there is nothing yet, if something went wrong
 * @property {boolean} isWriting files
 * @property {Progress | null} writing how far that is, where it takes long
 * @property {any} state as the session said it last, of the view that is shown
 * @property {number} version how often the session had changed, as its last message says
 * @property {number} view that is shown
 * @property {{name: string, size: [number, number]}[]} views of the session
 * @property {(Seen | null)[] | null} closeness how close each view is; null where nothing is painted
 * @property {number[][] | null} shares of each light, in each view
 * @property {Record<number, any>} verifiedOf renders, by view
 * @property {Light[]} lights
 * @property {LightAnswer[]} lit the last exact answer
 * @property {RGB[]} weights the last answer
 * @property {string} headline
 * @property {Advice | null} help what the headline advises
 * @property {Preview | null} preview of a change that is looked at before it is made
 * @property {number | null} deltaE
 * @property {number | null} deltaPresent the same of the current lighting: how much was asked for
 * @property {string[]} sentences
 * @property {boolean} isLive the last answer is the quick one, of a stroke in progress
 * @property {boolean} isJudged whether what is said of the answer is of the last one
 * @property {Record<string, Constraints>} constraints
 * @property {string[][]} ties
 * @property {Record<string, Record<string, any>>} poses of lights that were moved, by name
 * @property {string[]} addedLights names of lights that the scene does not have
 * @property {import("../engine/messages.js").Rig | null} rig where the lights hang, once it is known
 * @property {boolean} lamps whether lights are marked in the pictures
 * @property {number | null} lamp the marked light that was chosen, which has handles
 * @property {{light: number, place: Partial<import("../engine/messages.js").LightPlace>,
 *   at?: [number, number]} | null} dragged where a light is that the pointer drags; at: the pixel that
 *   it points at
 * @property {Progress | null} placing how far a search for places of the lights is
 * @property {Progress | null} sampling how near the lights are to the precision that was asked for,
 *   while samples are added
 * @property {{positions: Record<string, number[]>, directions: Record<string, number[]>} | null} trial
 *   places that a search tries now, by name of light
 * @property {{type: NewKind, where: string, count: number}} adding the light to add: where it hangs is
 *   "click", "anywhere", or the name of a rail, surface or shape
 * @property {Record<string, number[]>} ghosts places of lights before a search has moved them, by name
 * @property {Pointing | null} pointing what the next click on a picture does
 * @property {Record<string, any>} settings
 * @property {Record<string, any>} effectiveSettings
 * @property {{undo: string[], redo: string[], count?: number}} history labels of the last steps,
 *   and how many there are
 * @property {Look[]} looks
 * @property {{look: number, version: number, steps: number} | null} lastLook that was kept or
 *   gone on from last, with the version and the number of steps then
 * @property {Progress | null} basis
 * @property {Progress | null} verifying
 * @property {{done: number, total: number, isFirst?: boolean} | null} loading pictures of the lights;
 *   isFirst: some of the lights have none yet
 * @property {string | null} comingTo name of the look that is gone on from, until it is there
 * @property {{agrees: boolean, text: string, isOld?: boolean} | null} verified
 * @property {string[]} explained
 * @property {boolean} explaining
 * @property {{files: string[], command: string, is_unpainted?: boolean,
 *   is_stopped?: boolean} | null} exported
 * @property {"wait" | "open" | "lost" | "stale"} connection
 * @property {boolean} isSilent whether an answer is long in coming
 * @property {{reason: string, text: string} | null} closed
 * @property {number} unheard strokes that were lost since no session is there to hear them
 * @property {Toast[]} toasts
 * @property {Record<string, number>} resources
 * @property {boolean} hint whether somebody still has to be told what to do
 * @property {Tool} tool
 * @property {number} size
 * @property {number} hardness
 * @property {number} flow
 * @property {number} fillFlow that of Fill
 * @property {number} importance
 * @property {"light" | "colour"} as
 * @property {"spot" | "object"} about what a drag asks about
 * @property {RGB} colour linear, its largest channel at most 1
 * @property {number} stops brightness of the paint over `colour`
 * @property {import("./tools.js").Paint} second
 * @property {import("./tools.js").Paint[]} recent
 * @property {"white" | "hsv" | "rgb"} mixer
 * @property {{stops: number, mired: number} | null} asking by a drag
 * @property {{stops: number, mired: number, object: string | null}} inNumbers what is asked for in
 *   numbers, of an object or, for null, of the whole picture
 * @property {Show} show
 * @property {number[]} solo lights
 * @property {number[]} mute
 * @property {number | null} hovered light whose own picture is shown
 * @property {import("./engine_interface.js").Pointed | null} pointed
 * @property {number | null} fit CSS pixels for each of the picture where all of it is seen
 * @property {{a: number, b: number, share: number} | null} mix of two looks, by their ids
 * @property {Record<string, boolean>} open what is unfolded
 * @property {boolean} side whether the panels are there
 * @property {null | "settings"} panel what lies over the panels
 * @property {null | "keys" | "export"} dialog
 * @property {string} search
 * @property {"scene" | "name" | "share" | "change"} sort
 * @property {number[]} unfolded lights whose controls are open
 */

/** @typedef {import("./ui_store.js").Store<Ui>} UiStore */

/** @type {Show} */
const DEFAULT_SHOW = {
  left: 'painting',
  right: 'solution',
  layout: 'side',
  wipe: 0.5,
  blink: 'left',
  zoom: 1,
  pan: [0, 0],
  stops: 0,
  transform: 'srgb',
  clean: true,
  overlay: null,
  gains: null,
  instead: null,
  other: null,
};

/** @returns {Ui} */
export function initialState() {
  return {
    ready: false,
    waiting: '',
    isWriting: false,
    writing: null,
    state: null,
    version: -1,
    view: 0,
    views: [],
    closeness: null,
    shares: null,
    verifiedOf: {},
    lights: [],
    lit: [],
    weights: [],
    headline: '',
    help: null,
    preview: null,
    deltaE: null,
    deltaPresent: null,
    sentences: [],
    isLive: false,
    isJudged: true,
    constraints: {},
    ties: [],
    poses: {},
    addedLights: [],
    rig: null,
    lamps: false,
    lamp: null,
    dragged: null,
    placing: null,
    sampling: null,
    trial: null,
    adding: { type: 'spot', where: 'click', count: 1 },
    ghosts: {},
    pointing: null,
    settings: {},
    effectiveSettings: {},
    history: { undo: [], redo: [] },
    looks: [],
    lastLook: null,
    basis: null,
    verifying: null,
    loading: null,
    comingTo: null,
    verified: null,
    explained: [],
    explaining: false,
    exported: null,
    connection: 'wait',
    isSilent: false,
    closed: null,
    unheard: 0,
    toasts: [],
    resources: {},
    hint: false,
    tool: 'brush',
    size: 60,
    hardness: 0.2,
    flow: 0.5,
    fillFlow: 1,
    importance: 4,
    as: 'light',
    about: 'spot',
    colour: ofKelvin(3200),
    stops: 0,
    second: { colour: ofKelvin(12000), stops: 0 },
    recent: [],
    mixer: 'white',
    asking: null,
    inNumbers: { stops: 0.5, mired: 0, object: null },
    show: DEFAULT_SHOW,
    solo: [],
    mute: [],
    hovered: null,
    pointed: null,
    fit: null,
    mix: null,
    open: { colour: true, lights: true, plan: true, truth: false },
    side: true,
    panel: null,
    dialog: null,
    search: '',
    sort: 'scene',
    unfolded: [],
  };
}

/**
 * Return what is drawn: the chosen display with temporary changes.
 * @param {Ui} ui @returns {Show}
 */
export function shownSettings(ui) {
  const show = { ...ui.show, overlay: overlayOf(ui) };
  const isAlone = ui.solo.length > 0;
  if (isAlone || ui.mute.length) {
    show.gains = ui.lights.map((_, k) => (isAlone ? ui.solo.includes(k) : !ui.mute.includes(k)));
  }
  const mixed = ui.mix && mixedWeights(ui, ui.mix);
  if (mixed) show.other = mixed;
  if (ui.hovered !== null) {
    const k = ui.hovered;
    const gain = gainOf(ui, k);
    const rgb = alone(ui.weights[k], ui.lights[k]).map((x) => x * gain);
    show.other = ui.weights.map((_, i) => (i === k ? /** @type {RGB} */ (rgb) : [0, 0, 0]));
    show.right = 'other';
    show.gains = null;
  }
  return show;
}

/** Return the overlay. The importance brush shows the importance by default. @param {Ui} ui */
export function overlayOf({ show, tool }) {
  return show.overlay ?? (tool === 'weight' ? 'importance' : null);
}

/** Return the extra exposure of a light shown alone, in whole stops, so that one of many is
 * visible.
 * @param {Ui} ui @param {number} k @returns {number} */
export function gainOf(ui, k) {
  const share = ui.lit[k]?.share ?? 1;
  return share > 0 ? 2 ** Math.min(10, Math.max(0, Math.round(Math.log2(0.5 / share)))) : 1;
}

/** A light that is off is shown as in the scene, or else at one unit. @param {RGB} rgb
 * @param {Light} light @returns {RGB} */
function alone(rgb, light) {
  if (Math.max(...rgb) > 0) return rgb;
  return Math.max(...light.present) > 0 ? light.present : [1, 1, 1];
}

/** Reset the comparison of two looks. @param {Ui} ui @returns {Partial<Ui>} */
export function withoutMix({ show }) {
  const pair = /** @type {const} */ ({ left: 'painting', right: 'solution' });
  return { mix: null, show: { ...show, ...pair, instead: null, other: null } };
}

/** @param {Ui} ui @param {{a: number, b: number, share: number}} mix @returns {RGB[] | null} */
export function mixedWeights(ui, { a, b, share }) {
  const [from, to] = [a, b].map((id) => ui.looks.find((look) => look.id === id)?.weights);
  if (!from || !to) return null;
  return from
    .map((rgb, k) => [0, 1, 2].map((c) => (1 - share) * rgb[c] + share * to[k][c]))
    .map((rgb) => /** @type {RGB} */ (rgb));
}

/** Name of a mix of two looks. @param {Look[]} looks
 * @param {{a: number, b: number, share: number}} mix @returns {string} */
export function mixName(looks, { a, b, share }) {
  const [from, to] = [a, b].map((id) => looks.find((look) => look.id === id)?.name ?? '');
  return `${from} → ${to}, ${Math.round(100 * share)} %`;
}

/** Return the linear light of the current paint. At 0 stops it is as bright as white at the scene's
 * own exposure. @param {Ui} ui @returns {RGB} */
export function paintOf({ colour, stops, state }) {
  return /** @type {RGB} */ (colour.map((x) => x * 2 ** (stops - exposureOf(state))));
}

/** Return the exposure at which the scene is painted, in stops. @param {any} state
 * @returns {number} */
export function exposureOf(state) {
  return state?.transform?.stops ?? 0;
}
