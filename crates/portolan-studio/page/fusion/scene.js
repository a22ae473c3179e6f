// @ts-check
import { Field } from "./field.js";

/**
 * @typedef {{min: [number, number], max: [number, number]}} Box
 * @typedef {{name: string, settings: import("./settings.js").Values, grid: Field["grid"], block: number, lap:
 *   number, truth: {faces: any, chair: Box} | null, moves: [number, [number, number]][]}} All what seldom
 *   changes
 */

/** What is drawn: field and scan of the last answer, and what is chosen on the canvas. */
export class Scene {
  constructor() {
    /** @type {Field | undefined} */
    this.field = undefined;
    this.contour = new Float32Array();
    /** Where each line of the contour begins. */
    this.lines = new Uint32Array([0]);
    this.beams = new Float32Array();
    this.kinds = new Uint8Array();
    /** @type {[number, number, number] | null} */
    this.pose = null;
    /** Of the simulated world. @type {All["truth"]} */
    this.truth = null;
    /** When the chair was moved, and where to. @type {All["moves"]} */
    this.moves = [];
    /** Where the chair stood first. @type {Box | undefined} */
    this.home = undefined;
    /** Where the chair was before it was moved. @type {Box | undefined} */
    this.ghost = undefined;
    /** Where the chair is being dragged to. @type {Box | undefined} */
    this.held = undefined;
    /** Why it cannot be put there. @type {string | null} */
    this.heldRefused = null;
    /** The cell that is followed. @type {[number, number] | undefined} */
    this.cell = undefined;
    this.visible = { beams: true, contour: true, truth: true };
  }

  /** @param {any} body @param {any} arrays of an answer */
  take(body, arrays) {
    if (body.fresh) this.field?.clear();
    this.field?.apply(arrays.blocks, arrays.distance, arrays.weight);
    [this.contour, this.lines] = [arrays.contour, arrays.lines];
    this.beams = arrays.beam_ends ?? new Float32Array();
    this.kinds = arrays.beam_kinds ?? new Uint8Array();
    this.pose = body.pose;
    this.ghost = body.ghost?.old;
  }

  /** @param {All} all @param {Field["shows"]} shows */
  takeAll({ settings, grid, block, truth, moves }, shows) {
    const before = this.field?.grid;
    if (!before || JSON.stringify(before) !== JSON.stringify(grid)) {
      this.field = new Field(grid, block);
      this.field.shows = shows;
      // Another resolution has other cells.
      if (before && before.resolution !== grid.resolution) this.cell = undefined;
    }
    this.truth = truth;
    this.held = undefined;
    this.home ??= truth?.chair;
    this.moves = moves;
    this.field?.setColors(settings.truncation, settings.w_max ?? 256);
  }

  /** Whether a point lies on the chair. @param {[number, number]} p */
  onChair(p) {
    const box = this.truth?.chair;
    return box !== undefined && [0, 1].every((k) => p[k] >= box.min[k] && p[k] <= box.max[k]);
  }

  /** Whether the chair stands where it stood first. */
  get chairAtHome() {
    const [at, home] = [this.truth?.chair, this.home];
    return at && home && Math.hypot(at.min[0] - home.min[0], at.min[1] - home.min[1]) < 1e-9;
  }

  /** Whether there is such a cell. @param {[number, number]} cell */
  has([x, y]) {
    const [w, h] = this.field?.grid.shape ?? [Infinity, Infinity];
    return x >= 0 && y >= 0 && x < w && y < h;
  }
}

/** @param {Box} box @param {number[]} by @returns {Box} */
export function movedBy({ min, max }, [dx, dy]) {
  return { min: [min[0] + dx, min[1] + dy], max: [max[0] + dx, max[1] + dy] };
}

/** @param {Box} box @returns {[number, number]} */
export function middleOf({ min, max }) {
  return [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2];
}
