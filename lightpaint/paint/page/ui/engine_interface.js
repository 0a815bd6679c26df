/**
 * Types of all that passes between the interface, the picture engine and its host.
 *
 * The caller of `mount` provides both.
 */

/** @typedef {import("../engine/messages.js").RGB} RGB */
/** @typedef {import("../engine/messages.js").Requests} Requests */
/** @typedef {import("../engine/socket_host.js").HostEvents} HostEvents */
/** @typedef {{data: any, shape: number[]}} Picture */
/** @typedef {{kind: string, reply?: number, arrays?: Record<string, Picture>, [field: string]: any}} Message */

/**
 * The link to the session, through a socket or a notebook's model. `on` hears messages of a kind,
 * asked for or not, and "connection" with {state: "open" | "lost" | "stale"}, and "silence" with
 * {isSilent}. `send` is answered by the reply.
 * @typedef {object} Host
 * @property {<K extends keyof Requests>(kind: K, fields?: Requests[K],
 *   arrays?: Record<string, Picture>) => Promise<Message>} send
 * @property {<K extends keyof HostEvents>(kind: K, listener: (message: HostEvents[K]) => void) => void} on
 * @property {(name: string) => Promise<Picture>} fetch
 * @property {() => void} close
 */

/** @typedef {"painting" | "solution" | "other" | "verified" | "present"} Kind */

/**
 * What is drawn, and how. `visibleLights`: those that solo and mute leave; null for all. `solutionWeights`,
 * `otherWeights`: weights for "solution" and "other", of the lights and maybe of two looks; null for
 * the answer's. `lookPictures`: ids of these looks, if their lights hang elsewhere.
 * @typedef {object} Display
 * @property {Kind} left
 * @property {Kind} right
 * @property {"side" | "wipe" | "blink" | "inset"} layout
 * @property {number} wipe
 * @property {"left" | "right"} blink
 * @property {"left" | "right"} large the large picture where the other one is small in a corner
 * @property {import("../../../viewer/drawing/view.js").Corner} corner that the small one lies in
 * @property {number} zoom
 * @property {[number, number]} pan
 * @property {number} stops
 * @property {string} transform
 * @property {boolean} clean
 * @property {null | "missed" | "beyond" | "falsecolor" | "importance" | "lux"} overlay
 * @property {boolean[] | null} visibleLights
 * @property {RGB[] | null} solutionWeights
 * @property {RGB[] | null} otherWeights
 * @property {(number | null)[] | null} lookPictures
 * @property {RGB[][] | null} lookMixes weights of each of the looks that are side by side
 * @property {number} master factor of the answer's weights, but for fixed lights
 */

/** What the engine draws; lux are drawn over its pictures.
 * @typedef {Omit<Display, 'overlay'> & {overlay: import("../../../viewer/drawing/view.js").Overlay}}
 *   DrawnDisplay */

/** @typedef {"brush" | "eraser" | "weight" | "pick" | "fill" | "line" | "adjust" | "select" | "gradient" | "neutral"} Tool */

/**
 * The tool in the hand. `rgb`: linear light of the colour, including its stops. `size`: diameter in
 * pixels of the picture. `importance`: factor of the importance brush.
 * @typedef {object} ToolSettings
 * @property {Tool} tool
 * @property {RGB} rgb
 * @property {"light" | "colour"} paintMode
 * @property {number} size
 * @property {number} hardness
 * @property {number} flow
 * @property {number} importance
 * @property {"spot" | "object" | "selection"} adjustedArea what a drag adjusts
 * @property {import("../engine/layers/gradient.js").GradientSettings} gradient
 */

/** In pixels of the picture. @typedef {{x: number, y: number, pressure: number}} Point */
/** In CSS pixels of the element. @typedef {{kind: Kind, x: number, y: number, width: number,
 *   height: number, left: number, top: number, scale: number}} Pane */

/**
 * What is under the pointer. `object`: its name; `index`: its number, -1 for none. `shares`: each
 * light's share of the answer there. `place`: column and row in the picture, not rounded. `light`: light of
 * the picture under the pointer.
 * @typedef {{object: string | null, index: number, shares: number[], place: [number, number],
 *   light: RGB, paint: RGB}} Probe paint: what to paint with, as the hand does, to have that light there */
