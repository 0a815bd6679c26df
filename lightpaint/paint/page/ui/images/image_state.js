/** The state of the interface that is about lights that are images. */

import { fromKelvin } from '../paint_colour.js';

/** A light that is an image. lights: indices of its texels, each once, row by row.
 * @typedef {import("../../engine/messages.js").ImageInfo & {lights: number[]}} LightImage */
/** What a press or a drag on the map of an image does to its texels.
 * @typedef {"paint" | "fill" | "gradient" | "sun" | "lock" | "release"} TexelTool */

/**
 * @typedef {object} ImageState
 * @property {LightImage[]} images
 * @property {TexelTool} texelTool
 * @property {import("../engine_interface.js").RGB} texelColour of the paint, its largest channel 1
 * @property {number} texelStops brightness of the paint, from the mean of the image in the scene
 * @property {"white" | "hsv" | "rgb"} texelMixer how that colour is set
 * @property {import("./texel_arithmetic.js").TexelPaint} secondTexelPaint that a gradient becomes
 * @property {number} sunDiameter in degrees
 * @property {Record<string, number>} mapExposures stops at which maps stay shown, by name of the image
 */

/** @type {ImageState} */
export const INITIAL_IMAGES = {
  images: [],
  texelTool: 'paint',
  texelColour: fromKelvin(6500),
  texelStops: 0,
  texelMixer: 'white',
  secondTexelPaint: { colour: fromKelvin(3200), stops: 1 },
  sunDiameter: 4,
  mapExposures: {},
};
