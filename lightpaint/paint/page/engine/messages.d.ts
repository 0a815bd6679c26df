// Made by `python -m lightpaint.paint.protocol.typescript` of the dataclasses.

/** An array; float16 is the bits of halves in a Uint16Array.  */
export interface Picture {
  data: Uint8Array | Int16Array | Uint16Array | Float32Array | Float64Array;
  shape: number[];
}
export type RGB = [number, number, number];
/** Rows and columns of the picture, ends not included. */
export type Region = [top: number, bottom: number, left: number, right: number];

/**
 * Light, or an adjustment, that falls off from one place of a picture to another.
 *
 * shape: `linear`, across the line between them; `radial`, around `start` as far as `end`. start,
 * end: (x, y) in pixels. light: at `start`, linear; null for an adjustment by the layer's `gain`
 * and `tint`. end_light: at `end`; null to fade out. is_incident: whether it is light that arrives
 * at surfaces, which their albedo reflects.
 */
export interface Gradient {
  shape: 'linear' | 'radial';
  start: [number, number];
  end: [number, number];
  light: RGB | null;
  end_light: RGB | null;
  is_incident: boolean;
}

/**
 * A layer of a painting, without its pixels. Ids are never used twice in a session.
 *
 * kind: `pixels` replaces the light below, with its own importance; `paint` mixes a colour over it
 * by its coverage; `adjust` scales its luminance by `gain` and its colour by `tint`, and `weigh`
 * its importance by `times`, where the layer's mask covers; `gradient` does what `gradient` says,
 * within its mask; `group` has no pixels, and holds the layers whose `group` is its id. strength:
 * 0 to 2; adjustments and `weigh` take it as a power, so that 2 is twice the stops. importance:
 * factor of its importance. id: its number. name: for people. is_visible: whether it counts.
 * group: id of the group that it is in; null for none. gain, tint: factors of luminance and
 * colour. times: factor of importance. gradient: for this kind alone.
 */
export interface Layer {
  id: number;
  kind: 'pixels' | 'paint' | 'adjust' | 'weigh' | 'gradient' | 'group';
  name: string;
  is_visible: boolean;
  strength: number;
  importance: number;
  group: number | null;
  gain: number;
  tint: RGB;
  times: number;
  gradient: Gradient | null;
}

/**
 * The console that the answer can be sent to.
 *
 * address: target, universes, source and priority in words. is_on: whether it follows the brush.
 * is_dark: whether it was blacked out. trouble: why nothing leaves, in a sentence.
 */
export interface ConsoleInfo {
  address: string;
  is_on: boolean;
  is_dark: boolean;
  trouble: string | null;
}

/**
 * An emitter of a lamp, such as its red LEDs. swatch: its colour for a screen, as in CSS.
 */
export interface EmitterInfo {
  name: string;
  swatch: string;
}

/**
 * The constant properties of a light.
 *
 * present: its emission before anything was painted. parameter, plugin: its definition in the
 * scene. form: how the scene writes its emission. members: its emitters, if it is a group. group:
 * name of that group; null for a single emitter. is_fixed: whether it is not adjusted. is_scalar:
 * whether one number stands for all channels. scale: factor of its stored plane. name, label: its
 * name in the scene, and as people read it. unit: of its emission. emitters: those that mix the
 * light of a lamp, if its lights file lists them. address: its fixture and first channel on a
 * console; "" if unknown. lamp: of which it is an emitter, where renders have spectra; "" for a
 * whole light.
 */
export interface LightInfo {
  name: string;
  label: string;
  unit: string;
  parameter: string;
  plugin: string;
  form: string;
  members: string[];
  group: string | null;
  present: RGB;
  is_fixed: boolean;
  is_scalar: boolean;
  scale: number;
  emitters: EmitterInfo[];
  address: string;
  lamp: string;
}

/**
 * A light that is an image: its texels are lights.
 *
 * places: index of the light that each texel is, row by row from the top; in a symmetric image two
 * texels are one light; where some texels are finer than others, several places are one texel; -1
 * for one that is not adjusted, or only together with others. shares: part of the image that each
 * place covers, which add up to 1. aspect: width of its map over the height.
 */
export interface ImageInfo {
  name: string;
  places: number[][];
  shares: number[][];
  aspect: number;
}

/**
 * The place of a light, and its target.
 *
 * position: null for one at infinity, or without a place. direction: unit vector along its axis;
 * null for one without an axis. target: the requested point, or else the surface on its axis.
 * cutoff, beam: degrees from its axis; null for all but spots. rail: both ends of its rail.
 * immovable_reason: why it cannot be moved; "" if it can.
 */
export interface LightPlace {
  position: number[] | null;
  direction: number[] | null;
  target: number[] | null;
  cutoff: number | null;
  beam: number | null;
  rail: [number[], number[]] | null;
  immovable_reason: string;
}

/**
 * An object of the scene, seen from above.
 *
 * corners: of its outline, which is convex, in the two axes beside the upward one, in their order.
 */
export interface PlanObject {
  name: string;
  corners: [number, number][];
}

/**
 * The turn of the map of a sky.
 *
 * name: of the image. from_world: three rows of a matrix that takes a direction from the scene to
 * the map's own axes: its first row is up (0, 1, 0), and column x of n is at the azimuth
 * 2π (x + 1/2) / n from −z towards x.
 */
export interface SkyAxes {
  name: string;
  from_world: number[][];
}

/**
 * A camera without a lens. Pixel (x, y) sees origin + s · (x · x_axis + y · y_axis + forward).
 *
 * is_parallel: all rays have the direction `forward` and begin at origin + x · x_axis + y ·
 * y_axis. origin, x_axis, y_axis, forward: vectors in units of the scene.
 */
export interface Camera {
  origin: number[];
  x_axis: number[];
  y_axis: number[];
  forward: number[];
  is_parallel: boolean;
}

/**
 * A plane on which illuminance is measured, in one of the cases if there are several.
 *
 * name: as people read it, with the case. plane, case: names of both; "" is the light of the
 * scene. size: rows and columns of a picture of it. cells: row and column of each point. points:
 * where they are, in units of the scene. sides: of the cell of each point, across and along, six
 * numbers; null for listed points. seen: for each view, the indices of the points that nothing
 * covers in its picture, which may lie beyond its edges.
 */
export interface MeasuredPlane {
  name: string;
  plane: string;
  case: string;
  size: [number, number];
  cells: [number, number][];
  points: number[][];
  sides: number[][] | null;
  seen: number[][];
}

