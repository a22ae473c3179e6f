// @ts-check
import { LARGE } from "./surface.js";

const nextPicture = () => new Promise((resolve) => requestAnimationFrame(resolve));
const wait = (/** @type {number} */ ms) => new Promise((resolve) => setTimeout(resolve, ms));

/**
 * The one loop that asks the engine, one question after another, for as long as something is due: first what
 * was set and chosen, then frames and mesh, and when these rest, slice and voxel.
 */
export class Loop {
  /**
   * @param {import("./state.js").Core} core
   * @param {{frames: import("./frames.js").Frames, slice: import("./slice.js").Slice, voxel:
   *   import("./voxel.js").Voxel, take: (answer: import("../engine/engine.js").Answer) => void}} parts
   */
  constructor(core, { frames, slice, voxel, take }) {
    this.core = core;
    this.player = frames.player;
    this.slice = slice;
    this.voxel = voxel;
    this.take = take;
    this.running = false;
    /**
     * The next part of a large mesh, which the engine makes while the page takes this one in.
     * @type {Promise<any> | null}
     */
    this.ahead = null;
    /** Time (milliseconds) and bytes of the mesh that was loaded, for measurements. */
    this.load = { started: 0, transfer: 0, take: 0, bytes: 0, done: 0 };
  }

  async drive() {
    const { app, state } = this.core;
    if (this.running || !state.visible) return;
    this.running = true;
    try {
      while ((state.visible || this.ahead) && (await this.#turn()));
    } catch (error) {
      this.player.pause();
      state.goal = null;
      app.fail(error);
    } finally {
      this.running = false;
      this.ahead = null;
    }
    app.changed();
  }

  /** One question and its answer. @returns {Promise<boolean>} whether something may still be due */
  async #turn() {
    const question = this.#question();
    if (question) await this.#ask(question);
    else if (this.voxel.wanted !== undefined) await this.voxel.ask();
    else if (this.slice.due) await this.slice.ask();
    else if (this.#plays()) await this.#ask({ op: "step", frames: this.player.speed === Infinity ? 2 : 1 });
    else return this.#rest();
    return true;
  }

  /** The question about map and mesh that comes before anything else. @returns {object | null} */
  #question() {
    const { state } = this.core;
    const { all, body, goal, settings, color } = state;
    if (this.ahead) return { op: "mesh" };
    if (!all) return { op: "open" };
    if (settings) {
      state.settings = null;
      if (!this.player.playing) state.goal ??= body.at;
      return { op: "set", settings };
    }
    if (color) {
      state.color = null;
      return { op: "color", by: color };
    }
    if (goal !== null && goal !== body.at && (goal < body.at || !body.full))
      return { op: "seek", frame: goal };
    return body.mesh.pending > 0 ? { op: "mesh" } : null;
  }

  #plays() {
    const { at, frames, full } = this.core.state.body;
    return this.player.playing && at < frames && !full;
  }

  /** Frames and mesh are done: what follows them more slowly comes now. */
  async #rest() {
    this.core.state.goal = null;
    this.player.pause();
    if (this.slice.stale) await this.slice.ask();
    else if (this.voxel.stale) await this.voxel.ask();
    else if (this.voxel.incomplete) await this.voxel.askHistory();
    else return false;
    return true;
  }

  /** Asks about map and mesh, and takes the answer in. @param {object} question */
  async #ask(question) {
    const { app, ask, state } = this.core;
    const { load, player } = this;
    const started = performance.now();
    load.started ||= started;
    const answer = await (this.ahead ?? ask(question));
    const arrived = performance.now();
    this.ahead = null;
    const { pending, triangles } = answer.body.mesh;
    if (pending > 0 && triangles >= LARGE && !state.settings && !state.color) {
      this.ahead = ask({ op: "mesh" });
      // It is awaited in the next turn; a failure is reported there.
      this.ahead.catch(() => {});
    }
    // One answer per picture, so that the page stays light; a large mesh does not wait for pictures.
    await (state.body?.mesh.triangles < LARGE ? nextPicture() : wait(0));
    const taken = performance.now();
    app.meter.measure(() => this.take(answer));
    load.transfer += arrived - started;
    load.take += performance.now() - taken;
    load.bytes += Object.values(answer.arrays).reduce((n, a) => n + a.byteLength, 0);
    load.done = performance.now();
    if (state.goal === state.at) state.goal = null;
    if (this.slice.follows) await this.slice.ask();
    if (player.playing && state.goal === null && player.speed < Infinity)
      await wait(Math.max(0, 1000 / player.speed - (performance.now() - started)));
  }
}
