// @ts-check
import { el } from "../ui/controls.js";
import { colors } from "../ui/theme.js";

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
 * A canvas that shows a part of the plane: pan, zoom, layers from back to front. Drawn once per picture, when
 * asked.
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
     * A drag begins here: take it and get its moves, or let the plane pan.
     * @type {((p: [number, number]) => ((p: [number, number], last: boolean) => void) | undefined) |
     *   undefined}
     */
    this.ondrag = undefined;
    this.oncamera = () => {};
    this.#listen();
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

  /** What the address says of the camera; nothing where it is at home. @returns {Record<string, string>} */
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

  #listen() {
    const { canvas } = this;
    /** @type {[number, number] | undefined} where the first pointer went down */
    let down;
    /** @type {((p: [number, number], last: boolean) => void) | undefined} */
    let taken;
    let moved = false;
    const at = (/** @type {PointerEvent | WheelEvent} */ e) =>
      /** @type {[number, number]} */ ([e.offsetX, e.offsetY]);
    canvas.onpointerdown = (e) => {
      canvas.setPointerCapture(e.pointerId);
      this.pointers.set(e.pointerId, at(e));
      if (this.pointers.size > 1) return;
      down = at(e);
      moved = false;
      taken = this.ondrag?.(this.camera().toWorld(...down));
    };
    canvas.onpointermove = (e) => {
      const before = this.pointers.get(e.pointerId);
      const now = at(e);
      if (!before) return this.onhover?.(this.camera().toWorld(...now));
      this.pointers.set(e.pointerId, now);
      if (down && Math.hypot(now[0] - down[0], now[1] - down[1]) > 4) moved = true;
      if (this.pointers.size === 2) {
        const other = [...this.pointers].find(([id]) => id !== e.pointerId)?.[1] ?? now;
        const ratio =
          Math.hypot(now[0] - other[0], now[1] - other[1]) /
          Math.max(1, Math.hypot(before[0] - other[0], before[1] - other[1]));
        this.zoomAt(ratio, (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
      } else if (taken) {
        if (moved) taken(this.camera().toWorld(...now), false);
      } else if (moved) this.pan(now[0] - before[0], now[1] - before[1]);
    };
    canvas.onpointerup = canvas.onpointercancel = (e) => {
      if (!this.pointers.delete(e.pointerId) || this.pointers.size > 0) return;
      const p = this.camera().toWorld(...at(e));
      if (taken && moved) taken(p, true);
      else if (!moved && e.type === "pointerup") this.onclick?.(p, e);
      taken = undefined;
    };
    canvas.onpointerleave = () => this.onhover?.(undefined);
    canvas.addEventListener(
      "wheel",
      (e) => {
        e.preventDefault();
        this.zoomAt(Math.exp(-e.deltaY * (e.deltaMode ? 0.05 : 0.0015)), ...at(e));
      },
      { passive: false },
    );
    canvas.ondblclick = () => this.reset();
  }
}

/**
 * A round length at the lower left.
 * @param {CanvasRenderingContext2D} g
 * @param {Camera} camera
 * @param {number} height
 */
function scaleBar(g, camera, height) {
  const wanted = 90 / camera.scale;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const metres = [5, 2, 1].map((n) => n * power).find((n) => n <= wanted) ?? power;
  const length = metres * camera.scale;
  const [x, y] = [14, height - 14];
  g.strokeStyle = g.fillStyle = colors().muted;
  g.lineWidth = 1.5;
  g.beginPath();
  g.moveTo(x, y - 5);
  g.lineTo(x, y);
  g.lineTo(x + length, y);
  g.lineTo(x + length, y - 5);
  g.stroke();
  g.font = "11px system-ui, sans-serif";
  g.fillText(
    metres >= 1
      ? `${metres} m`
      : metres >= 0.01
        ? `${Math.round(metres * 100)} cm`
        : `${Math.round(metres * 1000)} mm`,
    x + length + 6,
    y,
  );
}
