// @ts-check
import { el } from "../ui/controls.js";

/** @typedef {import("./shown_panel.js").Field} Which */

/**
 * Rows of the table: id, label, and its text of a field's answer.
 * @type {[string, string, (f: any) => string][]}
 */
const ROWS = [
  ["status", "status", (f) => f.status],
  ["distance", "distance (m)", (f) => metres(f.distance)],
  ["lower", "at least (m)", (f) => metres(f.lower)],
  ["upper", "at most (m)", (f) => (f.upper === null && f.lower > 0 ? "no bound" : metres(f.upper))],
  [
    "gradient",
    "gradient",
    (f) => (f.gradient ? f.gradient.map((/** @type {number} */ v) => v.toFixed(3)).join(", ") : "–"),
  ],
  ["norm", "‖∇d‖", (f) => (typeof f.norm === "number" ? f.norm.toFixed(3) : "–")],
];

const metres = (/** @type {unknown} */ v) => (typeof v === "number" ? v.toFixed(4) : "–");

/** Distance, bounds and gradient of both fields where the probe is. */
export function probePanel() {
  const column = (/** @type {Which} */ which) => ROWS.map(([id]) => el("td", { id: `probe-${which}-${id}` }));
  const cells = { euclidean: column("euclidean"), truncated: column("truncated") };
  const heads = {
    euclidean: el("th", { scope: "col" }, "Euclidean"),
    truncated: el("th", { scope: "col" }, "Truncated"),
  };
  const at = el("output", { id: "probe-at" }, "–");
  const row = el("code", {
    id: "probe-row",
    class: "answer",
    tabindex: 0,
    "aria-label": "The row that query prints",
  });
  const command = el("span", { id: "probe-command" });
  const table = el(
    "table",
    { id: "probe-table" },
    el("thead", {}, el("tr", {}, el("td", {}), heads.euclidean, heads.truncated)),
    el(
      "tbody",
      {},
      ...ROWS.map(([, label], i) =>
        el("tr", {}, el("th", { scope: "row" }, label), cells.euclidean[i], cells.truncated[i]),
      ),
    ),
  );
  const note = el("p", { class: "note", id: "probe-note" });
  const node = el(
    "div",
    { class: "group" },
    el("div", { class: "row" }, el("h2", {}, "Probe"), at),
    table,
    note,
    el(
      "details",
      { id: "probe-query" },
      el("summary", {}, "As ", el("code", {}, "query"), " prints it"),
      el("p", { class: "note" }, "status, occupancy, distance, lower, upper and gradient, with ", command),
      row,
    ),
  );
  return {
    node,
    /** @param {any} answer @param {"optimistic" | "pessimistic"} unknown it was asked with */
    show(answer, unknown) {
      put(at, `${answer.at.map((/** @type {number} */ v) => v.toFixed(3)).join(", ")} m`);
      for (const which of /** @type {Which[]} */ (["euclidean", "truncated"])) {
        for (const [i, [, , text]] of ROWS.entries()) {
          const none = which === "truncated" && i > 1 && i < 4;
          put(cells[which][i], none ? "none" : text(answer[which]));
        }
        cells[which][0].dataset.status = answer[which].status;
      }
      put(row, answer.row);
      const counts = unknown === "pessimistic" ? "and no unknown cell " : "";
      put(
        note,
        `Certified: the surface is no farther than at most; no surface ${counts}is nearer than at least.`,
      );
      put(command, `--unknown ${unknown}`);
    },
    /** Which field is on the picture. @param {Which} which */
    mark(which) {
      for (const w of /** @type {Which[]} */ (["euclidean", "truncated"]))
        heads[w].classList.toggle("shown", w === which);
    },
  };
}

/** @param {HTMLElement} out @param {string} text */
function put(out, text) {
  if (out.textContent !== text) out.textContent = text;
}
