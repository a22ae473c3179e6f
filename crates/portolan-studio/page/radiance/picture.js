// @ts-check
import { el } from "../ui/controls.js";
import { colors } from "../ui/theme.js";
import { drawField } from "./field.js";
import { drawRays } from "./rays.js";

/**
 * What stays while a run lasts, as `answer.rs` gives it.
 * @typedef {object} Scene
 * @property {number} length of the line (metres)
 * @property {number} bins
 * @property {number} resolution metres
 * @property {[number, number][]} bodies where they begin and end (metres)
 * @property {{opacity: number[], reflectance: number[]}} truth
 * @property {[number, number][]} marks density (1/m) and the opacity of a bin that has it
 * @property {{origin: number, ascending: boolean, held_out: boolean, depth: number, at: number, reflectance:
 *   number}[]} rays
 * @property {{depth: number, reflectance: number, second_moment: number}} noise
 * @property {number} far metres
 * @property {number} margin metres
 * @property {{name: string, seed: number, shows: string}[]} named
 *
 * The fit as it stands.
 * @typedef {object} Fit
 * @property {any} body
 * @property {Record<string, Float32Array>} arrays
 *
 * Where things are on the canvas, in CSS pixels.
 * @typedef {object} Frame
 * @property {(x: number) => number} x of a place on the line (metres)
 * @property {(px: number) => number} metres of a place on the canvas
 * @property {number} left
 * @property {number} right
 * @property {{top: number, bottom: number}} field bars and light
 * @property {{top: number, bottom: number}} strip reflectance
 * @property {{top: number, bottom: number}} pull what descent wants
 * @property {{top: number, bottom: number}} rays
 * @property {(ray: number) => number} row of a ray
 * @property {number} pitch between rows
 */

export const FONT = "11px system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif";

/** The corridor on one canvas: density and light above, reflectance and gradient below it, then the rays. */
export class Picture {
  /**
   * @param {{meter: import("../ui/meter.js").Meter, before: () => void}} o `before`: called before each
   *   picture
   */
  constructor({ meter, before }) {
    this.canvas = el("canvas", {
      id: "radiance-canvas",
      tabindex: 0,
      role: "img",
      "aria-label":
        "The corridor: density of every bin, light of the chosen ray, reflectance, gradient, and ten rays " +
        "with what they measured and what they render",
    });
    this.node = el("div", { class: "canvas" }, this.canvas);
    this.meter = meter;
    this.before = before;
    this.asked = false;
    /** @type {Scene | undefined} */
    this.scene = undefined;
    /** @type {Fit | undefined} */
    this.fit = undefined;
    /** The bin under the pointer, or that of the keyboard. @type {number | undefined} */
    this.cursor = undefined;
    /** @type {(bin: number | undefined, ray: number | undefined) => void} */
    this.onpick = () => {};
    this.onhover = () => {};
    this.canvas.onpointermove = (e) => this.#hover(this.#binAt(e));
    this.canvas.onpointerleave = () => this.#hover(undefined);
    this.canvas.onclick = (e) => this.onpick(this.#binAt(e), this.#rayAt(e));
    new ResizeObserver(() => this.draw()).observe(this.node);
  }

  /** Asks for a picture; several in one frame are one. */
  draw() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      if (this.canvas.clientWidth === 0) return;
      this.meter.measure(() => {
        this.before();
        this.paint();
      });
      this.meter.picture();
    });
  }

  /** Draws now. */
  paint() {
    const { canvas, scene, fit } = this;
    const ratio = devicePixelRatio;
    const [w, h] = [canvas.clientWidth, canvas.clientHeight];
    const size = [Math.round(w * ratio), Math.round(h * ratio)];
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    const g = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    const c = colors();
    g.fillStyle = c.paper;
    g.fillRect(0, 0, w, h);
    if (!scene || !fit) return;
    const frame = layout(scene, w, h);
    g.font = FONT;
    bodies(g, frame, scene, c);
    columns(g, frame, scene, fit, this.cursor, c);
    drawField(g, frame, scene, fit, c);
    axis(g, frame, scene, c);
    drawRays(g, frame, scene, fit, c);
    if (this.cursor !== undefined) readout(g, frame, scene, fit, this.cursor, c);
  }

  /** @param {PointerEvent | MouseEvent} e @returns {number | undefined} */
  #binAt(e) {
    if (!this.scene) return undefined;
    const frame = layout(this.scene, this.canvas.clientWidth, this.canvas.clientHeight);
    const bin = Math.floor(frame.metres(e.offsetX) / this.scene.resolution);
    return bin >= 0 && bin < this.scene.bins ? bin : undefined;
  }

  /** @param {MouseEvent} e @returns {number | undefined} */
  #rayAt(e) {
    if (!this.scene) return undefined;
    const frame = layout(this.scene, this.canvas.clientWidth, this.canvas.clientHeight);
    if (e.offsetY < frame.rays.top) return undefined;
    const rows = this.scene.rays.map((_, i) => Math.abs(frame.row(i) - e.offsetY));
    const nearest = rows.indexOf(Math.min(...rows));
    return rows[nearest] <= frame.pitch ? nearest : undefined;
  }

  /** @param {number | undefined} bin */
  #hover(bin) {
    if (bin === this.cursor) return;
    this.cursor = bin;
    this.onhover();
    this.draw();
  }
}

