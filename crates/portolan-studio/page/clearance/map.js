// @ts-check
import { Cells, diverging, step, STEPS, word } from "../canvas2d/cells.js";
import { colors, rgb } from "../ui/theme.js";

/** @typedef {"euclidean" | "truncated" | "pessimistic"} Which */

/**
 * The fields of the map as an image, one of them shown. Cells of which nothing is known are left
 * transparent.
 */
export class FieldImage {
  /** @param {{origin: [number, number], resolution: number, shape: [number, number]}} grid */
  constructor(grid) {
    this.grid = grid;
    this.cells = new Cells(grid);
    /** @type {Record<Which, Float32Array>} */
    this.samples = {
      euclidean: new Float32Array(),
      truncated: new Float32Array(),
      pessimistic: new Float32Array(),
    };
    /** @type {Which} */
    this.which = "euclidean";
    /** Distance at the ends of the ramp (metres), the same for all fields. */
    this.reach = 1;
  }

  /** @param {Which} which */
  show(which) {
    this.which = which;
    this.paint();
  }

  /** All cells in the colors of the theme. */
  paint() {
    const ramp = opaque(diverging(colors().negative, colors().positive, [1, 0.85]));
    const { reach } = this;
    const values = this.samples[this.which];
    this.cells.fill((i) => (Number.isNaN(values[i]) ? 0 : ramp[step(values[i], -reach, reach)]));
  }

  /** The box of the map: x0, y0, x1, y1. @returns {[number, number, number, number]} */
  box() {
    const {
      origin: [x, y],
      resolution: r,
      shape: [w, h],
    } = this.grid;
    return [x, y, x + w * r, y + h * r];
  }

  /**
   * Calm hatching where the map is, and over it what is known.
   * @type {import("../canvas2d/canvas2d.js").Layer}
   */
  draw = (g, camera) => {
    const [x0, y0, x1, y1] = this.box();
    const [left, top] = camera.toScreen(x0, y1);
    g.save();
    g.fillStyle = colors().unknown;
    g.fillRect(left, top, (x1 - x0) * camera.scale, (y1 - y0) * camera.scale);
    const pattern = g.createPattern(hatching(), "repeat");
    if (pattern) {
      g.fillStyle = pattern;
      g.fillRect(left, top, (x1 - x0) * camera.scale, (y1 - y0) * camera.scale);
    }
    g.restore();
    this.cells.draw(g, camera);
  };
}

/** A ramp on paper. @param {Uint32Array} ramp */
function opaque(ramp) {
  const paper = rgb(colors().paper);
  const out = new Uint32Array(STEPS);
  ramp.forEach((w, i) => {
    const a = (w >>> 24) / 255;
    const mix = (/** @type {number} */ shift, /** @type {number} */ k) =>
      Math.round(((w >>> shift) & 255) * a + paper[k] * (1 - a));
    out[i] = word(mix(0, 0), mix(8, 1), mix(16, 2), 255);
  });
  return out;
}

/** @type {{color: string, tile: OffscreenCanvas} | undefined} */
let made;

/** Thin diagonals, 7 pixels apart. */
function hatching() {
  const color = colors().line;
  if (made?.color === color) return made.tile;
  const tile = new OffscreenCanvas(10, 10);
  const g = /** @type {OffscreenCanvasRenderingContext2D} */ (tile.getContext("2d"));
  g.strokeStyle = color;
  g.lineWidth = 1;
  g.beginPath();
  for (const shift of [-10, 0, 10]) {
    g.moveTo(shift - 1, 11);
    g.lineTo(shift + 11, -1);
  }
  g.stroke();
  made = { color, tile };
  return tile;
}
