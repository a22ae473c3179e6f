// @ts-check
import { el, facts, group } from "../ui/controls.js";
import { plot } from "../ui/plot.js";

/** Metres with a sign, to a tenth of a millimetre. @param {number | null | undefined} v */
const metres = (v) =>
  v === null || v === undefined ? "unknown" : `${v >= 0 ? "+" : "−"}${Math.abs(v).toFixed(4)} m`;
/** @param {number[]} p */
const place = (p) => p.map((v) => v.toFixed(3)).join(", ");

/** One voxel: what all maps know of it, and what its filter did frame by frame. */
export class Inspector {
  constructor() {
    this.facts = facts([
      ["voxel-cell", "Voxel"],
      ["voxel-center", "Centre (m)"],
      ["voxel-distance", "TSDF D"],
      ["voxel-weight", "Weight W"],
      ["voxel-status", "Status"],
      ["voxel-occupancy", "Occupancy"],
      ["voxel-esdf", "ESDF distance"],
      ["voxel-interval", "certified"],
      ["voxel-color", "Colour"],
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
      "Click the surface or the slice, or press Enter for the middle of the picture. X, Y, Z step to the next voxel, with Shift back.",
    );
    this.note = el("p", { class: "note", id: "voxel-note" });
    this.events = el("div", {}, el("h2", {}, "Its filter, the last step"), this.last.node, this.plot.node);
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
      "voxel-esdf": !e
        ? "when it rests"
        : e.distance === null
          ? e.status
          : `${metres(e.distance)}, ${e.status}`,
      "voxel-interval": !e
        ? "when it rests"
        : e.lower === null
          ? e.interval
          : `${e.lower.toFixed(4)} … ${e.upper === null ? "∞" : e.upper.toFixed(4)} m`,
      "voxel-color": v.color ? `${v.color.rgb.join(", ")} (W ${v.color.weight.toFixed(1)})` : "none",
      "voxel-truth": v.truth === null ? "not known" : metres(v.truth),
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
    if (!recorded) this.note.textContent = "The map was made before; what its frames did is not kept in it.";
    else if (history?.looked_at !== null && history)
      this.note.textContent = `Fusing frames again to see what they did: ${history.looked_at} of ${history.to_look_at}.`;
    else
      this.note.textContent =
        events.length === 0 ? "No frame has observed it." : `${events.length} of the frames observed it.`;
    if (!last) return;
    const [frame, before, , d, gain, after, weight] = last;
    this.last.set({
      "event-frame": String(frame + 1),
      "event-prior": before === null ? "none" : metres(before),
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
