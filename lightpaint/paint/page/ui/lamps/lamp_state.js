/** The state of the interface that is about many lamps. */

/**
 * @typedef {object} LampState
 * @property {number[]} selectedLights lights that one action changes
 * @property {number | null} selectionAnchor the light from which Shift selects a range
 * @property {boolean} isLassoing whether a drag over the pictures selects marked lights
 * @property {Record<string, string>} gelCodes codes of the filters put on lights here, by name
 * @property {"white" | "hsv" | "rgb" | "gel"} lampMixer how the colour of lamps is set
 * @property {number} master factor of all lights but fixed ones
 */

/** @type {LampState} */
export const INITIAL_LAMPS = {
  selectedLights: [],
  selectionAnchor: null,
  isLassoing: false,
  gelCodes: {},
  lampMixer: 'white',
  master: 1,
};

/** Return the weights that lights shine at, under the master dimmer. @param {LampState &
 *   Pick<import("../ui_state.js").BaseUi, 'weights' | 'lights'>} ui
 * @returns {import("../engine_interface.js").RGB[]} */
export const outputWeights = ({ weights, lights, master }) =>
  weights.map(([r, g, b], k) =>
    lights[k]?.is_fixed ? [r, g, b] : [master * r, master * g, master * b],
  );
