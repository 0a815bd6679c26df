/** Lights on one dimmer: who holds one of them, or puts it out, does it to all. */

/** @typedef {import("./ui_state.js").Asked} Asked */
/** @typedef {import("./ui_state.js").Ui} Ui */

/** Names of the lights on the dimmer of one, if there are others. @param {Ui} ui @param {number} light */
export const tieOf = (ui, light) => ui.ties.find((tie) => tie.includes(ui.lights[light].name));

/** @param {Ui} ui @param {string} name */
const isHeld = ({ asked }, name) => asked[name]?.lock !== undefined || Boolean(asked[name]?.off);

/** Lights that are held, or off, as somebody asks it of them. @param {Ui} ui */
export const heldOf = (ui) =>
  ui.lights.map((_, k) => k).filter((k) => isHeld(ui, ui.lights[k].name));

/** The light by which this one is held: itself, if none on its dimmer is.
 * @param {Ui} ui @param {number} light @returns {number} */
export function holderOf(ui, light) {
  const { name } = ui.lights[light];
  const holder = isHeld(ui, name) ? name : tieOf(ui, light)?.find((one) => isHeld(ui, one));
  return holder === undefined ? light : ui.lights.findIndex((one) => one.name === holder);
}

/** What is asked of a light, its level by whichever light of its dimmer.
 * @param {Ui} ui @param {number} light @returns {Asked | undefined} */
export function askedOf(ui, light) {
  const own = ui.asked[ui.lights[light].name];
  const holder = holderOf(ui, light);
  if (holder === light) return own;
  const { lock, off } = ui.asked[ui.lights[holder].name];
  return { ...own, ...(lock === undefined ? {} : { lock }), ...(off ? { off } : {}) };
}
