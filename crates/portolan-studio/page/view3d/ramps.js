// @ts-check
import { colors, rgb } from "../ui/theme.js";

/**
 * Colors in even steps from one end to the other, as `#rrggbb`.
 * @param {string} by what is colored
 * @returns {string[]}
 */
export function stops(by) {
  const c = colors();
  const dark = document.documentElement.dataset.theme === "dark";
  if (by === "error") return [c.negative, dark ? "#d9dbdf" : "#ececea", c.positive];
  if (by === "sigma" || by === "passed")
    return dark ? ["#3a3f4a", "#3e8cc2", "#f6fafd"] : ["#dbe9f4", "#3e8cc2", "#123a63"];
  if (by === "weight") return dark ? ["#3a3f4a", "#6d5fb8", "#d7c9ff"] : ["#e9e7f2", "#a58fe6", "#4c2bb8"];
  return ["#3b4f8f", "#2f7f9e", "#4fa98a", "#a8c66c", "#f1d98a"];
}

/** A ramp as 256 RGBA texels. @param {string[]} stops @returns {Uint8Array} */
export function texels(stops) {
  const out = new Uint8Array(256 * 4);
  const all = stops.map(rgb);
  for (let i = 0; i < 256; i++) {
    const at = (i / 255) * (all.length - 1);
    const k = Math.min(Math.floor(at), all.length - 2);
    for (let c = 0; c < 3; c++)
      out[4 * i + c] = Math.round(all[k][c] + (all[k + 1][c] - all[k][c]) * (at - k));
    out[4 * i + 3] = 255;
  }
  return out;
}

/** The same for a legend. @param {string[]} stops */
export const gradient = (stops) => `linear-gradient(to right, ${stops.join(", ")})`;
