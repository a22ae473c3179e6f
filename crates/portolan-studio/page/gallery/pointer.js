// @ts-check
import { answersOf } from "./words.js";

/** @typedef {[number, number]} Point */

/** Answers of all representations under the pointer: one question at a time, the latest place next. */
export class Pointer {
  /** @param {import("../views/gallery.js").Gallery} view */
  constructor(view) {
    this.view = view;
    /** @type {Point | undefined} */
    this.wanted = undefined;
    this.asking = false;
    /** Whether the middle of the picture is asked about, instead of the pointer. */
    this.middle = false;
  }

  /** @param {Point | undefined} p */
  async point(p) {
    const { view } = this;
    this.wanted = p;
    if (!p) return view.panels.point(undefined, {});
    if (this.asking || view.busy || !view.picture2d) return;
    this.asking = true;
    try {
      while (this.wanted) {
        const at = this.wanted;
        const { body } = await view.app.engine.ask("gallery", { op: "answers", at });
        if (this.wanted) view.app.meter.measure(() => view.panels.point(at, answersOf(body)));
        if (this.wanted === at) break;
      }
    } catch (error) {
      view.app.fail(error);
    }
    this.asking = false;
  }

  pointAtMiddle() {
    this.point(this.view.panels.canvas2d.middle());
  }

  toggleMiddle() {
    this.middle = !this.middle;
    if (this.middle) this.pointAtMiddle();
    else this.point(undefined);
  }
}
