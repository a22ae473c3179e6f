// @ts-check
import uPlotModule from "../vendor/uPlot.js";
import { colors } from "./theme.js";
import { el } from "./controls.js";

/** The library has no types of its own here. @type {any} */
const uPlot = uPlotModule;

/** A number where there is little room. @param {number} v */
const short = (v) =>
  Math.abs(v) >= 1e6
    ? `${+(v / 1e6).toPrecision(6)}M`
    : Math.abs(v) >= 1e4
      ? `${+(v / 1e3).toPrecision(6)}k`
      : String(+v.toPrecision(6));

/**
 * A plot of lines over one axis, which follows its frame's size and the theme.
 *
 * @param {{id: string, label: string, x: string, y: string, height?: number,
 * series: {label: string, color: string, dashed?: boolean, width?: number, fill?: boolean, points?: boolean,
 * steps?: boolean}[],
 * log?: boolean, yRange?: [number, number], marks?: () => {x: number, text: string}[]}} o `marks`: upright
 * lines, each with a word
 *   beside it; `label` says in words what is plotted; colours by the names of style.css
 */
export function plot(o) {
  const node = el("figure", { class: "plot", id: o.id, role: "img", "aria-label": o.label });
  if (o.height) node.style.height = `${o.height}px`;
  /** @type {any} */
  let made;
  /** @type {(number | null)[][]} */
  let data = [[], ...o.series.map(() => [])];

  function make() {
    made?.destroy();
    const c = colors();
    const axis = (/** @type {string} */ label, /** @type {number} */ size) => ({
      label,
      stroke: c.muted,
      labelSize: 18,
      size,
      font: "11px system-ui, sans-serif",
      labelFont: "11px system-ui, sans-serif",
      values: (/** @type {any} */ _, /** @type {(number | null)[]} */ splits) =>
        splits.map((v) => (v === null ? "" : short(v))),
      grid: { stroke: c["grid-line"], width: 1 },
      ticks: { stroke: c.line, width: 1 },
    });
    made = new uPlot(
      {
        width: Math.max(node.clientWidth, 50),
        height: Math.max(node.clientHeight, 50),
        padding: [8, 10, 0, 0],
        hooks: { draw: [drawMarks] },
        legend: { show: false },
        cursor: { show: true, points: { size: 6 }, drag: { x: false, y: false } },
        scales: {
          x: { time: false },
          y: { ...(o.log ? { distr: 3 } : {}), ...(o.yRange ? { range: o.yRange } : {}) },
        },
        axes: [axis(o.x, 30), axis(o.y, 46)],
        series: [
          {},
          ...o.series.map((s) => ({
            label: s.label,
            stroke: c[s.color],
            width: s.width ?? 1.5,
            dash: s.dashed ? [5, 4] : undefined,
            fill: s.fill ? `${c[s.color]}33` : undefined,
            points: { show: s.points ?? false, size: 4 },
            spanGaps: false,
            paths: s.steps ? uPlot.paths.stepped({ align: 1 }) : undefined,
          })),
        ],
      },
      data,
      node,
    );
  }

  /** @param {any} u */
  function drawMarks(u) {
    const { ctx: g, bbox } = u;
    g.save();
    g.strokeStyle = g.fillStyle = colors().muted;
    g.lineWidth = devicePixelRatio;
    g.font = `${10.5 * devicePixelRatio}px system-ui, sans-serif`;
    g.textBaseline = "top";
    for (const { x, text } of o.marks?.() ?? []) {
      const at = Math.round(u.valToPos(x, "x", true)) + 0.5;
      if (at < bbox.left || at > bbox.left + bbox.width) continue;
      g.setLineDash([3 * devicePixelRatio, 3 * devicePixelRatio]);
      g.beginPath();
      g.moveTo(at, bbox.top);
      g.lineTo(at, bbox.top + bbox.height);
      g.stroke();
      const left = at + g.measureText(text).width > bbox.left + bbox.width;
      g.textAlign = left ? "right" : "left";
      g.fillText(text, at + (left ? -4 : 4) * devicePixelRatio, bbox.top + 2);
    }
    g.restore();
  }

  new ResizeObserver(() => {
    if (node.clientWidth === 0) return;
    if (!made) make();
    else made.setSize({ width: node.clientWidth, height: node.clientHeight });
  }).observe(node);

  return {
    node,
    /**
     * x values, then the values of each line; `null` where there is none.
     * @param {(number | null)[][]} values
     */
    set(values) {
      data = values;
      if (made) made.setData(values);
      else if (node.clientWidth > 0) make();
    },
    /** With the colours of the theme. */
    redraw() {
      if (made) make();
    },
    /** The canvas it is drawn on. @returns {HTMLCanvasElement | null} */
    canvas: () => node.querySelector("canvas"),
  };
}
