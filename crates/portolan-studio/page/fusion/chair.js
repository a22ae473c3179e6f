// @ts-check
import { el, facts, group, legend } from "../ui/controls.js";
import { plot } from "../ui/plot.js";

const HINT =
  "Drag the chair anywhere, or press the button: the map keeps the old one until enough scans have " +
  "contradicted it.";
const PREDICTED =
  "Cells that were saturated when the chair was moved and have been seen as free ever since follow from " +
  "the gain, ln 2 / ln(1 + 1 / W_max): arithmetic. What the map makes of the chair is the row of all cells.";
const UNPREDICTED =
  "No cell of the old place was saturated when the chair was moved, or seen again since: choose a " +
  "smaller W_max, or drive more laps before.";

const number = (/** @type {number | null} */ v) => (v === null ? "–" : v.toFixed(2));

/** The ghost of the chair: how soon half of it is gone, over all of its cells and by kind of cell. */
export class ChairPanel {
  /** @param {{move: () => void, toCell: () => void}} o */
  constructor({ move, toCell }) {
    this.here = el(
      "button",
      { type: "button", id: "chair-to-cell", title: "M", onclick: toCell, disabled: true },
      "To the chosen cell",
    );
    this.numbers = facts([
      ["ghost-left", "half gone, all cells left (obs.)"],
      ["ghost-measured", "half-life, saturated cells (obs.)"],
      ["ghost-predicted", "by the gain alone (obs.)"],
      ["ghost-off", "apart"],
      ["ghost-cells", "saturated cells"],
      ["ghost-unclamped", "cells not yet at W_max"],
      ["ghost-tapered", "cells behind a surface"],
      ["ghost-laps", "laps since"],
    ]);
    this.curve = plot({
      id: "ghost-curve",
      label: "Error that is left in the ghost's cells against re-observations",
      x: "re-observations of a cell",
      y: "error left",
      height: 150,
      series: [
        { label: "median over cells", color: "chair", width: 2 },
        { label: "by the gain alone", color: "truth", dashed: true, width: 1.8 },
      ],
    });
    this.text = el("p", { class: "note", id: "ghost-note" }, HINT);
    const lines = legend([
      { color: "chair", text: "measured" },
      { color: "truth", text: "predicted by the gain alone", dashed: true },
    ]);
    this.details = el("div", { class: "group", hidden: true }, this.numbers.node, this.curve.node, lines);
    const button = el("button", { type: "button", id: "move-chair", onclick: move }, "Move the chair");
    this.node = group(
      "Move the chair",
      this.text,
      el("div", { class: "row" }, button, this.here),
      this.details,
    );
  }

  /** @param {boolean} chosen whether there is a cell to put it on */
  setCellChosen(chosen) {
    this.here.disabled = !chosen;
  }

  /** @param {any} ghost of the engine's answer; `null`: the chair was not moved */
  show(ghost) {
    this.details.hidden = !ghost;
    if (!ghost) return;
    const { left, saturated: m, unclamped, tapered } = ghost;
    const waiting = m.cells ? `not yet (${m.halved} of ${m.cells} cells)` : "–";
    const [half, predicted] = [m.half_life_measured, m.half_life_predicted];
    const off = half !== null && predicted ? `${(100 * Math.abs(half / predicted - 1)).toFixed(1)} %` : "–";
    const others = (/** @type {any} */ g) =>
      g.cells ? `${g.cells}: ${number(g.half_life_measured)} obs.` : "none";
    this.numbers.set({
      "ghost-left": others(left),
      "ghost-measured": half === null ? waiting : number(half),
      "ghost-predicted": number(predicted),
      "ghost-off": off,
      "ghost-cells": `${m.cells} of ${ghost.cells}`,
      "ghost-unclamped": others(unclamped),
      "ghost-tapered": others(tapered),
      "ghost-laps": number(ghost.laps),
    });
    const column = (/** @type {number} */ k) => m.curve.map((/** @type {number[]} */ p) => p[k]);
    this.curve.set([column(0), column(1), column(2)]);
    this.text.textContent = m.cells ? PREDICTED : UNPREDICTED;
  }

  redraw() {
    this.curve.redraw();
  }
}
