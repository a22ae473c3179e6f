// @ts-check
import { calmly, el } from "../ui/controls.js";
import { Player } from "../ui/player.js";

/** @type {[number, string][]} */
const SPEEDS = [
  ...[2, 5, 10, 30].map((s) => /** @type {[number, string]} */ ([s, `${s} frames/s`])),
  [Infinity, "as fast as possible"],
];

/** The strip below the map: play, step and scrub through the frames of the log. */
export class Frames {
  /** @param {import("./state.js").Core} core */
  constructor(core) {
    this.core = core;
    /** Most pieces of the mesh that were to come since all were there. */
    this.largest = 0;
    this.player = new Player({
      id: "3d-",
      label: "Speed",
      speeds: SPEEDS,
      speed: Infinity,
      keys: {},
      ontoggle: (playing) => this.#toggled(playing),
    });
    const button = (/** @type {string} */ id, /** @type {string} */ title, /** @type {string} */ text) =>
      el("button", { type: "button", id: `3d-${id}`, title }, text);
    this.next = button("step", "N", "Step");
    this.start = button("restart", "Home", "To start");
    this.scrub = el("input", {
      type: "range",
      id: "3d-frame",
      min: 0,
      max: 0,
      step: 1,
      value: 0,
      "aria-label": "Frame",
    });
    this.at = el("output", { for: "3d-frame", id: "3d-at" });
    const speed = el(
      "div",
      { class: "row control" },
      el("label", { for: "3d-speed" }, "Speed"),
      this.player.speeds,
    );
    this.node = el(
      "div",
      { class: "strip" },
      this.player.button,
      this.next,
      this.start,
      this.scrub,
      this.at,
      speed,
    );
    this.next.onclick = () => this.seek(core.state.at + 1);
    this.start.onclick = () => this.seek(0);
    const seek = calmly((/** @type {number} */ frame) => this.seek(frame), 120);
    this.scrub.oninput = () => (this.player.pause(), seek(Number(this.scrub.value)));
  }

  /** @param {boolean} playing */
  #toggled(playing) {
    const { state, app, drive } = this.core;
    if (playing) {
      // At the end it plays from the beginning.
      state.goal = state.at >= state.frames ? 0 : null;
      app.meter.reset();
    }
    drive();
  }

  /** Goes to where so many frames are fused, and stays there. @param {number} frame */
  seek(frame) {
    this.player.pause();
    this.core.state.seek(frame);
    this.core.drive();
  }

  /** A map that was read from a file has no frames. */
  enable() {
    const none = this.core.state.frames === 0;
    for (const control of [this.player.button, this.next, this.start, this.scrub]) control.disabled = none;
  }

  show() {
    const { at, frames, goal, body } = this.core.state;
    const { pending } = body.mesh;
    this.largest = pending > 0 ? Math.max(this.largest, pending) : 0;
    this.scrub.max = String(frames);
    if (document.activeElement !== this.scrub || goal === null) this.scrub.value = String(at);
    const drawn = `drawn ${Math.floor(100 * (1 - pending / this.largest))} %`;
    if (pending > 0) this.at.textContent = frames ? `${at} fused, ${drawn}` : drawn;
    else this.at.textContent = frames ? `${at} of ${frames}` : "";
  }

  /** @param {KeyboardEvent} event @returns {boolean} whether it was one of its keys */
  key(event) {
    /** @type {Record<string, () => void>} */
    const actions = {
      " ": () => this.core.state.frames > 0 && this.player.toggle(),
      n: () => this.next.click(),
      Home: () => this.start.click(),
      End: () => this.seek(this.core.state.frames),
    };
    const action = actions[event.key] ?? actions[event.key.toLowerCase()];
    action?.();
    return action !== undefined;
  }
}
