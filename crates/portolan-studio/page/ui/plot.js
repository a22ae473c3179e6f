// @ts-check
import uPlotModule from "../vendor/uPlot.js";
import { colors } from "./theme.js";
import { el } from "./controls.js";

/** The library has no types of its own here. @type {any} */
const uPlot = uPlotModule;

const FONT = "system-ui, sans-serif";

/**
 * @typedef {object} Options
 * @property {string} id
 * @property {string} label what is plotted, in words
 * @property {string} x name of the axis
 * @property {string} y
 * @property {number} [height] pixels
 * @property {Series[]} series
 * @property {boolean} [log] whether y is logarithmic
 * @property {[number, number]} [yRange]
 * @property {() => {x: number, text: string}[]} [marks] upright lines, each with a word beside it
 *
 * A line; colors by the names of style.css.
 * @typedef {{label: string, color: string, dashed?: boolean, width?: number, fill?: boolean, points?:
 *   boolean, steps?: boolean}} Series
 */

/** A plot of lines over one axis, which follows its frame's size and the theme. @param {Options} o */
export function plot(o) {
  const node = el("figure", { class: "plot", id: o.id, role: "img", "aria-label": o.label });
  if (o.height) node.style.height = `${o.height}px`;
  /** @type {any} */
  let drawn;
  /** @type {(number | null)[][]} */
  let data = [[], ...o.series.map(() => [])];

  const size = () => ({ width: Math.max(node.clientWidth, 50), height: Math.max(node.clientHeight, 50) });
  const draw = () => {
    drawn?.destroy();
    drawn = new uPlot({ ...size(), ...looks(o) }, data, node);
  };
  new ResizeObserver(() => {
    if (node.clientWidth === 0) return;
    if (!drawn) draw();
    else drawn.setSize({ width: node.clientWidth, height: node.clientHeight });
  }).observe(node);

  return {
    node,
    /** x values, then the values of each line; `null`: unknown. @param {(number | null)[][]} values */
    set(values) {
      data = values;
      if (drawn) drawn.setData(values);
      else if (node.clientWidth > 0) draw();
    },
    /** With the colors of the theme. */
    redraw() {
      if (drawn) draw();
    },
    /** The canvas it is drawn on. @returns {HTMLCanvasElement | null} */
    canvas: () => node.querySelector("canvas"),
  };
}

/** What the library takes, but for the size. @param {Options} o */
function looks(o) {
  const y = { ...(o.log ? { distr: 3 } : {}), ...(o.yRange ? { range: o.yRange } : {}) };
  return {
    padding: [8, 10, 0, 0],
    hooks: { draw: [(/** @type {any} */ u) => drawMarks(u, o.marks?.() ?? [])] },
    legend: { show: false },
    cursor: { show: true, points: { size: 6 }, drag: { x: false, y: false } },
    scales: { x: { time: false }, y },
    axes: [axis(o.x, 30), axis(o.y, 46)],
    series: [{}, ...o.series.map(line)],
  };
}

/** @param {string} label @param {number} size pixels */
function axis(label, size) {
  const c = colors();
  const texts = (/** @type {any} */ _, /** @type {(number | null)[]} */ splits) => splits.map(short);
  return {
    label,
    size,
    labelSize: 18,
    font: `11px ${FONT}`,
    labelFont: `11px ${FONT}`,
    values: texts,
    stroke: c.muted,
    grid: { stroke: c["grid-line"], width: 1 },
    ticks: { stroke: c.line, width: 1 },
  };
}

/** @param {Series} s */
function line(s) {
  const color = colors()[s.color];
  return {
    label: s.label,
    stroke: color,
    width: s.width ?? 1.5,
    dash: s.dashed ? [5, 4] : undefined,
    fill: s.fill ? `${color}33` : undefined,
    points: { show: s.points ?? false, size: 4 },
    spanGaps: false,
    paths: s.steps ? uPlot.paths.stepped({ align: 1 }) : undefined,
  };
}

/** A number where there is little room. @param {number | null} v */
function short(v) {
  if (v === null) return "";
  if (Math.abs(v) >= 1e6) return `${+(v / 1e6).toPrecision(6)}M`;
  if (Math.abs(v) >= 1e4) return `${+(v / 1e3).toPrecision(6)}k`;
  return String(+v.toPrecision(6));
}

/** @param {any} u the library's plot @param {{x: number, text: string}[]} marks */
function drawMarks(u, marks) {
  const { ctx: g, bbox } = u;
  const ratio = devicePixelRatio;
  g.save();
  g.strokeStyle = g.fillStyle = colors().muted;
  g.lineWidth = ratio;
  g.font = `${10.5 * ratio}px ${FONT}`;
  g.textBaseline = "top";
  for (const { x, text } of marks) {
    const at = Math.round(u.valToPos(x, "x", true)) + 0.5;
    if (at < bbox.left || at > bbox.left + bbox.width) continue;
    g.setLineDash([3 * ratio, 3 * ratio]);
    g.beginPath();
    g.moveTo(at, bbox.top);
    g.lineTo(at, bbox.top + bbox.height);
    g.stroke();
    const left = at + g.measureText(text).width > bbox.left + bbox.width;
    g.textAlign = left ? "right" : "left";
    g.fillText(text, at + (left ? -4 : 4) * ratio, bbox.top + 2);
  }
  g.restore();
}
