// @ts-check

import { three } from "../ui/units.js";

/** A power of ten of bytes. @param {number} power */
export const bytesOf = (power) =>
  power >= 9
    ? `${10 ** (power - 9)} GB`
    : power >= 6
      ? `${10 ** (power - 6)} MB`
      : power >= 3
        ? `${10 ** (power - 3)} kB`
        : `${10 ** power} B`;

/** A power of ten of seconds. @param {number} power */
export const timeOf = (power) =>
  power >= 0
    ? `${10 ** power} s`
    : power >= -3
      ? `${10 ** (power + 3)} ms`
      : power >= -6
        ? `${10 ** (power + 6)} µs`
        : `${10 ** (power + 9)} ns`;

/** Seconds in the unit that suits them. @param {number} s */
export function time(s) {
  if (s === 0) return "0";
  if (s < 1e-6) return `${three(s * 1e9)} ns`;
  if (s < 1e-3) return `${three(s * 1e6)} µs`;
  return s < 1 ? `${three(s * 1e3)} ms` : `${three(s)} s`;
}

/** How many times. @param {number} n */
export const times = (n) =>
  `${n >= 100 ? Math.round(n).toLocaleString("en") : n >= 10 ? n.toFixed(0) : n.toFixed(1)} ×`;

/** Whole numbers with their thousands apart. @param {number} n */
export const whole = (n) => n.toLocaleString("en");

/** Metres as millimetres. @param {number | null | undefined} m */
export const millimetres = (m) => (m === null || m === undefined ? "–" : `${(1000 * m).toFixed(1)}`);

/** A length for people. @param {number} m */
export const length = (m) => (Math.abs(m) < 1 ? `${(100 * m).toFixed(1)} cm` : `${m.toFixed(3)} m`);
