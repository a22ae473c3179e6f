// @ts-check
import { choice, el, facts, group, legend, toggle } from "../ui/controls.js";
import { bytes as inThousands } from "../ui/units.js";

const RAMP =
  "linear-gradient(90deg, var(--negative), transparent, " +
  "color-mix(in srgb, var(--positive) 50%, transparent))";

/** What is shown of map, scan and truth, and in which colors. */
export class ShownPanel {
  /**
   * @param {import("./scene.js").Scene} scene
   * @param {{field: (which: "distance" | "weight") => void, toggled: () => void}} o
   */
  constructor(scene, { field, toggled }) {
    this.field = choice({
      id: "shows",
      label: "Show",
      value: "distance",
      options: [
        ["distance", "signed distance D"],
        ["weight", "weight W"],
      ],
      onchange: (v) => field(v === "weight" ? "weight" : "distance"),
    });
    const shown = (/** @type {"beams" | "contour" | "truth"} */ what, /** @type {string} */ label) =>
      toggle({
        id: `show-${what}`,
        label,
        value: true,
        onchange: (v) => ((scene.visible[what] = v), toggled()),
      });
    const beams = shown("beams", "Beams of the scan");
    const contour = shown("contour", "Extracted contour");
    this.truth = shown("truth", "Truth");
    this.legend = el("div");
    const controls = [this.field.node, beams.node, contour.node, this.truth.node];
    this.node = el("div", { class: "group" }, ...controls, this.legend);
  }

  /** @param {boolean} simulated whether the truth is known */
  setSimulated(simulated) {
    this.truth.node.hidden = !simulated;
    const truth = [
      { color: "truth", text: "truth", dashed: true },
      { color: "chair", text: "chair" },
    ];
    this.legend.replaceChildren(
      legend([
        { color: "", text: "behind, in front of a surface", ramp: RAMP },
        { color: "beam", text: "beams" },
        { color: "contour", text: "contour" },
        ...(simulated ? truth : []),
        { color: "unknown", text: "never observed" },
      ]),
    );
  }
}

/** Numbers of the last scan. */
export class ScanPanel {
  constructor() {
    this.facts = facts([
      ["scan-cells", "cells touched by the scan"],
      ["scan-beams", "beams: hits, free, lost"],
      ["observed", "cells observed"],
      ["map-bytes", "memory of the map"],
      ["step-ms", "computed in"],
      ["under", "under the pointer"],
    ]);
    this.node = group("This scan", this.facts.node);
  }

  /** @param {any} body of an answer */
  show({ beams, observed, bytes, seconds }) {
    this.facts.set({
      "scan-cells": String(beams.cells),
      "scan-beams": `${beams.hit}, ${beams.max_range}, ${beams.no_return + beams.dropped}`,
      observed: String(observed),
      "map-bytes": inThousands(bytes),
      "step-ms": `${(1000 * seconds).toFixed(2)} ms`,
    });
  }

  /** What is under the pointer. @param {{distance: number, weight: number} | undefined} cell */
  showCell(cell) {
    const known = (/** @type {{distance: number, weight: number}} */ { distance, weight }) =>
      weight > 0 ? `D ${distance.toFixed(4)} m, W ${weight.toFixed(1)}` : "never observed";
    this.facts.set({ under: cell ? known(cell) : "–" });
  }
}
