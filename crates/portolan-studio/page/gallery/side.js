// @ts-check
import { choice, el, facts, group } from "../ui/controls.js";
import { bytesOf, time, timeOf, whole } from "./format.js";
import { cloudPanel, costTable, errorTable, fieldTable, treePanel } from "./tables.js";
import { ofFusion, verdict } from "./words.js";

/**
 * What can be asked of a map: name in the engine, on the button, as a question.
 * @type {[string, string, string][]}
 */
export const WORKLOADS = [
  ["occupancy", "Occupancy", "Is this point occupied?"],
  ["distance", "Distance", "How far is the nearest surface?"],
  ["surface", "Surface", "Where are the surfaces, as lines?"],
];
const PROBES = ["10000", "30000", "100000", "300000"];

/** Buttons that run workloads, and who was fastest. */
export class WorkloadPanel {
  /** @param {{run: (workload: string) => void, changed: () => void}} o */
  constructor({ run, changed }) {
    this.probes = choice({
      id: "gallery-probes",
      label: "Points to ask at",
      value: "100000",
      options: PROBES.map((n) => [n, whole(Number(n))]),
      onchange: changed,
    });
    this.buttons = WORKLOADS.map(([name, text, title]) => {
      const button = { type: "button", id: `gallery-run-${name}`, "aria-pressed": "false", title };
      return el("button", { ...button, onclick: () => run(name) }, text);
    });
    this.result = el("p", { id: "gallery-result", role: "status" });
    this.measured = el("p", { class: "note", id: "gallery-measured" });
    this.scale = el("p", { class: "note", id: "gallery-scale" });
    const row = el("div", { class: "row", role: "group", "aria-label": "Workload" }, ...this.buttons);
    const notes = [this.result, this.measured, this.scale];
    this.node = el(
      "div",
      { class: "group" },
      el("h2", {}, "Run a workload"),
      row,
      this.probes.node,
      ...notes,
    );
  }

  /** @param {any} winner @param {any[]} rows @param {string | undefined} ran the workload */
  showResult(winner, rows, ran) {
    WORKLOADS.forEach(([name], i) => this.buttons[i].setAttribute("aria-pressed", String(name === ran)));
    this.result.textContent = winner ? verdict(winner, rows) : "";
  }

  /** @param {{memory: [number, number], time: [number, number]}} scales powers of ten */
  showScales({ memory, time }) {
    const ends = (/** @type {[number, number]} */ [a, b], /** @type {(power: number) => string} */ f) =>
      `${f(a)} to ${f(b)}`;
    const [bytes, seconds] = [ends(memory, bytesOf), ends(time, timeOf)];
    this.scale.textContent = `Bars are logarithmic: memory from ${bytes}, times from ${seconds}.`;
  }

  /** @param {string} workload @param {number} n points @param {number} seconds */
  showMeasured(workload, n, seconds) {
    const asked =
      workload === "surface"
        ? "three extractions each, the median counts"
        : `five rounds of ${whole(n)} points (${whole(Math.ceil(n / 50))} for searches), the median counts`;
    this.measured.textContent = `Measured now in ${time(seconds)}: ${asked}.`;
  }

  /** What was measured when the view was opened. @param {number} n points */
  showFirst(n) {
    const points = `${whole(n)} points, ${whole(n / 50)} for searches`;
    this.measured.textContent = `First look: ${points}. Run a workload to measure it now.`;
  }

  /** @returns {Record<string, string>} */
  link() {
    return this.probes.value === "100000" ? {} : { probes: this.probes.value };
  }

  /** @param {URLSearchParams} link */
  restore(link) {
    const probes = link.get("probes") ?? "";
    if (PROBES.includes(probes)) this.probes.value = probes;
  }
}

/** What the representations were made of. */
export class MadePanel {
  constructor() {
    this.facts = facts([
      ["gallery-log", "log"],
      ["gallery-scans", "scans"],
      ["gallery-cells", "cells"],
      ["gallery-truncation", "truncation"],
      ["gallery-clamp", "clamp W_max"],
      ["gallery-fused", "sweep, weights"],
      ["gallery-seconds", "built and measured in"],
    ]);
    this.note = el("p", { class: "note", id: "gallery-moved" });
    this.node = group("Made of", this.facts.node, this.note);
    this.log = "";
  }

  /** @param {any} body of an answer */
  show(body) {
    const { settings, log, scans, lap } = body.of;
    const { shape, resolution } = body.picture.grid;
    this.log = log;
    this.facts.set({
      "gallery-log": log,
      "gallery-scans": `${whole(scans)} of ${whole(Math.max(lap, scans))}`,
      "gallery-cells": `${shape[0]} × ${shape[1]}, ${(100 * resolution).toFixed(1)} cm`,
      "gallery-truncation": `${settings.truncation.toFixed(2)} m`,
      "gallery-clamp": settings.w_max === null ? "none" : String(settings.w_max),
      "gallery-fused": `${settings.sweep}, ${settings.weights}`,
      "gallery-seconds": time(body.seconds),
    });
    this.note.textContent = ofFusion(body);
  }
}

/** Where a tree takes less memory than an array: the formula, and trees fused with other leaves. */
export class TreesPanel {
  /** @param {() => void} measure */
  constructor(measure) {
    this.tree = treePanel();
    const button = { type: "button", id: "gallery-trees-run", onclick: measure };
    this.button = el("button", button, "Measure leaves from 1.75 to 10 cm");
    this.note = el("p", { class: "note", id: "gallery-trees-note" });
    const { words, out, curve } = this.tree;
    const row = el("div", { class: "row" }, this.button);
    this.node = group("Where a tree breaks even", words, out, row, this.note, curve.node);
  }

  /** @param {any} constants */
  show(constants) {
    this.tree.show(constants);
    this.note.textContent = "";
  }

  /** @param {any} body of an answer about trees */
  showSizes({ sizes, every }) {
    this.tree.sizes(sizes);
    this.note.textContent =
      `Lines: the formula; dots: trees fused just now${every > 1 ? ` of one scan in ${every}` : ""}. ` +
      "Orange: 20 bytes a node, as in the textbook; blue: ours, 9 bytes an inner node. Below the dashed 1 " +
      "a tree is the smaller one. A tree is refined along the border of what was never seen, too, which " +
      "the formula leaves out.";
  }
}

/** Tables of errors and costs. */
export class TablesPanel {
  constructor() {
    const scroll = () => el("div", { class: "scroll" });
    this.errors = scroll();
    this.costs = scroll();
    this.fields = scroll();
    this.errorNote = el("p", { class: "note" });
    this.cloud = cloudPanel();
    this.nodes = [
      group("The cloud against the ESDF", this.cloud.words, this.cloud.curve.node),
      group("How wrong", this.errors, this.errorNote),
      group("All that was measured", this.costs),
      group("Three ways to the ESDF", this.fields),
    ];
  }

  /** What does not depend on time. @param {any} body */
  show({ picture, truth_and_trees: { fields, tsdf_gradient } }) {
    this.errorNote.textContent =
      picture.truth === null
        ? "The truth is unknown for a recorded log."
        : "Occupancy: share of wrong answers more than half a cell from a surface. Distance and surface: " +
          "median / 95 % of the error in mm. " +
          `Median ‖∇D‖ of the truncated field: ${tsdf_gradient?.toFixed(3) ?? "–"}.`;
    this.fields.replaceChildren(fieldTable(fields));
  }

  /** @param {any} costs */
  showCosts(costs) {
    this.errors.replaceChildren(errorTable(costs));
    this.costs.replaceChildren(costTable(costs));
    this.cloud.show(costs.cloud);
  }
}