/** Numbers of objects, (height, width).
 * @typedef {{data: ArrayLike<number>, width: number, height: number}} Objects */

/**
 * @typedef {object} Engine
 * @property {HTMLElement} element where the pictures are drawn
 * @property {(width: number, height: number) => void} resize in CSS pixels
 * @property {(display: DrawnDisplay) => void} show
 * @property {(canvases: HTMLCanvasElement[], width: number, height: number) => void} showLooks draws
 *   the looks that are side by side on canvases of one size, in CSS pixels; none: the pictures again
 * @property {(settings: ToolSettings) => void} setTool
 * @property {() => Pane[]} panes
 * @property {(view: number) => void} showView another view: what is shown, and painted
 * @property {(draftStep: number | null) => void} dragLight the step between the pixels and rows that
 *   the pictures of a dragged light show; null: no light is dragged
 * @property {number} minDraftStep the smallest such step with which they are drawn in time
 * @property {(x: number, y: number, factor: number) => {zoom: number, pan: [number, number]}} zoomAt
 * @property {boolean} isPainting whether a stroke goes on
 * @property {(point: Point) => void} begin a stroke of the tool in the hand
 * @property {(points: Point[]) => void} move
 * @property {() => void} end
 * @property {() => boolean} cancel the stroke that has begun; whether there was one
 * @property {(from: Point, to: Point) => void} line a straight stroke, whole
 * @property {(adjustment: {stops: number, mired: number, object: number | null}) => void} adjust
 *   brighter and warmer by so much, in an object or, for null, in the whole picture
 * @property {(point: Point) => boolean} neutralize makes what is painted around a place neutral, in the
 *   selection or the whole picture; false where no tint does that
 * @property {(kind: Kind, x: number, y: number) => RGB} lightAt
 * @property {(kind: Kind, x: number, y: number, light?: RGB) => RGB} paintAt what to paint with, in the manner
 *   that is in the hand, to have that light there
 * @property {(x: number, y: number) => Omit<Probe, 'light' | 'paint' | 'place'> | null} probe
 * @property {() => Objects | null} objects which object each pixel shows, once that is known
 * @property {(change: import("../engine/messages.js").ChangeLayers) => void} changeLayers one step, or
 *   while a slider moves none yet
 * @property {() => void} finishLayers ends a change by a slider that has reported no end
 * @property {(id: number) => void} chooseLayer for the brush to paint
 * @property {(id: number | null) => void} paintMask of a layer from now on; for null none
 * @property {() => Pick<import("./ui_state.js").Ui, 'layers' | 'nextLayer' | 'layer' | 'maskLayer'
 *   | 'layerRevisions' | 'isPaintingEmpty'>} layerState
 * @property {(id: number) => boolean} isLayerHere whether a layer has pixels in the current view
 * @property {(id: number) => {data: Float32Array, width: number, height: number}} coverage how far a
 *   layer, or a group, covers each pixel
 * @property {(id: number, width: number, height: number) => Uint8ClampedArray<ArrayBuffer>}
 *   layerThumbnail RGBA
 * @property {(id: number) => void} lookAtLayer fetches its pixels, if they are not here
 * @property {Pick<import("../engine/selection/selections.js").Selections,
 *   'current' | 'width' | 'summary' | 'select' | 'change'>} selections what strokes keep to
 * @property {() => void} onMaskChange called when a stroke changes a mask
 * @property {() => number} maxImportance the greatest painted importance, at least 1
 * @property {(kind: "painting" | "solution" | "present") => import("./scopes/scope_arithmetic.js").Codes | null}
 *   displayedCodes of a picture as it is displayed, whole and at reduced size; null before there is one
 * @property {(rgb: RGB, stops: number) => number[]} codes that light is shown with, at an exposure
 * @property {(name: string, listener: (event: any) => void) => void} on "message": an answer to a
 *   stroke; "loading": {done, total, isFirst} pictures, where some of
 *   the lights have none yet; "adjustment": {stops, mired} of a drag;
 *   "layers": {} when `layerState` has changed; "selection": {} when another part is selected; "view": {view} in which something was undone; "lost": {count, isStale} strokes that are not
 *   sent any more, since another page has painted meanwhile, or the session is there no more; "trouble": {text}
 * @property {() => void} close
 */

export {};
