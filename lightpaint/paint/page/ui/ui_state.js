/** The state of the interface: data from the session, and settings of the page itself. */

import { fromKelvin } from '../../../viewer/drawing/colour.js';
import { DEFAULT_PREFERENCES } from './preferences.js';

/** @import { AnswerChoice, Closeness, ConsoleInfo, Layer, LightPlace, PlacePair, PlanesInfo, PlanesReading, ReferenceInfo, RenderInfo, Rig, WishDelivery } from '../engine/messages.js' */
/** @import { Mode } from '../engine/selection/mask_operations.js' */
/** @import { Corner } from '../engine/selection/polygon_mask.js' */
/** @import { Summary } from '../engine/selection/selections.js' */
/** @import { LightImage } from './images/light_images.js' */
/** @import { TexelPaint } from './images/texel_arithmetic.js' */
/** @import { TexelTool } from './images/texel_stroke.js' */
/** @import { Probe } from './brush_cursor.js' */
/** @import { Mix } from './look_comparison.js' */
/** @import { ComparedAreas } from './references/reference_state.js' */
/** @import { ScopeKind } from './scopes/scope_drawing.js' */
/** @import { Shape, TypedKind } from './selection/selection_settings.js' */
/** @import { Paint } from './tools.js' */

// Types that the interface and its modules share.
/** @typedef {import("../engine/picture_engine.js").PictureEngine} Engine */
/** In CSS pixels of the engine's element. @typedef {ReturnType<Engine["panes"]>[number]} Pane */
/** @typedef {Required<Omit<import("../engine/picture_slots.js").Display, "draftStep">>} DrawnDisplay */
/** What is chosen to be shown: lux are drawn over the engine's pictures.
 * @typedef {Omit<DrawnDisplay, "overlay"> & {overlay: DrawnDisplay["overlay"] | "lux"}} Display */
/** @typedef {import("../engine/brush.js").Point} Point */
/** @typedef {import("../engine/stroke.js").Tool} Tool */
/** @typedef {import("../../../viewer/drawing/view.js").Kind} Kind */
/** @typedef {import("../../../viewer/drawing/lattice.js").Picture} Picture */
/** @typedef {import("../engine/message_frames.js").Message} Message */
/** @typedef {import("../engine/socket_host.js").Host} Host */
/** @typedef {import("../engine/socket_host.js").HostEvents} HostEvents */
/** @typedef {import("../engine/messages.js").Requests} Requests */
/** @typedef {import("../engine/messages.js").RGB} RGB */
/** @typedef {import("../engine/messages.js").LightInfo} Light */
/** @typedef {import("../engine/messages.js").LightAnswer} LightAnswer */
/** @typedef {import("../engine/messages.js").LookInfo} Look */
/** @typedef {Record<string, any>} Constraints */
/** @typedef {import("../engine/messages.js").Advice} Advice */
/** A request that changes settings or constraints.
 * @template {"change_settings" | "constrain_lights" | "tie"} K
 * @typedef {{kind: K, fields: Requests[K]}} ChangeOf */
/** @typedef {ChangeOf<"change_settings"> | ChangeOf<"constrain_lights"> | ChangeOf<"tie">} Change */
/** A preview of a change: its name and the known part of its effect.
 * @typedef {{number: number, label: string, change: Change, text: string, isAtCost: boolean,
 *   before: Picture | null, after: Picture | null}} Preview */
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

/** @typedef {ReturnType<typeof initialState>} Ui */
/** @typedef {import("./ui_store.js").Store<Ui>} UiStore */
/** @typedef {import("./session_controller.js").SessionController} SessionController */
/** What all parts of the interface use. @typedef {{store: UiStore, session: SessionController, engine: Engine}} App */

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

