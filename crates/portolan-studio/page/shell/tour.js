// @ts-check
import { el } from "../ui/controls.js";
import { byId } from "./status.js";

/** @typedef {{view: string, at: string, text: string, simulated?: boolean}} Stop `at`: the id of what is looked at */

/** @type {Stop[]} */
const STOPS = [
  {
    view: "fusion",
    at: "fusion-canvas",
    text:
      "Scans are fused one by one. Orange is behind a surface, blue in front of it, gray was never seen. " +
      "Space stops and goes on.",
  },
  {
    view: "fusion",
    at: "cell",
    text: "Click a wall in the picture. Then look here: what this one cell believed, observed and believes now.",
  },
  {
    view: "fusion",
    at: "move-chair",
    simulated: true,
    text: "Press this while scans play. The old chair fades at the rate that theory predicts.",
  },
  {
    view: "clearance",
    at: "clearance-canvas",
    text: "Move the pointer: nothing is inside of the circle. Click twice, and the path is certified or not.",
  },
  {
    view: "clearance",
    at: "probe-table",
    text: "The distance there, and the bounds that it is certified to lie in.",
  },
  {
    view: "gallery",
    at: "tab-gallery",
    text: "The same scans in six representations. Run a workload on the right, and see which of them wins it.",
  },
  {
    view: "3d",
    at: "3d-canvas",
    text: "Drag to go round, scroll to go nearer, click the surface: the voxel's filter is on the right.",
  },
];

/** A walk through the views, which can be left at any stop. */
export class Tour {
  /** @param {import("./shell.js").Shell} shell @param {boolean} simulated whether the 2-D world is simulated */
  constructor(shell, simulated) {
    this.shell = shell;
    this.stops = STOPS.filter((stop) => simulated || !stop.simulated);
    this.at = -1;
    this.text = el("p", { id: "tour-text" });
    this.count = el("span", { class: "note" });
    const button = (
      /** @type {string} */ id,
      /** @type {string} */ text,
      /** @type {() => void} */ onclick,
    ) => el("button", { type: "button", id, onclick }, text);
    this.back = button("tour-back", "Back", () => this.go(this.at - 1));
    this.next = button("tour-next", "Next", () => this.go(this.at + 1));
    const buttons = el(
      "span",
      {},
      this.back,
      " ",
      this.next,
      " ",
      button("tour-leave", "Leave", () => this.go(-1)),
    );
    this.card = el(
      "aside",
      { id: "tour", "aria-label": "Tour", hidden: true },
      this.text,
      el("div", { class: "row" }, this.count, buttons),
    );
    this.card.onkeydown = (event) => {
      if (event.key !== "Escape") return;
      event.stopPropagation();
      this.go(-1);
    };
    document.body.append(this.card);
  }

  /** Goes to a stop; before the first and after the last the tour is left. @param {number} i */
  async go(i) {
    const { stops } = this;
    document.querySelector(".toured")?.classList.remove("toured");
    const stop = stops[i];
    this.at = stop ? i : -1;
    this.card.hidden = !stop;
    if (!stop) return;
    this.text.textContent = stop.text;
    this.count.textContent = `${i + 1} of ${stops.length}`;
    this.back.disabled = i === 0;
    this.next.textContent = i + 1 < stops.length ? "Next" : "Done";
    this.next.focus();
    const view = this.shell.views.find((v) => v.id === stop.view);
    if (view && view !== this.shell.current) await this.shell.choose(view);
    // Another stop may have been gone to meanwhile.
    if (this.at !== i) return;
    const seen = byId(stop.at);
    seen?.classList.add("toured");
    seen?.scrollIntoView({ block: "nearest" });
  }
}
