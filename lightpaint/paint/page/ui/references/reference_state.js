/** The state of the interface that is about reference pictures. */

/** @typedef {import("../../engine/messages.js").PlacePair} PlacePair */
/** @typedef {"whole" | "regions" | "parts" | "pairs"} ComparedAreas */

/**
 * @typedef {object} ReferenceState
 * @property {import("../../engine/messages.js").ReferenceInfo[]} references the oldest first
 * @property {boolean} isReferenceOpen whether their pane is shown
 * @property {number | null} reference id of the one that is shown; null for the last one
 * @property {boolean} isReferenceComing whether a file is being read
 * @property {ComparedAreas} comparedAreas
 * @property {boolean} matchesBrightness
 * @property {(PlacePair & {owner: number, view: number})[]} placePairs of all references: `owner` is
 *   the id of one
 */

/** @type {ReferenceState} */
export const INITIAL_REFERENCES = {
  references: [],
  isReferenceOpen: false,
  reference: null,
  isReferenceComing: false,
  comparedAreas: 'regions',
  matchesBrightness: false,
  placePairs: [],
};

/** Return the reference that is shown; undefined without any. @param {ReferenceState} ui */
export const shownReference = ({ references, reference }) =>
  references.find(({ id }) => id === reference) ?? references.at(-1);

/** Return the pairs of the shown reference in the shown view.
 * @param {ReferenceState & {view: number}} ui */
export const shownPairs = (ui) =>
  ui.placePairs.filter(
    ({ owner, view }) => owner === shownReference(ui)?.id && view === ui.view,
  );

/** Take the list of references; a new one is shown.
 * @param {{references: ReferenceState["references"]}} message @param {ReferenceState} previous
 * @returns {Partial<ReferenceState>} */
export function referencesUpdate({ references }, previous) {
  const known = previous.references.map(({ id }) => id);
  const added = references.find(({ id }) => !known.includes(id));
  const ids = references.map(({ id }) => id);
  return {
    references,
    placePairs: previous.placePairs.filter(({ owner }) => ids.includes(owner)),
    ...(added ? { reference: added.id, isReferenceComing: false, isReferenceOpen: true } : {}),
  };
}