/**
 * The measuring planes.
 *
 * floor_m2: the area that power is divided by; null without one. budget_watts: the most power that
 * is allowed; null if any is. cameras: the camera of each view; null for one that is not a
 * pinhole.
 */
export interface PlanesInfo {
  planes: MeasuredPlane[];
  floor_m2: number | null;
  budget_watts: number | null;
  cameras: (Camera | null)[];
}

/**
 * A view that is painted.
 *
 * size: height and width in pixels. objects: names, in the order of the picture `objects`. scales:
 * factor of the stored plane of each light. plane_size: height and width of these planes, whose
 * pixels are means over blocks of the view's if they are fewer, as of many lights.
 */
export interface ViewInfo {
  name: string;
  size: [number, number];
  objects: string[];
  scales: number[];
  plane_size: [number, number];
}

/**
 * A layer, and where its pixels are: the picture `layer/ID`, in each view.
 *
 * regions: of that picture, by view; empty without coverage. accents: factor of its importance
 * there, since the whole picture is painted. revision: grows when its pixels change.
 */
export interface LayerInfo {
  id: number;
  kind: 'pixels' | 'paint' | 'adjust' | 'weigh' | 'gradient' | 'group';
  name: string;
  is_visible: boolean;
  strength: number;
  importance: number;
  group: number | null;
  gain: number;
  tint: RGB;
  times: number;
  gradient: Gradient | null;
  regions: Region[];
  accents: number[];
  revision: number;
}

/**
 * The layers of the painting, the lowest first. next: the id of the next new one.
 *
 * layers: of the painting.
 */
export interface LayerList {
  layers: LayerInfo[];
  next: number;
}

/**
 * The selected parts: the picture `selection/VIEW`, (rows, columns) uint8, in each view.
 *
 * regions: of that picture, by view; empty without a selection. revision: grows when one changes.
 */
export interface SelectionInfo {
  regions: Region[];
  revision: number;
}

/**
 * A kept look. stamp: time in seconds since 1970. thumbnail: name of its picture.
 *
 * lights: names of its lights, which may differ from the current ones. weights: of each. places:
 * as in `EditState`. id: a number that no other look has. is_proposal: whether an observer has
 * proposed it.
 */
export interface LookInfo {
  id: number;
  name: string;
  stamp: number | null;
  lights: string[];
  weights: RGB[];
  places: string;
  thumbnail: string;
  is_proposal: boolean;
}

/**
 * The view transform that the pictures are seen through, and its exposure in stops.
 *
 * name: of the transform. stops: exposure.
 */
export interface TransformInfo {
  name: string;
  stops: number;
}

/**
 * The grid of the view transforms' tables: points on a side, lowest and highest log2 light.
 *
 * side: points on a side. low, high: lowest and highest log2 light.
 */
export interface TableInfo {
  side: number;
  low: number;
  high: number;
}

/**
 * Samples per pixel: of the current basis, and of the final one.
 *
 * spp: of the current basis. target_spp: of the final one. is_complete: whether all samples are
 * there.
 */
export interface SampleCount {
  spp: number;
  target_spp: number;
  is_complete: boolean;
}

/**
 * Labels of the last steps that can be undone and redone; count: of all steps.
 *
 * undo, redo: labels of steps.
 */
export interface HistoryInfo {
  undo: string[];
  redo: string[];
  count: number;
}

/**
 * A step of the history. stamp: time in seconds since 1970; null if unknown.
 *
 * id: a number that no other step has; the picture `step/ID` shows the answer after it.
 * is_milestone: the last step before a pause or before everything was replaced, or the last of
 * many. label: what was done.
 */
export interface StepInfo {
  id: number;
  label: string;
  stamp: number | null;
  is_milestone: boolean;
}

/**
 * A search for places of lights that has ended, beside the steps of the history.
 *
 * after: id of the last step when it ended, which is its own if it found something; 0 for none.
 * title: what was searched for. text: what came of it. tried: sentences on what was tried. stamp:
 * time in seconds since 1970. id: a number that no other search has. seconds: that it took.
 */
export interface SearchInfo {
  id: number;
  after: number;
  title: string;
  text: string;
  tried: string[];
  stamp: number;
  seconds: number;
}

/**
 * A preset: a request for a whole scene. Its picture is `preset/NAME`.
 *
 * has_subject: whether it is about one object. name: in requests. title, description: for people.
 */
export interface PresetInfo {
  name: string;
  title: string;
  description: string;
  has_subject: boolean;
}

/**
 * A reference. Its pictures are `reference/ID`, (h, w, 3) uint8 as the session's view transform
 * shows it, and `reference_light/ID`, its light, reduced, (h, w, 3) float16.
 *
 * id: a number that no other reference has. name: of its file.
 */
export interface ReferenceInfo {
  id: number;
  name: string;
}

/**
 * A final render. Its small picture is `render/ID`, (h, w, 3) uint8, and the bytes of its files
 * are `render_file/ID/NAME`, uint8, once it is done.
 *
 * name: as requested. height: null until it is known. state: `waiting` for an earlier one; the
 * others speak for themselves. done, total: its passes. text: why it has failed. files: paths of
 * those that were written. id: a number that no other render has. view, width, spp, formats: as
 * requested.
 */
export interface RenderInfo {
  id: number;
  name: string;
  view: number;
  width: number;
  height: number | null;
  spp: number;
  formats: string[];
  state: 'waiting' | 'rendering' | 'done' | 'stopped' | 'failed';
  done: number;
  total: number;
  text: string;
  files: string[];
}

/**
 * Two places that should look alike: (x, y) as shares of width and height, 0 to 1.
 *
 * reference: the place in the reference. picture: the place in the view.
 */
export interface PlacePair {
  reference: [number, number];
  picture: [number, number];
}

/**
 * The resolved values of all settings, as in `lightpaint.Fit`.
 *
 * space: `display` or `linear`. hold: strength of the hold. colors: freedom of the lights.
 */
export interface ResolvedFit {
  space: string | null;
  hold: number | null;
  colors: string | null;
}

/**
 * The steps that can be undone, and the requests in effect.
 *
 * constraints: by name of light, keys and values as in a lights file. ties: names on one dimmer.
 * settings: those that were set. effective_settings: those in effect. poses: of moved lights, by
 * name. added_lights: names of lights that the scene does not have. places: a text, equal for
 * equal places of all lights; "" if all hang as in the scene. layers: of the painting. master:
 * factor of all lights but fixed ones, by the master dimmer: a light shines at `master` times its
 * weight. selection: the part of the painting that strokes keep to.
 *
 * earlier: constraints of lights that are locked or off, by name, from before they were, to be
 * sent when they are released. kept: names of those that are locked only since they were moved.
 * is_started: whether the solve starts from lamps that were set by hand. history: labels of steps
 * to undo and redo.
 */
