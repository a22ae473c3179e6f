// @ts-check
import { calmly, choice, el, group, slider, toggle } from "../ui/controls.js";

/**
 * What the engine's `set` takes.
 * @typedef {{resolution: number, truncation: number, w_max: number | null, noise: number, carve: boolean,
 *   carve_weight: number, weights: string, sweep: string}} Values
 */

const cm = (/** @type {number} */ v) => `${+(v * 100).toFixed(2)} cm`;

const CLAMPS = [2, 4, 8, 16, 24, 32, 64, 128, 256, Infinity];
const TRUNCATIONS = [0.05, 0.075, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5];
const RESOLUTIONS = [0.02, 0.025, 0.03, 0.04, 0.05, 0.075, 0.1, 0.15, 0.2];
const CARVE_WEIGHTS = [0.05, 0.1, 0.2, 0.3, 0.5, 1];
const WEIGHTS = /** @type {[string, string][]} */ ([
  ["constant", "all alike"],
  ["range", "1 / range²"],
  ["incidence", "cos of incidence"],
  ["range-incidence", "both"],
]);
const SWEEPS = /** @type {[string, string][]} */ ([
  ["cell-centre", "at cell centers"],
  ["march", "march along the beams"],
]);

/** How scans are made and fused. */
export class SettingsPanel {
  /** @param {(values: Values) => void} onchange */
  constructor(onchange) {
    this.changed = calmly(onchange, 120);
    /** @type {Values} */
    this.values = {
      resolution: 0.05,
      truncation: 0.15,
      w_max: 64,
      noise: 0.01,
      carve: true,
      carve_weight: 1,
      weights: "constant",
      sweep: "cell-centre",
    };
    this.sliders = this.#makeSliders();
    this.choices = this.#makeChoices();
    this.note = el("p", { class: "note", id: "half-life-note" });
    const { wMax, truncation, resolution, noise, carveWeight } = this.sliders;
    const { carve, weights, sweep } = this.choices;
    const controls = [wMax, truncation, resolution, noise, carve, carveWeight, weights, sweep];
    this.node = group("How it is fused", ...controls.map((c) => c.node), this.note);
  }

  #makeSliders() {
    const wMax = slider({
      id: "w-max",
      label: "Weight clamp W_max",
      values: CLAMPS,
      value: 64,
      format: (v) => (v === Infinity ? "∞, never forget" : String(v)),
      oninput: (v) => this.#set({ w_max: v === Infinity ? null : v }),
    });
    const truncation = slider({
      id: "truncation",
      label: "Truncation τ",
      values: TRUNCATIONS,
      value: 0.15,
      format: cm,
      oninput: (v) => this.#set({ truncation: v }),
    });
    const resolution = slider({
      id: "resolution",
      label: "Cell",
      values: RESOLUTIONS,
      value: 0.05,
      format: cm,
      oninput: (v) => this.#set({ resolution: v }),
    });
    const noise = slider({
      id: "noise",
      label: "Range noise σ",
      min: 0,
      max: 0.1,
      step: 0.005,
      value: 0.01,
      format: cm,
      oninput: (v) => this.#set({ noise: v }),
    });
    const carveWeight = slider({
      id: "carve-weight",
      label: "Weight of free space",
      values: CARVE_WEIGHTS,
      value: 1,
      oninput: (v) => this.#set({ carve_weight: v }),
    });
    return { wMax, truncation, resolution, noise, carveWeight };
  }

  #makeChoices() {
    const carve = toggle({
      id: "carve",
      label: "Carve free space",
      value: true,
      onchange: (v) => this.#set({ carve: v }),
    });
    const weights = choice({
      id: "weights",
      label: "Weights",
      value: "constant",
      options: WEIGHTS,
      onchange: (v) => this.#set({ weights: v }),
    });
    const sweep = choice({
      id: "sweep",
      label: "Sweep",
      value: "cell-centre",
      options: SWEEPS,
      onchange: (v) => this.#set({ sweep: v }),
    });
    return { carve, weights, sweep };
  }

  /** @param {Partial<Values>} change */
  #set(change) {
    const now = { ...this.values, ...change };
    // A band narrower than a cell would hold no cell.
    if (now.truncation < now.resolution) this.sliders.truncation.value = now.truncation = now.resolution;
    this.values = now;
    this.changed(now);
  }

  /** Shows what the engine has. @param {Values} values @param {boolean} simulated */
  show(values, simulated) {
    this.values = { ...values };
    const { sliders, choices } = this;
    sliders.wMax.value = values.w_max ?? Infinity;
    sliders.truncation.value = values.truncation;
    sliders.resolution.value = values.resolution;
    sliders.noise.value = values.noise;
    sliders.noise.node.hidden = !simulated;
    sliders.carveWeight.value = values.carve_weight;
    choices.carve.value = values.carve;
    choices.weights.value = values.weights;
    choices.sweep.value = values.sweep;
  }

  /** @param {number | null} halfLife observations; `null`: the map forgets nothing */
  showHalfLife(halfLife) {
    const note =
      halfLife === null
        ? "The map never forgets."
        : `A saturated cell forgets half of an error in ${halfLife.toFixed(2)} observations, whatever they weigh.`;
    if (this.note.textContent !== note) this.note.textContent = note;
  }

  /** @returns {Record<string, string>} */
  link() {
    const { w_max, ...rest } = this.values;
    const texts = Object.entries({ ...rest, w_max: w_max ?? "inf" }).map(([k, v]) => [k, String(v)]);
    return Object.fromEntries(texts);
  }

  /** The values with what a link changes; `undefined`: it changes nothing. @param {URLSearchParams} link */
  wanted(link) {
    const now = this.values;
    /** @type {any} */
    const wanted = { ...now };
    for (const [key, value] of Object.entries(now)) {
      const text = link.get(key);
      if (text === null) continue;
      if (key === "w_max") wanted[key] = text === "inf" ? null : Number(text);
      else if (typeof value === "number") wanted[key] = Number(text);
      else wanted[key] = typeof value === "boolean" ? text === "true" : text;
    }
    return JSON.stringify(wanted) === JSON.stringify(now) ? undefined : wanted;
  }
}
