/** The settings of the gradient tool. */

/**
 * @typedef {object} GradientUi
 * @property {"linear" | "radial"} shape
 * @property {boolean} isAdjusting whether it makes brighter and warmer, instead of painting
 * @property {boolean} hasEnd whether it leads to the second colour, instead of fading out
 * @property {number} stops
 * @property {number} mired
 */

/** @returns {GradientUi} */
export const initialGradient = () => ({
  shape: 'linear',
  isAdjusting: false,
  hasEnd: false,
  stops: 1,
  mired: 0,
});
