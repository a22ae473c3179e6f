// @ts-check
import { legend } from "../ui/controls.js";
import { length, time } from "./format.js";

/** Who wins, in a sentence. @param {any} winner @param {any[]} rows */
export function verdict(winner, rows) {
  const names = winner.level.map((/** @type {number} */ i) => rows[i].name);
  const spent = rows[winner.row][winner.workload].seconds;
  if (spent === 0) return `${names[0]}: it is the answer already.`;
  const level = names.length > 1 ? ` Level with it (within 1.3 times): ${names.slice(1).join("; ")}.` : "";
  const ahead = winner.ahead === null ? "" : ` The next takes ${winner.ahead.toFixed(1)} times as long.`;
  return `${names[0]} answers fastest, in ${time(spent)}.${level}${ahead}`;
}

/** What there is to know of where the maps come from. @param {any} body */
export function ofFusion({ of, picture }) {
  return [
    "The scans and settings are those of Fusion: change them there.",
    of.settings.carve ? "" : "Here the TSDF carves free space, though Fusion does not now.",
    of.moved ? "The chair was moved: the truth is as it is now." : "",
    picture.every > 1 ? `Of the cloud one point in ${picture.every} is drawn.` : "",
  ]
    .filter(Boolean)
    .join(" ");
}

/**
 * Powers of ten around all values.
 * @param {number[]} values
 * @param {[number, number]} otherwise
 * @returns {[number, number]}
 */
export function decades(values, otherwise) {
  if (values.length === 0) return otherwise;
  const logs = values.map(Math.log10);
  const low = Math.floor(Math.min(...logs) - 0.05);
  return [low, Math.max(low + 1, Math.ceil(Math.max(...logs)))];
}

/** What each representation answers, in words. @param {any} a @returns {Record<string, string>} */
export function answersOf(a) {
  const chance = (/** @type {number | null} */ p) =>
    p === null ? "never observed" : `occupied ${(100 * p).toFixed(1)} %`;
  const far = (/** @type {number | null} */ d) => (d === null ? "unknown" : length(d));
  const truth = a.truth === null ? "" : `; true ${far(a.truth)}`;
  const side = a.contour.inside === null ? "" : a.contour.inside ? "inside, " : "outside, ";
  return {
    grid: `${chance(a.grid.occupied)}; ring search ${far(a.grid.searched)}`,
    tree: chance(a.tree.occupied),
    tsdf:
      a.tsdf.weight === null ? "never observed" : `D ${far(a.tsdf.distance)}, W ${a.tsdf.weight.toFixed(1)}`,
    esdf: `d ${a.esdf.distance === null ? a.esdf.status : far(a.esdf.distance)}${truth}`,
    contour: `${side}${far(a.contour.distance)} away`,
    cloud: `nearest point ${far(a.cloud.distance)}`,
  };
}

/** @param {boolean} truth */
export function legendOf(truth) {
  return legend([
    { color: "", text: "free … occupied", ramp: "linear-gradient(90deg, var(--paper), var(--ink))" },
    { color: "unknown", text: "never observed" },
    {
      color: "",
      text: "distance below … above zero",
      ramp: "linear-gradient(90deg, var(--negative), transparent, var(--positive))",
    },
    { color: "positive", text: "borders of leaves" },
    { color: "contour", text: "contour" },
    { color: "beam", text: "end points" },
    ...(truth ? [{ color: "truth", text: "truth", dashed: true }] : []),
  ]);
}
