// @ts-check
import { Curves } from "../radiance/curves.js";
import { Explanation } from "../radiance/explain.js";
import { LookPanel, ResidualsPanel } from "../radiance/panels.js";
import { Picture } from "../radiance/picture.js";
import { readRun, replay, writeRun } from "../radiance/link.js";
import { StartPanel } from "../radiance/start.js";
import { Steps } from "../radiance/steps.js";
import { el } from "../ui/controls.js";
import { compose } from "../ui/picture.js";

/** Milliseconds between two drawings of the curves while playing. */
const CALM = 40;

/** @type {[string, string][]} */
const KEYS = [
  ["Space", "play or pause"],
  [". ,", "one step, as many as a picture has"],
  ["Home", "the same start again"],
  ["< >", "slower, faster"],
  ["R", "another start"],
  ["C", "other channels, from the field as it stands"],
  ["← →", "to another bin (with Shift ten further)"],
  ["Enter", "the gradient of that bin"],
  ["W", "the most misplaced bin"],
  ["Esc", "look at no bin"],
  ["↑ ↓", "the light of another ray"],
];

/** A radiance field on a line, fitted to seven rays step by step. @implements {Shown} */
export class Radiance {
  /** @param {HTMLElement} root @param {App} app */
  constructor(root, app) {
    this.app = app;
    this.keys = KEYS;
    /** Answers that came since the last picture. @type {import("../engine/engine.js").Answer[]} */
    this.arrived = [];
    /** The last answer that was taken in. @type {any} */
    this.last = undefined;
    this.opened = false;
    /** When the curves were drawn last. */
    this.plotted = 0;
    /** Counts what was asked for, so that a new wish ends the replay of a link. */
    this.turn = 0;
    this.image = new Picture({ meter: app.meter, before: () => this.#takeIn() });
    this.image.onpick = (bin, ray) => {
      if (ray !== undefined) this.#look({ ray });
      else if (bin !== undefined) this.#look({ bin });
    };
    this.curves = new Curves();
    this.steps = new Steps({
      step: (steps) => (this.turn++, this.ask({ op: "step", steps })),
      restart: () => this.#begin(this.start.seed),
      ontoggle: (playing) => this.#toggled(playing),
    });
    this.start = new StartPanel({ begin: (seed) => this.#begin(seed), goOn: () => this.#goOn() });
    this.looks = new LookPanel((ray) => this.#look({ ray }));
    this.residuals = new ResidualsPanel();
    this.explanation = new Explanation({
      worst: () => this.#lookAtWorst(),
      close: () => this.#look({ bin: null }),
    });
    const panels = [this.start, this.looks, this.residuals, this.explanation].map((p) => p.node);
    root.append(
      el("div", { class: "field" }, this.image.node, this.curves.node, this.steps.node),
      el("div", { class: "side" }, ...panels),
    );
  }

  /** @param {object} question */
  async ask(question) {
    try {
      const answer = await this.app.engine.ask("radiance", question);
      this.arrived.push(answer);
      this.image.draw();
      return answer;
    } catch (error) {
      this.app.fail(error);
      throw error;
    }
  }

  /** Asks; what is refused is in the status line already. @param {object} question */
  async #tryAsk(question) {
    try {
      await this.ask(question);
      this.app.changed();
    } catch {
      // It is in the status line.
    }
  }

  /** Takes in what arrived; part of the picture's work. */
  #takeIn() {
    for (const { body, arrays } of this.arrived.splice(0)) {
      if (body.all) this.#takeAll(body.all, body.seed);
      this.image.fit = { body, arrays: /** @type {any} */ (arrays) };
      this.curves.take(body, /** @type {Float32Array} */ (arrays.curve));
      this.last = body;
    }
    if (this.last) this.#show(this.last);
  }

  /** What seldom changes. @param {any} all @param {number} seed */
  #takeAll(all, seed) {
    this.image.scene = all;
    this.explanation.setNoise(all.noise);
    this.start.show(all.named, seed);
    this.looks.setRays(all.rays);
  }

  /** @param {any} last */
  #show(last) {
    const now = performance.now();
    const { playing } = this.steps.player;
    if (!playing || now - this.plotted > CALM) {
      this.plotted = now;
      this.curves.show(playing);
    }
    const phase = last.phases[last.phases.length - 1];
    this.start.way = phase;
    this.looks.show(last.look.ray);
    this.steps.show(last.phases, last.made, last.seconds);
    this.explanation.take(last.bin, phase.channels);
    this.residuals.show(last);
  }

  /** @param {boolean} playing */
  #toggled(playing) {
    if (playing) return this.app.meter.reset();
    this.app.changed();
    this.image.draw();
  }

