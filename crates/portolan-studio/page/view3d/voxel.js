// @ts-check
import { numbers } from "./format.js";
import { Inspector } from "./inspector.js";

/** The voxel that is looked at: how one is chosen, and what is asked of it. */
export class Voxel {
  /** @param {import("./state.js").Core} core @param {import("./slice.js").Slice} slice */
  constructor(core, slice) {
    this.core = core;
    this.slice = slice;
    this.inspector = new Inspector();
    /** What is known of it. @type {any} */
    this.known = null;
    /** The map's revision then. */
    this.revision = -1;
    /**
     * The one to look at from now on, `null`: at none; `undefined`: the same as before.
     * @type {number[] | null | undefined}
     */
    this.wanted = undefined;
  }

  /** Whether the map has changed since it was asked about. */
  get stale() {
    return this.known && this.revision !== this.core.state.body.revision;
  }

  /** Whether earlier frames are still to be fused again, to see what they did to it. */
  get incomplete() {
    const history = this.known?.history;
    return history && history.looked_at !== null;
  }

  /** @param {number[] | null} cell */
  look(cell) {
    this.wanted = cell;
    this.core.drive();
  }

  /** Looks at what is seen there. @param {number} x @param {number} y from -1 to 1, to the right and up */
  async pick(x, y) {
    const { app, ask, stage } = this.core;
    if (!stage) return;
    try {
      const slice = this.slice.answer ? this.slice.question() : null;
      const { body: hit } = await ask({ op: "pick", ...stage.eye.ray(x, y), slice });
      if (hit) this.look(hit.cell);
      else app.say("No surface was hit.");
    } catch (error) {
      app.fail(error);
    }
  }

  async ask() {
    const { app, ask, stage, state } = this.core;
    const cell = this.wanted !== undefined ? this.wanted : this.known?.cell;
    this.wanted = undefined;
    const answer = await ask({ op: "voxel", cell });
    app.meter.measure(() => {
      this.known = answer.body;
      this.revision = state.body.revision;
      this.inspector.show(this.known);
      stage?.showVoxel(this.known?.corner ?? null, state.all.resolution);
    });
    app.changed();
  }

  async askHistory() {
    const watched = this.known;
    const { body: history } = await this.core.ask({ op: "history" });
    watched.history = history;
    // Another one may have been chosen meanwhile.
    if (this.known !== watched) return;
    this.core.app.meter.measure(() => this.inspector.showHistory(history, watched.recorded));
  }

  /** Takes in its state from an answer about the map. @param {any} body */
  take({ voxel }) {
    if (voxel) {
      this.known = { ...this.known, ...voxel };
      // The history follows when nothing else is to be done.
      this.inspector.show({ ...this.known, history: undefined });
    } else if (this.known) {
      // Another lattice has other voxels.
      this.known = null;
      this.inspector.clear();
      this.core.stage?.showVoxel(null, 0);
    }
  }

  /** @param {KeyboardEvent} event @returns {boolean} whether it was one of its keys */
  key(event) {
    if (event.key === "Enter") return (this.pick(0, 0), true);
    if (!this.known) return false;
    if (event.key === "Escape") return (this.look(null), true);
    const axis = ["x", "y", "z"].indexOf(event.key.toLowerCase());
    if (axis < 0) return false;
    const cell = [...this.known.cell];
    cell[axis] += event.shiftKey ? -1 : 1;
    this.look(cell);
    return true;
  }

  /** Clicks on the canvas; a drag turns the eye. @param {HTMLCanvasElement} canvas */
  listen(canvas) {
    let down = [0, 0];
    canvas.addEventListener("pointerdown", (event) => (down = [event.clientX, event.clientY]));
    canvas.addEventListener("pointerup", (event) => {
      const { clientX: x, clientY: y } = event;
      if (event.button !== 0 || Math.hypot(x - down[0], y - down[1]) > 4) return;
      const { left, top, width, height } = canvas.getBoundingClientRect();
      this.pick((2 * (x - left)) / width - 1, 1 - (2 * (y - top)) / height);
    });
  }

  /** @returns {Record<string, string>} */
  link() {
    return this.known ? { voxel: this.known.cell.join(",") } : {};
  }

  /** @param {string | null} text of a link */
  restore(text) {
    const cell = numbers(text, 3);
    if (cell) this.wanted = cell;
  }
}