export interface EditState {
  history?: HistoryInfo;
  constraints?: Record<string, Record<string, any>>;
  ties?: string[][];
  settings?: Record<string, any>;
  poses?: Record<string, Record<string, any>>;
  added_lights?: string[];
  places?: string;
  effective_settings?: ResolvedFit;
  layers?: LayerList;
  master?: number;
  selection?: SelectionInfo;
  earlier?: Record<string, Record<string, any>>;
  kept?: string[];
  is_started?: boolean;
}

/**
 * A constraint that keeps the lights from the paint and can be loosened.
 *
 * kind: of the constraint; `reach` if there is none, but moving lights may help, and `light` if a
 * new light may, since all that reach the paint light the rest, too. names: its
 * lights. gain: share of the error that disappears without it; null if more is needed. hold: the
 * weaker hold to set. delta_e: mean ΔE over the paint now and without it; null if not known.
 */
export interface Advice {
  kind: string;
  names: string[];
  gain: number | null;
  hold: number | null;
  delta_e: [number, number] | null;
}

/**
 * Closeness of an answer in one view. delta_e_present: ΔE of the current look.
 *
 * headline: how close it is, in words. help: a constraint to loosen; null for none. delta_e: mean
 * ΔE over the paint. sentences: what stands below the headline.
 */
export interface Closeness {
  headline: string;
  help: Advice | null;
  delta_e: number;
  delta_e_present: number;
  sentences: string[];
}

/**
 * The share of a wish that came: of a `layer`, of a `group` of layers, or of a `wish`, which is
 * a stroke in a layer.
 *
 * layers: ids of its layers. brightness, color: share of the asked change that came; null if none
 * was asked. delta_e: of its lit parts, against the painting. name: of the layer, group or stroke.
 * kind: `layer`, `group` or `wish`. is_darker: whether it asks for less light.
 */
export interface WishDelivery {
  name: string;
  kind: string;
  layers: number[];
  brightness: number | null;
  color: number | null;
  delta_e: number;
  is_darker: boolean;
}

/**
 * The exact answer with one choice of `colors`. Its picture is `choice/COLORS`, in each view.
 *
 * is_chosen: whether it is the answer itself. delta_e: its mean ΔE over the paint. brightness,
 * color: mean share of the asked changes that came, from 0 to 1, in which each wish counts alike;
 * null if none was asked. worst: the wish of which least came; null if at least three quarters of
 * each did. colors: the choice.
 */
export interface AnswerChoice {
  colors: 'own' | 'gentle' | 'free';
  is_chosen: boolean;
  delta_e: number;
  brightness: number | null;
  color: number | null;
  worst: WishDelivery | null;
}

/**
 * The answer for one light.
 *
 * stops: relative to its current emission; null if it is, or was, off. kelvin: null for a colour
 * that is not white. share: of the light in the picture. error: its uncertainty, in words.
 * is_constrained: whether a constraint limits it. is_unreached: whether no paint depends on it.
 * emission: linear, in the unit of the light. swatch: its colour for a screen, as in CSS. is_on:
 * whether it shines. drives: of the emitters of a lamp, 0 to 1, in their order. slot_delta_e: of a
 * lamp with a colour wheel, how far its slot is from the colour that was solved for. rendering:
 * how the lamp renders colours, in words; null where its spectra are unknown, and of lights far
 * from white.
 */
export interface LightAnswer {
  emission: RGB;
  stops: number | null;
  kelvin: number | null;
  swatch: string;
  is_on: boolean;
  share: number;
  error?: string;
  is_constrained?: boolean;
  is_unreached?: boolean;
  drives?: number[];
  slot_delta_e?: number;
  rendering?: string;
}

/**
 * A wish for a measuring plane or, as `power`, for all lamps together.
 *
 * asked: in lx, in W, or as a share. reached: what came of it, at the sure end of its interval;
 * null if that is unknown. to: the other plane of a ratio; "" for none.
 */
export interface PlaneWish {
  kind: 'mean' | 'uniformity' | 'max' | 'ratio' | 'power';
  asked: number;
  reached: number;
  is_met: boolean;
  to: string;
}

/**
 * The illuminance on a measuring plane, in lx. mean_error: a standard error. uniformity: least
 * over mean. lux: at each of its points.
 */
export interface PlaneLight {
  mean: number;
  mean_error: number;
  uniformity: number;
  least: number;
  most: number;
  lux: number[];
  wishes: PlaneWish[];
}

/**
 * The illuminance on measuring planes under an answer and the master dimmer.
 *
 * planes: in the order of the state. watts: power of all lamps; null if the power of one is
 * unknown. power: the limit of it; null for none. is_required: whether answers have to meet the
 * wishes, as far as they can be met. is_old: whether lights have been moved, added or removed
 * since the planes were measured.
 */
export interface PlanesReading {
  planes: PlaneLight[];
  watts: number | null;
  power: PlaneWish | null;
  is_required: boolean;
  is_old: boolean;
}

/**
 * Properties of an answer; the sentences follow later than the lights.
 *
 * lights: in the order of the state. shares: of each light, by view, if there are several.
 * closeness: of each view; null for unpainted views. deliveries: how much of each wish came, in
 * all views together. headline, help, delta_e, delta_e_present, sentences: as in `Closeness`, of
 * the view with the largest error.
 */
export interface Findings {
  lights?: LightAnswer[];
  shares?: number[][];
  headline?: string;
  help?: Advice;
  delta_e?: number;
  delta_e_present?: number;
  sentences?: string[];
  closeness?: (Closeness | null)[];
  deliveries?: WishDelivery[];
}

/**
 * The progress of a long task. Unasked.
 *
 * task: `export`, `final` for a final render, `basis`, `sampling` for samples added where the
 * paint needs them, `planes` for measuring planes, or the renderer's name for the task. done,
 * total: steps so far, and in all. unit: of these steps; "" for none.
 */
export interface ProgressReport {
  kind: 'progress';
  reply?: number;
  task: string;
  done: number;
  total: number;
  unit: string;
  arrays: {  };
}

/**
 * The result of a verification; its render is the picture `verified`. Unasked.
 *
 * is_old: whether the session has changed since. agrees: whether the render is the predicted
 * picture but for noise. text: the result, in a sentence. view: index of the view.
 */
