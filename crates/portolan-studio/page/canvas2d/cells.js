// @ts-check
import { rgb } from "../ui/theme.js";

/**
 * Cells as an image: one pixel each, drawn sharp. A function of its index gives a cell its color.
 */
export class Cells {
  /**
   * @param {{origin: [number, number], resolution: number, shape: [number, number]}} grid
   */
  constructor(grid) {
    this.grid = grid;
    const [w, h] = grid.shape;
    this.image = new OffscreenCanvas(w, h);
    this.g = /** @type {OffscreenCanvasRenderingContext2D} */ (this.image.getContext("2d"));
    this.pixels = new ImageData(w, h);
    /** One word per cell, RGBA in memory order, rows from the top. */
    this.words = new Uint32Array(this.pixels.data.buffer);
    /** Rows that must be put, [from, to). */
    this.dirty = [h, 0];
  }

  /** Where the word of cell x, y is. @param {number} x @param {number} y */
  at(x, y) {
    return (this.grid.shape[1] - 1 - y) * this.grid.shape[0] + x;
  }

  /** Rows of cells [y0, y1) have changed. @param {number} y0 @param {number} y1 */
  touch(y0, y1) {
    const h = this.grid.shape[1];
    this.dirty = [Math.max(0, Math.min(this.dirty[0], h - y1)), Math.min(h, Math.max(this.dirty[1], h - y0))];
  }

  /** All cells anew. @param {(i: number) => number} word of cell i, x fastest */
  fill(word) {
    const [w, h] = this.grid.shape;
    for (let y = 0, i = 0; y < h; y++)
      for (let x = 0, k = (h - 1 - y) * w; x < w; x++, i++, k++) this.words[k] = word(i);
    this.touch(0, h);
  }

  /** @type {import("./canvas2d.js").Layer} */
  draw = (g, camera) => {
    const { origin, resolution, shape } = this.grid;
    if (this.dirty[0] < this.dirty[1]) {
      this.g.putImageData(this.pixels, 0, 0, 0, this.dirty[0], shape[0], this.dirty[1] - this.dirty[0]);
      this.dirty = [shape[1], 0];
    }
    const [x0, y0] = camera.toScreen(origin[0], origin[1] + shape[1] * resolution);
    // Magnified cells are sharp squares; where several share a pixel they are mixed.
    g.imageSmoothingEnabled = camera.scale * resolution * devicePixelRatio < 1;
    g.drawImage(
      this.image,
      x0,
      y0,
      shape[0] * resolution * camera.scale,
      shape[1] * resolution * camera.scale,
    );
  };
}

/** Red, green, blue, alpha (0 to 255) as a word of an image. */
export const word = (
  /** @type {number} */ r,
  /** @type {number} */ g,
  /** @type {number} */ b,
  /** @type {number} */ a,
) => ((a << 24) | (b << 16) | (g << 8) | r) >>> 0;

/** Steps of a ramp. */
export const STEPS = 256;

/**
 * A diverging ramp over [-1, 1]: one color, transparent zero, the other. Opacity grows with the root of the
 * distance from zero, so that small distances differ from zero.
 * @param {string} negative `#rrggbb`
 * @param {string} positive
 * @param {[number, number]} most opacity at either end, 0 to 1: there is more free space than anything else,
 *   and it should not shout
 */
export function diverging(negative, positive, most = [0.95, 0.5]) {
  const ramp = new Uint32Array(STEPS);
  for (let i = 0; i < STEPS; i++) {
    const v = (2 * i) / (STEPS - 1) - 1;
    const [r, g, b] = rgb(v < 0 ? negative : positive);
    ramp[i] = word(r, g, b, Math.round(255 * most[v < 0 ? 0 : 1] * Math.sqrt(Math.abs(v))));
  }
  return ramp;
}

/** A sequential ramp between two colors. @param {string} from @param {string} to */
export function sequential(from, to) {
  const [a, b] = [rgb(from), rgb(to)];
  const ramp = new Uint32Array(STEPS);
  for (let i = 0; i < STEPS; i++) {
    const mix = (/** @type {number} */ k) => Math.round(a[k] + ((b[k] - a[k]) * i) / (STEPS - 1));
    ramp[i] = word(mix(0), mix(1), mix(2), 255);
  }
  return ramp;
}

/**
 * The step of a value in [low, high]; beyond it the last.
 * @param {number} v
 * @param {number} low
 * @param {number} high
 */
export const step = (v, low, high) =>
  Math.max(0, Math.min(STEPS - 1, Math.round(((v - low) / (high - low)) * (STEPS - 1))));
