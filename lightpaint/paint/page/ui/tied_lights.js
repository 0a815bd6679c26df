/** Tied lights: locking one of them, or switching it off, affects all. */

/** @import { Constraints, Ui } from './ui_state.js' */

/** Return the names of all lights on a light's dimmer, if there are others. @param {Ui} ui
 * @param {number} light */
export const findTie = (ui, light) => ui.ties.find((tie) => tie.includes(ui.lights[light].name));

/** @param {Ui} ui @param {string} name */
const isLocked = ({ constraints }, name) =>
  constraints[name]?.lock !== undefined || Boolean(constraints[name]?.off);

/** Return the lights that constraints lock or switch off. @param {Ui} ui */
export const lockedLights = (ui) =>
  ui.lights.map((_, k) => k).filter((k) => isLocked(ui, ui.lights[k].name));

/** Return the light whose lock holds this one: itself, if none on its dimmer is locked.
 * @param {Ui} ui @param {number} light @returns {number} */
export function lockingLight(ui, light) {
  const { name } = ui.lights[light];
  const lockingName = isLocked(ui, name)
    ? name
    : findTie(ui, light)?.find((member) => isLocked(ui, member));
  return lockingName === undefined
    ? light
    : ui.lights.findIndex((member) => member.name === lockingName);
}

/** Return the constraints of a light, with the level constraint of its dimmer.
 * @param {Ui} ui @param {number} light @returns {Constraints | undefined} */
export function constraintsOf(ui, light) {
  const ownConstraints = ui.constraints[ui.lights[light].name];
  const lockingIndex = lockingLight(ui, light);
  if (lockingIndex === light) return ownConstraints;
  const { lock, off } = ui.constraints[ui.lights[lockingIndex].name];
  return { ...ownConstraints, ...(lock === undefined ? {} : { lock }), ...(off ? { off } : {}) };
}
