// @ts-check
import { Canvas2d } from "../canvas2d/canvas2d.js";
import { FieldImage } from "../clearance/map.js";
import { meterPanel } from "../clearance/meter_panel.js";
import { Path, pointsOf, textOf } from "../clearance/path.js";
import { probePanel } from "../clearance/probe_panel.js";
import { Questions } from "../clearance/questions.js";
import { movingLayers, newScene, stillLayers } from "../clearance/scene.js";
import { ShownPanel } from "../clearance/shown_panel.js";
import { Still } from "../clearance/still.js";
import { el } from "../ui/controls.js";
import { exportPanel } from "../ui/exports.js";
import { compose } from "../ui/picture.js";

/** @typedef {[number, number]} Point */

/** @type {[string, string][]} */
const KEYS = [
  ["Arrows", "move the probe by a cell; with Shift by ten"],
  ["Enter", "a waypoint where the probe is"],
  ["Backspace", "remove the last waypoint"],
  ["Esc", "remove the path"],
  ["[ ]", "a smaller, a larger robot"],
  ["F", "Euclidean or truncated field"],
  ["U", "unknown space an obstacle or not"],
  ["R G", "rings, gradient arrows"],
  ["D", "draw by dragging, or not"],
  ["W", "the way that was driven"],
  ["+ − 0", "larger, smaller, all"],
];

/**
 * The distance field of the fused map: a probe, level rings, and a path with its verdict.
 * @implements {Shown}
 */
export class Clearance {
  /** @param {HTMLElement} root @param {App} app */
  constructor(root, app) {
    this.app = app;
    this.keys = KEYS;
    this.scene = newScene();
    /** The engine's answer about the map that is shown. @type {any} */
    this.map = undefined;
    this.opening = false;
    const label = "The distance field of the map, a probe into it and a path through it";
    this.canvas2d = new Canvas2d({ id: "clearance-canvas", label, meter: app.meter });
    this.still = new Still(stillLayers(this.scene));
    this.canvas2d.layers = [this.still.draw, ...movingLayers(this.scene)];
    this.questions = new Questions(this);
    this.shown = this.#shownPanel();
    this.probe = probePanel();
    this.path = new Path(this);
    this.meter = meterPanel();
    this.probe.mark("euclidean");
    this.#listen();
    const panels = [this.shown, this.probe, this.path.panel, this.meter].map((p) => p.node);
    root.append(
      el("div", { class: "field" }, this.canvas2d.node, this.shown.strip),
      el("div", { class: "side" }, ...panels, exportPanel("clearance-", app)),
    );
  }

