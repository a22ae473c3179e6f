// @ts-check
import { Canvas2d } from "../canvas2d/canvas2d.js";
import { ChairPanel } from "../fusion/chair.js";
import { Inspector } from "../fusion/inspector.js";
import { layers } from "../fusion/layers.js";
import { restore, write } from "../fusion/link.js";
import { ScanPanel, ShownPanel } from "../fusion/panels.js";
import { middleOf, movedBy, Scene } from "../fusion/scene.js";
import { Scans } from "../fusion/scans.js";
import { SettingsPanel } from "../fusion/settings.js";
import { latest } from "../clearance/latest.js";
import { el } from "../ui/controls.js";
import { exportPanel } from "../ui/exports.js";
import { compose } from "../ui/picture.js";

/** How far the button moves the chair (metres): there, and back again. */
const CHAIR_MOVE = [1.38, -1.62];

/** @type {[string, string][]} */
const KEYS = [
  ["Space", "play or pause"],
  [". ,", "one scan on, one back"],
  ["Home End", "start, end of the lap"],
  ["< >", "slower, faster"],
  ["Arrows", "move the picture"],
  ["+ − 0", "larger, smaller, all"],
  ["Enter", "follow the cell in the middle"],
  ["W A S D", "the cell above, left, below, right"],
  ["Esc", "follow no cell"],
  ["M", "put the chair on the chosen cell"],
];

/** A log fused in 2-D, scan by scan: the field, a cell's filter, the ghost of a chair. @implements {Shown} */
export class Fusion {
  /** @param {HTMLElement} root @param {App} app */
  constructor(root, app) {
    this.app = app;
    this.scene = new Scene();
    /** Answers that came since the last picture. @type {import("../engine/engine.js").Answer[]} */
    this.arrived = [];
    /** The last answer that was taken in. @type {any} */
    this.last = undefined;
    this.opened = false;
    this.keys = KEYS;
    this.canvas2d = new Canvas2d({
      id: "fusion-canvas",
      label: "The truncated signed distance field while it is fused",
      meter: app.meter,
      before: () => this.takeIn(),
    });
    this.canvas2d.layers = layers(this.scene);
    this.canvas2d.oncamera = app.changed;
    this.scans = new Scans({
      step: (scans) => this.ask({ op: "step", scans }),
      seek: (scan) => this.ask({ op: "seek", scan }).then(app.changed),
      ontoggle: (playing) => playing && app.meter.reset(),
    });
    this.shown = new ShownPanel(this.scene, {
      field: (which) => this.showField(which),
      toggled: () => this.canvas2d.draw(),
    });
    this.inspector = new Inspector({
      move: (dx, dy) => this.#chooseNext(dx, dy),
      close: () => this.choose(undefined),
    });
    this.chair = new ChairPanel({
      move: () => this.#moveChairByButton(),
      toCell: () => this.#moveChairToCell(),
    });
    this.settings = new SettingsPanel((settings) => this.tryAsk({ op: "set", settings }).then(app.changed));
    this.scan = new ScanPanel();
    this.#listen();
    const { canvas2d, scans, shown, inspector, chair, settings, scan } = this;
    const panels = [shown, inspector, chair, settings, scan].map((p) => p.node);
    root.append(
      el("div", { class: "field" }, canvas2d.node, scans.node),
      el("div", { class: "side" }, ...panels, exportPanel("", app)),
    );
  }

