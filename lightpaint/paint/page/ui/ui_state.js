/** The state of the interface: data from the session, and settings of the page itself. */

import { INITIAL_CHOICES } from './answer_choices.js';
import { INITIAL_CONSOLE } from './lamps/console_row.js';
import { INITIAL_PLANES } from './planes/plane_state.js';
import { INITIAL_IMAGES } from './images/image_state.js';
import { INITIAL_LAMPS } from './lamps/lamp_state.js';
import { INITIAL_RENDERS } from './exports/render_state.js';
import { fromKelvin } from './paint_colour.js';
import { DEFAULT_PREFERENCES } from './preferences.js';
import { INITIAL_REFERENCES } from './references/reference_state.js';
import { INITIAL_SCOPES } from './scopes/scope_state.js';
import { initialGradient } from './selection/gradient_settings.js';
import { initialSelection } from './selection/selection_settings.js';

/** @typedef {import("./engine_interface.js").RGB} RGB */
/** @typedef {import("./engine_interface.js").Display} Display */
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
/** @typedef {import("../engine/messages.js").Closeness} Closeness */
/** @typedef {import("../engine/messages.js").WishDelivery} WishDelivery */
/** The effect of the next click: aim a light or hang a new one. edge: the place that casts the
 * shadow, once clicked.
 * @typedef {{light: number, mode: "aim" | "highlight" | "shadow", edge?: [number, number]}
 *   | {mode: "hang", type: NewKind}
 *   | {mode: "pair", reference: [number, number], owner: number}} ClickAction */
/** @typedef {"spot" | "point" | "panel"} NewKind */
/** since: time of the first report, in ms, and the progress then; remainingSeconds: an estimate,
 * once known.
 * @typedef {{task: string, done: number, total: number, unit: string,
 *   since?: {ms: number, done: number}, remainingSeconds?: number}} Progress */
/** @typedef {{id: number, text: string, tone: "info" | "warn"}} Toast */