  #shownPanel() {
    const { questions, app } = this;
    return new ShownPanel({
      visible: this.scene.visible,
      field: () => this.#showField(),
      unknown: () => {
        questions.probe();
        questions.path();
        this.#showField();
      },
      spacing: () => {
        questions.rings();
        app.changed();
      },
      toggled: () => {
        questions.arrows();
        this.drawAll();
        app.changed();
      },
    });
  }

  #listen() {
    const { canvas2d } = this;
    canvas2d.oncamera = () => {
      this.questions.arrows();
      this.app.changed();
    };
    canvas2d.onhover = (p) => p && this.#putProbe(p);
    canvas2d.onclick = (p) => {
      this.#putProbe(p);
      this.path.add();
    };
    canvas2d.ondrag = (from) => this.path.drag(from);
  }

  #showRamp() {
    if (this.scene.image) this.shown.showRamp(this.scene.image.reach);
  }

  /** Draws everything anew. */
  drawAll() {
    this.still.changed();
    this.canvas2d.draw();
  }

  #showField() {
    const { scene, shown } = this;
    scene.image?.show(shown.picture);
    this.probe.mark(shown.field);
    this.#showRamp();
    scene.rings = scene.arrows = undefined;
    this.questions.rings();
    this.questions.arrows();
    this.drawAll();
    this.app.changed();
  }

  /** Opens the map again where an answer is about another one. @param {number} revision */
  checkRevision(revision) {
    if (this.map && revision !== this.map.revision) this.#open();
  }

  /** Everything of the map as it is now, where the page has not drawn it already. */
  async #open() {
    if (this.opening) return;
    this.opening = true;
    try {
      const { body, arrays } = await this.questions.ask({ op: "open", have: this.map?.revision ?? null });
      if (!body.unchanged) this.app.meter.measure(() => this.#takeMap(body, arrays));
    } finally {
      this.opening = false;
    }
  }

  /** @param {any} body @param {any} arrays */
  #takeMap(body, arrays) {
    const { scene, shown } = this;
    const before = scene.image?.grid;
    this.map = body;
    const image = new FieldImage(body.grid);
    const { euclidean, truncated, pessimistic } = /** @type {any} */ (arrays);
    image.samples = { euclidean, truncated, pessimistic };
    image.which = shown.picture;
    image.reach = Math.max(body.truncation, body.usual_length);
    image.paint();
    scene.image = image;
    [scene.contour, scene.lines, scene.truth] = [arrays.contour, arrays.lines, body.truth];
    scene.obstacles = arrays.obstacles;
    if (JSON.stringify(before) !== JSON.stringify(body.grid)) this.canvas2d.setHome(image.box());
    scene.probe ??= body.start ?? undefined;
    this.path.follow();
    shown.showMap(body);
    this.#showRamp();
    this.meter.show(body.meter);
    const took = `both fields made in ${(1000 * body.seconds).toFixed(0)} ms`;
    this.app.say(`${body.name} after ${body.at} scans: ${took}. Move the pointer, click a path.`);
    this.questions.all();
    this.drawAll();
  }

  /** @param {Point} p */
  #putProbe(p) {
    this.scene.probe = p;
    this.questions.probe();
    this.canvas2d.draw();
    this.app.changed();
  }

  /** Moves the probe by cells, and the picture after it. @param {number} dx @param {number} dy */
  #moveProbe(dx, dy) {
    const { canvas2d, scene } = this;
    const r = scene.image?.grid.resolution ?? 0.05;
    const [x, y] = scene.probe ?? canvas2d.center;
    const p = /** @type {Point} */ ([x + dx * r, y + dy * r]);
    const [px, py] = canvas2d.camera().toScreen(...p);
    const { clientWidth: w, clientHeight: h } = canvas2d.canvas;
    const inside = (/** @type {number} */ v, /** @type {number} */ size) =>
      Math.max(24 - v, 0) - Math.max(v - size + 24, 0);
    const by = [inside(px, w), inside(py, h)];
    if (by[0] || by[1]) canvas2d.pan(by[0], by[1]);
    this.#putProbe(p);
  }

  /** @param {URLSearchParams} link */
  async show(link) {
    if (link.size > 0) this.#restore(link);
    await this.#open();
    if (link.has("at")) this.canvas2d.restore(link);
    // The canvas has a size only now: before, no arrows could be asked for.
    this.questions.arrows();
    this.canvas2d.draw();
  }

  hide() {}

  /** @returns {Record<string, string>} */
  state() {
    const { probe } = this.scene;
    return {
      ...this.shown.link(),
      ...this.path.link(),
      ...(probe ? { probe: textOf([probe]) } : {}),
      ...this.canvas2d.state(),
    };
  }

  /** @param {URLSearchParams} link */
  #restore(link) {
    const { scene, shown } = this;
    shown.restore(link);
    this.path.restore(link);
    const [probe] = pointsOf(link.get("probe"));
    if (probe) scene.probe = probe;
    this.probe.mark(shown.field);
    if (!this.map) return;
    scene.image?.show(shown.picture);
    this.#showRamp();
    this.drawAll();
    this.questions.all();
  }

  picture() {
    this.canvas2d.paint();
    const field = this.shown.field === "euclidean" ? "Euclidean" : "truncated";
    const plots = [this.scene.checked ? this.path.panel.plot.canvas() : null, this.meter.plot.canvas()];
    return compose(`portolan studio · clearance · ${field} field`, [[this.canvas2d.canvas], plots]);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const far = event.shiftKey ? 10 : 1;
    const { shown, path } = this;
    /** @type {Record<string, () => void>} */
    const actions = {
      ArrowLeft: () => this.#moveProbe(-far, 0),
      ArrowRight: () => this.#moveProbe(far, 0),
      ArrowUp: () => this.#moveProbe(0, far),
      ArrowDown: () => this.#moveProbe(0, -far),
      Enter: () => this.path.add(),
      Backspace: () => this.path.removeLast(),
      Escape: () => this.path.removeAll(),
      f: () => shown.fieldPair.next(),
      u: () => shown.unknownPair.next(),
      r: () => shown.toggle("rings"),
      g: () => shown.toggle("arrows"),
      d: () => path.panel.draw.click(),
      w: () => path.panel.drive.click(),
      "[": () => this.path.resizeRobot(-0.01),
      "]": () => this.path.resizeRobot(0.01),
    };
    actions[event.key]?.();
    return event.key in actions || this.canvas2d.key(event);
  }

  redraw() {
    this.scene.image?.paint();
    this.path.panel.plot.redraw();
    this.meter.plot.redraw();
    this.drawAll();
  }
}

/**
 * @typedef {import("./view.js").App} App
 * @typedef {import("./view.js").Shown} Shown
 * @type {import("./view.js").View}
 */
export default {
  id: "clearance",
  title: "Clearance",
  lead:
    "The {Euclidean field} says at every place how far the nearest obstacle is, within bounds that are {certified}: what a robot " +
    "must know before it drives there.",
  in_3d: false,
  mount: (root, app) => new Clearance(root, app),
};
