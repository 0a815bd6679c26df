/** Tied lights: locking one of them, or switching it off, affects all. */

/** @typedef {import("./ui_state.js").Constraints} Constraints */
/** @typedef {import("./ui_state.js").Ui} Ui */

/** Names of the lights on the dimmer of one, if there are others. @param {Ui} ui @param {number} light */
export const findTie = (ui, light) => ui.ties.find((tie) => tie.includes(ui.lights[light].name));

/** @param {Ui} ui @param {string} name */
const isLocked = ({ asked }, name) => asked[name]?.lock !== undefined || Boolean(asked[name]?.off);

/** Lights that are held, or off, as somebody asks it of them. @param {Ui} ui */
export const lockedLights = (ui) =>
  ui.lights.map((_, k) => k).filter((k) => isLocked(ui, ui.lights[k].name));

/** The light by which this one is held: itself, if none on its dimmer is.
 * @param {Ui} ui @param {number} light @returns {number} */
export function lockingLight(ui, light) {
  const { name } = ui.lights[light];
  const locking = isLocked(ui, name) ? name : findTie(ui, light)?.find((one) => isLocked(ui, one));
  return locking === undefined ? light : ui.lights.findIndex((one) => one.name === locking);
}

/** What is asked of a light, its level by whichever light of its dimmer.
 * @param {Ui} ui @param {number} light @returns {Constraints | undefined} */
export function constraintsOf(ui, light) {
  const own = ui.asked[ui.lights[light].name];
  const locking = lockingLight(ui, light);
  if (locking === light) return own;
  const { lock, off } = ui.asked[ui.lights[locking].name];
  return { ...own, ...(lock === undefined ? {} : { lock }), ...(off ? { off } : {}) };
}
