// @ts-check

/** Metres as centimetres. @param {number} m */
export const cm = (m) => `${(100 * m).toFixed(1).replace(/\.0$/, "")} cm`;

/** @param {number} s */
export const ms = (s) => `${(1000 * s).toFixed(1)} ms`;

/** A whole number with its thousands apart. @param {number} n */
export const count = (n) => n.toLocaleString("en").replaceAll(",", " ");

/**
 * The numbers of a link, separated by commas.
 * @param {string | null} text
 * @param {number} n how many there must be
 * @returns {number[] | null}
 */
export function numbers(text, n) {
  const all = (text ?? "").split(",").map(Number);
  return all.length === n && all.every(Number.isFinite) ? all : null;
}
