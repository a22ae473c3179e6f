// @ts-check

/**
 * Layers that stay as they are while the probe moves: kept as a picture once the camera rests, and copied
 * until it moves or what they show changes. While it moves they are drawn as they are: a picture costs the
 * main thread what a browser otherwise does beside it.
 */
export class Still {
  /** @param {import("../canvas2d/canvas2d.js").Layer[]} layers from back to front */
  constructor(layers) {
    this.layers = layers;
    this.canvas = new OffscreenCanvas(1, 1);
    /** Of what there is a picture. */
    this.kept = "";
    /** What was drawn last. */
    this.last = "";
  }

  /** What is shown has changed. */
  changed() {
    this.kept = this.last = "";
  }

  /** @type {import("../canvas2d/canvas2d.js").Layer} */
  draw = (g, camera) => {
    const { width, height } = g.canvas;
    const key = [width, height, devicePixelRatio, camera.scale, ...camera.toScreen(0, 0)].join(" ");
    if (key !== this.kept && key !== this.last) {
      this.last = key;
      this.#layers(g, camera);
      return;
    }
    if (key !== this.kept) {
      this.kept = key;
      this.#keep(width, height, camera);
    }
    g.setTransform(1, 0, 0, 1, 0, 0);
    g.drawImage(this.canvas, 0, 0);
  };

  /** @param {number} width @param {number} height @param {import("../canvas2d/canvas2d.js").Camera} camera */
  #keep(width, height, camera) {
    if (this.canvas.width !== width || this.canvas.height !== height)
      this.canvas = new OffscreenCanvas(width, height);
    // The layers use what both kinds of canvas have.
    const g = /** @type {CanvasRenderingContext2D} */ (/** @type {unknown} */ (this.canvas.getContext("2d")));
    g.setTransform(1, 0, 0, 1, 0, 0);
    g.clearRect(0, 0, width, height);
    g.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    this.#layers(g, camera);
  }

  /** @param {CanvasRenderingContext2D} g @param {import("../canvas2d/canvas2d.js").Camera} camera */
  #layers(g, camera) {
    for (const layer of this.layers) {
      g.save();
      layer(g, camera);
      g.restore();
    }
  }
}
