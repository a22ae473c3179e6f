// @ts-check
import { el } from "../ui/controls.js";
import { plot } from "../ui/plot.js";

/**
 * Values of a point: step, objective, then depth, reflectance and second moment of training and held-out
 * rays.
 */
const ROW = 8;

/** What a way of fitting is called where there is little room. @type {Record<string, string>} */
const SHORT = { depth: "depth", reflectance: "+ reflectance", spread: "+ spread" };

/** Residuals and objective over the steps, on logarithmic scales. */
export class Curves {
  constructor() {
    /** @type {number[][]} */
    this.points = [];
    /** @type {{x: number, text: string}[]} */
    this.changes = [];
    this.noise = { depth: 0, reflectance: 0 };
    const marks = () => this.changes;
    const lines = [
      { label: "training rays", color: "beam", width: 2 },
      { label: "held-out rays", color: "contour", width: 2 },
      { label: "noise of a measurement", color: "truth", dashed: true },
    ];
    this.depth = plot({
      id: "radiance-depth",
      label: "Root mean square residual of depth over the steps: training rays, held-out rays, noise",
      x: "step",
      y: "RMS depth (m)",
      height: 178,
      log: true,
      series: lines,
      marks,
    });
    this.reflectance = plot({
      id: "radiance-reflectance",
      label: "Root mean square residual of reflectance over the steps: training rays, held-out rays, noise",
      x: "step",
      y: "RMS reflectance",
      height: 178,
      log: true,
      series: lines,
      marks,
    });
    this.objective = plot({
      id: "radiance-objective",
      label: "Objective over the steps: negative logarithm of the posterior",
      x: "step",
      y: "objective J",
      height: 178,
      log: true,
      series: [{ label: "J", color: "positive", width: 2 }],
      marks,
    });
    /** The plot that is drawn next while playing. */
    this.next = 0;
    this.plots = [this.depth, this.reflectance, this.objective];
    this.node = el("div", { class: "radiance-curves" }, ...this.plots.map((p) => p.node));
  }

  /**
   * Takes an answer in; `show` draws it.
   * @param {any} body @param {Float32Array} values
   */
  take(body, values) {
    if (body.all) this.noise = body.all.noise;
    this.points.length = Math.min(this.points.length, body.curve_from);
    for (let i = 0; i < values.length; i += ROW) this.points.push(Array.from(values.subarray(i, i + ROW)));
    const { training: t, held_out: h } = body;
    this.now = [
      body.step,
      body.objective,
      t.depth,
      t.reflectance,
      t.second_moment,
      h.depth,
      h.reflectance,
      h.second_moment,
    ];
    let at = 0;
    this.changes = body.phases.map((/** @type {any} */ phase) => {
      const change = { x: at, text: SHORT[phase.channels] + (phase.optimizer === "adam" ? ", Adam" : "") };
      at += phase.steps;
      return change;
    });
  }

  /**
   * Draws them; while playing, one at a time: three in one picture are more than a picture has time for.
   * @param {boolean} playing
   */
  show(playing) {
    if (!this.now) return;
    const turn = this.next++ % this.plots.length;
    const due = (/** @type {number} */ k) => !playing || turn === k;
    const rows = [...this.points, this.now];
    // Only positive numbers have a place on a logarithmic plot.
    const column = (/** @type {number} */ k) => rows.map((r) => (r[k] > 0 ? r[k] : null));
    const steps = rows.map((r) => r[0]);
    const level = (/** @type {number} */ v) => rows.map(() => v);
    if (due(0)) this.depth.set([steps, column(2), column(5), level(this.noise.depth)]);
    if (due(1)) this.reflectance.set([steps, column(3), column(6), level(this.noise.reflectance)]);
    if (due(2)) this.objective.set([steps, column(1)]);
  }

  redraw() {
    for (const p of this.plots) p.redraw();
  }
}
