// @ts-check
import { el } from "../ui/controls.js";
import { button, Player } from "../ui/player.js";

/** Steps per picture. */
const SPEEDS = [1, 5, 20, 50, 100, 200, 500, 1000, 2000];
/** Playing pauses after so many steps: what the named seeds show, they show by then. */
const REST = 20_000;

/** The strip below the pictures: play and step the fit. */
export class Steps {
  /**
   * @param {{step: (n: number) => Promise<unknown>, restart: () => void, ontoggle: (playing: boolean) =>
   *   void}} o
   */
  constructor({ step, restart, ontoggle }) {
    /** Steps since the channels or the optimizer were changed last. */
    this.inPhase = 0;
    const one = () => this.#ask(1);
    const many = () => this.#ask(this.player.speed);
    const again = () => (this.player.pause(), restart());
    this.step = async (/** @type {number} */ n) => {
      await step(n);
      this.inPhase += n;
      if (this.inPhase % REST === 0) this.player.pause();
    };
    this.more = button("radiance-more", "+50", "As many steps as a picture has (,)", many);
    this.player = new Player({
      id: "radiance-",
      label: "Steps a picture",
      speeds: SPEEDS.map((s) => [s, String(s)]),
      speed: 50,
      keys: { ".": one, ",": many, Home: again },
      onspeed: (speed) => void (this.more.textContent = `+${speed}`),
      due: (_, speed) => Math.min(speed, REST - (this.inPhase % REST)),
      step: this.step,
      ontoggle,
    });
    this.text = el("output", { id: "radiance-at", "aria-live": "off" });
    this.node = el(
      "div",
      { class: "strip" },
      this.player.button,
      button("radiance-step", "+1", "One step (.)", one),
      this.more,
      button("radiance-restart", "Start over", "The same start again (Home)", again),
      this.text,
      this.player.speeds,
      el("label", { for: "radiance-speed" }, "steps a picture"),
    );
  }

  /** @param {number} n */
  #ask(n) {
    this.player.pause();
    this.player.ask(() => this.step(n));
  }

  /**
   * Shows where the engine is.
   * @param {{steps: number}[]} phases
   * @param {number} made steps of the last answer
   * @param {number} seconds that they took
   */
  show(phases, made, seconds) {
    this.inPhase = phases[phases.length - 1].steps;
    const all = phases.reduce((n, p) => n + p.steps, 0);
    const each = made > 0 && seconds > 0 ? ` · ${((1e6 * seconds) / made).toFixed(1)} µs a step` : "";
    this.text.textContent = `step ${all.toLocaleString("en").replaceAll(",", "\u202f")}${each}`;
  }
}