export interface VerificationResult {
  kind: 'verified';
  reply?: number;
  agrees: boolean;
  text: string;
  view: number;
  is_old: boolean;
  arrays: {  };
}

/**
 * Notice that a long task has started. task: the request, or `stop`.
 */
export interface TaskStarted {
  kind: 'started';
  reply?: number;
  task: 'export' | 'verify' | 'explain' | 'preview' | 'rig' | 'place' | 'compare' | 'import' | 'reference' | 'stop';
  arrays: {  };
}

/**
 * Notice that a stopped task has ended. Unasked.
 *
 * task: the request.
 */
export interface TaskStopped {
  kind: 'stopped';
  reply?: number;
  task: 'verify';
  arrays: {  };
}

/**
 * Files that were written. Unasked.
 *
 * command: solves for the exported paintings; "" for none. is_stopped: whether the export was
 * stopped before its end. is_unpainted: whether files that need a painting were left out. files:
 * their paths.
 */
export interface ExportResult {
  kind: 'exported';
  reply?: number;
  files: string[];
  command: string;
  is_stopped?: boolean;
  is_unpainted?: boolean;
  arrays: {  };
}

/**
 * The final renders since the painter was started, the oldest first: the answer to requests
 * about them, and unasked when one changes its state.
 */
export interface RenderList {
  kind: 'renders';
  reply?: number;
  renders: RenderInfo[];
  arrays: {  };
}

/**
 * The reasons why a view is not closer to its painting; the picture `beyond` shows where.
 * Unasked.
 *
 * sentences: the reasons. view: index of the view. is_old: whether the session has changed since.
 */
export interface Explanation {
  kind: 'explained';
  reply?: number;
  sentences: string[];
  view: number;
  is_old: boolean;
  arrays: {  };
}

/**
 * The effect of a change, before it is made. Unasked. number: of the preview. is_at_cost:
 * whether it changes the unpainted part by more than it gains. before, after: (h, w, 3) uint8.
 *
 * view: as requested. text: the effect, in a sentence. is_old: whether the session has changed
 * since.
 */
export interface PreviewResult {
  kind: 'previewed';
  reply?: number;
  number: number;
  view: number;
  text: string;
  is_at_cost: boolean;
  is_old: boolean;
  arrays: { before: Picture; after: Picture };
}

/**
 * The places that a search is trying. Unasked.
 *
 * positions, directions: by name of light, including new ones.
 */
export interface TrialPlaces {
  kind: 'trial';
  reply?: number;
  positions: Record<string, number[]>;
  directions: Record<string, number[]>;
  arrays: {  };
}

/**
 * The extent of a search for places, and its time: the answer to `estimate_place`.
 *
 * text: the lights, and what each may do. seconds: about how long it takes, at least and at most.
 * is_measured: whether an earlier search of this session tells the pace of this machine.
 */
export interface PlacingEstimate {
  kind: 'place_estimate';
  reply?: number;
  text: string;
  seconds: [number, number];
  is_measured: boolean;
  arrays: {  };
}

/**
 * The result of a search for places of lights. Unasked.
 *
 * text: the moves or additions and their gain, or why there are none. names: of these lights.
 */
export interface PlacingResult {
  kind: 'placed';
  reply?: number;
  text: string;
  names: string[];
  arrays: {  };
}

/**
 * The state while there is no picture yet; `state` follows. text: an error, if one occurred.
 *
 * version: of this protocol. scene, folder: names of the scene file and of the session.
 * can_render: whether there is a scene to render, and not a basis alone. can_report: whether a
 * report can be written. progress: of what it waits for. is_back: as in `state`.
 */
export interface SessionPending {
  kind: 'waiting';
  reply?: number;
  version: number;
  scene: string;
  folder: string;
  can_render: boolean;
  can_report: boolean;
  text: string;
  progress: Omit<ProgressReport, 'kind' | 'arrays'> | null;
  is_back: boolean;
  arrays: {  };
}

/**
 * The whole state: the answer to `hello`, `take_over` and `observe`, and unasked when the basis
 * improves. All lists of lights are in the order of `lights`.
 *
 * version: of this protocol. size: height and width of the first view, and `objects` the names of
 * its objects. lut: the grid of the tables `lut/NAME` of all `transforms`. resources: pictures,
 * with a number that grows when one is replaced. verifications: the last one of each view.
 * renders: the final renders, as in `renders`. is_new: whether the session has no steps yet.
 * stroke: number of the last stroke that arrived. command: solves for the exported paintings.
 * is_back: the client had the session before, and no other client since; also true if unasked.
 * weights: (lights, 3) float64, the last answer.
 *
 * choices: as the last `choices` had them; empty once the session has changed since. scene,
 * folder: names of the scene file and of the session. can_render: whether there is a scene to
 * render, and not a basis alone. can_report: whether a report can be written. images: lights that
 * are images. transforms: names of view transforms. transform: the one in use. basis: how many
 * samples the planes have. answer: how close the last one is. console: null if there is none.
 * planes, reading: measuring planes, and what the answer gives there; null until they are
 * measured, and without any.
 */
export interface SessionState {
  kind: 'state';
  reply?: number;
  history?: HistoryInfo;
  constraints?: Record<string, Record<string, any>>;
  ties?: string[][];
  settings?: Record<string, any>;
  poses?: Record<string, Record<string, any>>;
  added_lights?: string[];
  places?: string;
  effective_settings?: ResolvedFit;
  layers?: LayerList;
  master?: number;
  selection?: SelectionInfo;
  earlier?: Record<string, Record<string, any>>;
  kept?: string[];
  is_started?: boolean;
  version: number;
  scene: string;
  folder: string;
  can_render: boolean;
  can_report: boolean;
  size: [number, number];
  objects: string[];
  lights: LightInfo[];
  images: ImageInfo[];
  views: ViewInfo[];
  transforms: string[];
  transform: TransformInfo;
  lut: TableInfo;
  resources: Record<string, number>;
  looks: LookInfo[];
  presets: PresetInfo[];
  references: ReferenceInfo[];
  basis: SampleCount;
  verifications: Omit<VerificationResult, 'kind' | 'arrays'>[];
  is_new: boolean;
  stroke: number;
  command: string;
  answer: Findings;
  is_back: boolean;
  choices: AnswerChoice[];
  renders: RenderInfo[];
  console: ConsoleInfo | null;
  planes: PlanesInfo | null;
  reading: PlanesReading | null;
  arrays: { weights: Picture };
}

