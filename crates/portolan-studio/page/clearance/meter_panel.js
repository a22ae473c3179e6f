// @ts-check
import { el, facts, group, legend } from "../ui/controls.js";
import { plot } from "../ui/plot.js";

/** How long gradients are, over the whole map and at the probe. */
export function meterPanel() {
  const numbers = facts([
    ["median-euclidean", "median, Euclidean"],
    ["median-truncated", "median, truncated"],
    ["norm-euclidean", "at the probe, Euclidean"],
    ["norm-truncated", "at the probe, truncated"],
  ]);
  const histogram = plot({
    id: "norm-histogram",
    label: "How many corners between known cells have a gradient of which length, in both fields",
    x: "‖∇d‖",
    y: "corners (%)",
    height: 150,
    series: [
      { label: "Euclidean", color: "positive", steps: true, fill: true },
      { label: "truncated", color: "negative", steps: true, fill: true },
    ],
  });
  const note = el("p", { class: "note", id: "meter-note" });
  const node = group(
    "‖∇d‖ meter",
    numbers.node,
    legend([
      { color: "positive", text: "Euclidean" },
      { color: "negative", text: "truncated" },
    ]),
    histogram.node,
    note,
  );
  const text = (/** @type {unknown} */ v, digits = 3) => (typeof v === "number" ? v.toFixed(digits) : "–");
  return {
    node,
    plot: histogram,
    /** @param {any} meter */
    show(meter) {
      numbers.set({
        "median-euclidean": text(meter.euclidean.median),
        "median-truncated": text(meter.truncated.median),
      });
      const share = (/** @type {number[]} */ counts) =>
        counts.map((n) => (100 * n) / Math.max(1, meter.corners));
      const edges = meter.euclidean.counts.map(
        (/** @type {number} */ _, /** @type {number} */ i) => i * meter.bin,
      );
      histogram.set([edges, share(meter.euclidean.counts), share(meter.truncated.counts)]);
      note.textContent =
        `At ${meter.corners} corners between known cells. A distance field grows by a metre a metre: 1, ` +
        "except where two surfaces are equally near. A constant has no direction: 0.";
    },
    /** @param {any} answer */
    probe(answer) {
      numbers.set({
        "norm-euclidean": text(answer.euclidean.norm),
        "norm-truncated": text(answer.truncated.norm),
      });
    },
  };
}