/**
 * @typedef {import("./lamps/lamp_state.js").LampState & import("./preferences.js").Preferences
 *   & import("./references/reference_state.js").ReferenceState
 *   & import("./scopes/scope_state.js").ScopeState
 *   & import("./answer_choices.js").ChoiceState
 *   & import("./lamps/console_row.js").ConsoleUi & import("./planes/plane_state.js").PlaneState
 *   & import("./images/image_state.js").ImageState & import("./exports/render_state.js").RenderState
 *   & BaseUi} Ui
 *
 * @typedef {object} BaseUi
 * @property {boolean} ready whether the session has sent what there is
 * @property {string} waitReason why there is nothing yet, if something went wrong
 * @property {boolean} isExporting files
 * @property {Progress | null} exportProgress how far the export is, if it takes long
 * @property {any} state as the session sent it last, of the view that is shown
 * @property {number} version how often the session had changed, as its last message says
 * @property {number} view that is shown
 * @property {{name: string, size: [number, number]}[]} views of the session
 * @property {(Closeness | null)[] | null} closeness how close each view is; null where nothing is painted
 * @property {WishDelivery[]} deliveries how much of each wish came, by the last exact answer
 * @property {number[][] | null} shares of each light, in each view
 * @property {Record<number, any>} verifications renders, by view
 * @property {Light[]} lights
 * @property {LightAnswer[]} lightAnswers the last exact answer
 * @property {RGB[]} weights the last answer
 * @property {string} headline
 * @property {Advice | null} advice what the headline advises
 * @property {Preview | null} preview of a change that is looked at before it is made
 * @property {number | null} deltaE
 * @property {number | null} deltaPresent the same of the current lighting: how much was asked for
 * @property {string[]} sentences
 * @property {boolean} isLive the last answer is the quick one, of a stroke in progress
 * @property {boolean} isJudgementCurrent whether the statements on the answer are on the last one
 * @property {Record<string, Constraints>} constraints
 * @property {Record<string, Constraints>} earlier constraints of held lights from before they were held
 * @property {boolean} isStarted whether the solve starts from lamps that were set by hand
 * @property {string[]} kept names of lights that are held only since they were moved
 * @property {string[][]} ties
 * @property {Record<string, Record<string, any>>} poses of lights that were moved, by name
 * @property {string[]} addedLights names of lights that the scene does not have
 * @property {string} places a text, equal for equal places of all lights
 * @property {import("../engine/messages.js").Rig | null} rig where the lights hang, once it is known
 * @property {boolean} areLampsMarked whether lights are marked in the pictures
 * @property {number | null} lamp the marked light that was chosen, which has handles
 * @property {{light: number, place: Partial<import("../engine/messages.js").LightPlace>,
 *   aimPixel?: [number, number]} | null} drag where a light is that the pointer drags; at: the pixel that
 *   it points at
 * @property {Progress | null} placementProgress how far a search for places of the lights is
 * @property {boolean} isPlacementEnding whether the search ends with the best so far
 * @property {number} searchCount searches for places that have ended while the page was open
 * @property {Progress | null} samplingProgress how near the lights are to the precision sought
 * @property {{positions: Record<string, number[]>, directions: Record<string, number[]>} | null} trial
 *   places that a search tries now, by name of light
 * @property {{type: NewKind, surface: string, count: number}} newLight the light to add: where it hangs is
 *   "click", "anywhere", or the name of a rail, surface or shape
 * @property {boolean} isNewLightSought whether the fields of a new light are to be scrolled into view
 * @property {Record<string, number[]>} ghosts places of lights before a search has moved them, by name
 * @property {ClickAction | null} clickAction what the next click on a picture does
 * @property {Record<string, any>} settings
 * @property {Record<string, any>} effectiveSettings
 * @property {{undo: string[], redo: string[], count?: number}} history labels of steps, and their count
 * @property {boolean} isPreviousHeld whether the answer before the last step is asked for
 * @property {RGB[] | null} previousWeights that answer, while it is shown
 * @property {boolean} isOriginalHeld whether the original scene is shown in place of the answer
 * @property {Look[]} looks
 * @property {{look: number, version: number, steps: number} | null} lastLook last saved or loaded, with
 *   the version and the number of steps then
 * @property {Progress | null} basis
 * @property {Progress | null} verificationProgress
 * @property {{done: number, total: number, isFirst?: boolean} | null} loadProgress pictures of the lights;
 *   isFirst: some of the lights have none yet
 * @property {string | null} loadingLook name of the look that is being loaded
 * @property {{agrees: boolean, text: string, isOld?: boolean} | null} verification
 * @property {string[]} reasons
 * @property {boolean} isExplaining
 * @property {{files: string[], command: string, is_unpainted?: boolean,
 *   is_stopped?: boolean} | null} exportResult
 * @property {"wait" | "open" | "lost" | "stale"} connection
 * @property {boolean} isSilent whether an answer is long in coming
 * @property {{reason: string, text: string} | null} closure
 * @property {number} lostStrokes number of strokes that no session received
 * @property {Toast[]} toasts
 * @property {import("../engine/messages.js").Layer[]} layers of the painting, the lowest first
 * @property {number} layer id of the active one
 * @property {number | null} openLayer id of the one whose controls are unfolded
 * @property {number | null} maskLayer id of the layer whose mask is painted
 * @property {number} nextLayer id of the next new one
 * @property {Record<number, number>} layerRevisions numbers that grow when a layer's pixels change
 * @property {boolean} isPaintingEmpty whether nothing is on the layer that is always there
 * @property {number[]} selectedLayers ids of several layers for one action
 * @property {number | null} hoveredLayer id of the layer whose mask is shown
 * @property {File | null} layerFile that somebody imports, while it is asked where to
 * @property {string} layerNote what has happened to a layer by key, for screen readers
 * @property {Record<string, number>} resources
 * @property {boolean} hint whether somebody still needs instructions
 * @property {Tool} tool
 * @property {number} size
 * @property {number} hardness
 * @property {number} flow
 * @property {number} fillFlow the flow of Fill
 * @property {number} importance
 * @property {"light" | "colour"} paintMode
 * @property {"spot" | "object" | "selection"} adjustedArea what a drag adjusts
 * @property {import("./selection/selection_settings.js").SelectionUi} selection
 * @property {import("./selection/gradient_settings.js").GradientUi} gradient
 * @property {RGB} colour linear, its largest channel at most 1
 * @property {number} stops brightness of the paint over `colour`
 * @property {import("./tools.js").Paint} second
 * @property {import("./tools.js").Paint[]} recent
 * @property {"white" | "hsv" | "rgb"} mixer
 * @property {{stops: number, mired: number} | null} dragAdjustment of a drag in progress
 * @property {{stops: number, mired: number, object: string | null}} typedAdjustment the adjustment in
 *   numbers: of an object or, for null, of the whole picture
 * @property {Display} display
 * @property {number[]} solo lights
 * @property {number[]} mute
 * @property {number | null} hoveredLight light whose own picture is shown
 * @property {import("./engine_interface.js").Probe | null} probe
 * @property {number | null} fit CSS pixels for each of the picture where all of it is seen
 * @property {import("./look_comparison.js").Mix | null} mix of looks that are compared
 * @property {Record<string, boolean>} open what is unfolded
 * @property {boolean} side whether the panels are there
 * @property {string} panelNote where a panel was moved to by key, for screen readers
 * @property {null | "settings"} panel what lies over the panels
 * @property {number | null} tour step of the tour that is shown
 * @property {string | null} tourFold what this step has unfolded and folds again
 * @property {null | "keys" | "export" | "render" | "move" | "looks" | "presets"} dialog
 * @property {string} search
 * @property {"scene" | "name" | "share" | "change"} sort
 * @property {number[]} openLights lights whose controls are open
 */

