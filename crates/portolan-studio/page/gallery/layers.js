// @ts-check
import { Cells, STEPS, diverging, sequential, step, word } from "../canvas2d/cells.js";
import { strokeFaces, strokeLines } from "../canvas2d/lines.js";
import { colors, rgb } from "../ui/theme.js";
import { Pixels } from "./pixels.js";

/** Distance at which the color of the Euclidean field is full (metres). */
const FAR = 1.5;
/** Value of cells that were never observed, where chances are bytes. */
const UNOBSERVED = 255;
/**
 * Borders are drawn of cells that are at least so large (CSS pixels); of smaller ones they would cover what
 * is inside.
 */
const BORDERED = 2.5;

/** What the engine sent of all representations, ready to be drawn. */
export class Picture {
  /** @param {any} body @param {Record<string, any>} arrays */
  constructor(body, arrays) {
    this.grid = body.grid;
    this.tree = body.tree;
    this.truncation = body.truncation;
    this.truth = body.truth;
    this.arrays = arrays;
    this.occupancy = new Cells(this.grid);
    this.leaves = new Cells(this.grid);
    this.tsdf = new Cells(this.grid);
    this.esdf = new Cells(this.grid);
    this.borders = new Pixels();
    this.points = new Pixels();
    this.recolor();
  }

  /**
   * The box of the world that is shown: what the grid fills, and below it room for the scale.
   * @returns {[number, number, number, number]}
   */
  box() {
    const {
      origin: [x, y],
      resolution: r,
      shape: [w, h],
    } = this.grid;
    return [x, y - 0.07 * h * r, x + w * r, y + h * r];
  }

  /** With the colors of the theme. */
  recolor() {
    const c = colors();
    const a = this.arrays;
    const unknown = word(...rgb(c.unknown), 255);
    // Squared below: what is clamped at a small chance looks free.
    const chance = sequential(c.paper, c.ink);
    const ramp = diverging(c.negative, c.positive);
    const share = (/** @type {number} */ p) =>
      p === UNOBSERVED ? unknown : chance[Math.round((p / 254) ** 2 * (STEPS - 1))];
    const signed = (/** @type {number} */ d, /** @type {number} */ end) =>
      Number.isNaN(d) ? unknown : ramp[step(d, -end, end)];
    this.occupancy.fill((i) => share(a.occupancy[i]));
    this.tsdf.fill((i) => signed(a.tsdf[i], this.truncation));
    this.esdf.fill((i) => signed(a.esdf[i], FAR));
    this.leaves.fill(() => unknown);
    const [w, h] = this.grid.shape;
    for (let n = 0, k = 0; n < a.leaf_occupancy.length; n++, k += 3) {
      const [x, y, size] = [a.leaves[k], a.leaves[k + 1], a.leaves[k + 2]];
      const color = share(a.leaf_occupancy[n]);
      const right = Math.min(w, x + size);
      // The root covers more than the grid does.
      for (let j = y; j < Math.min(h, y + size); j++)
        if (x < right) this.leaves.words.fill(color, this.leaves.at(x, j), this.leaves.at(x, j) + right - x);
    }
    this.leaves.touch(0, h);
  }

