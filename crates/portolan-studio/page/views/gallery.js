// @ts-check
import { Picture } from "../gallery/layers.js";
import { Panels } from "../gallery/panels.js";
import { Pointer } from "../gallery/pointer.js";
import { MadePanel, TablesPanel, TreesPanel, WorkloadPanel, WORKLOADS } from "../gallery/side.js";
import { decades, legendOf } from "../gallery/words.js";
import { el } from "../ui/controls.js";
import { compose } from "../ui/picture.js";

/** @type {[string, string][]} */
const KEYS = [
  ["O D S", "run occupancy, distance, surface"],
  ["X", "ask at the middle of the picture, and stop"],
  ["Arrows", "move all pictures"],
  ["+ − 0", "larger, smaller, all"],
];

const currentTheme = () => document.documentElement.dataset.theme;

/** The same log in every representation: what each costs, and what each answers. @implements {Shown} */
export class Gallery {
  /** @param {HTMLElement} root @param {App} app */
  constructor(root, app) {
    this.app = app;
    this.keys = KEYS;
    /** @type {Picture | undefined} */
    this.picture2d = undefined;
    /** Number of the map that is shown. @type {number | null} */
    this.revision = null;
    /** The workload that was run last. @type {string | undefined} */
    this.ran = undefined;
    this.busy = false;
    /** The theme that the pictures have the colors of. */
    this.theme = currentTheme();
    this.pointer = new Pointer(this);
    this.panels = new Panels(app.meter, {
      oncamera: () => {
        app.changed();
        if (this.pointer.middle) this.pointer.pointAtMiddle();
      },
      onhover: (p) => void (this.pointer.middle || this.pointer.point(p)),
    });
    this.workloads = new WorkloadPanel({ run: (name) => this.#run(name), changed: app.changed });
    this.made = new MadePanel();
    this.trees = new TreesPanel(() => this.#runTrees());
    this.tables = new TablesPanel();
    this.legend = el("div", { class: "strip" });
    const side = [this.workloads, this.made, this.trees].map((p) => p.node);
    root.append(
      el("div", { class: "field" }, this.panels.node, this.legend),
      el("div", { class: "side" }, ...side, ...this.tables.nodes),
    );
  }

  /** Takes all representations in. @param {import("../engine/engine.js").Answer} answer */
  #take({ body, arrays }) {
    const { panels } = this;
    const first = this.picture2d === undefined;
    this.revision = body.revision;
    this.picture2d = new Picture(body.picture, arrays);
    panels.canvas2d.home = this.picture2d.box();
    if (first) panels.canvas2d.setHome(this.picture2d.box());
    else panels.canvas2d.oncamera();
    panels.show(this.picture2d);
    this.legend.replaceChildren(legendOf(body.picture.truth !== null));
    this.made.show(body);
    this.trees.show(body.truth_and_trees);
    this.tables.show(body);
    this.workloads.showFirst(body.of.probes);
    this.#takeCosts(body.costs);
  }

  /** @param {any} costs */
  #takeCosts(costs) {
    const { rows } = costs;
    const times = rows.flatMap((/** @type {any} */ r) => [r.update, r.occupancy, r.distance, r.surface]);
    const seconds = times.map((/** @type {any} */ cost) => cost?.seconds ?? 0);
    const sizes = rows.map((/** @type {any} */ r) => r.memory_bytes);
    const positive = (/** @type {number} */ v) => v > 0;
    const scales = {
      memory: decades(sizes.filter(positive), [3, 6]),
      time: decades(seconds.filter(positive), [-9, -2]),
    };
    this.panels.showCosts(costs, scales);
    this.workloads.showScales(scales);
    this.tables.showCosts(costs);
    const winner = this.ran && costs.winners.find((/** @type {any} */ w) => w.workload === this.ran);
    this.panels.showRanks(winner || undefined, rows);
    this.workloads.showResult(winner, rows, this.ran);
  }

  /**
   * Asks the engine while the buttons rest; `undefined`: it was refused.
   * @param {string} what
   * @param {object} question
   */
  async #working(what, question) {
    if (this.busy) return undefined;
    const rest = (/** @type {boolean} */ on) => {
      this.busy = on;
      for (const b of [...this.workloads.buttons, this.trees.button]) b.disabled = on;
      if (on) this.panels.node.setAttribute("aria-busy", "true");
      else this.panels.node.removeAttribute("aria-busy");
    };
    rest(true);
    this.app.say(what);
    try {
      return await this.app.engine.ask("gallery", question);
    } catch (error) {
      this.app.fail(error);
      return undefined;
    } finally {
      rest(false);
    }
  }

