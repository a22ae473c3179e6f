// @ts-check
import { choice, el, facts, group, legend } from "../ui/controls.js";
import { digits } from "./explain.js";

/** Key, name and unit of each channel. */
const CHANNELS = [
  ["depth", "depth", " m"],
  ["reflectance", "reflectance", ""],
  ["second_moment", "second moment", " m²"],
];

/** Which ray's light is drawn, and in which colors. */
export class LookPanel {
  /** @param {(ray: number | null) => void} onchange */
  constructor(onchange) {
    this.ray = choice({
      id: "radiance-ray",
      label: "Light of ray",
      value: "none",
      options: [["none", "none"]],
      onchange: (v) => onchange(v === "none" ? null : Number(v)),
    });
    const colors = legend([
      { color: "positive", text: "density" },
      { color: "beam", text: "training ray, its light" },
      { color: "contour", text: "held-out ray, its light", dashed: true },
      { color: "negative", text: "residual" },
      { color: "truth", text: "truth, noise", dashed: true },
      { color: "", text: "reflectance 0 to 1", ramp: "linear-gradient(90deg, #000, #fff)" },
    ]);
    this.node = el("div", { class: "group" }, this.ray.node, colors);
  }

  /** @param {any[]} rays */
  setRays(rays) {
    const select = /** @type {HTMLSelectElement} */ (this.ray.node.querySelector("select"));
    if (select.options.length > 1) return;
    const name = (/** @type {any} */ ray, /** @type {number} */ i) => {
      const heldOut = ray.held_out ? ", held out" : "";
      return `${i + 1} ${ray.ascending ? "›" : "‹"} ${ray.origin.toFixed(2)} m${heldOut}`;
    };
    select.append(...rays.map((ray, i) => el("option", { value: i }, name(ray, i))));
  }

  /** @param {number | null} ray */
  show(ray) {
    this.ray.value = String(ray ?? "none");
  }
}

/** Residuals of three channels and two kinds of rays, and what the fit comes to. */
export class ResidualsPanel {
  constructor() {
    const ids = ["training", "held-out"];
    this.cells = CHANNELS.map(([key]) =>
      ids.map((kind) => el("td", { id: `radiance-${kind}-${key.replace("_", "-")}` })),
    );
    const head = ["training", "held out"].map((text) => el("th", { scope: "col" }, text));
    const rows = CHANNELS.map(([, name], i) =>
      el("tr", {}, el("th", { scope: "row" }, name), ...this.cells[i]),
    );
    const table = el("table", {}, el("thead", {}, el("tr", {}, el("td"), ...head)), el("tbody", {}, ...rows));
    this.facts = facts([
      ["radiance-j", "objective J"],
      ["radiance-misplaced", "matter in empty space, Σ σδ"],
    ]);
    this.node = group("Residuals, root mean square", table, this.facts.node);
  }

  /** @param {any} body of an answer */
  show({ training, held_out, objective, misplaced }) {
    for (const [i, [key, , unit]] of CHANNELS.entries())
      for (const [k, values] of [training, held_out].entries()) {
        const text = digits(values[key]) + unit;
        if (this.cells[i][k].textContent !== text) this.cells[i][k].textContent = text;
      }
    this.facts.set({ "radiance-j": digits(objective), "radiance-misplaced": digits(misplaced) });
  }
}
