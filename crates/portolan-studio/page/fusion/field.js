// @ts-check
import { Cells, diverging, sequential, step, word } from "../canvas2d/cells.js";
import { colors, rgb } from "../ui/theme.js";

/** The page's copy of the truncated field, and its image. */
export class Field {
  /**
   * @param {{origin: [number, number], resolution: number, shape: [number, number]}} grid
   * @param {number} block edge of a block (cells)
   */
  constructor(grid, block) {
    this.grid = grid;
    this.block = block;
    const n = grid.shape[0] * grid.shape[1];
    this.distance = new Float32Array(n);
    this.weight = new Float32Array(n);
    this.cells = new Cells(grid);
    /** @type {"distance" | "weight"} */
    this.shows = "distance";
    this.truncation = 1;
    this.wMax = 1;
    this.signed = new Uint32Array(256);
    this.trust = new Uint32Array(256);
    this.unknown = 0;
  }

  /**
   * Colors of the theme; distances up to the truncation, weights up to the clamp.
   * @param {number} truncation
   * @param {number} wMax
   */
  setColors(truncation, wMax) {
    const c = colors();
    this.truncation = truncation;
    this.wMax = wMax;
    this.signed = diverging(c.negative, c.positive);
    this.trust = sequential(c.paper, c.accent);
    this.unknown = word(...rgb(c.unknown), 255);
    this.cells.fill((i) => this.#word(i));
  }

  /** Forgets all. */
  clear() {
    this.distance.fill(0);
    this.weight.fill(0);
    this.cells.words.fill(this.unknown);
    this.cells.touch(0, this.grid.shape[1]);
  }

  /**
   * Takes blocks in.
   * @param {Uint32Array} blocks
   * @param {Float32Array} distance
   * @param {Float32Array} weight
   */
  apply(blocks, distance, weight) {
    const { block: b, grid } = this;
    const [w, h] = grid.shape;
    const across = Math.ceil(w / b);
    for (let n = 0; n < blocks.length; n++) {
      const x0 = (blocks[n] % across) * b;
      const y0 = Math.floor(blocks[n] / across) * b;
      const width = Math.min(b, w - x0);
      const y1 = Math.min(h, y0 + b);
      for (let y = y0; y < y1; y++) {
        let from = n * b * b + (y - y0) * b;
        let i = y * w + x0;
        let k = this.cells.at(x0, y);
        for (let x = 0; x < width; x++, from++, i++, k++) {
          this.distance[i] = distance[from];
          this.weight[i] = weight[from];
          this.cells.words[k] = this.#word(i);
        }
      }
      this.cells.touch(y0, y1);
    }
  }

  /** The cell at a point of the world. @param {[number, number]} p @returns {[number, number] | undefined} */
  cellAt([x, y]) {
    const { origin, resolution, shape } = this.grid;
    const cell = [Math.floor((x - origin[0]) / resolution), Math.floor((y - origin[1]) / resolution)];
    const inside = cell[0] >= 0 && cell[1] >= 0 && cell[0] < shape[0] && cell[1] < shape[1];
    return inside ? [cell[0], cell[1]] : undefined;
  }

  /** Middle of a cell. @param {[number, number]} cell @returns {[number, number]} */
  center([x, y]) {
    const { origin, resolution } = this.grid;
    return [origin[0] + (x + 0.5) * resolution, origin[1] + (y + 0.5) * resolution];
  }

  /** What is known of a cell. @param {[number, number]} cell */
  at([x, y]) {
    const i = y * this.grid.shape[0] + x;
    return { distance: this.distance[i], weight: this.weight[i] };
  }

  /** @param {number} i */
  #word(i) {
    const weight = this.weight[i];
    if (!(weight > 0)) return this.unknown;
    if (this.shows === "weight") return this.trust[step(weight, 0, this.wMax)];
    return this.signed[step(this.distance[i], -this.truncation, this.truncation)];
  }
}
