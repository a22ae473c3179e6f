// @ts-check
import { el, facts, slider } from "../ui/controls.js";
import { plot } from "../ui/plot.js";

/** What is said of why a path is refused. @type {Record<string, string>} */
const CAUSES = {
  "too near": "a surface is nearer than the robot's radius",
  "unknown space": "unknown space is nearer than the robot's radius",
  "outside of the map": "it leaves the map",
  undecided: "the bounds lie on both sides of the radius",
};

const metres = (/** @type {number | null} */ v) =>
  v === null ? "no bound" : `${v.toFixed(v < 10 ? 3 : 2)} m`;

/**
 * The path: the robot's radius, what may be done to it, what is certified, and the profile.
 * @param {{radius: number, setRadius: (v: number) => void, undo: () => void, clear: () => void, way: () =>
 *   void, draw: (on: boolean) => void}} o
 */
export function pathPanel(o) {
  const radius = slider({
    id: "robot-radius",
    label: "Robot's radius",
    min: 0,
    max: 1,
    step: 0.01,
    value: o.radius,
    format: (v) => `${v.toFixed(2)} m`,
    oninput: o.setRadius,
  });
  const draw = el(
    "button",
    { type: "button", id: "path-draw", "aria-pressed": "false", title: "Draw by dragging (D)" },
    "Draw",
  );
  const undo = el(
    "button",
    { type: "button", id: "path-undo", title: "Remove the last waypoint (Backspace)", onclick: o.undo },
    "Undo",
  );
  const clear = el(
    "button",
    { type: "button", id: "path-clear", title: "Remove all (Esc)", onclick: o.clear },
    "Clear",
  );
  const way = el(
    "button",
    { type: "button", id: "path-way", title: "The way on which the map was made (W)", onclick: o.way },
    "Driven way",
  );
  draw.onclick = () => setDrawing(draw.getAttribute("aria-pressed") !== "true");
  const setDrawing = (/** @type {boolean} */ on) => {
    draw.setAttribute("aria-pressed", String(on));
    o.draw(on);
  };
  const verdict = el("p", { id: "path-verdict", "aria-live": "polite" });
  const numbers = facts([
    ["path-length", "length"],
    ["path-certified", "certified"],
    ["path-violated", "violated"],
    ["path-undecided", "not certifiable"],
    ["path-least", "least clearance"],
  ]);
  const profile = plot({
    id: "path-profile",
    label: "Clearance along the path: lower and upper bound, and what is demanded",
    x: "along the path (m)",
    y: "clearance (m)",
    height: 170,
    series: [
      { label: "at least", color: "accent", fill: true },
      { label: "at most", color: "muted", dashed: true },
      { label: "demanded, certified", color: "good", width: 3 },
      { label: "demanded, violated", color: "bad", width: 3 },
      { label: "demanded, not certifiable", color: "warn", width: 3 },
    ],
  });
  const found = el(
    "div",
    { class: "group", id: "path-found", hidden: true },
    verdict,
    profile.node,
    numbers.node,
  );
  const hint = el("p", { class: "note", id: "path-hint" });
  const node = el(
    "div",
    { class: "group" },
    el("h2", {}, "Path"),
    radius.node,
    el("div", { class: "row" }, draw, undo, clear, way),
    hint,
    found,
  );

  return {
    node,
    radius,
    setDrawing,
    plot: profile,
    toggleDrawing: () => draw.click(),
    /** How many waypoints there are. @param {number} n */
    count(n) {
      undo.disabled = clear.disabled = n === 0;
      hint.textContent =
        n === 0
          ? "Click to set waypoints, or press Enter where the probe is."
          : n === 1
            ? "One waypoint; a second makes a path."
            : `${n} waypoints. Drag them, or a leg to bend it.`;
      if (n === 0) found.hidden = true;
    },
    /** @param {import("../engine/engine.js").Answer} answer */
    show({ body, arrays }) {
      found.hidden = false;
      const { check, lengths, pieces } = body;
      verdict.className = check.certified
        ? "verdict good"
        : check.cause === "too near"
          ? "verdict bad"
          : "verdict warn";
      verdict.textContent = check.certified
        ? `Certified: no point of it comes nearer than ${body.clearance.toFixed(2)} m.`
        : `Not certified from ${check.from.toFixed(2)} m on: ${CAUSES[check.cause] ?? check.cause}.`;
      numbers.set({
        "path-length": metres(body.length),
        "path-certified": metres(lengths.certified),
        "path-violated": metres(lengths.violated),
        "path-undecided": metres(lengths.undecided),
        "path-least": check.certified ? `${metres(check.lower)} to ${metres(check.upper)}` : "–",
      });
      const at = Array.from(arrays.at);
      const finite = (/** @type {number} */ v) => (Number.isNaN(v) ? null : v);
      /** @type {(number | null)[][]} */
      const demand = [[], [], []];
      const names = ["certified", "violated", "undecided"];
      let k = 0;
      for (const s of at) {
        while (k + 1 < pieces.length && s >= pieces[k].to) k++;
        for (const [i, name] of names.entries())
          demand[i].push(pieces[k].verdict === name ? body.clearance : null);
      }
      profile.set([at, Array.from(arrays.lower, finite), Array.from(arrays.upper, finite), ...demand]);
    },
    /** A path that cannot be checked. */
    refused() {
      found.hidden = true;
    },
  };
}