/** @typedef {import("./ui_store.js").Store<Ui>} UiStore */

/** @type {Display} */
const DEFAULT_DISPLAY = {
  left: 'painting',
  right: 'solution',
  layout: 'side',
  wipe: 0.5,
  blink: 'left',
  large: 'right',
  corner: 'bottom-right',
  zoom: 1,
  pan: [0, 0],
  stops: 0,
  transform: 'srgb',
  clean: true,
  overlay: null,
  visibleLights: null,
  solutionWeights: null,
  otherWeights: null,
  lookPictures: null,
  lookMixes: null,
  master: 1,
};

/** @returns {Ui} */
export function initialState() {
  return {
    ready: false,
    waitReason: '',
    isExporting: false,
    exportProgress: null,
    state: null,
    version: -1,
    view: 0,
    views: [],
    closeness: null,
    deliveries: [],
    shares: null,
    verifications: {},
    lights: [],
    lightAnswers: [],
    weights: [],
    headline: '',
    advice: null,
    preview: null,
    deltaE: null,
    deltaPresent: null,
    sentences: [],
    isLive: false,
    isJudgementCurrent: true,
    constraints: {},
    earlier: {},
    kept: [],
    isStarted: false,
    ties: [],
    poses: {},
    addedLights: [],
    places: '',
    rig: null,
    areLampsMarked: false,
    lamp: null,
    drag: null,
    placementProgress: null,
    isPlacementEnding: false,
    searchCount: 0,
    samplingProgress: null,
    trial: null,
    newLight: { type: 'spot', surface: 'click', count: 1 },
    isNewLightSought: false,
    ghosts: {},
    clickAction: null,
    settings: {},
    effectiveSettings: {},
    history: { undo: [], redo: [] },
    isPreviousHeld: false,
    previousWeights: null,
    isOriginalHeld: false,
    looks: [],
    lastLook: null,
    basis: null,
    verificationProgress: null,
    loadProgress: null,
    loadingLook: null,
    verification: null,
    reasons: [],
    isExplaining: false,
    exportResult: null,
    connection: 'wait',
    isSilent: false,
    closure: null,
    lostStrokes: 0,
    toasts: [],
    layers: [],
    layer: 0,
    openLayer: null,
    maskLayer: null,
    nextLayer: 1,
    layerRevisions: {},
    isPaintingEmpty: true,
    selectedLayers: [],
    hoveredLayer: null,
    layerFile: null,
    layerNote: '',
    resources: {},
    hint: false,
    tool: 'brush',
    size: 60,
    hardness: 0.2,
    flow: 0.5,
    fillFlow: 1,
    importance: 4,
    paintMode: 'light',
    adjustedArea: 'spot',
    selection: initialSelection(),
    gradient: initialGradient(),
    colour: fromKelvin(3200),
    stops: 0,
    second: { colour: fromKelvin(12000), stops: 0 },
    recent: [],
    mixer: 'white',
    dragAdjustment: null,
    typedAdjustment: { stops: 0.5, mired: 0, object: null },
    display: DEFAULT_DISPLAY,
    solo: [],
    mute: [],
    hoveredLight: null,
    probe: null,
    fit: null,
    mix: null,
    open: { colour: true, lights: true, plan: true, planes: true, truth: false },
    side: true,
    panelNote: '',
    panel: null,
    tour: null,
    tourFold: null,
    dialog: null,
    search: '',
    sort: 'scene',
    openLights: [],
    ...INITIAL_LAMPS,
    ...INITIAL_IMAGES,
    ...DEFAULT_PREFERENCES,
    ...INITIAL_REFERENCES,
    ...INITIAL_CHOICES,
    ...INITIAL_CONSOLE,
    ...INITIAL_PLANES,
    ...INITIAL_SCOPES,
    ...INITIAL_RENDERS,
  };
}
