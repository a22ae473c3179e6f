// @ts-check

const ORDER = ["system", "light", "dark"];

const chosen = () => localStorage.getItem("theme") ?? "system";

/** Sets the theme that was chosen, or that of the system. */
export function applyTheme() {
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  const theme = chosen() === "system" ? (dark ? "dark" : "light") : chosen();
  document.documentElement.dataset.theme = theme;
  palette = undefined;
}

/** Goes on to the next theme and gives its name. */
export function nextTheme() {
  localStorage.setItem("theme", ORDER[(ORDER.indexOf(chosen()) + 1) % ORDER.length]);
  applyTheme();
  return chosen();
}

/** @type {Record<string, string> | undefined} */
let palette;
const NAMES = [
  "bg",
  "panel",
  "ink",
  "muted",
  "line",
  "accent",
  "good",
  "bad",
  "warn",
  "soft",
  "negative",
  "positive",
  "beam",
  "contour",
  "truth",
  "paper",
  "grid-line",
  "robot",
  "chair",
  "unknown",
];

/** The colors of the theme by the names of style.css, as CSS colors. @returns {Record<string, string>} */
export function colors() {
  if (!palette) {
    const style = getComputedStyle(document.documentElement);
    palette = Object.fromEntries(NAMES.map((n) => [n, style.getPropertyValue(`--${n}`).trim()]));
  }
  return palette;
}

/** A color `#rrggbb` as numbers. @param {string} color @returns {[number, number, number]} */
export function rgb(color) {
  const n = parseInt(color.slice(1), 16);
  return [(n >> 16) & 255, (n >> 8) & 255, n & 255];
}
