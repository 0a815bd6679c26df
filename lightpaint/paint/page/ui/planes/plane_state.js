/** The state of the interface that is about measuring planes. */

/**
 * @typedef {object} PlaneState
 * @property {import("../../engine/messages.js").PlanesInfo | null} planes null until they are measured
 * @property {import("../../engine/messages.js").PlanesReading | null} planesReading what the answer
 *   gives there
 * @property {import("../ui_state.js").Progress | null} planesProgress how far a measurement is
 * @property {string | null} planeCase the case that the pictures show; null for the first
 * @property {string[]} hiddenPlanes names of planes that are not drawn in the pictures
 */

/** @type {PlaneState} */
export const INITIAL_PLANES = {
  planes: null,
  planesReading: null,
  planesProgress: null,
  planeCase: null,
  hiddenPlanes: [],
};
