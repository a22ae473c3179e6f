// @ts-check
import { latest } from "./latest.js";

/** @typedef {import("../views/clearance.js").Clearance} Clearance */

/**
 * What the view asks about the map that it shows. Each kind of question is asked one at a time, the latest
 * next; its answer is taken in within the picture's work.
 */
export class Questions {
  /** @param {Clearance} view */
  constructor(view) {
    this.view = view;
    const { app } = view;
    /** @param {(answer: import("../engine/engine.js").Answer, question: any) => void} take */
    const asker = (take) =>
      latest(
        (/** @type {object} */ question) => this.ask(question),
        (answer, question) => {
          app.meter.measure(() => take(answer, question));
          view.canvas2d.draw();
          view.checkRevision(answer.body.revision);
        },
        app.fail,
      );
    this.askProbe = asker((answer, question) => this.#takeProbe(answer, question));
    this.askRings = asker((answer, question) => this.#takeRings(answer, question));
    this.askArrows = asker((answer, question) => this.#takeArrows(answer, question));
    this.askPath = asker((answer) => this.#takePath(answer));
  }

  /** @param {object} question */
  ask(question) {
    return this.view.app.engine.ask("clearance", question);
  }

  all() {
    this.probe();
    this.rings();
    this.arrows();
    this.path();
  }

  probe() {
    const { map, scene, shown } = this.view;
    if (map && scene.probe) this.askProbe({ op: "probe", at: scene.probe, unknown: shown.unknown });
  }

  rings() {
    const { map, scene, shown } = this.view;
    if (map && scene.visible.rings)
      this.askRings({ op: "rings", field: shown.picture, spacing: shown.spacing });
  }

  /** Arrows where the canvas shows something, 30 pixels apart. */
  arrows() {
    const { map, scene, shown, canvas2d } = this.view;
    const { clientWidth: w, clientHeight: h } = canvas2d.canvas;
    if (!map || !scene.visible.arrows || w === 0) return;
    const camera = canvas2d.camera();
    const bounds = [camera.toWorld(0, h), camera.toWorld(w, 0)];
    this.askArrows({ op: "arrows", field: shown.picture, bounds, spacing: roundUp(30 / camera.scale) });
  }

  path() {
    const { map, scene, shown } = this.view;
    const { waypoints: points, radius: clearance } = scene;
    if (map && points.length > 0) this.askPath({ op: "path", points, clearance, unknown: shown.unknown });
  }

  /** @param {import("../engine/engine.js").Answer} answer @param {any} question */
  #takeProbe({ body }, question) {
    this.view.scene.answer = body;
    this.view.probe.show(body, question.unknown);
    this.view.meter.probe(body);
  }

  /** @param {import("../engine/engine.js").Answer} answer @param {any} question */
  #takeRings({ body, arrays }, question) {
    const { scene, shown, map, still } = this.view;
    if (question.field !== scene.image?.which) return;
    const { points, starts, levels } = /** @type {any} */ (arrays);
    scene.rings = { points, starts, levels, spacing: body.spacing };
    shown.showRings(body, map.truncation);
    still.changed();
  }

  /** @param {import("../engine/engine.js").Answer} answer @param {any} question */
  #takeArrows({ body, arrays }, question) {
    const { scene, still } = this.view;
    if (question.field !== scene.image?.which) return;
    const { points, gradients } = /** @type {any} */ (arrays);
    scene.arrows = { points, gradients, spacing: body.spacing };
    still.changed();
  }

  /** @param {import("../engine/engine.js").Answer} answer */
  #takePath(answer) {
    const { scene, path } = this.view;
    if (scene.waypoints.length === 0) return;
    const { points, starts } = /** @type {any} */ (answer.arrays);
    scene.checked = { points, starts, pieces: answer.body.pieces };
    path.panel.show(answer);
  }
}

/** The next length of 1, 2 or 5 times a power of ten. @param {number} length */
function roundUp(length) {
  const power = 10 ** Math.floor(Math.log10(length));
  return ([1, 2, 5].find((n) => n * power >= length) ?? 10) * power;
}