/**
 * The current lights: the answer to paint and requests, unasked once the exact answer is found,
 * and again with its analysis.
 *
 * version: grows with every change of the session. stroke: number of the last stroke that arrived.
 * exact: whether it equals the answer of `lightpaint solve`. mode: space in which it was found
 * under the brush. reading: what these lights give on measuring planes, if there are any.
 * weights: (lights, 3) float64. drives: of the emitters of each lamp in the order of the lights,
 * null for other lights; some answers under the brush have them, exact ones have them in `lights`.
 */
export interface AnswerUpdate {
  kind: 'answer';
  reply?: number;
  lights?: LightAnswer[];
  shares?: number[][];
  headline?: string;
  help?: Advice;
  delta_e?: number;
  delta_e_present?: number;
  sentences?: string[];
  closeness?: (Closeness | null)[];
  deliveries?: WishDelivery[];
  history?: HistoryInfo;
  constraints?: Record<string, Record<string, any>>;
  ties?: string[][];
  settings?: Record<string, any>;
  poses?: Record<string, Record<string, any>>;
  added_lights?: string[];
  places?: string;
  effective_settings?: ResolvedFit;
  layers?: LayerList;
  master?: number;
  selection?: SelectionInfo;
  earlier?: Record<string, Record<string, any>>;
  kept?: string[];
  is_started?: boolean;
  version: number;
  stroke: number;
  exact: boolean;
  mode: string;
  drives?: (number[] | null)[];
  reading?: PlanesReading;
  arrays: { weights: Picture };
}

/**
 * New pixels of a canvas, after undo and the like: one message for each changed view; `views`
 * lists all of these.
 *
 * image: (rows, columns, 3) float32. importance: (rows, columns) float32. weights: (lights, 3)
 * float64. region: of these pixels. view: index of the view. version, stroke, exact, mode: as in
 * `answer`.
 */
export interface CanvasPatch {
  kind: 'patch';
  reply?: number;
  history?: HistoryInfo;
  constraints?: Record<string, Record<string, any>>;
  ties?: string[][];
  settings?: Record<string, any>;
  poses?: Record<string, Record<string, any>>;
  added_lights?: string[];
  places?: string;
  effective_settings?: ResolvedFit;
  layers?: LayerList;
  master?: number;
  selection?: SelectionInfo;
  earlier?: Record<string, Record<string, any>>;
  kept?: string[];
  is_started?: boolean;
  region: Region;
  view: number;
  views: number[];
  version: number;
  stroke: number;
  exact: boolean;
  mode: string;
  arrays: { image: Picture; importance: Picture; weights: Picture };
}

/**
 * The new selection: the answer to `select`, which changes no light.
 */
export interface SelectionUpdate {
  kind: 'selected';
  reply?: number;
  history?: HistoryInfo;
  constraints?: Record<string, Record<string, any>>;
  ties?: string[][];
  settings?: Record<string, any>;
  poses?: Record<string, Record<string, any>>;
  added_lights?: string[];
  places?: string;
  effective_settings?: ResolvedFit;
  layers?: LayerList;
  master?: number;
  selection?: SelectionInfo;
  earlier?: Record<string, Record<string, any>>;
  kept?: string[];
  is_started?: boolean;
  arrays: {  };
}

/**
 * New or replaced pictures, and their numbers. Unasked.
 *
 * resources: pictures, with a number that grows when one is replaced.
 */
export interface PictureUpdate {
  kind: 'renewed';
  reply?: number;
  resources: Record<string, number>;
  arrays: {  };
}

/**
 * The picture of a light that is dragged, so that it need not be fetched. Unasked, before the
 * answer.
 *
 * light: its index. view: the one that the request named. resources: numbers of its pictures, all
 * of which are this one. step: as the request had it. data: (h, w, 3) float16, divided by the
 * light's `scale`; every step-th pixel of every step-th row.
 */
export interface DraggedPlane {
  kind: 'dragged';
  reply?: number;
  light: number;
  view: number;
  step: number;
  resources: Record<string, number>;
  arrays: { data: Picture };
}

/**
 * A picture, as the array `data`: the answer to `fetch`.
 *
 * name: as requested. data: the picture.
 */
export interface PictureData {
  kind: 'fetched';
  reply?: number;
  name: string;
  arrays: { data: Picture };
}

/**
 * The last steps of the history, in order, including undone ones: the answer to `list_steps`.
 *
 * earlier: number of steps before them. done: id of the last step that is not undone; 0 at the
 * beginning. searches: those after a step that still exists, the oldest first.
 */
export interface StepList {
  kind: 'steps';
  reply?: number;
  steps: StepInfo[];
  earlier: number;
  done: number;
  searches: SearchInfo[];
  arrays: {  };
}

/**
 * The answer before the last step, under the master dimmer: the answer to `show_previous`.
 *
 * weights: (lights, 3) float64, in the order of the state.
 */
export interface PreviousAnswer {
  kind: 'previous';
  reply?: number;
  arrays: { weights: Picture };
}

/**
 * The kept looks, and all pictures: the answer to requests about looks, and unasked when an
 * observer has proposed one.
 *
 * resources: as in `renewed`.
 */
export interface LookList {
  kind: 'looks';
  reply?: number;
  looks: LookInfo[];
  resources: Record<string, number>;
  arrays: {  };
}

/**
 * The references, the oldest first: the answer to requests about them, and unasked once a file
 * has become one.
 */
export interface ReferenceList {
  kind: 'references';
  reply?: number;
  references: ReferenceInfo[];
  arrays: {  };
}

/**
 * The answers with other light colours, to choose from. Unasked, once the exact answer rests.
 *
 * version: of the session. choices: from the least freedom to the most; empty without paint, and
 * where no light can change its colour. resources: numbers of their pictures.
 */
export interface AnswerChoices {
  kind: 'choices';
  reply?: number;
  version: number;
  choices: AnswerChoice[];
  resources: Record<string, number>;
  arrays: {  };
}

/**
 * The places of all lights. Sent after every move, once requested.
 *
 * lights: in the order of the state. cameras: of each view; null for one that is not a pinhole.
 * up: the axis nearest to upwards, 0, 1 or 2. low, high: corners of a box around the visible scene
 * and all lights. surfaces: names of rails, surfaces and shapes that new lights may hang on.
 * objects: those within that box, the largest first. skies: of images that are skies.
 */
export interface Rig {
  kind: 'rig';
  reply?: number;
  lights: LightPlace[];
  cameras: (Camera | null)[];
  up: number;
  low: number[];
  high: number[];
  surfaces: string[];
  objects: PlanObject[];
  skies: SkyAxes[];
  arrays: {  };
}

