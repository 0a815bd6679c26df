/** The state of the interface that is about scopes. */

/** @typedef {"histogram" | "waveform" | "parade" | "vectorscope"} ScopeKind */

/**
 * @typedef {object} ScopeState
 * @property {ScopeKind} scopeKind
 * @property {"painting" | "solution" | "present"} scopePicture whose codes it shows
 */

/** @type {ScopeState} */
export const INITIAL_SCOPES = { scopeKind: 'waveform', scopePicture: 'solution' };
