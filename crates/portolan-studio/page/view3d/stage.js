// @ts-check
import * as THREE from "../vendor/three.js";
import { colors, rgb } from "../ui/theme.js";
import { Cut } from "./cut.js";
import { Eye } from "./eye.js";
import { Surface } from "./surface.js";

/** @param {string} name of style.css */
const raw = (name) => rgb(colors()[name]).map((v) => v / 255);

/**
 * The scene: surface, slice, way of the sensor, its last points, the voxel that is looked at; and the eye
 * that goes round it.
 */
export class Stage {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {import("../ui/meter.js").Meter} meter
   * @throws where the browser has no WebGL
   */
  constructor(canvas, meter) {
    this.canvas = canvas;
    this.meter = meter;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    // Colors are those of style.css: nothing is converted on the way.
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.scene = new THREE.Scene();
    this.eye = new Eye(canvas, () => this.draw());
    this.surface = new Surface();
    this.cut = new Cut();
    this.way = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial());
    this.points = new THREE.Points(
      new THREE.BufferGeometry(),
      new THREE.PointsMaterial({ size: 2, sizeAttenuation: false }),
    );
    /** What moved and is not in the map. */
    this.movers = new THREE.Points(
      new THREE.BufferGeometry(),
      new THREE.PointsMaterial({ size: 3, sizeAttenuation: false }),
    );
    this.sensor = new THREE.Points(
      new THREE.BufferGeometry(),
      new THREE.PointsMaterial({ size: 9, sizeAttenuation: false }),
    );
    this.voxel = new THREE.LineSegments(
      new THREE.BufferGeometry(),
      new THREE.LineBasicMaterial({ depthTest: false, transparent: true }),
    );
    this.voxel.renderOrder = 3;
    this.cut.quad.renderOrder = 1;
    for (const o of [this.way, this.points, this.movers, this.sensor, this.voxel]) {
      o.frustumCulled = false;
      o.visible = false;
    }
    this.scene.add(
      this.surface.mesh,
      this.cut.quad,
      this.cut.frame,
      this.way,
      this.points,
      this.movers,
      this.sensor,
      this.voxel,
    );
    /** When the last pictures were drawn (milliseconds). @type {number[]} */
    this.times = [];
    this.waiting = false;
    this.name = rendererName(this.renderer.getContext());
    new ResizeObserver(() => this.#resize()).observe(/** @type {HTMLElement} */ (canvas.parentElement));
    this.redraw();
  }

  /** @param {number[]} up */
  setUp(up) {
    if (this.eye.setUp(up)) this.surface.setUp(up);
  }

  #resize() {
    const { clientWidth: w, clientHeight: h } = /** @type {HTMLElement} */ (this.canvas.parentElement);
    if (w === 0 || h === 0) return;
    this.renderer.setSize(w, h, false);
    this.eye.setAspect(w / h);
    this.draw();
  }

  /**
   * Draws before the next picture of the screen; `work` of the page before it belongs to the same picture.
   */
  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame((now) => {
      this.waiting = false;
      this.meter.measure(() => this.renderer.render(this.scene, this.eye.camera));
      this.times.push(now);
      if (this.times.length > 30) this.times.shift();
      this.meter.note = this.rate();
      this.meter.picture();
    });
  }

  /** Pictures a second of those that followed each other, and what draws them. */
  rate() {
    const gaps = this.times
      .slice(1)
      .map((t, i) => t - this.times[i])
      .filter((gap) => gap < 400)
      .sort((a, b) => a - b);
    const middle = gaps[gaps.length >> 1];
    return `${middle ? `${(1000 / middle).toFixed(0)} pictures/s · ` : ""}${this.name}`;
  }

  /** @param {number[][]} places */
  showWay(places) {
    line(this.way, places.flat());
  }

  /** @param {Float32Array} points @param {number[] | null} sensor */
  showScan(points, sensor) {
    line(this.points, points);
    line(this.sensor, sensor ?? []);
  }

  /** @param {Float32Array} points of what moved @param {boolean} shown */
  setMovers(points, shown) {
    line(this.movers, points);
    this.movers.visible = shown;
  }

  /** @param {boolean} shown */
  showMovers(shown) {
    this.movers.visible = shown && this.movers.geometry.drawRange.count > 0;
    this.draw();
  }

  /** The edges of a voxel. @param {number[] | null} corner @param {number} edge */
  showVoxel(corner, edge) {
    /** @type {number[]} */
    const ends = [];
    for (let axis = 0; corner && axis < 3; axis++)
      for (let k = 0; k < 4; k++) {
        const p = [0, 0, 0];
        p[(axis + 1) % 3] = k & 1;
        p[(axis + 2) % 3] = k >> 1;
        const q = [...p];
        q[axis] = 1;
        ends.push(...p.map((v, i) => corner[i] + v * edge), ...q.map((v, i) => corner[i] + v * edge));
      }
    line(this.voxel, ends);
    this.draw();
  }

  /** With the colors of the theme. */
  redraw() {
    const set = (/** @type {any} */ o, /** @type {string} */ name) => o.material.color.setRGB(...raw(name));
    set(this.way, "truth");
    set(this.points, "beam");
    set(this.movers, "negative");
    set(this.sensor, "robot");
    set(this.voxel, "chair");
    const [r, g, b] = raw("paper");
    this.renderer.setClearColor(new THREE.Color().setRGB(r, g, b), 1);
    this.surface.redraw();
    this.cut.redraw();
    this.draw();
  }

  /** What is seen, as a picture of its own. */
  picture() {
    this.renderer.render(this.scene, this.eye.camera);
    const out = document.createElement("canvas");
    out.width = this.canvas.width;
    out.height = this.canvas.height;
    // In the same task as it was drawn: afterwards the browser may clear it.
    out.getContext("2d")?.drawImage(this.canvas, 0, 0);
    return out;
  }
}

/** @param {any} object @param {ArrayLike<number>} values x, y, z of each place */
function line(object, values) {
  object.visible = values.length > 0;
  const held = object.geometry.getAttribute("position");
  if (held && held.count * 3 >= values.length) {
    held.array.set(values);
    held.needsUpdate = true;
  } else {
    object.geometry.dispose();
    object.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(values), 3));
  }
  object.geometry.setDrawRange(0, values.length / 3);
}

/**
 * What draws, without the layers between: the device of `ANGLE (vendor, Vulkan 1.3.0 (device (0x…)),
 * driver)`.
 * @param {any} gl
 */
function rendererName(gl) {
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const whole = String(info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : gl.getParameter(gl.RENDERER));
  const device = /^ANGLE \([^,]*, (.*?)(, [^,]*)?\)$/.exec(whole)?.[1] ?? whole;
  return device
    .replace(/ ?\(0x[0-9a-fA-F]+\)/, "")
    .replace(/^Vulkan [\d.]+ \((.*)\)$/, "$1")
    .slice(0, 60);
}
