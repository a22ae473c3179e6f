// @ts-check
import { calmly, choice, group, slider, toggle, el } from "../ui/controls.js";

/**
 * What the engine's `set` takes.
 * @typedef {{resolution: number, truncation: number, w_max: number | null, noise: number, carve: boolean,
 *   carve_weight: number,
 *   weights: string, sweep: string}} Values
 */

const cm = (/** @type {number} */ v) => `${+(v * 100).toFixed(2)} cm`;

/** Sliders for how scans are made and fused. @param {(v: Values) => void} onchange */
export function settings(onchange) {
  const tell = calmly(onchange, 120);
  /** @type {Values} */
  let now = {
    resolution: 0.05,
    truncation: 0.15,
    w_max: 64,
    noise: 0.01,
    carve: true,
    carve_weight: 1,
    weights: "constant",
    sweep: "cell-centre",
  };
  /** @param {Partial<Values>} change */
  const set = (change) => {
    now = { ...now, ...change };
    // A band narrower than a cell holds nothing.
    if (now.truncation < now.resolution) truncation.value = now.truncation = now.resolution;
    tell(now);
  };
  const wMax = slider({
    id: "w-max",
    label: "Weight clamp W_max",
    values: [2, 4, 8, 16, 24, 32, 64, 128, 256, Infinity],
    value: 64,
    format: (v) => (v === Infinity ? "∞, never forget" : String(v)),
    oninput: (v) => set({ w_max: v === Infinity ? null : v }),
  });
  const truncation = slider({
    id: "truncation",
    label: "Truncation τ",
    values: [0.05, 0.075, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5],
    value: 0.15,
    format: cm,
    oninput: (v) => set({ truncation: v }),
  });
  const resolution = slider({
    id: "resolution",
    label: "Cell",
    values: [0.02, 0.025, 0.03, 0.04, 0.05, 0.075, 0.1, 0.15, 0.2],
    value: 0.05,
    format: cm,
    oninput: (v) => set({ resolution: v }),
  });
  const noise = slider({
    id: "noise",
    label: "Range noise σ",
    min: 0,
    max: 0.1,
    step: 0.005,
    value: 0.01,
    format: cm,
    oninput: (v) => set({ noise: v }),
  });
  const carve = toggle({
    id: "carve",
    label: "Carve free space",
    value: true,
    onchange: (v) => set({ carve: v }),
  });
  const carveWeight = slider({
    id: "carve-weight",
    label: "Weight of free space",
    values: [0.05, 0.1, 0.2, 0.3, 0.5, 1],
    value: 1,
    oninput: (v) => set({ carve_weight: v }),
  });
  const weights = choice({
    id: "weights",
    label: "Weights",
    value: "constant",
    options: [
      ["constant", "all alike"],
      ["range", "1 / range²"],
      ["incidence", "cos of incidence"],
      ["range-incidence", "both"],
    ],
    onchange: (v) => set({ weights: v }),
  });
  const sweep = choice({
    id: "sweep",
    label: "Sweep",
    value: "cell-centre",
    options: [
      ["cell-centre", "at cell centres"],
      ["march", "the chapter's march"],
    ],
    onchange: (v) => set({ sweep: v }),
  });
  return {
    node: group(
      "How it is fused",
      wMax.node,
      truncation.node,
      resolution.node,
      noise.node,
      carve.node,
      carveWeight.node,
      weights.node,
      sweep.node,
      el("p", { class: "note", id: "half-life-note" }),
    ),
    /** Shows what the engine has. @param {Values} v @param {boolean} simulated */
    show(v, simulated) {
      now = { ...v };
      wMax.value = v.w_max ?? Infinity;
      truncation.value = v.truncation;
      resolution.value = v.resolution;
      noise.value = v.noise;
      carve.value = v.carve;
      carveWeight.value = v.carve_weight;
      weights.value = v.weights;
      sweep.value = v.sweep;
      noise.node.hidden = !simulated;
    },
    get values() {
      return now;
    },
  };
}
