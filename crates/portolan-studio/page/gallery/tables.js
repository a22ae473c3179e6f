// @ts-check
import { el } from "../ui/controls.js";
import { plot } from "../ui/plot.js";
import { bytes } from "../ui/units.js";
import { millimetres, time, whole } from "./format.js";

/**
 * A table of texts.
 * @param {string} id
 * @param {string} label
 * @param {string[]} head
 * @param {string[][]} lines
 */
function table(id, label, head, lines) {
  return el(
    "table",
    { id, "aria-label": label },
    el("thead", {}, el("tr", {}, ...head.map((t) => el("th", { scope: "col" }, t)))),
    el(
      "tbody",
      {},
      ...lines.map(([first, ...rest]) =>
        el("tr", {}, el("th", { scope: "row" }, first), ...rest.map((t) => el("td", {}, t))),
      ),
    ),
  );
}

/** All rows with all costs. @param {any} costs */
export function costTable(costs) {
  const cost = (/** @type {any} */ c) => (c ? time(c.seconds) : "–");
  return table(
    "gallery-costs",
    "What every representation costs",
    ["", "memory", "update", "occ.", "dist.", "surf."],
    costs.rows.map((/** @type {any} */ r) => [
      r.name,
      `${r.derived ? "+" : ""}${bytes(r.memory_bytes)}`,
      cost(r.update),
      cost(r.occupancy),
      cost(r.distance),
      cost(r.surface),
    ]),
  );
}

/** How wrong answers are. @param {any} costs */
export function errorTable(costs) {
  const both = (/** @type {any} */ e) => (e ? `${millimetres(e.median)} / ${millimetres(e.p95)}` : "–");
  return table(
    "gallery-errors",
    "How wrong the answers are",
    ["", "wrong", "distance", "surface", "foretold"],
    costs.rows.map((/** @type {any} */ r) => [
      r.name,
      r.occupancy_wrong === null ? "–" : `${(100 * r.occupancy_wrong).toFixed(2)} %`,
      both(r.distance_error),
      both(r.surface_error),
      r.foretold === null ? "–" : `${(100 * r.foretold.within_10_cm).toFixed(1)} %`,
    ]),
  );
}

/** The three ways to a distance field. @param {any[]} fields */
export function fieldTable(fields) {
  return table(
    "gallery-fields",
    "Three ways to the Euclidean field",
    ["", "rebuild", "off the contour", "off the truth", "‖∇d‖"],
    fields.map((f) => [
      f.name,
      time(f.seconds),
      millimetres(f.against_contour?.median),
      millimetres(f.against_truth?.median),
      f.gradient === null ? "–" : f.gradient.toFixed(3),
    ]),
  );
}

/** The formula, its numbers, and what is measured of trees. */
export function treePanel() {
  const words = el("p", { id: "gallery-tree-words" });
  const out = el("div");
  const curve = plot({
    id: "gallery-tree-plot",
    label:
      "Bytes of a quadtree over those of a dense array, by the size of the leaves: the formula's lines and " +
      "what was measured",
    height: 190,
    x: "edge of a leaf (cm)",
    y: "tree ÷ array",
    series: [
      { label: "1", color: "muted", dashed: true, width: 1 },
      { label: "20 B a node, formula", color: "negative" },
      { label: "20 B a node, measured", color: "negative", points: true, width: 0 },
      { label: "ours, formula", color: "positive" },
      { label: "ours, measured", color: "positive", points: true, width: 0 },
    ],
  });
  curve.node.hidden = true;
  return {
    words,
    out,
    curve,
    /** @param {any} constants */
    show(constants) {
      curve.node.hidden = true;
      const { area, surface, surface_known: known, trees } = constants;
      words.replaceChildren(
        el("span", { class: "formula" }, "r* = V ∕ (b · c · S)"),
        ` with V = ${area.toFixed(0)} m² of area, S = ${surface.toFixed(1)} m of ` +
          `${known ? "true surface" : "extracted contour"}, c = 2 in 2-D, b bytes a node. ` +
          "With leaves smaller than r* a tree takes less than a byte a cell: bytes of the tree over those " +
          "of the dense array fall below 1.",
      );
      out.replaceChildren(
        table(
          "gallery-trees",
          "Where a tree breaks even",
          ["", "r* cm", "leaf cm", "formula", "measured"],
          trees.map((/** @type {any} */ t) => [
            t.name,
            (100 * t.predicted_resolution).toFixed(2),
            (100 * t.resolution).toFixed(2),
            t.predicted_ratio.toFixed(2),
            t.measured_ratio.toFixed(2),
          ]),
        ),
      );
    },
    /** Trees of other leaves. @param {any[]} sizes */
    sizes(sizes) {
      const ascending = [...sizes].reverse();
      const of = (/** @type {number} */ k, /** @type {string} */ what) => [
        0,
        ...ascending.map((p) => p[k][what]),
      ];
      const measured = (/** @type {number} */ k) => [null, ...ascending.map((p) => p[k].measured_ratio)];
      curve.node.hidden = false;
      curve.set([
        of(0, "resolution").map((r) => 100 * r),
        of(0, "resolution").map(() => 1),
        of(0, "predicted_ratio"),
        measured(0),
        of(1, "predicted_ratio"),
        measured(1),
      ]);
    },
  };
}

/** The cloud against the ESDF. */
export function cloudPanel() {
  const words = el("p", { id: "gallery-cloud-words", class: "note" });
  const curve = plot({
    id: "gallery-cloud-plot",
    label: "Time of a distance query by the number of points of the cloud, and of the Euclidean field",
    height: 150,
    x: "points of the cloud (power of ten)",
    y: "ns a query",
    series: [
      { label: "cloud", color: "beam", points: true },
      { label: "ESDF", color: "positive", dashed: true },
    ],
  });
  return {
    words,
    curve,
    /** @param {any} cloud */
    show(cloud) {
      const { points, measured, esdf_seconds: esdf } = cloud;
      words.textContent =
        points === null
          ? "Its distance query beats the ESDF's at every size measured."
          : points === 0
            ? "Its distance query loses to the ESDF's from the first point on."
            : `Its distance query loses to the ESDF's from about ${whole(points)} points on.`;
      curve.set([
        measured.map((/** @type {number[]} */ m) => Math.log10(m[0])),
        measured.map((/** @type {number[]} */ m) => 1e9 * m[1]),
        measured.map(() => 1e9 * esdf),
      ]);
    },
  };
}
