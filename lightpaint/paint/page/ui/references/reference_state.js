/** Which reference picture is shown, with its pairs of places. */

/** @import { Ui } from '../ui_state.js' */
/** @typedef {"whole" | "regions" | "parts" | "pairs"} ComparedAreas */

/** Return the reference that is shown; undefined without any. @param {Pick<Ui, "references" | "reference">} ui */
export const shownReference = ({ references, reference }) =>
  references.find(({ id }) => id === reference) ?? references.at(-1);

/** Return the pairs of the shown reference in the shown view.
 * @param {Ui} ui */
export const shownPairs = (ui) =>
  ui.placePairs.filter(
    ({ owner, view }) => owner === shownReference(ui)?.id && view === ui.view,
  );

/** Take the list of references; a new one is shown.
 * @param {Pick<Ui, "references">} message @param {Ui} previous
 * @returns {Partial<Ui>} */
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
