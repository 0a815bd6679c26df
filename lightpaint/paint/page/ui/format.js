/** Numbers as people read them. A true minus, a thin choice of digits, the unit behind. */

const MINUS = '\u2212';

/** @param {number} value @param {number} [digits] @returns {string} */
export function number(value, digits = 3) {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  const text =
    size >= 1e5 || (size > 0 && size < 1e-3)
      ? value.toExponential(1).replace('+', '')
      : String(Number(value.toPrecision(digits)));
  return text.replace('-', MINUS);
}

/** @param {number} value @param {number} [digits] @returns {string} "+0.5", "−1.2", "0" */
export function signed(value, digits = 1) {
  const rounded = Number(value.toFixed(digits));
  if (!rounded) return '0';
  return (rounded > 0 ? '+' : MINUS) + Math.abs(rounded).toFixed(digits);
}

/** @param {number | null | undefined} stops @returns {string} */
export function stopsText(stops) {
  if (stops === null || stops === undefined || !Number.isFinite(stops)) return '';
  return Math.abs(stops) < 0.05 ? 'as now' : `${signed(stops)} st`;
}

/** @param {number} share 0 to 1 @returns {string} */
export function percent(share) {
  const value = 100 * share;
  if (value > 0 && value < 1) return '<1 %';
  return `${Math.round(value)} %`;
}

/** No finer than an eye tells them apart. @param {number} kelvin @returns {string} */
export const kelvinText = (kelvin) => {
  const step = kelvin < 4000 ? 10 : kelvin < 8000 ? 50 : 500;
  return `${Math.round(kelvin / step) * step} K`;
};

/** @param {number} count @param {string} one @param {string} [many] @returns {string} */
export const counted = (count, one, many = `${one}s`) => `${count} ${count === 1 ? one : many}`;
