/** What messages of the session say, as state of the interface. */

/** @typedef {import('./engine.js').Message} Message */
/** @typedef {import('./engine.js').RGB} RGB */
/** @typedef {import('./model.js').Ui} Ui */

/** @param {any} message @returns {Partial<Ui>} */
export function stateOf(message, /** @type {import('./model.js').Ui} */ before) {
  const { lights, asked, ties, settings, meant, history, looks, resources, basis } = message;
  return {
    ready: true,
    state: message,
    lights,
    asked: asked ?? {},
    ties: ties ?? [],
    settings: settings ?? {},
    meant: meant ?? {},
    history,
    looks: looks ?? [],
    resources: resources ?? {},
    hint: Boolean(message.first),
    connection: 'open',
    closed: null,
    basis:
      basis && !basis.done
        ? { what: 'basis', done: basis.spp, total: basis.wanted, unit: 'samples' }
        : null,
    // A scene is first shown as it is painted.
    ...(before.state ? {} : { show: { ...before.show, ...shownAs(message.transform) } }),
    ...answerFields(message.answer ?? {}, []),
    ...weightsOf(message),
  };
}

/** @param {{name: string, stops: number} | undefined} transform */
function shownAs(transform) {
  return transform ? { transform: transform.name, stops: transform.stops } : {};
}

/**
 * What an exact answer says. The sentences come after the lights, when they have been found; until
 * then those of the last answer stay.
 * @param {any} answer @param {import('./model.js').Lit[]} before @returns {Partial<Ui>}
 */
function answerFields({ headline, delta_e: deltaE, sentences, lights }, before) {
  /** @type {Partial<Ui>} */
  const made = { isLive: false };
  if (headline !== undefined) {
    Object.assign(made, { headline, deltaE: deltaE ?? null, sentences: sentences ?? [] });
  }
  if (lights) {
    made.lit = lights.map((/** @type {any} */ one, /** @type {number} */ k) => ({
      ...before[k],
      ...one,
    }));
  }
  return made;
}

/** @param {Message} message @returns {Partial<Ui>} */
function weightsOf(message) {
  const flat = message.arrays?.weights?.data;
  if (!flat) return {};
  /** @type {RGB[]} */
  const weights = [];
  for (let at = 0; at < flat.length; at += 3) weights.push([flat[at], flat[at + 1], flat[at + 2]]);
  return { weights };
}

/** Of an answer, and of a patch. @param {any} message @param {Ui} ui @returns {Partial<Ui>} */
export function answerOf(message, ui) {
  const made = /** @type {Partial<Ui>} */ (weightsOf(message));
  for (const key of /** @type {const} */ (['history', 'asked', 'ties', 'settings', 'meant'])) {
    if (message[key]) made[key] = message[key];
  }
  if (message.lights) Object.assign(made, answerFields(message, ui.lit));
  else if (!message.exact) made.isLive = true;
  if (ui.verified && made.weights) made.verified = { ...ui.verified, isOld: true };
  // The reasons were those of the answer before.
  if (made.isLive && ui.explained.length) made.explained = [];
  return made;
}

/** @param {any} message @returns {Partial<Ui>} */
export function progressOf({ what, done, total, unit }) {
  const made = { what, done, total, unit };
  if (!what) return { basis: null, verifying: null, writing: null };
  if (what === 'export') return { writing: made };
  if (/verif/i.test(what)) return { verifying: made };
  return { basis: total && done >= total ? null : made };
}
