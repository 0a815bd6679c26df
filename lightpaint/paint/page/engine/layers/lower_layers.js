/**
 * The composition below a layer that is being painted or changed, tile by tile, kept until that
 * changes: a stroke costs the same however many layers lie below. The twin of
 * paint/layers/composed_layers.py.
 */

/** @typedef {import("./layer_composition.js").Composed} Composed */

export class LowerLayers {
  constructor() {
    /** What the tiles depend on. */
    this.state = '';
    /** @type {Map<number, Composed>} */
    this.tiles = new Map();
  }

  /** Return a copy of a tile, which is composed if it is not known for this state.
   * @param {string} state @param {number} key @param {() => Composed} compose
   * @returns {Composed} */
  tile(state, key, compose) {
    if (state !== this.state) this.tiles.clear();
    this.state = state;
    const { light, counts } = this.tiles.get(key) ?? this.keep(key, compose());
    return { light: light.slice(), counts: counts.slice() };
  }

  /** @param {number} key @param {Composed} tile */
  keep(key, tile) {
    this.tiles.set(key, tile);
    return tile;
  }
}