/**
 * The state of the console: the answer to requests about it.
 */
export interface ConsoleState {
  kind: 'console';
  reply?: number;
  console: ConsoleInfo | null;
  arrays: {  };
}

/**
 * A sentence for users. Unasked. task: the one that it ends.
 *
 * text: the sentence. tone: whether it is a warning.
 */
export interface Notice {
  kind: 'notice';
  reply?: number;
  text: string;
  tone: 'info' | 'warn';
  task?: string;
  arrays: {  };
}

/**
 * The reason why a request was refused; nothing has changed.
 *
 * text: the reason, in a sentence. tone: whether it is a warning.
 */
export interface Failure {
  kind: 'failed';
  reply?: number;
  text: string;
  tone?: 'info' | 'warn';
  arrays: {  };
}

/**
 * Notice that the client does not have the session, or has lost it: another client has `taken`
 * it, the painter has `ended`, or the client speaks another `version` of this protocol.
 *
 * reason: as above. text: the same, in a sentence.
 */
export interface Closing {
  kind: 'closed';
  reply?: number;
  reason: 'taken' | 'ended' | 'version';
  text: string;
  arrays: {  };
}

/**
 * Confirmation of a request that has no other answer.
 */
export interface Acknowledgement {
  kind: 'done';
  reply?: number;
  arrays: {  };
}

/**
 * New constraints on one light; an empty object frees it. Answered by `answer`.
 *
 * constraints: keys and values as in a lights file: lock, off, limits, color, kelvin, duv,
 * primaries. is_final: whether it becomes a step; false while a slider moves. light: its index.
 */
export interface ConstrainLight {
  light: number;
  constraints: Record<string, any>;
  is_final?: boolean;
}

/**
 * New constraints on several lights, by name, as in `constrain_light`: one step and one solve.
 * Answered by `answer`.
 *
 * is_final: as in `constrain_light`. label: its name for undo; "" for the names of the lights.
 * earlier: constraints of lights that are locked or off, by name, which apply once these are
 * released, in place of those from before they were locked. constraints: by name of light, keys
 * and values.
 */
export interface ConstrainLights {
  constraints: Record<string, Record<string, any>>;
  is_final?: boolean;
  label?: string;
  earlier?: Record<string, Record<string, any>>;
}

/**
 * The master dimmer: one step. Answered by `answer`.
 *
 * level: factor of all lights but fixed ones, 0 to 2, applied to the answer. It changes neither
 * the painting nor the solve.
 */
export interface SetMaster {
  level: number;
}

/**
 * The lights as they are now become the lighting that the solve starts from and stays near, and
 * locked ones are released; or this ends. Adjustments that they answer are hidden meanwhile. One
 * step. Answered by the whole `state`, with another look under the painting. The setting `near`
 * says how near.
 *
 * is_on: false to end it.
 */
export interface StartFromLamps {
  is_on?: boolean;
}

/**
 * New places, targets and cones of lights, by name. Answered by `answer`; `rig` follows.
 *
 * A light that is moved keeps its level from then on, as if it were locked, until it is released
 * or put back.
 *
 * poses: changed fields of `lightpaint.Pose`: position, target, cutoff and beam; an empty object
 * restores a light's place from the scene; without any pose, a drag ends and its light goes back.
 * is_final: whether it becomes a step; false while a light is dragged. view: index of the view
 * whose pictures of dragged lights are sent at once, as `dragged`. step: while a light is dragged,
 * its picture is computed at every step-th pixel of every step-th row, 1 to 8: what the page draws
 * in time.
 */
export interface MoveLights {
  poses: Record<string, Record<string, any>>;
  is_final?: boolean;
  view?: number;
  step?: number;
}

/**
 * A move of a light by a place in the picture. Answered by `answer`; `rig` follows.
 *
 * mode: `aim` points it there; `highlight` hangs it so that its reflection appears there; `shadow`
 * hangs it so that the shadow of the surface at `edge` ends there. pixel, edge: column and row in
 * pixels. view: index of the view. is_final, step: as in `move`. light: its index.
 */
export interface PointLight {
  light: number;
  mode: 'aim' | 'highlight' | 'shadow';
  pixel: [number, number];
  edge?: [number, number] | null;
  view?: number;
  is_final?: boolean;
  step?: number;
}

/**
 * A new light, with a generated name: one step. Answered by `state`; `rig` follows.
 *
 * type: of the light. pixel: column and row in a picture; the light hangs a little before the
 * surface there, and points away from it. position: its place, instead; it points down. view:
 * index of the view.
 */
export interface AddLight {
  type: 'spot' | 'point' | 'panel';
  pixel?: [number, number] | null;
  position?: number[] | null;
  view?: number;
}

/**
 * A request to remove an added light, by name: one step. Answered by `state`; `rig` follows.
 *
 * name: of the light.
 */
export interface RemoveLight {
  name: string;
}

/**
 * A request for the places of all lights, and for `rig` after every later move. Answered by
 * `started`, later by `rig`.
 */
export interface ShowRig {
}

/**
 * A request to find places, directions and cones of lights that come closest to the paintings,
 * or to stop that. Answered by `started`, then by `trial` and later by `placed`; the result is one
 * step.
 *
 * new_type: type of lights to add, instead of moving existing ones; null for none. max_count:
 * maximum number of them. surfaces: names of rails, surfaces and shapes that they may hang on;
 * none for anywhere free. keeps_best: for a stop: whether the best that was found by then becomes
 * a step, once it is judged; otherwise every light stays where it is. run: false to stop.
 */
export interface PlaceLights {
  run?: boolean;
  new_type?: 'spot' | 'point' | 'panel' | null;
  max_count?: number;
  surfaces?: string[];
  keeps_best?: boolean;
}

/**
 * A request to say what a search for places would do, and about how long it would take.
 * Answered by `place_estimate`.
 *
 * new_type, max_count, surfaces: as in `place`.
 */
export interface EstimatePlaces {
  new_type?: 'spot' | 'point' | 'panel' | null;
  max_count?: number;
  surfaces?: string[];
}

/**
 * The lights that share a dimmer: all such groups, of names. Answered by `answer`.
 *
 * ties: groups of names of lights.
 */
export interface TieLights {
  ties: string[][];
}

/**
 * Pixels under the brush; with arrays `image` (rows, columns, 3) float32 and `importance`
 * (rows, columns) float32. Answered by `answer`.
 *
 * stroke: number of the stroke, which the page counts. is_final: whether this ends the stroke;
 * only then it is kept. label: its name for undo. view: index of the painted view. layer: id of
 * the layer of these pixels. For all kinds but `pixels`, `importance` is the coverage, 0 to 1, and
 * masks need no `image`. properties: of the layer, from now on; with an unused id they add a layer
 * on top. region: of these pixels.
 */
