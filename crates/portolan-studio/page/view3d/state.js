// @ts-check

/**
 * What the parts of the view share.
 * @typedef {object} Core
 * @property {import("../views/view.js").App} app
 * @property {State} state
 * @property {import("./stage.js").Stage | null} stage `null`: the browser has no WebGL
 * @property {(question: object) => Promise<import("../engine/engine.js").Answer>} ask
 * @property {() => void} drive asks the engine for what is due
 */

/** The last answer, and what is to be asked for next. */
export class State {
  constructor() {
    /** The last answer about maps and mesh; `null`: there was none yet. @type {any} */
    this.body = null;
    /** What seldom changes: name, settings, lattice, colors. @type {any} */
    this.all = null;
    /** Whether the view is on the page. */
    this.visible = false;
    /** Where the player goes by itself (frames). @type {number | null} */
    this.goal = null;
    /** Settings that are to be set: the run begins again. @type {any} */
    this.settings = null;
    /** What the surface is to be colored by. @type {string | null} */
    this.color = null;
  }

  /** Frames that are fused. */
  get at() {
    return this.body?.at ?? 0;
  }

  get frames() {
    return this.body?.frames ?? 0;
  }

  /** @param {number} frame */
  seek(frame) {
    this.goal = Math.max(0, Math.min(frame, this.frames));
  }

  /** @param {object} change of the settings */
  set(change) {
    this.settings = { ...(this.settings ?? this.all.settings), ...change };
  }
}