  /** A new run from the start of a seed. @param {number} seed */
  async #begin(seed) {
    this.turn++;
    await this.#tryAsk({ op: "start", seed, ...this.start.way });
    const shows = this.image.scene?.named.find((n) => n.seed === seed)?.shows;
    this.app.say(`Seed ${seed}${shows ? `: ${shows}` : ""}.`);
  }

  /** On from the field as it stands, in another way. */
  #goOn() {
    this.turn++;
    this.#tryAsk({ op: "go_on", ...this.start.way });
  }

  /** Looks at another ray or bin. @param {{ray?: number | null, bin?: number | null}} change */
  #look(change) {
    return this.#tryAsk({ op: "look", ray: this.last?.look.ray, bin: this.last?.look.bin, ...change });
  }

  #lookAtWorst() {
    if (this.last?.worst !== null) this.#look({ bin: this.last.worst });
  }

  /** @param {number} by */
  #moveCursor(by) {
    const bins = this.image.scene?.bins ?? 1;
    const from = this.image.cursor ?? this.last?.look.bin ?? 0;
    this.image.cursor = Math.max(0, Math.min(bins - 1, from + by));
    this.image.draw();
  }

  /** @param {number} by */
  #moveRay(by) {
    const count = this.image.scene?.rays.length ?? 1;
    const from = this.last?.look.ray ?? (by > 0 ? -1 : 0);
    this.#look({ ray: (from + by + count) % count });
  }

  /** @param {URLSearchParams} link */
  async show(link) {
    if (!this.opened) {
      this.opened = true;
      const { body } = await this.ask({ op: "open" });
      await this.ask({ op: "look", ray: 1, bin: body.worst });
      this.app.say("Play: gradient descent fits the field to seven rays. Then add reflectance.");
    }
    if (link.has("speed")) this.steps.player.speed = Number(link.get("speed"));
    const run = readRun(link);
    if (run) {
      const number = (/** @type {string} */ key) => (link.has(key) ? Number(link.get(key)) : null);
      await this.ask({ op: "look", ray: number("ray"), bin: number("bin") });
      await replay(this, run);
    }
    this.image.draw();
  }

  hide() {
    this.steps.player.pause();
  }

  /** @returns {Record<string, string>} */
  state() {
    if (!this.last) return {};
    const { ray, bin } = this.last.look;
    return {
      ...writeRun(this.last),
      ...(ray === null ? {} : { ray: String(ray) }),
      ...(bin === null ? {} : { bin: String(bin) }),
      speed: String(this.steps.player.speed),
    };
  }

  picture() {
    this.image.paint();
    const title = `portolan studio · radiance · seed ${this.last?.seed}, step ${this.last?.step}`;
    return compose(title, [[this.image.canvas], this.curves.plots.map((p) => p.canvas())]);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const far = event.shiftKey ? 10 : 1;
    const { cursor } = this.image;
    /** @type {Record<string, () => void>} */
    const actions = {
      ArrowLeft: () => this.#moveCursor(-far),
      ArrowRight: () => this.#moveCursor(far),
      ArrowUp: () => this.#moveRay(-1),
      ArrowDown: () => this.#moveRay(1),
      Enter: () => cursor !== undefined && this.#look({ bin: cursor }),
      Escape: () => this.#look({ bin: null }),
      w: () => this.#lookAtWorst(),
      r: () => this.start.reroll(),
      c: () => this.start.nextChannels(),
    };
    actions[event.key]?.();
    return event.key in actions || this.steps.player.key(event);
  }

  redraw() {
    this.curves.redraw();
    this.image.draw();
  }
}

/**
 * @typedef {import("./view.js").App} App
 * @typedef {import("./view.js").Shown} Shown
 * @type {import("./view.js").View}
 */
export default {
  id: "radiance",
  title: "Radiance",
  lead:
    "Seven rays of light are all that is known of a line; {gradient descent} fits a {density field} to them, and you see why it may " +
    "settle on a wrong one.",
  mount: (root, app) => new Radiance(root, app),
};