/** Return the state of a page that has just opened. */
export function initialState() {
  return {
    ready: false, // whether the session has sent what there is
    waitReason: '', // why there is nothing yet, if something went wrong
    isExporting: false, // files
    exportProgress: /** @type {Progress | null} */ (null), // how far the export is, if it takes long
    state: /** @type {any} */ (null), // as the session sent it last, of the view that is shown
    version: -1, // how often the session had changed, as its last message says
    view: 0, // that is shown
    views: /** @type {{name: string, size: [number, number]}[]} */ ([]), // of the session
    // how close each view is; null where nothing is painted
    closeness: /** @type {(Closeness | null)[] | null} */ (null),
    deliveries: /** @type {WishDelivery[]} */ ([]), // how much of each wish came, by the last exact answer
    shares: /** @type {number[][] | null} */ (null), // of each light, in each view
    verifications: /** @type {Record<number, any>} */ ({}), // renders, by view
    lights: /** @type {Light[]} */ ([]),
    lightAnswers: /** @type {LightAnswer[]} */ ([]), // the last exact answer
    weights: /** @type {RGB[]} */ ([]), // the last answer
    headline: '',
    advice: /** @type {Advice | null} */ (null), // what the headline advises
    preview: /** @type {Preview | null} */ (null), // of a change that is looked at before it is made
    deltaE: /** @type {number | null} */ (null),
    // the same of the current lighting: how much was asked for
    deltaPresent: /** @type {number | null} */ (null),
    sentences: /** @type {string[]} */ ([]),
    isLive: false, // the last answer is the quick one, of a stroke in progress
    isJudgementCurrent: true, // whether the statements on the answer are on the last one
    constraints: /** @type {Record<string, Constraints>} */ ({}),
    // constraints of held lights from before they were held
    earlier: /** @type {Record<string, Constraints>} */ ({}),
    isStarted: false, // whether the solve starts from lamps that were set by hand
    kept: /** @type {string[]} */ ([]), // names of lights that are held only since they were moved
    ties: /** @type {string[][]} */ ([]),
    poses: /** @type {Record<string, Record<string, any>>} */ ({}), // of lights that were moved, by name
    addedLights: /** @type {string[]} */ ([]), // names of lights that the scene does not have
    places: '', // a text, equal for equal places of all lights
    // where the lights hang, once it is known
    rig: /** @type {Rig | null} */ (null),
    areLampsMarked: false, // whether lights are marked in the pictures
    lamp: /** @type {number | null} */ (null), // the marked light that was chosen, which has handles
    // where a light is that the pointer drags; aimPixel: that it points at
    drag: /** @type {{light: number, place: Partial<LightPlace>, aimPixel?: [number, number]} | null} */ (null),
    placementProgress: /** @type {Progress | null} */ (null), // how far a search for places of the lights is
    isPlacementEnding: false, // whether the search ends with the best so far
    searchCount: 0, // searches for places that have ended while the page was open
    // how near the lights are to the precision sought
    samplingProgress: /** @type {Progress | null} */ (null),
    // places that a search tries now, by name of light
    trial: /** @type {{positions: Record<string, number[]>, directions: Record<string, number[]>} | null} */ (null),
    // the light to add: where it hangs is "click", "anywhere", or the name of a rail, surface or shape
    newLight: /** @type {{type: NewKind, surface: string, count: number}} */ ({ type: 'spot', surface: 'click', count: 1 }),
    isNewLightSought: false, // whether the fields of a new light are to be scrolled into view
    // places of lights before a search has moved them, by name
    ghosts: /** @type {Record<string, number[]>} */ ({}),
    clickAction: /** @type {ClickAction | null} */ (null), // what the next click on a picture does
    settings: /** @type {Record<string, any>} */ ({}),
    effectiveSettings: /** @type {Record<string, any>} */ ({}),
    // labels of steps, and their count
    history: /** @type {{undo: string[], redo: string[], count?: number}} */ ({ undo: [], redo: [] }),
    isPreviousHeld: false, // whether the answer before the last step is asked for
    previousWeights: /** @type {RGB[] | null} */ (null), // that answer, while it is shown
    isOriginalHeld: false, // whether the original scene is shown in place of the answer
    looks: /** @type {Look[]} */ ([]),
    // last saved or loaded, with the version and the number of steps then
    lastLook: /** @type {{look: number, version: number, steps: number} | null} */ (null),
    basis: /** @type {Progress | null} */ (null),
    areLightsUnknown: false, // whether only a picture of the scene is there, and its lights are rendered
    verificationProgress: /** @type {Progress | null} */ (null),
    // pictures of the lights; isFirst: some of the lights have none yet
    loadProgress: /** @type {{done: number, total: number, isFirst?: boolean} | null} */ (null),
    loadingLook: /** @type {string | null} */ (null), // name of the look that is being loaded
    verification: /** @type {{agrees: boolean, text: string, isOld?: boolean} | null} */ (null),
    reasons: /** @type {string[]} */ ([]),
    isExplaining: false,
    exportResult: /** @type {{files: string[], command: string, is_unpainted?: boolean, is_stopped?: boolean} | null} */ (null),
    connection: /** @type {"wait" | "open" | "lost" | "stale"} */ ('wait'),
    isSilent: false, // whether an answer is long in coming
    closure: /** @type {{reason: string, text: string} | null} */ (null),
    lostStrokes: 0, // number of strokes that no session received
    toasts: /** @type {Toast[]} */ ([]),
    layers: /** @type {Layer[]} */ ([]), // of the painting, the lowest first
    layer: 0, // id of the active one
    openLayer: /** @type {number | null} */ (null), // id of the one whose controls are unfolded
    maskLayer: /** @type {number | null} */ (null), // id of the layer whose mask is painted
    nextLayer: 1, // id of the next new one
    // numbers that grow when a layer's pixels change
    layerRevisions: /** @type {Record<number, number>} */ ({}),
    isPaintingEmpty: true, // whether nothing is on the layer that is always there
    selectedLayers: /** @type {number[]} */ ([]), // ids of several layers for one action
    hoveredLayer: /** @type {number | null} */ (null), // id of the layer whose mask is shown
    layerFile: /** @type {File | null} */ (null), // that somebody imports, while it is asked where to
    layerNote: '', // what has happened to a layer by key, for screen readers
    resources: /** @type {Record<string, number>} */ ({}),
    hint: false, // whether somebody still needs instructions
    tool: /** @type {Tool} */ ('brush'),
    size: 60,
    hardness: 0.2,
    flow: 0.5,
    fillFlow: 1, // the flow of Fill
    importance: 4,
    paintMode: /** @type {"light" | "colour"} */ ('light'),
    adjustedArea: /** @type {"spot" | "object" | "selection"} */ ('spot'), // what a drag adjusts
    selection: {
      current: /** @type {Summary | null} */ (null), // null while everything can be painted
      shape: /** @type {Shape} */ ('rectangle'),
      mode: /** @type {Mode} */ ('replace'), // how a new part joins what is selected
      feather: 0, // width of a new part's soft edge, in pixels
      tolerance: 12, // of a selection by colour, in ΔE
      show: /** @type {"ants" | "tint"} */ ('ants'),
      // a shape that is being drawn
      draft: /** @type {{shape: Shape, corners: Corner[], mode: Mode} | null} */ (null),
      kind: /** @type {TypedKind} */ ('rectangle'), // of the panel
      box: /** @type {{x: number, y: number, width: number, height: number}} */ ({ x: 0, y: 0, width: 100, height: 100 }),
      object: '', // name of that in the panel, "" for none
      light: '',
      picture: /** @type {"painting" | "solution"} */ ('painting'), // whose brightness counts
      brightness: /** @type {[low: number, high: number]} */ ([60, 100]),
      pixels: 8, // by which the selection grows, shrinks or fades
      // what a drag adjusted before something was selected
      areaBefore: /** @type {"spot" | "object" | "selection"} */ ('spot'),
    },
    gradient: {
      shape: /** @type {"linear" | "radial"} */ ('linear'),
      isAdjusting: false, // whether it makes brighter and warmer, instead of painting
      hasEnd: false, // whether it leads to the second colour, instead of fading out
      stops: 1,
      mired: 0,
    },
    colour: /** @type {RGB} */ (fromKelvin(3200)), // linear, its largest channel at most 1
    stops: 0, // brightness of the paint over `colour`
    second: /** @type {Paint} */ ({ colour: fromKelvin(12000), stops: 0 }),
    recent: /** @type {Paint[]} */ ([]),
    mixer: /** @type {"white" | "hsv" | "rgb"} */ ('white'),
    dragAdjustment: /** @type {{stops: number, mired: number} | null} */ (null), // of a drag in progress
    // the adjustment in numbers: of an object or, for null, of the whole picture
    typedAdjustment: /** @type {{stops: number, mired: number, object: string | null}} */ ({ stops: 0.5, mired: 0, object: null }),
    display: /** @type {Display} */ (DEFAULT_DISPLAY),
    solo: /** @type {number[]} */ ([]), // lights
    mute: /** @type {number[]} */ ([]),
    hoveredLight: /** @type {number | null} */ (null), // light whose own picture is shown
    probe: /** @type {Probe | null} */ (null),
    fit: /** @type {number | null} */ (null), // CSS pixels for each of the picture where all of it is seen
    mix: /** @type {Mix | null} */ (null), // of looks that are compared
    // what is unfolded
    open: /** @type {Record<string, boolean>} */ ({ colour: true, lights: true, plan: true, planes: true, truth: false }),
    side: true, // whether the panels are there
    panelNote: '', // where a panel was moved to by key, for screen readers
    panel: /** @type {null | "settings"} */ (null), // what lies over the panels
    tour: /** @type {number | null} */ (null), // step of the tour that is shown
    tourFold: /** @type {string | null} */ (null), // what this step has unfolded and folds again
    dialog: /** @type {null | "keys" | "export" | "render" | "move" | "looks" | "presets"} */ (null),
    search: '',
    sort: /** @type {"scene" | "name" | "share" | "change"} */ ('scene'),
    openLights: /** @type {number[]} */ ([]), // lights whose controls are open

    // Many lamps.
    selectedLights: /** @type {number[]} */ ([]), // lights that one action changes
    selectionAnchor: /** @type {number | null} */ (null), // the light from which Shift selects a range
    isLassoing: false, // whether a drag over the pictures selects marked lights
    gelCodes: /** @type {Record<string, string>} */ ({}), // codes of the filters put on lights here, by name
    lampMixer: /** @type {"white" | "hsv" | "rgb" | "gel"} */ ('white'), // how the colour of lamps is set
    master: 1, // factor of all lights but fixed ones

    // Lights that are images.
    images: /** @type {LightImage[]} */ ([]),
    texelTool: /** @type {TexelTool} */ ('paint'),
    texelColour: /** @type {RGB} */ (fromKelvin(6500)), // of the paint, its largest channel 1
    texelStops: 0, // brightness of the paint, from the mean of the image in the scene
    texelMixer: /** @type {"white" | "hsv" | "rgb"} */ ('white'), // how that colour is set
    // that a gradient becomes
    secondTexelPaint: /** @type {TexelPaint} */ ({ colour: fromKelvin(3200), stops: 1 }),
    sunDiameter: 4, // in degrees
    // stops at which maps stay shown, by name of the image
    mapExposures: /** @type {Record<string, number>} */ ({}),

    // Reference pictures.
    references: /** @type {ReferenceInfo[]} */ ([]), // the oldest first
    isReferenceOpen: false, // whether their pane is shown
    reference: /** @type {number | null} */ (null), // id of the one that is shown; null for the last one
    isReferenceComing: false, // whether a file is being read
    comparedAreas: /** @type {ComparedAreas} */ ('regions'),
    matchesBrightness: false,
    // of all references: `owner` is the id of one
    placePairs: /** @type {(PlacePair & {owner: number, view: number})[]} */ ([]),

    // Measuring planes.
    // null until they are measured
    planes: /** @type {PlanesInfo | null} */ (null),
    // what the answer gives there
    planesReading: /** @type {PlanesReading | null} */ (null),
    planesProgress: /** @type {Progress | null} */ (null), // how far a measurement is
    planeCase: /** @type {string | null} */ (null), // the case that the pictures show; null for the first
    hiddenPlanes: /** @type {string[]} */ ([]), // names of planes that are not drawn in the pictures

    // Scopes.
    scopeKind: /** @type {ScopeKind} */ ('waveform'),
    scopePicture: /** @type {"painting" | "solution" | "present"} */ ('solution'), // whose codes it shows

    // Answers with other light colours.
    choices: /** @type {readonly AnswerChoice[]} */ ([]),
    choicesVersion: -1, // of the session, of which they are

    // A console.
    console: /** @type {ConsoleInfo | null} */ (null), // null without one

    // Final renders.
    renders: /** @type {RenderInfo[]} */ ([]), // the oldest first
    renderProgress: /** @type {Progress | null} */ (null), // of the one that is rendered now
    ...DEFAULT_PREFERENCES,
  };
}
