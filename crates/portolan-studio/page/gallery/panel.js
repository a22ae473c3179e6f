// @ts-check
import { Canvas2d } from "../canvas2d/canvas2d.js";
import { el } from "../ui/controls.js";
import { bytes } from "../ui/units.js";
import { time, times } from "./format.js";

/** Meters of a panel, memory and then times. @type {[string, string][]} */
const METERS = [
  ["memory", "memory"],
  ["update", "update"],
  ["occupancy", "occupancy?"],
  ["distance", "distance?"],
  ["surface", "surface?"],
];

/** One representation: its picture, and meters of what it costs. */
export class Panel {
  /**
   * @param {{name: string, title: string, label: string, meter: import("../ui/meter.js").Meter}} o `name`: in
   *   the engine's answers
   */
  constructor({ name, title, label, meter }) {
    this.name = name;
    this.title = title;
    this.canvas2d = new Canvas2d({ id: `gallery-${name}`, label, meter });
    this.badge = el("span", { class: "badge", id: `gallery-${name}-badge` });
    this.answer = el("p", { class: "answer", id: `gallery-${name}-answer` });
    this.canvas2d.node.append(this.answer);
    this.meters = METERS.map(([key, text]) => this.#meter(key, text));
    this.node = el(
      "article",
      { class: "panel", id: `gallery-panel-${name}`, "aria-label": title },
      el("h2", {}, title, this.badge),
      this.canvas2d.node,
      el("dl", { class: "meters" }, ...this.meters.flatMap((m) => [m.head, m.row])),
    );
  }

  /** @param {string} key @param {string} text */
  #meter(key, text) {
    const bar = el("i", { style: "width: 0" });
    const value = el("output", { id: `gallery-${this.name}-${key}` }, "–");
    const by = el("span", { class: "note" });
    const head = el("dt", { "data-meter": key }, text, by);
    const track = el("span", { class: "track", "aria-hidden": "true" }, bar);
    const row = el("dd", { "data-meter": key }, track, value);
    return { key, bar, value, by, head, row };
  }

  /**
   * Bars over their scales.
   * @param {any} row of the costs
   * @param {{memory: [number, number], time: [number, number]}} scales powers of ten
   */
  showCosts(row, scales) {
    for (const { key, bar, value, by, head } of this.meters) {
      if (key === "memory") {
        bar.style.width = widthOf(row.memory_bytes, scales.memory);
        value.textContent = `${row.derived ? "+" : ""}${bytes(row.memory_bytes)}`;
        value.title = head.title = row.derived ? "on top of the TSDF" : "";
        continue;
      }
      const cost = row[key];
      bar.style.width = widthOf(cost?.seconds ?? 0, scales.time);
      value.textContent = cost ? time(cost.seconds) : "–";
      value.title = head.title = cost ? (cost.by ?? "") : "cannot answer";
      by.textContent = cost?.by ? ` ${cost.by}` : "";
    }
  }

  /**
   * The frame and badge for a workload that was run.
   * @param {any} winner `undefined`: none was run
   * @param {any[]} rows of the costs
   */
  showRank(winner, rows) {
    const own = rows.flatMap((r, i) => (r.panel === this.name ? [i] : []));
    const wins = winner !== undefined && own.includes(winner.row);
    const level = winner !== undefined && !wins && own.some((i) => winner.level.includes(i));
    this.node.classList.toggle("winner", wins);
    this.node.classList.toggle("level", level);
    for (const m of this.meters) m.head.classList.toggle("asked", m.key === winner?.workload);
    if (winner === undefined || own.length === 0) this.badge.textContent = "";
    else if (wins) this.badge.textContent = "fastest";
    else this.badge.textContent = level ? "level with it" : behind(winner, rows[own[0]], own[0]);
  }
}

/** The width of a bar. @param {number} value @param {[number, number]} ends powers of ten */
function widthOf(value, [low, high]) {
  const share = value > 0 ? (Math.log10(value) - low) / (high - low) : 0;
  return `${Math.max(value > 0 ? 1 : 0, Math.min(100, 100 * share)).toFixed(1)}%`;
}

/** How far a row is behind, in words. @param {any} winner @param {any} row @param {number} i */
function behind(winner, row, i) {
  const cost = row[winner.workload];
  if (!cost) return "– cannot answer";
  return winner.times[i] === null ? `${time(cost.seconds)} more` : `${times(winner.times[i])} slower`;
}
