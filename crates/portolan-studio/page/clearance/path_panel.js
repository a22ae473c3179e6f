// @ts-check
import { el, facts, slider } from "../ui/controls.js";
import { plot } from "../ui/plot.js";

/** Why a path is refused, by the word of the engine. @type {Record<string, string>} */
const CAUSES = {
  "too near": "a surface is nearer than the robot's radius",
  "unknown space": "unknown space is nearer than the robot's radius",
  "outside of the map": "it leaves the map",
  undecided: "the bounds lie on both sides of the radius",
};
const VERDICTS = ["certified", "violated", "undecided"];
const PROFILE = [
  { label: "at least", color: "accent", fill: true },
  { label: "at most", color: "muted", dashed: true },
  { label: "demanded, certified", color: "good", width: 3 },
  { label: "demanded, violated", color: "bad", width: 3 },
  { label: "demanded, not certifiable", color: "warn", width: 3 },
];

const metres = (/** @type {number | null} */ v) =>
  v === null ? "no bound" : `${v.toFixed(v < 10 ? 3 : 2)} m`;

/** The path: the robot's radius, buttons that edit it, its verdict, and the profile of its clearance. */
export class PathPanel {
  /**
   * @param {{radius: number, setRadius: (v: number) => void, undo: () => void, clear: () => void, drive: ()
   *   => void, draw: (on: boolean) => void}} o `drive`: takes the driven way
   */
  constructor(o) {
    this.radius = slider({
      id: "robot-radius",
      label: "Robot's radius",
      min: 0,
      max: 1,
      step: 0.01,
      value: o.radius,
      format: (v) => `${v.toFixed(2)} m`,
      oninput: o.setRadius,
    });
    const button = (
      /** @type {string} */ id,
      /** @type {string} */ text,
      /** @type {string} */ title,
      /** @type {() => void} */ onclick,
    ) => el("button", { type: "button", id: `path-${id}`, title, onclick }, text);
    this.draw = button("draw", "Draw", "Draw by dragging (D)", () => {
      const on = this.draw.getAttribute("aria-pressed") !== "true";
      this.draw.setAttribute("aria-pressed", String(on));
      o.draw(on);
    });
    this.draw.setAttribute("aria-pressed", "false");
    this.undo = button("undo", "Undo", "Remove the last waypoint (Backspace)", o.undo);
    this.clear = button("clear", "Clear", "Remove all (Esc)", o.clear);
    this.drive = button("way", "Driven way", "The way on which the map was made (W)", o.drive);
    this.hint = el("p", { class: "note", id: "path-hint" });
    this.verdict = el("p", { id: "path-verdict", "aria-live": "polite" });
    this.plot = plot({
      id: "path-profile",
      label: "Clearance along the path: lower and upper bound, and what is demanded",
      x: "along the path (m)",
      y: "clearance (m)",
      height: 170,
      series: PROFILE,
    });
    this.facts = facts([
      ["path-length", "length"],
      ["path-certified", "certified"],
      ["path-violated", "violated"],
      ["path-undecided", "not certifiable"],
      ["path-least", "least clearance"],
    ]);
    const result = { class: "group", id: "path-found", hidden: true };
    this.result = el("div", result, this.verdict, this.plot.node, this.facts.node);
    const buttons = el("div", { class: "row" }, this.draw, this.undo, this.clear, this.drive);
    const heading = el("h2", {}, "Path");
    this.node = el("div", { class: "group" }, heading, this.radius.node, buttons, this.hint, this.result);
    this.count(0);
  }

  /** How many waypoints there are. @param {number} n */
  count(n) {
    this.undo.disabled = this.clear.disabled = n === 0;
    if (n === 0) this.hint.textContent = "Click to set waypoints, or press Enter where the probe is.";
    else if (n === 1) this.hint.textContent = "One waypoint; a second makes a path.";
    else this.hint.textContent = `${n} waypoints. Drag them, or a leg to bend it.`;
    if (n === 0) this.result.hidden = true;
  }

  /** @param {import("../engine/engine.js").Answer} answer */
  show({ body, arrays }) {
    this.result.hidden = false;
    const { check, lengths } = body;
    const bad = check.cause === "too near" ? "bad" : "warn";
    this.verdict.className = `verdict ${check.certified ? "good" : bad}`;
    this.verdict.textContent = check.certified
      ? `Certified: no point of it comes nearer than ${body.clearance.toFixed(2)} m.`
      : `Not certified from ${check.from.toFixed(2)} m on: ${CAUSES[check.cause] ?? check.cause}.`;
    this.facts.set({
      "path-length": metres(body.length),
      "path-certified": metres(lengths.certified),
      "path-violated": metres(lengths.violated),
      "path-undecided": metres(lengths.undecided),
      "path-least": check.certified ? `${metres(check.lower)} to ${metres(check.upper)}` : "–",
    });
    this.#showProfile(body, arrays);
  }

  /** @param {any} body @param {any} arrays */
  #showProfile({ pieces, clearance }, { at, lower, upper }) {
    const finite = (/** @type {number} */ v) => (Number.isNaN(v) ? null : v);
    /** @type {(number | null)[][]} */
    const demand = VERDICTS.map(() => []);
    let k = 0;
    for (const s of at) {
      while (k + 1 < pieces.length && s >= pieces[k].to) k++;
      for (const [i, verdict] of VERDICTS.entries())
        demand[i].push(pieces[k].verdict === verdict ? clearance : null);
    }
    this.plot.set([Array.from(at), Array.from(lower, finite), Array.from(upper, finite), ...demand]);
  }
}
