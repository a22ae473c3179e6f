// @ts-check
import { calmly, el } from "../ui/controls.js";
import { compose } from "../ui/picture.js";
import { numbers } from "../view3d/format.js";
import { Frames } from "../view3d/frames.js";
import { Loop } from "../view3d/loop.js";
import { Overlay } from "../view3d/overlay.js";
import { FilesPanel, MapPanel, SurfacePanel } from "../view3d/panels.js";
import { SettingsPanel } from "../view3d/settings.js";
import { Slice } from "../view3d/slice.js";
import { Stage } from "../view3d/stage.js";
import { State } from "../view3d/state.js";
import { LARGE } from "../view3d/surface.js";
import { Voxel } from "../view3d/voxel.js";

/** Milliseconds between pictures while a mesh comes in. */
const LOADING = 300;

/** @type {[string, string][]} */
const KEYS = [
  ["Space", "play, pause"],
  ["N", "the next frame"],
  ["Home, End", "the first frame, the last"],
  ["arrows", "go round; with Shift sideways"],
  ["+ −", "nearer, further"],
  ["F", "see all"],
  ["Enter", "select the voxel in the middle"],
  ["X Y Z", "the next voxel along the axis; with Shift the one before"],
  ["[ ]", "move the slice by a cell"],
  ["Esc", "select no voxel"],
];

/** A log fused in 3-D, frame by frame: mesh, slices, voxels. @implements {Shown} */
class View3d {
  /** @param {HTMLElement} root @param {App} app */
  constructor(root, app) {
    this.app = app;
    this.state3d = new State();
    this.overlay = new Overlay();
    this.stage = this.#stage();
    /** @type {import("../view3d/state.js").Core} */
    const core = {
      app,
      state: this.state3d,
      stage: this.stage,
      ask: (question) => app.engine.ask("3d", question),
      drive: () => void this.loop.drive(),
    };
    this.core = core;
    this.frames = new Frames(core);
    this.map = new MapPanel();
    this.surface = new SurfacePanel(core, {
      fit: () => this.#fit(),
      movers: (shown) => this.stage?.showMovers(shown),
    });
    this.slice = new Slice(core, this.overlay);
    this.voxel = new Voxel(core, this.slice);
    this.settings = new SettingsPanel(core);
    this.files = new FilesPanel(core);
    const { frames, slice, voxel } = this;
    this.loop = new Loop(core, { frames, slice, voxel, take: (answer) => this.#take(answer) });
    /** When the last picture of a mesh that comes in was drawn. */
    this.drawn = 0;
    this.keys = KEYS;
    voxel.listen(this.overlay.canvas);
    // For measurements and tests: `document.getElementById("3d-canvas").load`.
    Object.assign(this.overlay.canvas, {
      load: this.loop.load,
      info: () => this.stage?.renderer.info,
      up: () => this.stage?.eye.up.toArray(),
      coloredBy: () => this.stage?.surface.by,
      shadeOf: (/** @type {number} */ vertex) => this.stage?.surface.shade[4 * vertex],
      movers: () => (this.stage?.movers.visible ? this.stage.movers.geometry.drawRange.count : 0),
    });
    const panels = [this.map, this.surface, slice, voxel.inspector, this.settings, this.files];
    root.append(
      el("div", { class: "field" }, this.overlay.node, frames.node),
      el("div", { class: "side" }, ...panels.map((p) => p.node)),
    );
  }

  /** @returns {Stage | null} */
  #stage() {
    try {
      const stage = new Stage(this.overlay.canvas, this.app.meter);
      const changed = calmly(() => this.app.changed(), 200);
      stage.eye.moved = () => changed(null);
      return stage;
    } catch {
      this.overlay.withoutWebGL();
      return null;
    }
  }

  /** Takes an answer about map and mesh in. @param {import("../engine/engine.js").Answer} answer */
  #take(answer) {
    const { state3d: state, stage } = this;
    const before = state.body;
    const body = answer.body;
    state.body = body;
    if (body.all) this.#takeAll(body.all);
    const movers = /** @type {Float32Array} */ (answer.arrays.movers);
    if (movers.length > 0) stage?.setMovers(movers, this.surface.moved.value);
    const news = stage?.surface.apply(answer) ?? false;
    stage?.showScan(/** @type {Float32Array} */ (answer.arrays.points), body.pose);
    if (stage?.eye.fitted && body.surface && String(before?.surface) !== String(body.surface))
      stage.eye.fit(body.surface);
    this.frames.show();
    this.map.show(state);
    this.#showColor();
    this.voxel.take(body);
    this.#draw(news || !before);
  }

