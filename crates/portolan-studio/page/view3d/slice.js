// @ts-check
import { choice, el, group, slider } from "../ui/controls.js";
import { image, rampCss } from "./cut.js";
import { cm } from "./format.js";

const FIELDS = /** @type {[string, string][]} */ ([
  ["none", "no slice"],
  ["tsdf", "TSDF"],
  ["esdf", "ESDF"],
  ["occupancy", "occupancy"],
]);
const AXES = /** @type {[string, string][]} */ ([
  ["0", "x"],
  ["1", "y"],
  ["2", "z"],
]);

/** A slice through a field: which one is chosen, its controls, and its picture. */
export class Slice {
  /** @param {import("./state.js").Core} core @param {import("./overlay.js").Overlay} overlay */
  constructor(core, overlay) {
    this.core = core;
    this.overlay = overlay;
    this.field = "none";
    this.axis = 2;
    /** Metres from the page's origin; `null`: the middle of the surface. @type {number | null} */
    this.at = null;
    /** What is shown. @type {import("../engine/engine.js").Answer | null} */
    this.answer = null;
    /** Whether another one was chosen than is shown. */
    this.due = false;
    this.fields = choice({
      id: "3d-slice",
      label: "Slice",
      value: "none",
      options: FIELDS,
      onchange: (field) => this.change({ field }),
    });
    this.axes = choice({
      id: "3d-axis",
      label: "across",
      value: "2",
      options: AXES,
      onchange: (axis) => this.change({ axis: Number(axis), at: null }),
    });
    this.place = slider({
      id: "3d-slice-at",
      label: "at",
      min: 0,
      max: 1,
      step: 0.01,
      value: 0,
      format: () => this.#where(),
      oninput: (at) => this.change({ at }),
    });
    this.note = el("p", { class: "note", id: "3d-slice-note" });
    this.node = group("Slice", this.fields.node, this.axes.node, this.place.node, this.note);
  }

  get shown() {
    return this.field !== "none";
  }

  /** As the engine is asked for it; `null`: no slice is shown. */
  question() {
    const { field, axis, at } = this;
    return this.shown && at !== null ? { field, axis, at } : null;
  }

  /** Whether the map has changed since the slice was made. */
  get stale() {
    const { body } = this.core.state;
    return this.shown && body?.bounds && this.answer?.body.revision !== body.revision;
  }

  /** Whether it follows the map while frames are fused: an ESDF takes too long. */
  get follows() {
    return this.field !== "esdf" && this.core.state.body?.mesh.pending === 0 && this.stale;
  }

  /** @param {{field?: string, axis?: number, at?: number | null}} change */
  change(change) {
    const { state, drive } = this.core;
    Object.assign(this, change);
    if (!this.shown) this.#hide();
    this.due = true;
    // A map without occupancy is made again with it.
    if (this.field === "occupancy" && !state.all.occupancy && !state.all.fixed)
      state.set({ occupancy: true });
    drive();
  }

  /** Moves it. @param {number} cells @returns {boolean} whether a slice is shown */
  move(cells) {
    if (!this.shown || this.at === null) return false;
    this.change({ at: this.at + cells * this.core.state.all.resolution });
    return true;
  }

  /** Asks for the slice that was chosen, and shows it. */
  async ask() {
    const { app, state, ask } = this.core;
    this.due = false;
    const { bounds, surface } = state.body ?? {};
    if (!this.shown || !bounds) return;
    const [low, high] = bounds.map((/** @type {number[]} */ p) => p[this.axis]);
    const [a, b] = surface ?? bounds;
    this.at ??= (a[this.axis] + b[this.axis]) / 2;
    this.at = Math.min(Math.max(this.at, low), high);
    const field = this.field;
    const answer = await ask({ op: "slice", slice: this.question() });
    app.meter.measure(() => {
      this.answer = answer;
      this.#showPlace(low, high);
      this.#paint(answer, field);
      this.#showLegend(answer.body, field);
      this.core.stage?.draw();
    });
    app.changed();
  }

  /** @param {number} low @param {number} high */
  #showPlace(low, high) {
    const input = /** @type {HTMLInputElement} */ (this.place.node.querySelector("input"));
    input.min = String(low);
    input.max = String(high);
    input.step = String(this.core.state.all.resolution);
    this.place.value = /** @type {number} */ (this.at);
  }

  /** @param {any} body @param {string} field */
  #showLegend(body, field) {
    const notes = [
      field === "esdf" && body.seconds > 0
        ? `The ESDF was computed in ${(1000 * body.seconds).toFixed(0)} ms.`
        : "",
      body.step > 1 ? `One cell in ${body.step} is shown.` : "",
    ];
    this.note.textContent = notes.filter(Boolean).join(" ");
    const ends = field === "occupancy" ? ["occupied", "free"] : [`−${cm(body.most)}`, `+${cm(body.most)}`];
    const name = FIELDS.find(([id]) => id === field)?.[1];
    const ramp = el("i", { class: "swatch", "aria-hidden": "true", style: `background:${rampCss()}` });
    this.overlay.slice.hidden = false;
    this.overlay.slice.replaceChildren(`Slice, ${name} ${ends[0]} `, ramp, ` ${ends[1]}`);
  }

  /** @param {import("../engine/engine.js").Answer} answer @param {string} field */
  #paint(answer, field) {
    const { stage } = this.core;
    if (stage) return stage.cut.show(answer, field);
    const { width, height, bytes } = image(answer, field);
    const { flat } = this.overlay;
    [flat.width, flat.height] = [width, height];
    const rows = new ImageData(width, height);
    const row = 4 * width;
    for (let y = 0; y < height; y++)
      rows.data.set(bytes.subarray(row * y, row * (y + 1)), row * (height - 1 - y));
    flat.getContext("2d")?.putImageData(rows, 0, 0);
  }

  #hide() {
    const { stage } = this.core;
    const { flat, slice } = this.overlay;
    this.answer = null;
    stage?.cut.hide();
    stage?.draw();
    this.note.textContent = "";
    slice.hidden = true;
    flat.getContext("2d")?.clearRect(0, 0, flat.width, flat.height);
  }

  #where() {
    return this.answer && this.shown ? `${"xyz"[this.axis]} = ${this.answer.body.world.toFixed(3)} m` : "";
  }

  /** With the colors of the theme. */
  redraw() {
    if (!this.answer) return;
    this.#paint(this.answer, this.field);
    const ramp = /** @type {HTMLElement | null} */ (this.overlay.slice.querySelector("i"));
    if (ramp) ramp.style.background = rampCss();
  }

  /** @returns {Record<string, string>} */
  link() {
    const q = this.question();
    return q ? { slice: `${q.field},${q.axis},${q.at.toFixed(3)}` } : {};
  }

  /** @param {string | null} text of a link @returns {boolean} whether it can be shown */
  restore(text) {
    if (text === null) return true;
    const [field, axis, place] = (text ?? "").split(",");
    const at = Number(place);
    const known = FIELDS.some(([id]) => id === field) && AXES.some(([id]) => id === axis);
    if (!known || !Number.isFinite(at)) return false;
    Object.assign(this, { field, axis: Number(axis), at, due: true });
    this.fields.value = field;
    this.axes.value = axis;
    return true;
  }
}
