// @ts-check
import { el, group } from "./controls.js";
import { saveAnswer } from "./files.js";

const FILES = [
  ["esdf", "esdf.bin"],
  ["contour", "contour.geojson"],
  ["map", "map.portolan"],
];

/**
 * Files of the 2-D map, to save.
 * @param {string} id prefix of the ids of the buttons
 * @param {import("../views/view.js").App} app
 */
export function exportPanel(id, { engine, fail }) {
  const save = (/** @type {string} */ file) =>
    engine.ask("fusion", { op: "export", file }).then(saveAnswer, fail);
  const button = (/** @type {string[]} */ [file, name]) =>
    el("button", { type: "button", id: `${id}export-${file}`, onclick: () => save(file) }, name);
  return group("Take away", el("div", { class: "row" }, ...FILES.map(button)));
}
