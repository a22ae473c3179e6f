// @ts-check

/** Metres as centimetres. @param {number} m */
export const cm = (m) => `${(100 * m).toFixed(1).replace(/\.0$/, "")} cm`;

/** @param {number} s */
export const ms = (s) => `${(1000 * s).toFixed(1)} ms`;

/** @param {number | null} n */
export function bytes(n) {
  if (n === null) return "—";
  return n >= 1 << 20 ? `${(n / (1 << 20)).toFixed(1)} MiB` : `${(n / 1024).toFixed(0)} KiB`;
}

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
