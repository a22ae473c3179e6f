// @ts-check

/** Layers that stay as they are while the probe moves: drawn once, and copied until the camera or what they show changes. */
export class Still {
  /** @param {import("../plane/plane.js").Layer[]} layers from back to front */
  constructor(layers) {
    this.layers = layers;
    this.canvas = new OffscreenCanvas(1, 1);
    this.drawn = "";
  }

  /** What is shown has changed. */
  changed() {
    this.drawn = "";
  }

  /** @type {import("../plane/plane.js").Layer} */
  draw = (g, camera) => {
    const { width, height } = g.canvas;
    const key = [width, height, devicePixelRatio, camera.scale, ...camera.toScreen(0, 0)].join(" ");
    if (key !== this.drawn) {
      this.drawn = key;
      this.#paint(width, height, camera);
    }
    g.setTransform(1, 0, 0, 1, 0, 0);
    g.drawImage(this.canvas, 0, 0);
  };

  /** @param {number} width @param {number} height @param {import("../plane/plane.js").Camera} camera */
  #paint(width, height, camera) {
    if (this.canvas.width !== width || this.canvas.height !== height) this.canvas = new OffscreenCanvas(width, height);
    // The layers use what both kinds of canvas have.
    const g = /** @type {CanvasRenderingContext2D} */ (/** @type {unknown} */ (this.canvas.getContext("2d")));
    g.setTransform(1, 0, 0, 1, 0, 0);
    g.clearRect(0, 0, width, height);
    g.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    for (const layer of this.layers) {
      g.save();
      layer(g, camera);
      g.restore();
    }
  }
}