export interface Paint {
  stroke: number;
  region: Region;
  is_final?: boolean;
  label?: string;
  view?: number;
  layer?: number;
  properties?: Layer | null;
}

/**
 * A change of layers, their properties or their order: one step. Answered by `answer`.
 *
 * layers: new or changed ones; new ones lie on top. order: ids of all that stay, the lowest first;
 * null for the current order. copies: ids of the originals by the id of each copy, which is among
 * `layers`. is_final: whether it becomes a step; false while a slider moves. label: its name for
 * undo.
 */
export interface ChangeLayers {
  layers?: Layer[];
  order?: number[] | null;
  copies?: Record<string, number>;
  is_final?: boolean;
  label?: string;
}

/**
 * The selection of a view: a mask that clients multiply what they paint by; one step. With an
 * array `mask` (rows, columns) uint8, 255 for a fully selected pixel. Answered by `selected`.
 *
 * region: of the mask; nothing is selected outside it. With an empty one, or a mask of zeros,
 * everything can be painted. label: its name for undo. view: index of the view.
 */
export interface Select {
  region: Region;
  label?: string;
  view?: number;
}

/**
 * A part of a file of layers, `.ora` or the painter's EXR; with array `part`, its bytes.
 * Answered by `started`. After the last part follow `patch` messages, as a step was made, and a
 * `notice`; or a `notice` that says why not.
 *
 * name: of the file. size: of the whole file in bytes. start: position of the part, which arrive
 * in order. view: index of the view that the layers are of. replaces: whether they replace all
 * layers, which needs a session of one view; otherwise they lie on top.
 */
export interface ImportLayers {
  name: string;
  size: number;
  start: number;
  view?: number;
  replaces?: boolean;
}

/**
 * Cancel the unfinished stroke, and what a drag or a slider has changed. Answered by `patch`.
 *
 * stroke: number of the stroke; 0 for none.
 */
export interface DropStroke {
  stroke?: number;
}

/**
 * Undo the last step, whether paint, constraints or settings. Answered by `patch`.
 */
export interface Undo {
}

/**
 * Redo a step that was undone. Answered by `patch`.
 */
export interface Redo {
}

/**
 * A request for the last `count` steps of the history. Answered by `steps`.
 */
export interface ListSteps {
  count?: number;
}

/**
 * Undo or redo up to the state after a step, by its id; 0 is the beginning. Answered by
 * `patch`.
 */
export interface GoToStep {
  step: number;
}

/**
 * A request for the answer before the last step, to compare with. Answered by `previous`.
 */
export interface ShowPrevious {
}

/**
 * Put the layers of a preset on top, in all views and within what is selected: one step.
 * Answered by `patch`.
 *
 * preset: its name, as in `state`. subject: name of the object that it is about; null to take the
 * most central one.
 */
export interface ApplyPreset {
  preset: string;
  subject?: string | null;
}

/**
 * A part of a picture file that becomes a reference; with array `part`, its bytes. Answered by
 * `started`. After the last part follows `references`, or a `notice` that says why not.
 *
 * name: of the file. size: of the whole file in bytes. start: position of the part, which arrive
 * in order.
 */
export interface AddReference {
  name: string;
  size: number;
  start: number;
}

/**
 * Delete a reference. Answered by `references`.
 *
 * reference: its id.
 */
export interface DropReference {
  reference: number;
}

/**
 * Put layers on top that ask for the light of a reference, within what is selected: one step.
 * Answered by `patch`.
 *
 * areas: that are compared beside the colour of the `whole` picture: its shadows and lit parts;
 * these and its `regions`, top, middle and bottom; nine `parts`, for a reference of the same view;
 * or `pairs` of places, each in the reference and in the view. matches_brightness: whether the
 * picture becomes as bright as the reference; otherwise only differences within it count.
 * reference: its id. pairs: of places, if `areas` is `pairs`. view: index of the view.
 */
export interface LookLike {
  reference: number;
  areas?: 'whole' | 'regions' | 'parts' | 'pairs';
  pairs?: PlacePair[];
  view?: number;
  matches_brightness?: boolean;
}

/**
 * Delete all layers and all paint, in all views: one step. Answered by `patch`.
 */
export interface ClearPainting {
}

/**
 * Go back to the scene as it was before anything was painted or requested, except for looks:
 * one step. Answered by `patch`, or by `state` if lights had been added.
 */
export interface StartOver {
}

/**
 * Keep painting and answer under a name. Answered by `looks`.
 *
 * name: of the look.
 */
export interface SaveLook {
  name: string;
}

/**
 * Continue from a look; a step that can be undone. Answered by `patch`.
 *
 * look: its id.
 */
export interface LoadLook {
  look: number;
}

/**
 * Give a look another name. Answered by `looks`.
 *
 * look: its id. name: the new one.
 */
export interface RenameLook {
  look: number;
  name: string;
}

/**
 * Keep a copy of a look. Answered by `looks`.
 *
 * look: its id.
 */
export interface CopyLook {
  look: number;
}

/**
 * Keep a mix of two looks: its lights are locked at the share `part` of the way from the first
 * to the second. Answered by `looks`.
 *
 * first, second: their ids. part: 0 to 1. name: of the mix.
 */
export interface MixLooks {
  first: number;
  second: number;
  part: number;
  name: string;
}

/**
 * A request for pictures of looks whose lights hang elsewhere than now; for none, to stop.
 * Answered by `started`; `renewed` then lists `look_plane/ID` and `look_clean/ID` of each: first
 * with estimated planes of lights that hang nowhere else, later with rendered ones.
 *
 * looks: their ids.
 */
export interface CompareLooks {
  looks?: number[];
}

/**
 * Delete a look. Answered by `looks`.
 *
 * look: its id.
 */
export interface DropLook {
  look: number;
}

/**
 * Propose a lighting to the painter: it becomes a look with each light locked at the proposed
 * level, and replaces an earlier proposal of that name. Answered by `looks`.
 *
 * lights: emission by name of light; other lights keep the emission of the current answer. name:
 * of the proposal.
 */
export interface Propose {
  name: string;
  lights: Record<string, RGB>;
}

/**
 * The first message of a page, and again after a dropped connection. Answered by `state`, or by
 * `waiting` while there is no picture yet; `state` then comes as soon as there is one.
 *
 * version: of the protocol that the client speaks.
 */
