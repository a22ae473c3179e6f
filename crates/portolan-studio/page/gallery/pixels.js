// @ts-check

/**
 * Thousands of small things, written straight into the pixels of a panel: as paths they would take longer
 * than a picture may.
 */
export class Pixels {
  constructor() {
    this.image = new OffscreenCanvas(1, 1);
    this.data = new ImageData(1, 1);
    /** RGBA in memory order, rows from the top. */
    this.words = new Uint32Array(this.data.data.buffer);
    this.width = 1;
    this.height = 1;
    this.ratio = 1;
  }

  /**
   * An empty picture as large as the canvas, filled by `fill` and laid over it.
   * @param {CanvasRenderingContext2D} g
   * @param {() => void} fill
   */
  over(g, fill) {
    const { width, height, clientWidth, clientHeight } = g.canvas;
    if (this.width !== width || this.height !== height) {
      [this.image.width, this.image.height] = [this.width, this.height] = [width, height];
      this.data = new ImageData(width, height);
      this.words = new Uint32Array(this.data.data.buffer);
    } else this.words.fill(0);
    this.ratio = width / clientWidth;
    fill();
    /** @type {OffscreenCanvasRenderingContext2D} */ (this.image.getContext("2d")).putImageData(
      this.data,
      0,
      0,
    );
    g.drawImage(this.image, 0, 0, clientWidth, clientHeight);
  }

  /**
   * Two sides, the left and the lower, of a square; its neighbors bring the others. Canvas pixels, y down.
   * @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 @param {number} word
   */
  corner(x0, y0, x1, y1, word) {
    const [w, h] = [this.width, this.height];
    const [left, right] = [Math.max(0, x0), Math.min(w, x1)];
    const [top, bottom] = [Math.max(0, y0), Math.min(h, y1)];
    if (left >= right || top >= bottom) return;
    if (x0 >= 0) for (let y = top, k = top * w + x0; y < bottom; y++, k += w) this.words[k] = word;
    if (y1 <= h) this.words.fill(word, (y1 - 1) * w + left, (y1 - 1) * w + right);
  }

  /**
   * A square dot.
   * @param {number} x its middle
   * @param {number} y
   * @param {number} size
   * @param {number} word
   */
  dot(x, y, size, word) {
    const x0 = Math.round(x - size / 2);
    const y0 = Math.round(y - size / 2);
    if (x0 < 0 || y0 < 0 || x0 + size > this.width || y0 + size > this.height) return;
    for (let i = 0, k = y0 * this.width + x0; i < size; i++, k += this.width)
      for (let j = 0; j < size; j++) this.words[k + j] = word;
  }
}