  /**
   * Layers of each panel, from back to front.
   * @returns {Record<string, import("../canvas2d/canvas2d.js").Layer[]>}
   */
  layers() {
    const squares = this.#squares;
    return {
      grid: [this.occupancy.draw, squares],
      tree: [this.leaves.draw, this.#leafBorders],
      tsdf: [this.tsdf.draw, squares, this.#truth, this.#contour],
      esdf: [this.esdf.draw, this.#rings, this.#contour],
      contour: [this.#truth, this.#contour],
      cloud: [this.#cloud],
    };
  }

  /** The cells of the grid, where they are large enough. @type {import("../canvas2d/canvas2d.js").Layer} */
  #squares = (g, camera) => {
    const { origin, resolution: r, shape } = this.grid;
    if (r * camera.scale < 2 * BORDERED) return;
    const { clientWidth: w, clientHeight: h } = g.canvas;
    const [low, high] = [camera.toWorld(0, h), camera.toWorld(w, 0)];
    const clamp = (/** @type {number} */ k, /** @type {number} */ v) =>
      Math.min(shape[k], Math.max(0, Math.floor((v - origin[k]) / r)));
    const [x0, x1, y0, y1] = [
      clamp(0, low[0]),
      clamp(0, high[0] + r),
      clamp(1, low[1]),
      clamp(1, high[1] + r),
    ];
    g.strokeStyle = colors().line;
    g.globalAlpha = 0.8;
    g.lineWidth = 1;
    g.beginPath();
    for (let x = x0; x <= x1; x++) {
      g.moveTo(...camera.toScreen(origin[0] + x * r, origin[1] + y0 * r));
      g.lineTo(...camera.toScreen(origin[0] + x * r, origin[1] + y1 * r));
    }
    for (let y = y0; y <= y1; y++) {
      g.moveTo(...camera.toScreen(origin[0] + x0 * r, origin[1] + y * r));
      g.lineTo(...camera.toScreen(origin[0] + x1 * r, origin[1] + y * r));
    }
    g.stroke();
  };

  /**
   * Borders of the leaves; the larger the leaf, the stronger.
   * @type {import("../canvas2d/canvas2d.js").Layer}
   */
  #leafBorders = (g, camera) => {
    const {
      origin: [ox, oy],
      resolution: r,
    } = this.tree;
    const { leaves, leaf_occupancy: occupancy } = this.arrays;
    const line = rgb(colors().positive);
    this.borders.over(g, () => {
      const p = this.borders;
      const [sx, sy] = camera.toScreen(ox, oy);
      const scale = r * camera.scale * p.ratio;
      const [x0, y0] = [sx * p.ratio, sy * p.ratio];
      const strength = Array.from({ length: 32 }, (_, height) => {
        const edge = (2 ** height * scale) / p.ratio;
        return edge < BORDERED
          ? 0
          : word(...line, Math.round(255 * Math.min(0.95, 0.22 + 0.14 * height + 0.012 * edge)));
      });
      for (let n = 0, k = 0; n < occupancy.length; n++, k += 3) {
        const size = leaves[k + 2];
        const color = strength[31 - Math.clz32(size)];
        if (color === 0) continue;
        const [x, y] = [leaves[k], leaves[k + 1]];
        p.corner(
          Math.round(x0 + x * scale),
          Math.round(y0 - (y + size) * scale),
          Math.round(x0 + (x + size) * scale),
          Math.round(y0 - y * scale),
          color,
        );
      }
    });
  };

  /** @type {import("../canvas2d/canvas2d.js").Layer} */
  #truth = (g, camera) => {
    if (!this.truth) return;
    g.strokeStyle = colors().truth;
    g.lineWidth = 1.25;
    g.setLineDash([5, 4]);
    strokeFaces(g, camera, this.truth);
    g.setLineDash([]);
  };

  /** @type {import("../canvas2d/canvas2d.js").Layer} */
  #contour = (g, camera) => {
    g.strokeStyle = colors().contour;
    g.lineWidth = Math.min(1.8, Math.max(0.7, 0.6 * this.grid.resolution * camera.scale));
    g.lineJoin = "round";
    strokeLines(g, camera, this.arrays.contour, this.arrays.contour_starts);
  };

  /** @type {import("../canvas2d/canvas2d.js").Layer} */
  #rings = (g, camera) => {
    g.strokeStyle = colors().ink;
    g.globalAlpha = 0.5;
    g.lineWidth = 0.8;
    strokeLines(g, camera, this.arrays.rings, this.arrays.ring_starts);
    g.globalAlpha = 1;
  };

  /** @type {import("../canvas2d/canvas2d.js").Layer} */
  #cloud = (g, camera) => {
    const { cloud } = this.arrays;
    const color = word(...rgb(colors().beam), 200);
    this.points.over(g, () => {
      const p = this.points;
      const [sx, sy] = camera.toScreen(0, 0);
      const s = camera.scale * p.ratio;
      const [x0, y0] = [sx * p.ratio, sy * p.ratio];
      const size = Math.max(1, Math.min(4, Math.round(0.012 * s)));
      for (let i = 0; i < cloud.length; i += 2) p.dot(x0 + cloud[i] * s, y0 - cloud[i + 1] * s, size, color);
    });
  };
}