/** @param {Scene} scene @param {number} w @param {number} h @returns {Frame} */
function layout(scene, w, h) {
  const [left, right] = [58, w - 58];
  const scale = (right - left) / scene.length;
  const count = scene.rays.length;
  // Ten rows and a gap before those that are held out.
  const pitch = Math.max(11, Math.min(20, (0.36 * h) / (count + 1)));
  const rays = { top: h - 14 - (count + 0.9) * pitch - 16, bottom: h - 10 };
  const pull = { top: rays.top - 22 - 44, bottom: rays.top - 22 };
  const strip = { top: pull.top - 22 - 22, bottom: pull.top - 22 };
  const held = (/** @type {number} */ i) => (scene.rays[i].held_out ? 0.9 : 0);
  return {
    x: (x) => left + x * scale,
    metres: (px) => (px - left) / scale,
    left,
    right,
    field: { top: 30, bottom: strip.top - 5 },
    strip,
    pull,
    rays,
    pitch,
    row: (i) => rays.top + 16 + (i + held(i)) * pitch,
  };
}

/**
 * Where there is something in truth: through all of the picture.
 * @param {CanvasRenderingContext2D} g
 * @param {Frame} f
 * @param {Scene} scene
 * @param {Record<string, string>} c
 */
function bodies(g, f, scene, c) {
  g.fillStyle = c.soft;
  for (const [low, high] of scene.bodies)
    g.fillRect(f.x(low), f.field.top, f.x(high) - f.x(low), f.rays.bottom - f.field.top);
}

/**
 * The bin that is looked at and the one under the cursor.
 * @param {CanvasRenderingContext2D} g
 * @param {Frame} f
 * @param {Scene} scene
 * @param {Fit} fit
 * @param {number | undefined} cursor
 * @param {Record<string, string>} c
 */
function columns(g, f, scene, fit, cursor, c) {
  const column = (/** @type {number} */ bin) => [
    f.x(bin * scene.resolution),
    f.x((bin + 1) * scene.resolution),
  ];
  const bin = fit.body.look.bin;
  if (bin !== null) {
    const [a, b] = column(bin);
    g.fillStyle = `${c.accent}2e`;
    g.fillRect(a, f.field.top - 4, b - a, f.rays.bottom - f.field.top + 4);
  }
  if (cursor !== undefined) {
    const [a, b] = column(cursor);
    g.strokeStyle = c.muted;
    g.lineWidth = 1;
    g.setLineDash([2, 3]);
    g.strokeRect(a - 0.5, f.field.top - 4, b - a + 1, f.rays.bottom - f.field.top + 4);
    g.setLineDash([]);
  }
}

/**
 * Metres, between reflectance and gradient.
 * @param {CanvasRenderingContext2D} g
 * @param {Frame} f
 * @param {Scene} scene
 * @param {Record<string, string>} c
 */
function axis(g, f, scene, c) {
  g.fillStyle = c.muted;
  g.textAlign = "center";
  g.textBaseline = "top";
  for (let m = 0; m <= scene.length; m++)
    g.fillText(m === scene.length ? `${m} m` : String(m), f.x(m), f.strip.bottom + 4);
}

/**
 * What there is under the cursor, in words.
 * @param {CanvasRenderingContext2D} g
 * @param {Frame} f
 * @param {Scene} scene
 * @param {Fit} fit
 * @param {number} bin
 * @param {Record<string, string>} c
 */
function readout(g, f, scene, fit, bin, c) {
  const { density, opacity, reflectance } = fit.arrays;
  const at = (bin + 0.5) * scene.resolution;
  g.fillStyle = c.ink;
  g.textAlign = "center";
  g.textBaseline = "bottom";
  g.fillText(
    `bin ${bin} at ${at.toFixed(2)} m: ${density[bin].toPrecision(3)} /m, ends ` +
      `${(100 * opacity[bin]).toPrecision(3)} % of light, reflects ${reflectance[bin].toFixed(2)}`,
    (f.left + f.right) / 2,
    f.field.top - 8,
  );
}