  async #open() {
    const question = { op: "open", have: this.revision };
    const answer = await this.#working("Building all representations, and measuring …", question);
    if (!answer) return;
    if (!answer.body.picture) return this.app.say("");
    const again = this.ran;
    this.ran = undefined;
    this.app.meter.measure(() => this.#take(answer));
    this.app.say("Zoom one panel and all zoom. Run a workload to see who wins it.");
    if (again) await this.#run(again);
  }

  /** @param {string} workload */
  async #run(workload) {
    const probes = Number(this.workloads.probes.value);
    const answer = await this.#working(`Measuring ${workload} …`, { op: "run", workload, probes });
    if (!answer) return;
    if (answer.body.revision !== this.revision) return this.#open();
    this.ran = workload;
    this.app.meter.measure(() => this.#takeCosts(answer.body.costs));
    this.workloads.showMeasured(workload, probes, answer.body.seconds);
    this.app.say(this.workloads.result.textContent ?? "");
    this.app.changed();
  }

  async #runTrees() {
    const answer = await this.#working("Fusing trees of other leaves …", { op: "trees" });
    if (!answer) return;
    this.trees.showSizes(answer.body);
    this.app.say("");
  }

  /** @param {URLSearchParams} link */
  async show(link) {
    const { panels, pointer } = this;
    if (this.theme !== currentTheme()) this.redraw();
    this.workloads.restore(link);
    await this.#open();
    panels.canvas2d.restore(link);
    if (link.has("at")) panels.canvas2d.oncamera();
    const workload = WORKLOADS.find(([name]) => name === link.get("run"))?.[0];
    if (workload) await this.#run(workload);
    if (link.get("middle") === "1") {
      pointer.middle = true;
      pointer.pointAtMiddle();
    }
    panels.draw();
  }

  hide() {}

  /** @returns {Record<string, string>} */
  state() {
    return {
      ...(this.ran ? { run: this.ran } : {}),
      ...this.workloads.link(),
      ...(this.pointer.middle ? { middle: "1" } : {}),
      ...this.panels.canvas2d.state(),
    };
  }

  picture() {
    const ran = this.ran ? ` · who answers for ${this.ran}` : "";
    return compose(`portolan studio · gallery · ${this.made.log}${ran}`, this.panels.canvases());
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const workload = WORKLOADS.find(([name]) => name[0] === event.key)?.[0];
    if (workload) this.#run(workload);
    else if (event.key === "x") {
      this.pointer.toggleMiddle();
      this.app.changed();
    } else return this.panels.canvas2d.key(event);
    return true;
  }

  redraw() {
    this.theme = currentTheme();
    this.picture2d?.recolor();
    this.trees.tree.curve.redraw();
    this.tables.cloud.curve.redraw();
    this.panels.draw();
  }
}

/**
 * @typedef {import("./view.js").App} App
 * @typedef {import("./view.js").Shown} Shown
 * @type {import("./view.js").View}
 */
export default {
  id: "gallery",
  lead:
    "The same scans in six {representation|representations}, each with what it weighs and what its answers cost: none is best at " +
    "everything, and here you see which is best at what you need.",
  in_3d: false,
  title: "Gallery",
  mount: (root, app) => new Gallery(root, app),
};