export interface Hello {
  version: number;
}

/**
 * Settings of the answer, as in `Fit`. Answered by `answer`.
 *
 * settings: of hold, space, colors, literal, prefer_current, near, sparse; null for the default
 * that follows from the painting. With `ignore_wishes` true, answers need not meet the wishes for
 * measuring planes.
 */
export interface ChangeSettings {
  settings: Record<string, any>;
}

/**
 * A request to show the effect of a change, before it is made. Answered by `started`, later by
 * `previewed`, with small pictures of the answer now and after the change, `before` and `after`
 * (h, w, 3) uint8.
 *
 * number: of the preview, which the page counts; `previewed` returns it. settings, constraints,
 * ties: as in `change_settings`, `constrain_lights` and `tie`; null for unchanged ties. view:
 * index of the view.
 */
export interface Preview {
  number: number;
  settings?: Record<string, any>;
  constraints?: Record<string, Record<string, any>>;
  ties?: string[][] | null;
  view?: number;
}

/**
 * Write results to a folder of the session, or stop that. Answered by `started`, later by
 * `exported`, which names the files written, even if stopped.
 *
 * outputs: `target`: a painting of each painted view; `layers`: its layers; `picture`: the
 * displayed answer in each view. name: of a new folder in `exports/` for these files; a number
 * follows a name that is taken, so that no earlier export is replaced. "" for the folder of the
 * session itself, whose earlier files of the same names are replaced. run: false to stop.
 */
export interface Export {
  outputs: ('target' | 'picture' | 'lighting' | 'relit' | 'report' | 'layers')[];
  run?: boolean;
  name?: string;
}

/**
 * Render the answer of now with the renderer, in the background, into a new folder in
 * `renders/`. Answered by `renders`, which follows again whenever a render changes its state.
 *
 * name: of the folder; a number follows one that is taken. width: of the picture in pixels; the
 * height follows from the scene. spp: samples per pixel. formats: `exr`, linear light as rendered,
 * its noise, and denoised; `png`, 16 bits, denoised, through the view and exposure of the scene.
 * view: index of the view.
 */
export interface RenderFinal {
  name: string;
  width: number;
  spp: number;
  formats?: ('exr' | 'png')[];
  view?: number;
}

/**
 * Stop a final render, which writes nothing then. Answered by `renders`.
 *
 * render: its id.
 */
export interface StopRender {
  render: number;
}

/**
 * Send the answer to the console from now on, as it follows the brush, or end that. Answered by
 * `console`.
 *
 * is_on: whether to send.
 */
export interface SwitchConsole {
  is_on: boolean;
}

/**
 * Take all lamps of the console to 0 until it is switched on again. Answered by `console`.
 */
export interface BlackOut {
}

/**
 * Take a final render that has ended off the list; its files stay. Answered by `renders`.
 *
 * render: its id.
 */
export interface DropRender {
  render: number;
}

/**
 * Render the answer in a view, or stop that. Answered by `started`, later by `verified`, or by
 * `stopped` once the render has ended.
 *
 * run: false to stop. view: index of the view.
 */
export interface Verify {
  run?: boolean;
  view?: number;
}

/**
 * A request for the reasons why a view is not closer to its painting. Answered by `started`,
 * later by `explained` and the picture `beyond`.
 *
 * view: index of the view.
 */
export interface Explain {
  view?: number;
}

/**
 * Take the session over from the page that has it. Answered by `state`.
 */
export interface TakeOver {
}

/**
 * A request for a picture, for clients without HTTP. Answered by `fetched`, with the picture as
 * its array.
 *
 * name: of the picture, as in `resources`.
 */
export interface Fetch {
  name: string;
}

/**
 * The first message of an observer: a client that receives lighting, looks and progress, and
 * never has the session. It may then send `fetch`, `export` and `propose`, and nothing else.
 * Answered by `state` or `waiting`.
 *
 * version: as in `hello`.
 */
export interface Observe {
  version: number;
}

/** Events from the session, by kind. */
export interface Events {
  progress: ProgressReport;
  verified: VerificationResult;
  started: TaskStarted;
  stopped: TaskStopped;
  exported: ExportResult;
  renders: RenderList;
  explained: Explanation;
  previewed: PreviewResult;
  trial: TrialPlaces;
  place_estimate: PlacingEstimate;
  placed: PlacingResult;
  waiting: SessionPending;
  state: SessionState;
  answer: AnswerUpdate;
  patch: CanvasPatch;
  selected: SelectionUpdate;
  renewed: PictureUpdate;
  dragged: DraggedPlane;
  fetched: PictureData;
  steps: StepList;
  previous: PreviousAnswer;
  looks: LookList;
  references: ReferenceList;
  choices: AnswerChoices;
  rig: Rig;
  console: ConsoleState;
  notice: Notice;
  failed: Failure;
  closed: Closing;
  done: Acknowledgement;
}

/** Fields of clients' requests, by kind. */
export interface Requests {
  constrain_light: ConstrainLight;
  constrain_lights: ConstrainLights;
  set_master: SetMaster;
  start_from_lamps: StartFromLamps;
  move: MoveLights;
  point: PointLight;
  add_light: AddLight;
  remove_light: RemoveLight;
  show_rig: ShowRig;
  place: PlaceLights;
  estimate_place: EstimatePlaces;
  tie: TieLights;
  paint: Paint;
  change_layers: ChangeLayers;
  select: Select;
  import_layers: ImportLayers;
  drop_stroke: DropStroke;
  undo: Undo;
  redo: Redo;
  list_steps: ListSteps;
  go_to_step: GoToStep;
  show_previous: ShowPrevious;
  apply_preset: ApplyPreset;
  add_reference: AddReference;
  drop_reference: DropReference;
  look_like: LookLike;
  clear_painting: ClearPainting;
  start_over: StartOver;
  save_look: SaveLook;
  load_look: LoadLook;
  rename_look: RenameLook;
  copy_look: CopyLook;
  mix_looks: MixLooks;
  compare_looks: CompareLooks;
  drop_look: DropLook;
  propose: Propose;
  hello: Hello;
  change_settings: ChangeSettings;
  preview: Preview;
  export: Export;
  render_final: RenderFinal;
  stop_render: StopRender;
  switch_console: SwitchConsole;
  black_out: BlackOut;
  drop_render: DropRender;
  verify: Verify;
  explain: Explain;
  take_over: TakeOver;
  fetch: Fetch;
  observe: Observe;
}

export type AnyEvent = Events[keyof Events];
