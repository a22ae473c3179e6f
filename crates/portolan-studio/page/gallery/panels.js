// @ts-check
import { el } from "../ui/controls.js";
import { colors } from "../ui/theme.js";
import { Panel } from "./panel.js";
import { portrait } from "./portrait.js";

/**
 * Name in the engine's answers, heading, and a label for those who do not see the picture.
 * @type {[string, string, string][]}
 */
const PANELS = [
  ["grid", "Occupancy grid", "The occupancy grid: a byte per cell"],
  ["tree", "Quadtree", "The quadtree with the cells that pruning has left"],
  ["tsdf", "TSDF", "The truncated signed distance field, the extracted contour and the truth"],
  ["esdf", "ESDF", "The Euclidean distance field with its level rings"],
  ["contour", "Contour", "The extracted contour and the truth"],
  ["cloud", "Point cloud", "The end points of all beams"],
];

/** Six panels over one part of the world: what moves one moves all. */
export class Panels {
  /**
   * @param {import("../ui/meter.js").Meter} meter
   * @param {{oncamera: () => void, onhover: (p: [number, number] | undefined) => void}} o
   */
  constructor(meter, { oncamera, onhover }) {
    this.meter = meter;
    this.each = PANELS.map(([name, title, label]) => new Panel({ name, title, label, meter }));
    /** Where all are asked. @type {[number, number] | undefined} */
    this.place = undefined;
    this.asked = false;
    /** The camera of all. */
    this.canvas2d = this.each[0].canvas2d;
    this.node = el("div", { class: "panels" }, ...this.each.map((p) => p.node));
    for (const { canvas2d } of this.each) {
      // One scale serves all.
      canvas2d.bar = canvas2d === this.canvas2d;
      canvas2d.draw = () => this.draw();
      canvas2d.onhover = onhover;
      canvas2d.oncamera = () => {
        this.#follow(canvas2d);
        oncamera();
        this.draw();
      };
    }
  }

  /** All six show the same part. @param {import("../canvas2d/canvas2d.js").Canvas2d} leader */
  #follow({ home, center, zoom }) {
    for (const { canvas2d } of this.each) {
      canvas2d.home = home;
      canvas2d.center = [...center];
      canvas2d.zoom = zoom;
    }
  }

  /** All six are one picture: drawn together, measured together. */
  draw() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      if (this.canvas2d.canvas.clientWidth === 0) return;
      this.meter.measure(() => this.paint());
      this.meter.picture();
    });
  }

  paint() {
    for (const { canvas2d } of this.each) canvas2d.paint();
  }

  /** @param {import("./layers.js").Picture} picture */
  show(picture) {
    const layers = picture.layers();
    for (const { canvas2d, name } of this.each) canvas2d.layers = [...layers[name], this.#crosshair];
    this.draw();
  }

  /** @type {import("../canvas2d/canvas2d.js").Layer} */
  #crosshair = (g, camera) => {
    if (!this.place) return;
    const [x, y] = camera.toScreen(...this.place).map((v) => Math.round(v) + 0.5);
    g.strokeStyle = colors().ink;
    g.lineWidth = 1;
    g.globalAlpha = 0.55;
    g.beginPath();
    g.moveTo(x, 0);
    g.lineTo(x, g.canvas.clientHeight);
    g.moveTo(0, y);
    g.lineTo(g.canvas.clientWidth, y);
    g.stroke();
  };

  /**
   * Crosshairs, and what each answers there.
   * @param {[number, number] | undefined} p
   * @param {Record<string, string>} answers
   */
  point(p, answers) {
    this.place = p;
    for (const { name, answer } of this.each) answer.textContent = answers[name] ?? "";
    this.draw();
  }

  /** @param {any} costs @param {{memory: [number, number], time: [number, number]}} scales powers of ten */
  showCosts(costs, scales) {
    for (const panel of this.each) {
      const row = costs.rows.find((/** @type {any} */ r) => r.panel === panel.name);
      if (row) panel.showCosts(row, scales);
    }
  }

  /** Frames for a workload that was run. @param {any} winner `undefined`: none was run @param {any[]} rows */
  showRanks(winner, rows) {
    for (const panel of this.each) panel.showRank(winner, rows);
  }

  /** What they show as canvases with headings and meters, in three columns, for a picture. */
  canvases() {
    this.paint();
    const drawn = this.each.map(portrait);
    return [0, 1, 2].map((column) => [drawn[column], drawn[column + 3]]);
  }
}
