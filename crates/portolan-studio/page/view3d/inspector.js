// @ts-check
import { el, facts, group } from "../ui/controls.js";
import { plot } from "../ui/plot.js";

/** Metres with a sign, to a tenth of a millimetre. @param {number | null | undefined} v */
const metres = (v) =>
  v === null || v === undefined ? "unknown" : `${v >= 0 ? "+" : "−"}${Math.abs(v).toFixed(4)} m`;
/** @param {number[]} p */
const place = (p) => p.map((v) => v.toFixed(3)).join(", ");

/** What stands for values of the ESDF while frames are fused. */
const PAUSED = "updated when paused";

/** One voxel: what all maps know of it, and what its filter did frame by frame. */
export class Inspector {
  constructor() {
    this.facts = facts([
      ["voxel-cell", "Voxel"],
      ["voxel-center", "Center (m)"],
      ["voxel-distance", "TSDF D"],
      ["voxel-weight", "Weight W"],
      ["voxel-status", "Status"],
      ["voxel-occupancy", "Occupancy"],
      ["voxel-esdf", "ESDF distance"],
      ["voxel-interval", "certified"],
      ["voxel-color", "Color"],
      ["voxel-truth", "Truth"],
    ]);
    this.last = facts([
      ["event-frame", "Frame"],
      ["event-prior", "Prior D"],
      ["event-observation", "Observation d"],
      ["event-gain", "Gain K"],
      ["event-posterior", "Posterior D"],
      ["event-weight", "W after"],
    ]);
    this.plot = plot({
      id: "voxel-plot",
      label: "Observations and estimate of the voxel, frame by frame",
      x: "frame",
      y: "metres",
      series: [
        { label: "observation d", color: "beam", points: true, width: 0 },
        { label: "estimate D", color: "accent", steps: true, width: 2 },
      ],
    });
    this.hint = el(
      "p",
      { class: "note", id: "voxel-hint" },
      "Click the surface or the slice, or press Enter for the middle of the picture. " +
        "X, Y, Z step to the next voxel, with Shift to the one before.",
    );
    this.note = el("p", { class: "note", id: "voxel-note" });
    this.events = el("div", {}, el("h2", {}, "Its filter, the last update"), this.last.node, this.plot.node);
    this.body = el(
      "div",
      { class: "group", style: "padding-top:0;border:0" },
      this.facts.node,
      this.note,
      this.events,
    );
    this.node = group("Voxel", this.hint, this.body);
    this.clear();
  }

  clear() {
    this.body.hidden = true;
    this.plot.set([[], [], []]);
  }

  /** What is known now. @param {any} v */
  show(v) {
    if (!v) return this.clear();
    this.body.hidden = false;
    const o = v.occupancy;
    const e = v.esdf;
    this.facts.set({
      "voxel-cell": v.cell.join(", "),
      "voxel-center": place(v.center),
      "voxel-distance": metres(v.distance),
      "voxel-weight": v.weight === null ? "—" : v.weight.toFixed(2),
      "voxel-status": v.status,
      "voxel-occupancy": !o
        ? "not in this map"
        : o.probability === null
          ? "unknown"
          : `${o.occupied ? "occupied" : "free"}, P ${o.probability.toFixed(3)}`,
      "voxel-esdf": !e ? PAUSED : e.distance === null ? e.status : `${metres(e.distance)}, ${e.status}`,
      "voxel-interval": !e
        ? PAUSED
        : e.lower === null
          ? e.interval
          : `${e.lower.toFixed(4)} … ${e.upper === null ? "∞" : e.upper.toFixed(4)} m`,
      "voxel-color": v.color ? `${v.color.rgb.join(", ")} (W ${v.color.weight.toFixed(1)})` : "none",
      "voxel-truth": metres(v.truth),
    });
    if (v.history !== undefined) this.showHistory(v.history, v.recorded);
    if (v.trouble) this.note.textContent = v.trouble;
  }

  /**
   * What scans did to it.
   * @param {any} history
   * @param {boolean} [recorded] whether there are frames at all
   */
  showHistory(history, recorded = true) {
    const events = history?.events ?? [];
    const last = events.at(-1);
    this.events.hidden = events.length === 0;
    this.note.textContent = recorded
      ? progress(history)
      : "This map was read from a file, without its frames.";
    if (!last) return;
    const [frame, before, , d, gain, after, weight] = last;
    this.last.set({
      "event-frame": String(frame + 1),
      "event-prior": metres(before),
      "event-observation": metres(d),
      "event-gain": gain.toFixed(4),
      "event-posterior": metres(after),
      "event-weight": weight.toFixed(3),
    });
    this.plot.set([
      events.map((/** @type {any[]} */ e) => e[0] + 1),
      events.map((/** @type {any[]} */ e) => e[3]),
      events.map((/** @type {any[]} */ e) => e[5]),
    ]);
  }
}

/** How many frames observed the voxel, or how far the search for them is. @param {any} history */
function progress(history) {
  if (history && history.looked_at !== null)
    return `Fusing frames again to see what they did: ${history.looked_at} of ${history.to_look_at}.`;
  const n = history?.events.length ?? 0;
  return n === 0 ? "No frame has observed it." : `${n} of the frames observed it.`;
}
