// @ts-check
import { choice, el, facts, group, toggle } from "../ui/controls.js";
import { saveAnswer } from "../ui/files.js";
import { bytes } from "../ui/units.js";
import { count, ms } from "./format.js";

const COLORS = /** @type {[string, string][]} */ ([
  ["height", "height"],
  ["color", "color"],
  ["weight", "weight"],
  ["sigma", "standard deviation"],
  ["passed", "looks that passed"],
  ["error", "error"],
]);

/** What there is of the map: sizes and times. */
export class MapPanel {
  constructor() {
    this.facts = facts([
      ["3d-name", "Log"],
      ["3d-hits", "Surfaces in the frame"],
      ["3d-triangles", "Triangles"],
      ["3d-bricks", "Bricks"],
      ["3d-bytes", "TSDF"],
      ["3d-bytes-occupancy", "Occupancy"],
      ["3d-bytes-esdf", "ESDF"],
      ["3d-bytes-mesh", "Mesh"],
      ["3d-movers", "Moved, not in the map"],
      ["3d-time", "Fused in"],
      ["3d-time-mesh", "Meshed in"],
    ]);
    this.problem = el("p", { class: "error", id: "3d-problem", hidden: true });
    this.node = group("Map", this.facts.node, this.problem);
  }

  /** @param {import("./state.js").State} state */
  show({ body, all }) {
    const { seconds, left_out: left } = body;
    const occupancy = body.bytes.occupancy ? ` + occupancy ${ms(seconds.occupancy)}` : "";
    this.facts.set({
      "3d-name": all.name,
      "3d-hits": body.hits === null ? "—" : count(body.hits),
      "3d-triangles": count(body.mesh.triangles),
      "3d-bricks": count(body.bricks),
      "3d-bytes": bytes(body.bytes.tsdf),
      "3d-bytes-occupancy": bytes(body.bytes.occupancy),
      "3d-bytes-esdf": bytes(body.bytes.esdf),
      "3d-bytes-mesh": bytes(body.bytes.mesh),
      "3d-movers": all.movers ? `${count(all.movers)} returns` : "—",
      "3d-time": `${ms(seconds.tsdf)}${occupancy}`,
      "3d-time-mesh": ms(seconds.mesh),
    });
    const skipped = left.frames ? `${left.frames} frames were skipped; the first: ${left.why}` : "";
    const problem = body.full ?? skipped;
    this.problem.hidden = !problem;
    this.problem.textContent = problem;
  }
}

/** How the surface is colored. */
export class SurfacePanel {
  /**
   * @param {import("./state.js").Core} core
   * @param {{fit: () => void, movers: (shown: boolean) => void}} does shows all of the surface, and what moved
   */
  constructor(core, { fit, movers }) {
    this.core = core;
    this.moved = toggle({ id: "3d-show-movers", label: "Show what moved", value: true, onchange: movers });
    this.moved.node.hidden = true;
    this.colors = el("div", {});
    this.note = el("p", { class: "note", id: "3d-color-note" });
    const all = el("button", { type: "button", id: "3d-fit", title: "F", onclick: fit }, "See all");
    this.node = group("Surface", this.colors, this.moved.node, this.note, el("div", { class: "row" }, all));
  }

  /** The choices that this log has. */
  show() {
    const { state, drive } = this.core;
    const { colors } = state.all;
    const refused = colors.filter((/** @type {any} */ c) => c.refused);
    const made = choice({
      id: "3d-color",
      label: "Color by",
      value: state.body.color.by,
      options: COLORS.filter(([id]) => !refused.some((/** @type {any} */ c) => c.by === id)),
      onchange: (by) => ((state.color = by), drive()),
    });
    this.colors.replaceChildren(made.node);
    this.moved.node.hidden = state.all.movers === 0;
    this.note.textContent = refused.map((/** @type {any} */ c) => `No ${c.by}: ${c.refused}.`).join(" ");
  }
}

/** Files to save. */
export class FilesPanel {
  /** @param {import("./state.js").Core} core */
  constructor(core) {
    this.core = core;
    this.octree = this.#button("octree", "octree.bt");
    const files = [
      this.#button("ply", "mesh.ply"),
      this.#button("glb", "mesh.glb"),
      this.#button("esdf", "esdf.bin"),
    ];
    this.node = group("Files", el("div", { class: "row start" }, ...files, this.octree));
  }

  /** @param {string} file @param {string} name */
  #button(file, name) {
    const button = el(
      "button",
      { type: "button", id: `3d-${file}`, onclick: () => this.#save(button, file) },
      name,
    );
    return button;
  }

  /** @param {HTMLButtonElement} button @param {string} file */
  async #save(button, file) {
    const { app, ask } = this.core;
    const name = button.textContent;
    button.disabled = true;
    try {
      app.say(`Writing ${name} …`);
      saveAnswer(await ask({ op: "export", file }));
      app.say(`${name} is saved.`);
    } catch (error) {
      app.fail(error);
    } finally {
      button.disabled = false;
    }
  }

  /** An octree needs a map of occupancy. */
  show() {
    const { occupancy } = this.core.state.all;
    this.octree.disabled = !occupancy;
    this.octree.title = occupancy ? "" : "Switch on occupancy in the settings";
  }
}
