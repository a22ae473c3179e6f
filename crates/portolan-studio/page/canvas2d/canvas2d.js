// @ts-check
import { el } from "../ui/controls.js";
import { colors } from "../ui/theme.js";
import { listen } from "./pointer.js";
import { scaleBar } from "./scale_bar.js";

/**
 * @typedef {object} Camera where the world is on the canvas, in CSS pixels
 * @property {number} scale pixels per metre
 * @property {(x: number, y: number) => [number, number]} toScreen
 * @property {(px: number, py: number) => [number, number]} toWorld
 *
 * @typedef {(g: CanvasRenderingContext2D, camera: Camera) => void} Layer draws itself; the context is in CSS
 *   pixels
 */

/**
 * A canvas that shows a part of a 2-D world: pan, zoom, layers from back to front. Drawn once per picture,
 * when asked.
 */
export class Canvas2d {
  /**
   * @param {object} o
   * @param {string} o.id of the canvas
   * @param {string} o.label what it shows, in words
   * @param {import("../ui/meter.js").Meter} o.meter
   * @param {() => void} [o.before] called before each picture
   */
  constructor({ id, label, meter, before }) {
    this.canvas = el("canvas", { id, tabindex: 0, role: "img", "aria-label": label });
    this.node = el("div", { class: "canvas" }, this.canvas);
    this.meter = meter;
    this.before = before;
    /** @type {Layer[]} */
    this.layers = [];
    /**
     * World box that is shown where nothing was moved: x0, y0, x1, y1.
     * @type {[number, number, number, number]}
     */
    this.home = [0, 0, 1, 1];
    this.center = [0.5, 0.5];
    this.zoom = 1;
    /** Pointers that are down. @type {Map<number, [number, number]>} */
    this.pointers = new Map();
    this.asked = false;
    /** Whether a length is drawn at the lower left. */
    this.bar = true;
    /**
     * A click that was no drag: world x, y.
     * @type {((p: [number, number], event: PointerEvent) => void) | undefined}
     */
    this.onclick = undefined;
    /**
     * The pointer moves over the canvas: world x, y; `undefined`: it has left.
     * @type {((p: [number, number] | undefined) => void) | undefined}
     */
    this.onhover = undefined;
    /**
     * A drag begins here: take it and get its moves, or let the picture pan.
     * @type {((p: [number, number]) => ((p: [number, number], last: boolean) => void) | undefined) |
     *   undefined}
     */
    this.ondrag = undefined;
    this.oncamera = () => {};
    listen(this);
    new ResizeObserver(() => this.draw()).observe(this.node);
  }

  /** Shows this box of the world (x0, y0, x1, y1). @param {[number, number, number, number]} box */
  setHome(box) {
    this.home = box;
    this.reset();
  }

  /** All of it again. */
  reset() {
    const [x0, y0, x1, y1] = this.home;
    this.center = [(x0 + x1) / 2, (y0 + y1) / 2];
    this.zoom = 1;
    this.oncamera();
    this.draw();
  }

  /** @returns {Camera} */
  camera() {
    const [x0, y0, x1, y1] = this.home;
    const { clientWidth: w, clientHeight: h } = this.canvas;
    const margin = Math.min(28, 0.04 * Math.min(w, h));
    const scale =
      this.zoom * Math.max(1e-6, Math.min((w - 2 * margin) / (x1 - x0), (h - 2 * margin) / (y1 - y0)));
    const [cx, cy] = this.center;
    return {
      scale,
      toScreen: (x, y) => [w / 2 + (x - cx) * scale, h / 2 - (y - cy) * scale],
      toWorld: (px, py) => [cx + (px - w / 2) / scale, cy - (py - h / 2) / scale],
    };
  }

  /** The middle of the canvas in the world. */
  middle() {
    const { clientWidth: w, clientHeight: h } = this.canvas;
    return this.camera().toWorld(w / 2, h / 2);
  }

  /** Asks for a picture; several in one frame are one. */
  draw() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      if (this.canvas.clientWidth === 0) return;
      this.meter.measure(() => {
        this.before?.();
        this.paint();
      });
      this.meter.picture();
    });
  }

  /** Draws now. */
  paint() {
    const { canvas } = this;
    const ratio = devicePixelRatio;
    const [w, h] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    const g = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    g.setTransform(1, 0, 0, 1, 0, 0);
    g.fillStyle = colors().paper;
    g.fillRect(0, 0, w, h);
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    const camera = this.camera();
    for (const layer of this.layers) {
      g.save();
      layer(g, camera);
      g.restore();
    }
    if (this.bar) scaleBar(g, camera, canvas.clientHeight);
  }

  /** Zooms about a point of the canvas. @param {number} factor @param {number} px @param {number} py */
  zoomAt(factor, px, py) {
    const [x, y] = this.camera().toWorld(px, py);
    this.zoom = Math.min(200, Math.max(0.25, this.zoom * factor));
    const [nx, ny] = this.camera().toWorld(px, py);
    this.center = [this.center[0] + x - nx, this.center[1] + y - ny];
    this.oncamera();
    this.draw();
  }

  /** Moves by so many pixels. @param {number} dx @param {number} dy */
  pan(dx, dy) {
    const { scale } = this.camera();
    this.center = [this.center[0] - dx / scale, this.center[1] + dy / scale];
    this.oncamera();
    this.draw();
  }

  /** Keys that move the camera. @param {KeyboardEvent} event @returns {boolean} whether it was one of them */
  key(event) {
    const { clientWidth: w, clientHeight: h } = this.canvas;
    const step = event.shiftKey ? 200 : 60;
    /** @type {Record<string, () => void>} */
    const does = {
      "+": () => this.zoomAt(1.25, w / 2, h / 2),
      "=": () => this.zoomAt(1.25, w / 2, h / 2),
      "-": () => this.zoomAt(0.8, w / 2, h / 2),
      0: () => this.reset(),
      ArrowLeft: () => this.pan(step, 0),
      ArrowRight: () => this.pan(-step, 0),
      ArrowUp: () => this.pan(0, step),
      ArrowDown: () => this.pan(0, -step),
    };
    const what = does[event.key];
    what?.();
    return what !== undefined;
  }

  /** What a link says of the camera; empty where it is at home. @returns {Record<string, string>} */
  state() {
    const [x0, y0, x1, y1] = this.home;
    const home =
      this.zoom === 1 && Math.hypot(this.center[0] - (x0 + x1) / 2, this.center[1] - (y0 + y1) / 2) < 1e-6;
    return home ? {} : { at: [...this.center, this.zoom].map((v) => v.toFixed(3)).join(",") };
  }

  /** @param {URLSearchParams} state */
  restore(state) {
    const [x, y, zoom] = (state.get("at") ?? "").split(",").map(Number);
    if (![x, y, zoom].every(Number.isFinite) || !(zoom > 0)) return;
    this.center = [x, y];
    this.zoom = Math.min(200, Math.max(0.25, zoom));
    this.draw();
  }
}