  /** What the colors mean that are drawn, not those that are still to come. */
  #showColor() {
    const { stage, overlay } = this;
    const { body, all } = this.state3d;
    overlay.showColor(stage?.surface.color ?? body.color, all.height);
    overlay.showProgress(body.color.by, stage?.surface.recolored ?? null);
  }

  /** @param {any} all */
  #takeAll(all) {
    this.state3d.all = all;
    this.stage?.setUp(all.up);
    this.stage?.showWay(all.way);
    this.surface.show();
    this.settings.show();
    this.files.show();
    this.frames.enable();
  }

  /**
   * A mesh that comes in part by part is drawn now and then, a large one when all of it is there.
   * @param {boolean} news
   */
  #draw(news) {
    const { pending, triangles } = this.state3d.body.mesh;
    const now = performance.now();
    if (pending === 0) {
      this.drawn = now;
      this.stage?.draw();
    } else if (news && now - this.drawn > LOADING && triangles < LARGE) {
      this.drawn = now;
      this.stage?.draw();
    } else if (news) this.app.meter.picture();
    this.overlay.canvas.dataset.pending = String(pending);
  }

  #fit() {
    const { surface } = this.state3d.body ?? {};
    if (!this.stage || !surface) return;
    this.stage.eye.fitted = true;
    this.stage.eye.fit(surface);
    this.app.changed();
  }

  /** @param {URLSearchParams} link */
  async show(link) {
    const { state3d: state, app } = this;
    state.visible = true;
    const first = !state.all;
    if (!this.slice.restore(link.get("slice"))) app.strange(`a slice “${link.get("slice")}”`);
    const eye = numbers(link.get("eye"), 6);
    if (eye) this.stage?.eye.set(eye);
    this.voxel.restore(link.get("voxel"));
    if (first) await this.#open();
    // Settings come first: by them it is decided what colors there are.
    if (this.settings.restore(link)) await this.#set();
    const frame = link.has("frame") ? Number(link.get("frame")) : NaN;
    if (Number.isInteger(frame)) state.seek(frame);
    else if (first && state.frames > 0 && !this.frames.player.playing) this.frames.player.toggle();
    this.#restoreColor(link.get("color"));
    if (first) {
      const { all, frames } = state;
      app.say(all.fixed ? `${all.name}: a map read from a file.` : `${all.name}: ${frames} frames.`);
    }
    this.core.drive();
    this.stage?.draw();
  }

  async #open() {
    this.loop.load.started = performance.now();
    const answer = await this.core.ask({ op: "open" });
    this.app.meter.measure(() => this.#take(answer));
  }

  async #set() {
    const { settings } = this.state3d;
    this.state3d.settings = null;
    const answer = await this.core.ask({ op: "set", settings });
    this.app.meter.measure(() => this.#take(answer));
  }

  /** A link may come from another log, whose surface can be colored in other ways. @param {string | null} color */
  #restoreColor(color) {
    if (color === null) return;
    const known = this.state3d.all.colors.find((/** @type {any} */ c) => c.by === color);
    if (known && !known.refused) this.state3d.color = color;
    else this.app.strange(`colors by “${color}”${known ? `, as ${known.refused}` : ""}`);
  }

  hide() {
    this.state3d.visible = false;
    this.frames.player.pause();
    this.app.meter.note = "";
  }

  /** @returns {Record<string, string>} */
  state() {
    const { body, all } = this.state3d;
    if (!all) return {};
    const eye = this.stage && !this.stage.eye.fitted ? this.stage.eye.get() : null;
    return {
      frame: String(body.at),
      color: body.color.by,
      ...this.settings.link(),
      ...this.slice.link(),
      ...this.voxel.link(),
      ...(eye ? { eye: eye.map((v) => v.toFixed(2)).join(",") } : {}),
    };
  }

  picture() {
    const { all, at, frames } = this.state3d;
    const title = `${all?.name ?? "3-D"}, frame ${at} of ${frames}`;
    const plot = this.voxel.known ? this.voxel.inspector.plot.canvas() : null;
    return compose(title, [
      [this.stage ? this.stage.picture() : this.overlay.flat],
      ...(plot ? [[plot]] : []),
    ]);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.key.toLowerCase() === "f") return (this.#fit(), true);
    const cells = { "[": -1, "]": 1, "{": -10, "}": 10 }[event.key];
    if (cells && this.slice.move(cells)) return true;
    return this.frames.key(event) || this.voxel.key(event) || (this.stage?.eye.key(event) ?? false);
  }

  redraw() {
    this.stage?.redraw();
    this.voxel.inspector.plot.redraw();
    if (!this.state3d.body) return;
    this.#showColor();
    this.slice.redraw();
    this.stage?.draw();
  }
}

/**
 * @typedef {import("./view.js").App} App
 * @typedef {import("./view.js").Shown} Shown
 * @type {import("./view.js").View}
 */
export default {
  id: "3d",
  formerly: "space",
  title: "3-D",
  lead: "Scans become a {mesh}, {brick} by brick; click the surface, and you see what one {voxel} has observed and how sure it is.",
  in_3d: true,
  mount: (root, app) => new View3d(root, app),
};
