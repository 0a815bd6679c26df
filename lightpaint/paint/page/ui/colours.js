/**
 * Colours of paint: hex, HSV and Kelvin with green, to and from linear Rec.709.
 *
 * Kelvin is a place on Planck's locus; green is the distance from it in CIE 1960 (u, v), times
 * 1000, positive towards green, as on the dials of film lights.
 */

/** @typedef {[number, number, number]} RGB */

/** @param {number} x linear, 0 to 1 @returns {number} */
export const encode = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055)

/** @param {number} v display, 0 to 1 @returns {number} */
export const decode = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)

/** @param {ArrayLike<number>} rgb @returns {number} */
export const luminance = (rgb) => 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]

/** @param {ArrayLike<number>} rgb linear; brighter than 1 is scaled down @returns {string} */
export function toHex(rgb) {
  const top = Math.max(1, rgb[0], rgb[1], rgb[2])
  const digits = [0, 1, 2].map((c) => Math.round(255 * encode(Math.max(0, rgb[c]) / top)))
  return '#' + digits.map((d) => d.toString(16).padStart(2, '0')).join('')
}

/** @param {string} text @returns {RGB | null} null for what is no colour */
export function ofHex(text) {
  const found = /^#?([0-9a-f]{3}|[0-9a-f]{6})$/i.exec(text.trim())
  if (!found) return null
  const full = found[1].length === 3 ? found[1].replace(/./g, '$&$&') : found[1]
  const [r, g, b] = [0, 2, 4].map((at) => decode(parseInt(full.slice(at, at + 2), 16) / 255))
  return [r, g, b]
}

/** @param {ArrayLike<number>} rgb linear @returns {RGB} hue in degrees, saturation and value 0..1 */
export function toHsv(rgb) {
  const [r, g, b] = [0, 1, 2].map((c) => encode(Math.min(1, Math.max(0, rgb[c]))))
  const top = Math.max(r, g, b)
  const range = top - Math.min(r, g, b)
  if (range < 1e-9) return [0, 0, top]
  const turn = top === r ? (g - b) / range : top === g ? 2 + (b - r) / range : 4 + (r - g) / range
  return [(60 * turn + 360) % 360, range / top, top]
}

/** @param {RGB} hsv @returns {RGB} linear */
export function ofHsv([hue, saturation, value]) {
  const part = (/** @type {number} */ n) => {
    const k = (n + hue / 60) % 6
    return decode(value - value * saturation * Math.max(0, Math.min(k, 4 - k, 1)))
  }
  return [part(5), part(3), part(1)]
}

/** Planck's locus in CIE 1960 (Krystek 1985). @param {number} kelvin @returns {[number, number]} */
function locus(kelvin) {
  const t = kelvin
  const u =
    (0.860117757 + 1.54118254e-4 * t + 1.28641212e-7 * t * t) /
    (1 + 8.42420235e-4 * t + 7.08145163e-7 * t * t)
  const v =
    (0.317398726 + 4.22806245e-5 * t + 4.20481691e-8 * t * t) /
    (1 - 2.89741816e-5 * t + 1.61456053e-7 * t * t)
  return [u, v]
}

/** The locus's unit normal towards green. @param {number} kelvin @returns {[number, number]} */
function towardsGreen(kelvin) {
  const [u0, v0] = locus(kelvin * 0.995)
  const [u1, v1] = locus(kelvin * 1.005)
  const length = Math.hypot(u1 - u0, v1 - v0)
  return [((v0 - v1) / length) * -1, ((u1 - u0) / length) * -1]
}

/**
 * @param {number} kelvin
 * @param {number} [green] in thousandths of (u, v)
 * @returns {RGB} linear, its largest channel 1, none below 0
 */
export function ofKelvin(kelvin, green = 0) {
  const normal = towardsGreen(kelvin)
  const [u, v] = locus(kelvin).map((place, c) => place + (green / 1000) * normal[c])
  const [x, y] = [(3 * u) / (2 * u - 8 * v + 4), (2 * v) / (2 * u - 8 * v + 4)]
  const [X, Z] = [x / y, (1 - x - y) / y]
  const rgb = [
    3.2404542 * X - 1.5371385 - 0.4985314 * Z,
    -0.969266 * X + 1.8760108 + 0.041556 * Z,
    0.0556434 * X - 0.2040259 + 1.0572252 * Z,
  ].map((light) => Math.max(0, light))
  const top = Math.max(...rgb)
  return [rgb[0] / top, rgb[1] / top, rgb[2] / top]
}

/**
 * @param {ArrayLike<number>} rgb linear
 * @returns {{kelvin: number, green: number} | null} null for black, and what is no white of any kind
 */
export function toKelvin(rgb) {
  const X = 0.4124564 * rgb[0] + 0.3575761 * rgb[1] + 0.1804375 * rgb[2]
  const Y = luminance(rgb)
  const Z = 0.0193339 * rgb[0] + 0.119192 * rgb[1] + 0.9503041 * rgb[2]
  const sum = X + 15 * Y + 3 * Z
  if (!(sum > 0)) return null
  const [u, v] = [(4 * X) / sum, (6 * Y) / sum]
  // By the mired, along which the locus is nearly even.
  let [low, high] = [40, 1000]
  const far = (/** @type {number} */ mired) => {
    const [a, b] = locus(1e6 / mired)
    return Math.hypot(u - a, v - b)
  }
  for (let round = 0; round < 60; round += 1) {
    const third = (high - low) / 3
    if (far(low + third) < far(high - third)) high -= third
    else low += third
  }
  const kelvin = 2e6 / (low + high)
  const [a, b] = locus(kelvin)
  const normal = towardsGreen(kelvin)
  const green = 1000 * ((u - a) * normal[0] + (v - b) * normal[1])
  return far((low + high) / 2) > 0.05 ? null : { kelvin, green }
}
