// @ts-check
import { drag, MOST } from "./path_edit.js";
import { PathPanel } from "./path_panel.js";

/** @typedef {[number, number]} Point */

/** The path through the map: what changes it. */
export class Path {
  /** @param {import("../views/clearance.js").Clearance} view */
  constructor(view) {
    this.view = view;
    /** Whether dragging draws. */
    this.drawing = false;
    /** It is the driven way, or will be once there is a map. */
    this.driven = false;
    this.panel = new PathPanel({
      radius: view.scene.radius,
      setRadius: (radius) => this.#setRadius(radius),
      undo: () => this.removeLast(),
      clear: () => this.removeAll(),
      drive: () => this.#drive(),
      draw: (on) => (this.drawing = on),
    });
  }

  get waypoints() {
    return this.view.scene.waypoints;
  }

  set waypoints(points) {
    this.view.scene.waypoints = points;
    this.panel.count(points.length);
  }

  /** The way on which the map was made. @returns {Point[]} */
  #drivenWay() {
    return (this.view.map?.way ?? []).map((/** @type {Point} */ p) => [...p]);
  }

  /** The map is another: so is the driven way. */
  follow() {
    if (this.driven) this.waypoints = this.#drivenWay();
  }

  /** @param {() => void} change of the waypoints, in place: a drag may be under way */
  #edit(change) {
    const { view } = this;
    this.driven = false;
    change();
    if (this.waypoints.length === 0) view.scene.checked = undefined;
    this.panel.count(this.waypoints.length);
    view.questions.path();
    view.canvas2d.draw();
    view.app.changed();
  }

  /** A waypoint where the probe is. */
  add() {
    const { probe } = this.view.scene;
    if (!probe || this.waypoints.length >= MOST) return;
    // To the millimetre, as links hold it: a link is about the same path.
    const [x, y] = probe.map((v) => Math.round(1000 * v) / 1000);
    this.#edit(() => this.waypoints.push([x, y]));
  }

  removeLast() {
    this.#edit(() => this.waypoints.pop());
  }

  removeAll() {
    this.#edit(() => (this.waypoints.length = 0));
  }

  #drive() {
    this.#edit(() => (this.waypoints = this.#drivenWay()));
    this.driven = true;
  }

  /** What a drag does that begins at `from`, if anything. @param {Point} from */
  drag(from) {
    const { waypoints: points, drawing } = this;
    const scale = () => this.view.canvas2d.camera().scale;
    return drag({ points, scale, drawing, changed: () => this.#edit(() => {}) }, from);
  }

  /** @param {number} radius metres */
  #setRadius(radius) {
    const { view } = this;
    view.scene.radius = radius;
    view.questions.path();
    view.canvas2d.draw();
    view.app.changed();
  }

  /** @param {number} by metres */
  resizeRobot(by) {
    const radius = Math.round(100 * Math.min(1, Math.max(0, this.view.scene.radius + by))) / 100;
    this.panel.radius.value = radius;
    this.#setRadius(radius);
  }

  /** What a link says of it. @returns {Record<string, string>} */
  link() {
    const path = this.driven ? "driven" : textOf(this.waypoints);
    return { radius: this.view.scene.radius.toFixed(2), ...(path ? { path } : {}) };
  }

  /** Makes what a link says. @param {URLSearchParams} link */
  restore(link) {
    const radius = Number(link.get("radius") ?? NaN);
    if (radius >= 0 && radius <= 1) this.panel.radius.value = this.view.scene.radius = radius;
    if (!link.has("path")) return;
    this.driven = link.get("path") === "driven";
    this.waypoints = this.driven ? this.#drivenWay() : pointsOf(link.get("path")).slice(0, MOST);
  }
}

/** Points as a link has them. @param {Point[]} points */
export const textOf = (points) => points.map((p) => p.map((v) => v.toFixed(3)).join(",")).join(";");

/** @param {string | null} text @returns {Point[]} */
export function pointsOf(text) {
  const all = (text ?? "").split(";").map((p) => p.split(",").map(Number));
  return /** @type {Point[]} */ (all.filter((p) => p.length === 2 && p.every(Number.isFinite)));
}
