// @ts-check
import { el, facts, group } from "../ui/controls.js";
import { plot } from "../ui/plot.js";

const number = (/** @type {number | null} */ v, /** @type {number} */ digits = 2) =>
  v === null ? "–" : v.toFixed(digits);

/** The ghost of the chair: measured beside predicted. @param {{move: () => void, toCell: () => void}} o */
export function chairPanel({ move, toCell }) {
  const here = el(
    "button",
    { type: "button", id: "chair-to-cell", title: "M", onclick: toCell, disabled: true },
    "To the chosen cell",
  );
  const numbers = facts([
    ["ghost-measured", "half-life measured (obs.)"],
    ["ghost-predicted", "half-life predicted (obs.)"],
    ["ghost-off", "apart"],
    ["ghost-cells", "cells the prediction is for"],
    ["ghost-unclamped", "cells not yet at W_max"],
    ["ghost-tapered", "cells behind a surface"],
    ["ghost-laps", "laps since"],
  ]);
  const curve = plot({
    id: "ghost-curve",
    label: "Error that is left in the ghost's cells against re-observations",
    x: "re-observations of a cell",
    y: "error left",
    height: 150,
    series: [{ label: "median over cells", color: "chair", width: 2 }],
  });
  const text = el(
    "p",
    { class: "note", id: "ghost-note" },
    "Drag the chair anywhere, or press the button: the map believes in the old one until enough scans have contradicted it.",
  );
  const details = el("div", { class: "group", hidden: true }, numbers.node, curve.node);
  return {
    node: group(
      "Move the chair",
      text,
      el(
        "div",
        { class: "row" },
        el("button", { type: "button", id: "move-chair", onclick: move }, "Move the chair"),
        here,
      ),
      details,
    ),
    /** Whether there is a cell to put it on. @param {boolean} yes */
    canGoToCell(yes) {
      here.disabled = !yes;
    },
    /** @param {any} ghost as the engine tells it; `null`: nothing was moved */
    show(ghost) {
      details.hidden = !ghost;
      if (!ghost) return;
      const { measured: m, unclamped: u, tapered: t } = ghost;
      const off =
        m.half_life_measured !== null && m.half_life_predicted
          ? `${(100 * Math.abs(m.half_life_measured / m.half_life_predicted - 1)).toFixed(1)} %`
          : "–";
      const others = (/** @type {any} */ g) =>
        g.cells ? `${g.cells}: ${number(g.half_life_measured)} obs.` : "none";
      numbers.set({
        "ghost-measured":
          m.half_life_measured === null
            ? m.cells
              ? `not yet (${m.halved} of ${m.cells} cells)`
              : "–"
            : number(m.half_life_measured),
        "ghost-predicted": m.half_life_predicted === null ? "–" : number(m.half_life_predicted),
        "ghost-off": off,
        "ghost-cells": `${m.cells} of ${ghost.cells}`,
        "ghost-unclamped": others(u),
        "ghost-tapered": others(t),
        "ghost-laps": number(ghost.laps),
      });
      curve.set(
        m.curve.length
          ? [
              m.curve.map((/** @type {number[]} */ p) => p[0]),
              m.curve.map((/** @type {number[]} */ p) => p[1]),
            ]
          : [[], []],
      );
      text.textContent = m.cells
        ? "The prediction ln 2 / ln(1 + w / W_max) is for cells that were saturated when the chair went and have only been seen as free since."
        : "No cell of the old place was saturated when the chair went, or none has been seen again yet: a smaller W_max, or more laps before.";
    },
    redraw: () => curve.redraw(),
  };
}
