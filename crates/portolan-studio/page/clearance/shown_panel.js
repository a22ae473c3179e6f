// @ts-check
import { choice, el, legend, toggle } from "../ui/controls.js";
import { pair } from "./pair.js";

/**
 * @typedef {import("./map.js").Which} Which
 * @typedef {"euclidean" | "truncated"} Field
 * @typedef {"pessimistic" | "optimistic"} Unknown
 */

/** Metres between rings. */
const SPACINGS = ["0.05", "0.1", "0.25", "0.5", "1"];
const TOGGLES = { rings: "Level rings", arrows: "Gradients", contour: "Contour", truth: "Truth" };
const RAMP = "background: linear-gradient(90deg, var(--negative), var(--paper), var(--positive))";

/** What is shown, and how unknown space counts. */
export class ShownPanel {
  /**
   * @param {{visible: Record<string, boolean>, field: () => void, unknown: () => void, spacing:
   *   () => void, toggled: () => void}} o
   */
  constructor(o) {
    this.visible = o.visible;
    this.fieldPair = pair({
      id: "field",
      label: "Field",
      options: [
        ["euclidean", "Euclidean"],
        ["truncated", "Truncated"],
      ],
      value: "euclidean",
      onchange: o.field,
    });
    this.unknownPair = pair({
      id: "unknown",
      label: "Unknown space",
      options: [
        ["pessimistic", "obstacle"],
        ["optimistic", "no obstacle"],
      ],
      value: "pessimistic",
      onchange: o.unknown,
    });
    this.spacingChoice = choice({
      id: "ring-spacing",
      label: "Rings every",
      value: "0.25",
      options: SPACINGS.map((v) => [v, `${v} m`]),
      onchange: o.spacing,
    });
    const changed = (/** @type {string} */ what, /** @type {boolean} */ on) => {
      o.visible[what] = on;
      if (what === "rings" && on) o.spacing();
      o.toggled();
    };
    const toggles = Object.entries(TOGGLES).map(([what, label]) => [
      what,
      toggle({ id: `clearance-${what}`, label, value: o.visible[what], onchange: (on) => changed(what, on) }),
    ]);
    /** @type {Record<string, ReturnType<typeof toggle>>} */
    this.toggles = Object.fromEntries(toggles);
    this.ringNote = el("p", { class: "note", id: "ring-note" });
    this.reach = el("span", { id: "ramp-reach" });
    this.strip = el("div", { class: "strip" }, this.#legend());
    const shown = el("div", { class: "toggles" }, ...Object.values(this.toggles).map((t) => t.node));
    const controls = [this.fieldPair, this.unknownPair, this.spacingChoice].map((c) => c.node);
    this.node = el("div", { class: "group" }, ...controls, this.ringNote, shown);
  }

  #legend() {
    const lines = legend([
      { color: "contour", text: "contour, and cells that stop beams without one" },
      { color: "accent", text: "nothing is nearer" },
      { color: "good", text: "certified" },
      { color: "bad", text: "violated", dashed: true },
      { color: "warn", text: "not certifiable", dashed: true },
    ]);
    const ramp = el("i", { class: "ramp", style: RAMP, "aria-hidden": "true" });
    const unknown = el("li", {}, el("i", { class: "hatch", "aria-hidden": "true" }), "unknown");
    const items = [el("li", {}, ramp, this.reach), ...lines.children, unknown];
    return el("ul", { class: "legend", "aria-label": "Legend" }, ...items);
  }

  get field() {
    return /** @type {Field} */ (this.fieldPair.value);
  }

  /**
   * What the picture has the colors of: of the Euclidean field, what is certified of it, where unknown space
   * counts as an obstacle. @returns {Which}
   */
  get picture() {
    return this.field === "euclidean" && this.unknown === "pessimistic" ? "pessimistic" : this.field;
  }

  get unknown() {
    return /** @type {Unknown} */ (this.unknownPair.value);
  }

  get spacing() {
    return Number(this.spacingChoice.value);
  }

  /** @param {string} what */
  toggle(what) {
    document.getElementById(`clearance-${what}`)?.click();
  }

  /** @param {number} length at the ends of the ramp (metres) */
  showRamp(length) {
    const what = { euclidean: "distance", truncated: "distance along beams", pessimistic: "certified" };
    this.reach.textContent = `${what[this.picture]}: −${length.toFixed(2)} to ${length.toFixed(2)} m`;
  }

  /** @param {any} body of a map */
  showMap(body) {
    this.toggles.truth.node.hidden = body.truth === null;
  }

  /** @param {any} body of the rings @param {number} truncation */
  showRings({ spacing, largest }, truncation) {
    const wider = spacing > this.spacing ? `Drawn every ${spacing} m: closer they would be too many. ` : "";
    const end = `the field ends ${truncation} m from the surface.`;
    let ends = "";
    if (largest < spacing) ends = `No ring: ${end}`;
    else if (this.field === "truncated") ends = `The last ring is where ${end}`;
    this.ringNote.textContent = wider + ends;
    this.ringNote.hidden = this.ringNote.textContent === "";
  }

  /** @returns {Record<string, string>} */
  link() {
    const { rings, arrows, contour, truth } = this.visible;
    return {
      field: this.field,
      unknown: this.unknown,
      rings: rings ? this.spacingChoice.value : "none",
      ...(arrows ? {} : { arrows: "none" }),
      ...(contour ? {} : { contour: "none" }),
      ...(truth ? { truth: "shown" } : {}),
    };
  }

  /** @param {URLSearchParams} link */
  restore(link) {
    this.fieldPair.value = link.get("field") ?? this.field;
    this.unknownPair.value = link.get("unknown") ?? this.unknown;
    const every = link.get("rings");
    if (every && SPACINGS.includes(every)) this.spacingChoice.value = every;
    const set = (/** @type {string} */ what, /** @type {boolean} */ on) =>
      (this.toggles[what].value = this.visible[what] = on);
    for (const what of ["rings", "arrows", "contour"]) if (link.get(what) === "none") set(what, false);
    if (link.get("truth") === "shown") set("truth", true);
  }
}