  #listen() {
    const { canvas2d, scene, scans } = this;
    canvas2d.onclick = (p) => this.choose(scene.field?.cellAt(p));
    canvas2d.onhover = (p) => {
      const cell = p && scene.field?.cellAt(p);
      this.scan.showCell(cell && scene.field?.at(cell));
    };
    const fits = latest(
      (/** @type {[number, number]} */ to) => this.app.engine.ask("fusion", { op: "chair_fits", to }),
      ({ body }) => {
        scene.heldRefused = body.refused;
        canvas2d.draw();
      },
      this.app.fail,
    );
    canvas2d.ondrag = (from) => {
      const box = scene.truth?.chair;
      if (!box || !scene.onChair(from)) return undefined;
      scans.player.pause();
      return (p, done) => {
        scene.held = movedBy(box, [p[0] - from[0], p[1] - from[1]]);
        fits(middleOf(scene.held));
        canvas2d.draw();
        if (done) this.#moveChair(middleOf(scene.held));
      };
    };
  }

  /** @param {object} question */
  async ask(question) {
    try {
      const answer = await this.app.engine.ask("fusion", question);
      if (answer.body && "at" in answer.body) {
        this.arrived.push(answer);
        this.canvas2d.draw();
      }
      return answer;
    } catch (error) {
      this.app.fail(error);
      throw error;
    }
  }

  /** Asks; what is refused is in the status line already. @param {object} question */
  tryAsk(question) {
    return this.ask(question).catch(() => undefined);
  }

  /** Takes in what arrived; part of the picture's work. */
  takeIn() {
    const answers = this.arrived.splice(0);
    for (const answer of answers) this.#take(answer);
    if (answers.length === 0) return;
    const { last } = this;
    this.scans.show(last.at, last.lap, last.most);
    if (last.inspected || this.scene.cell === undefined) this.inspector.take(last.inspected);
    this.chair.show(last.ghost);
    this.chair.setCellChosen(this.scene.cell !== undefined);
    this.scan.show(last);
    this.settings.showHalfLife(last.half_life);
  }

  /** @param {import("../engine/engine.js").Answer} answer */
  #take({ body, arrays }) {
    if (body.all) this.#takeAll(body.all, body.lap);
    this.scene.take(body, arrays);
    this.last = body;
  }

  /** @param {import("../fusion/scene.js").All} all @param {number} lap scans in it */
  #takeAll(all, lap) {
    const { scene } = this;
    const { grid, truth, name } = all;
    if (!scene.field) {
      const [x, y] = grid.origin;
      const [w, h] = grid.shape;
      this.canvas2d.setHome([x, y, x + w * grid.resolution, y + h * grid.resolution]);
    }
    scene.takeAll(all, /** @type {any} */ (this.shown.field.value));
    this.settings.show(all.settings, truth !== null);
    this.chair.node.hidden = truth === null;
    if (this.last) return;
    this.shown.setSimulated(truth !== null);
    this.app.say(`${name}: ${lap} scans. Play, click a cell${truth ? ", move the chair" : ""}.`);
  }

  /** @param {"distance" | "weight"} which */
  showField(which) {
    if (!this.scene.field) return;
    this.scene.field.shows = which;
    this.#recolor();
    this.app.changed();
  }

  #recolor() {
    const { truncation, w_max } = this.settings.values;
    this.scene.field?.setColors(truncation, w_max ?? 256);
    this.canvas2d.draw();
  }

  /** Follows this cell; `undefined`: none. @param {[number, number] | undefined} cell */
  async choose(cell) {
    const { scene } = this;
    if (cell && !scene.has(cell)) return;
    scene.cell = cell;
    this.chair.setCellChosen(cell !== undefined);
    this.canvas2d.draw();
    const answer = await this.tryAsk({ op: "watch", cell: cell ?? null });
    // Another may have been chosen meanwhile.
    if (answer && scene.cell === cell) this.app.meter.measure(() => this.inspector.take(answer.body));
    this.app.changed();
  }

  /** @param {number} dx @param {number} dy */
  #chooseNext(dx, dy) {
    const { cell } = this.scene;
    if (cell) this.choose([cell[0] + dx, cell[1] + dy]);
  }

  #moveChairByButton() {
    const box = this.scene.truth?.chair;
    if (!box) return;
    const [x, y] = middleOf(box);
    const sign = this.scene.chairAtHome ? 1 : -1;
    this.#moveChair([x + sign * CHAIR_MOVE[0], y + sign * CHAIR_MOVE[1]]);
  }

  #moveChairToCell() {
    const { cell, field } = this.scene;
    if (cell && field) this.#moveChair(field.center(cell));
  }

  /** @param {[number, number]} to middle of the chair */
  async #moveChair(to) {
    const answer = await this.tryAsk({ op: "move_chair", to });
    // Not with the next picture: the link must have the move.
    this.takeIn();
    this.scene.held = undefined;
    this.canvas2d.draw();
    if (answer) this.app.say("The chair was moved. Play on, and watch the ghost fade.");
    this.app.changed();
  }

  /** @param {URLSearchParams} link */
  async show(link) {
    if (!this.opened || link.size > 0) {
      this.opened = true;
      await this.ask({ op: "open" });
      this.takeIn();
      await restore(this, link);
      if (link.has("play")) this.scans.arrive();
    }
    this.canvas2d.draw();
  }

  hide() {
    this.scans.player.pause();
  }

  state() {
    return { ...(this.last ? write(this) : {}), ...this.canvas2d.state() };
  }

  picture() {
    this.canvas2d.paint();
    const title = `portolan studio · fusion · ${this.scans.text.textContent}`;
    return compose(title, [[this.canvas2d.canvas], [this.inspector.plot.canvas()]]);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    /** @type {Record<string, () => void>} */
    const actions = {
      Enter: () => this.choose(this.scene.field?.cellAt(this.canvas2d.middle())),
      Escape: () => this.choose(undefined),
      m: () => this.chair.here.click(),
      w: () => this.#chooseNext(0, 1),
      a: () => this.#chooseNext(-1, 0),
      s: () => this.#chooseNext(0, -1),
      d: () => this.#chooseNext(1, 0),
    };
    actions[event.key]?.();
    return event.key in actions || this.scans.player.key(event) || this.canvas2d.key(event);
  }

  redraw() {
    this.#recolor();
    this.inspector.redraw();
    this.chair.redraw();
  }
}

/**
 * @typedef {import("./view.js").App} App
 * @typedef {import("./view.js").Shown} Shown
 * @type {import("./view.js").View}
 */
export default {
  id: "fusion",
  title: "Fusion",
  lead:
    "A robot fuses its range scans one by one into {signed distance|signed distances}, blue in front of walls and orange " +
    "behind them; every cell runs a {filter} that you can look into, so that you see why a map believes what it believes.",
  in_3d: false,
  mount: (root, app) => new Fusion(root, app),
};
