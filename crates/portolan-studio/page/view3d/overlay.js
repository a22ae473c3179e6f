// @ts-check
import { el } from "../ui/controls.js";
import { cm } from "./format.js";
import { gradient, stops } from "./ramps.js";

const NAMES = /** @type {Record<string, string>} */ ({
  height: "Height ",
  color: "Color as it was seen",
  weight: "Weight ",
  sigma: "Standard deviation of the surface ",
  passed: "Looks that passed ",
  error: "Distance to the true surface ",
});
const LABEL =
  "The map in 3-D. Arrow keys go round it, with Shift sideways, plus and minus nearer and further, " +
  "Enter selects the voxel in the middle.";

/** The canvases of the view, with legends and crosshair over them. */
export class Overlay {
  constructor() {
    this.canvas = el("canvas", { id: "3d-canvas", tabindex: 0, role: "application", "aria-label": LABEL });
    /** Slices, where the browser has no WebGL. */
    this.flat = el("canvas", { id: "3d-flat", class: "pixels", hidden: true, "aria-label": "The slice" });
    this.text = el("span", { id: "3d-legend" });
    this.ramp = el("i", { class: "swatch", "aria-hidden": "true" });
    this.low = el("span", { id: "3d-low" });
    this.high = el("span", { id: "3d-high" });
    this.progress = el("div", { id: "3d-recoloring", hidden: true });
    this.slice = el("div", { id: "3d-slice-legend", hidden: true });
    const surface = el("div", {}, this.text, this.low, this.ramp, this.high);
    this.legend = el("div", { class: "overlay" }, surface, this.progress, this.slice);
    this.cross = el("div", { class: "crosshair", "aria-hidden": "true", hidden: true });
    this.node = el("div", { class: "canvas" }, this.canvas, this.flat, this.legend, this.cross);
    this.canvas.addEventListener("focus", () => {
      this.cross.hidden = !this.canvas.matches(":focus-visible");
    });
    this.canvas.addEventListener("blur", () => (this.cross.hidden = true));
  }

  /** How far colors of another kind are. @param {string} by @param {number | null} share `null`: they are there */
  showProgress(by, share) {
    this.progress.hidden = share === null;
    this.progress.textContent = share === null ? "" : `Next by ${by}: ${Math.floor(100 * share)} %`;
  }

  withoutWebGL() {
    this.canvas.hidden = true;
    this.flat.hidden = false;
    const why = "This browser has no WebGL: slices are shown, the mesh is not.";
    this.legend.append(el("p", { class: "error", id: "3d-no-webgl" }, why));
  }

  /**
   * What the colors of the surface mean.
   * @param {{by: string, ramp: {low: number | null, high: number | null, unit: string} | null}} color
   * @param {number} ground height of the page's origin (metres)
   */
  showColor({ by, ramp }, ground) {
    this.text.textContent = NAMES[by] ?? "";
    this.ramp.hidden = this.low.hidden = this.high.hidden = !ramp;
    if (!ramp) return;
    this.ramp.style.background = gradient(stops(by));
    const end = (/** @type {number | null} */ v) => {
      if (v === null) return "";
      if (by === "sigma") return cm(v);
      if (by === "error") return `${v > 0 ? "+" : "−"}${cm(Math.abs(v))}`;
      return `${by === "height" ? (v + ground).toFixed(2) : v.toFixed(0)}${ramp.unit && ` ${ramp.unit}`}`;
    };
    this.low.textContent = end(ramp.low);
    this.high.textContent = end(ramp.high);
  }
}
