// @ts-check
import { el, facts, group } from "../ui/controls.js";
import { plot } from "../ui/plot.js";

/**
 * What a scan did to a cell: `[scan, D before, W before, d, K, D after, W after]`.
 * @typedef {[number, number | null, number, number, number, number, number]} Event
 */

const metres = (/** @type {number | null} */ v) => (v === null ? "unknown" : `${v.toFixed(6)} m`);

const HINT = "Click a cell of the field, or press Enter for the one in the middle.";

/** One cell's filter, step by step, and its history. */
export class Inspector {
  /** @param {{move: (dx: number, dy: number) => void, close: () => void}} o */
  constructor({ move, close }) {
    /** @type {Event[]} */
    this.events = [];
    /** The event that is shown; `undefined`: always the last. @type {number | undefined} */
    this.picked = undefined;
    /** @type {any} */
    this.decay = null;
    this.title = el("p", { id: "cell" }, HINT);
    this.facts = facts([
      ["cell-before", "prior D"],
      ["cell-observed", "observation d"],
      ["cell-gain", "gain K = w / (W + w)"],
      ["cell-after", "posterior D = D + K (d − D)"],
      ["cell-weight-before", "weight W before"],
      ["cell-weight", "weight W after"],
      ["cell-scan", "scan"],
    ]);
    const label = "Which observation of the cell";
    this.pick = el("input", {
      type: "range",
      id: "cell-event",
      min: 0,
      max: 0,
      step: 1,
      "aria-label": label,
    });
    this.which = el("output", { for: "cell-event", id: "cell-count" });
    this.pick.oninput = () => {
      const n = Number(this.pick.value);
      this.picked = n === this.events.length - 1 ? undefined : n;
      this.show();
    };
    this.plot = plot({
      id: "cell-history",
      label: "History of the cell: observations, estimate, and the decay that theory predicts",
      x: "observation",
      y: "distance (m)",
      series: [
        { label: "observation d", color: "beam", width: 0, points: true },
        { label: "estimate D", color: "positive", width: 2 },
        { label: "closed form", color: "chair", dashed: true, width: 1.8 },
      ],
    });
    this.note = el("p", { class: "note", id: "cell-decay" });
    const which = el("label", { for: "cell-event" }, "Observation", this.which);
    this.details = el(
      "div",
      { class: "group", hidden: true },
      el("div", { class: "control" }, which, this.pick),
      this.facts.node,
      this.plot.node,
      this.note,
      el(
        "div",
        { class: "row" },
        el("span", { class: "note" }, "Neighbor (W A S D)"),
        neighbors(move, close),
      ),
    );
    this.node = group("A cell's filter", this.title, this.details);
    this.shownAt = 0;
  }

  /** Takes in what is new of the cell; `null`: no cell is followed. @param {any} watched */
  take(watched) {
    if (!watched) {
      this.events = [];
      this.details.hidden = true;
      this.title.textContent = HINT;
      return;
    }
    this.details.hidden = false;
    const added = watched.events.length > 0 || watched.from < this.events.length;
    this.events.length = watched.from;
    this.events.push(...watched.events);
    if (this.picked !== undefined && this.picked >= this.events.length) this.picked = undefined;
    this.decay = watched.decay;
    const [x, y] = watched.center ?? [0, 0];
    const place = `${x.toFixed(3)}, ${y.toFixed(3)}`;
    const text = `Cell ${watched.cell.join(", ")} at (${place}) m: ${this.events.length} observations`;
    if (this.title.textContent !== text) this.title.textContent = text;
    if (added) this.show();
  }

  show() {
    const n = this.picked ?? this.events.length - 1;
    this.pick.max = String(Math.max(0, this.events.length - 1));
    this.pick.value = String(Math.max(0, n));
    this.which.textContent = this.events.length ? `${n + 1} of ${this.events.length}` : "none yet";
    this.pick.setAttribute("aria-valuetext", this.which.textContent);
    const e = this.events[n];
    const none = "–";
    this.facts.set(
      e
        ? {
            "cell-before": metres(e[1]),
            "cell-observed": metres(e[3]),
            "cell-gain": e[4].toFixed(6),
            "cell-after": metres(e[5]),
            "cell-weight-before": e[2].toFixed(4),
            "cell-weight": e[6].toFixed(4),
            "cell-scan": String(e[0] + 1),
          }
        : Object.fromEntries(
            ["before", "observed", "gain", "after", "weight-before", "weight", "scan"].map((k) => [
              `cell-${k}`,
              none,
            ]),
          ),
    );
    // The plot costs more than the numbers, and it need not change sixty times a second.
    if (performance.now() - this.shownAt > 120 || this.picked !== undefined) this.showPlot();
    else {
      clearTimeout(this.later);
      this.later = window.setTimeout(() => this.showPlot(), 130);
    }
  }

  showPlot() {
    this.shownAt = performance.now();
    const { events, decay } = this;
    const closed = events.map(() => /** @type {number | null} */ (null));
    decay?.values.forEach((/** @type {number} */ v, /** @type {number} */ k) => {
      const i = decay.since - 1 + k;
      if (i >= 0 && i < closed.length) closed[i] = v;
    });
    this.plot.set([events.map((_, i) => i + 1), events.map((e) => e[3]), events.map((e) => e[5]), closed]);
    this.note.textContent = decay ? this.#decay() : "";
  }

  /** The closed form, in words. */
  #decay() {
    const { target, lambda, half_life: half, weight, since } = this.decay;
    return (
      `Since the chair was moved: D decays to ${target.toFixed(3)} m with λ = W_max / (W_max + w) = ` +
      `${lambda.toFixed(4)}, half of it in ${half.toFixed(2)} observations of weight ${weight.toFixed(2)} ` +
      `(dashed). It had W = ${this.events[since][2].toFixed(2)} then; below W_max a cell forgets faster ` +
      "than that."
    );
  }

  redraw() {
    this.plot.redraw();
  }
}

/** Buttons to the cells beside. @param {(dx: number, dy: number) => void} move @param {() => void} close */
function neighbors(move, close) {
  const buttons = /** @type {[string, string, () => void][]} */ ([
    ["←", "Cell to the left", () => move(-1, 0)],
    ["↑", "Cell above", () => move(0, 1)],
    ["↓", "Cell below", () => move(0, -1)],
    ["→", "Cell to the right", () => move(1, 0)],
    ["✕", "Follow no cell", close],
  ]);
  const made = buttons.flatMap(([text, title, onclick]) => [
    el("button", { type: "button", "aria-label": title, title, onclick }, text),
    " ",
  ]);
  return el("span", {}, ...made.slice(0, -1));
}
