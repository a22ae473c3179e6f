// @ts-check
import { calmly, choice, el, group, slider, toggle } from "../ui/controls.js";
import { cm, numbers } from "./format.js";

const RESOLUTIONS = [0.01, 0.015, 0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1, 0.15, 0.2, 0.3];
const CLAMPS = [1, 2, 4, 8, 16, 32, 64, 128, 256];
/** @type {[string, string][]} */
const SENSORS = [
  ["lidar", "lidar"],
  ["camera", "depth camera"],
];

/** How frames are fused. A change begins the run again. */
export class SettingsPanel {
  /** @param {import("./state.js").Core} core */
  constructor(core) {
    this.core = core;
    this.controls = el("div", { class: "group plain" });
    this.node = group("Settings", this.controls);
    this.setCalmly = calmly((/** @type {object} */ change) => this.#set(change), 250);
  }

  /** @param {object} change */
  #set(change) {
    this.core.state.set(change);
    this.core.drive();
  }

  /** Controls with the values that the engine has. */
  show() {
    const { all } = this.core.state;
    if (all.fixed) {
      const { resolution, truncation } = all;
      const note = `This map was read from a file: cells of ${cm(resolution)}, truncation ${cm(truncation)}.`;
      this.controls.replaceChildren(el("p", { class: "note" }, note));
      return;
    }
    const halfLife = `Half-life of a surface that has gone: ${all.half_life.toFixed(1)} observations.`;
    this.controls.replaceChildren(
      ...(all.simulated ? [this.#sensor(all.settings)] : []),
      ...this.#sizes(all.settings),
      el("p", { class: "note", id: "3d-half-life" }, halfLife),
      ...this.#maps(all.settings),
    );
  }

  /** @param {any} settings */
  #sensor({ sensor }) {
    const onchange = (/** @type {string} */ v) => this.#set({ sensor: v });
    return choice({ id: "3d-sensor", label: "Sensor", value: sensor, options: SENSORS, onchange }).node;
  }

  /** @param {any} settings */
  #sizes(settings) {
    const truncation = slider({
      id: "3d-truncation",
      label: "Truncation",
      min: 1,
      max: 10,
      step: 0.5,
      value: settings.truncation / settings.resolution,
      format: (v) => `${v} cells`,
      oninput: (v) => this.setCalmly({ truncation: v * resolution.value }),
    });
    const resolution = slider({
      id: "3d-resolution",
      label: "Resolution",
      values: RESOLUTIONS,
      value: settings.resolution,
      format: cm,
      oninput: (v) => this.setCalmly({ resolution: v, truncation: truncation.value * v }),
    });
    const clamp = slider({
      id: "3d-wmax",
      label: "W_max",
      values: CLAMPS,
      value: settings.w_max,
      oninput: (v) => this.setCalmly({ w_max: v }),
    });
    return [resolution.node, truncation.node, clamp.node];
  }

  /** @param {any} settings */
  #maps(settings) {
    const carve = toggle({
      id: "3d-carve",
      label: "Carve free space",
      value: settings.carve,
      onchange: (v) => this.#set({ carve: v }),
    });
    const occupancy = toggle({
      id: "3d-occupancy",
      label: "Occupancy too (slower)",
      value: settings.occupancy,
      onchange: (v) => this.#set({ occupancy: v }),
    });
    return [carve.node, occupancy.node];
  }

  /** @returns {Record<string, string>} */
  link() {
    const { fixed, settings: s } = this.core.state.all;
    if (fixed) return {};
    const values = [s.resolution, s.truncation, s.w_max, Number(s.carve), Number(s.occupancy)];
    return { settings: values.map((v) => Number(v.toFixed(4))).join(","), sensor: s.sensor };
  }

  /** @param {URLSearchParams} link @returns {boolean} whether it has settings other than there are */
  restore(link) {
    const { state } = this.core;
    const { fixed, simulated, settings } = state.all;
    const values = numbers(link.get("settings"), 5);
    const asked = link.get("sensor");
    if (fixed) return false;
    const sensor = simulated && asked && SENSORS.some(([id]) => id === asked) ? asked : settings.sensor;
    const [resolution, truncation, w_max, carve, occupancy] = values ?? [];
    const said = values && { resolution, truncation, w_max, carve: carve !== 0, occupancy: occupancy !== 0 };
    const wanted = { ...settings, ...said, sensor };
    if (JSON.stringify(wanted) === JSON.stringify(settings)) return false;
    state.settings = wanted;
    return true;
  }
}
