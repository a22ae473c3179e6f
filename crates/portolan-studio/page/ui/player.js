// @ts-check
import { el } from "./controls.js";

/**
 * @typedef {object} Options
 * @property {string} id prefix of the ids of its controls
 * @property {[number, string][]} speeds each with its name
 * @property {number} speed the first one
 * @property {string} label of the list of speeds
 * @property {(playing: boolean) => void} ontoggle
 * @property {Record<string, () => void>} keys besides Space, `<` and `>`
 * @property {(speed: number) => void} [onspeed]
 * @property {(seconds: number, speed: number, idle: boolean) => number | null} [due] how many steps to ask
 *   for now, `seconds` after the last picture; 0 to wait, `null` at the end. Left out: the view runs a loop
 *   of its own
 * @property {(n: number) => Promise<unknown>} [step]
 */

/** Play, pause and speed. It asks one question at a time and waits for the answer before it asks again. */
export class Player {
  /** @param {Options} options */
  constructor(options) {
    this.options = options;
    this.playing = false;
    this.busy = false;
    /**
     * The latest of the questions that came while another was being answered.
     * @type {(() => Promise<unknown>) | undefined}
     */
    this.waiting = undefined;
    this.drawn = 0;
    const { id, speeds, speed, label } = options;
    this.button = button(`${id}play`, "Play", "Play or pause (Space)", () => this.toggle());
    this.button.setAttribute("aria-pressed", "false");
    const list = speeds.map(([value, name]) => el("option", { value }, name));
    this.speeds = el("select", { id: `${id}speed`, "aria-label": label }, ...list);
    this.speeds.value = String(speed);
    this.speeds.onchange = () => options.onspeed?.(this.speed);
  }

  get speed() {
    return Number(this.speeds.value);
  }

  /** A speed that is not in the list is passed over. */
  set speed(value) {
    if (this.options.speeds.some(([v]) => v === value)) this.speeds.value = String(value);
    this.options.onspeed?.(this.speed);
  }

  /** @param {number} by */
  faster(by) {
    const last = this.speeds.options.length - 1;
    this.speeds.selectedIndex = Math.max(0, Math.min(last, this.speeds.selectedIndex + by));
    this.options.onspeed?.(this.speed);
  }

  toggle() {
    this.playing = !this.playing;
    this.button.textContent = this.playing ? "Pause" : "Play";
    this.button.setAttribute("aria-pressed", String(this.playing));
    this.options.ontoggle(this.playing);
    if (!this.playing || !this.options.due) return;
    this.drawn = performance.now();
    requestAnimationFrame(this.#tick);
  }

  /** Plays for who has just come, but not for who has asked their system for less motion. */
  arrive() {
    if (!this.playing && !matchMedia("(prefers-reduced-motion: reduce)").matches) this.toggle();
  }

  pause() {
    if (this.playing) this.toggle();
  }

  /** Asks now, or after the answer that is awaited. @param {() => Promise<unknown>} question */
  async ask(question) {
    if (this.busy) {
      this.waiting = question;
      return;
    }
    this.busy = true;
    try {
      await question();
    } catch {
      this.pause();
    } finally {
      this.busy = false;
    }
    const next = this.waiting;
    this.waiting = undefined;
    if (next) this.ask(next);
  }

  #tick = (/** @type {number} */ now) => {
    const { due, step } = this.options;
    if (!this.playing || !due || !step) return;
    requestAnimationFrame(this.#tick);
    const seconds = (now - this.drawn) / 1000;
    this.drawn = now;
    const n = due(seconds, this.speed, !this.busy);
    if (n === null) this.pause();
    else if (n >= 1 && !this.busy) this.ask(() => step(n));
  };

  /** @param {KeyboardEvent} event @returns {boolean} whether it was a key of the player */
  key(event) {
    /** @type {Record<string, () => void>} */
    const actions = {
      ...this.options.keys,
      " ": () => this.toggle(),
      "<": () => this.faster(-1),
      ">": () => this.faster(1),
    };
    actions[event.key]?.();
    return event.key in actions;
  }
}

/** @param {string} id @param {string} text @param {string} label @param {() => void} onclick */
export function button(id, text, label, onclick) {
  return el("button", { type: "button", id, title: label, "aria-label": label, onclick }, text);
}
