// @ts-check

/** About three digits. @param {number} v */
export const three = (v) => v.toFixed(v >= 100 ? 0 : v >= 10 ? 1 : 2);

/** Bytes, in thousands, as the command line has them. @param {number | null} n */
export function bytes(n) {
  if (n === null) return "—";
  return n >= 1e9 ? `${three(n / 1e9)} GB` : n >= 1e6 ? `${three(n / 1e6)} MB` : `${three(n / 1e3)} kB`;
}
