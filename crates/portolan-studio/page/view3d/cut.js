// @ts-check
import * as THREE from "../vendor/three.js";
import { diverging, step } from "../canvas2d/cells.js";
import { colors, rgb } from "../ui/theme.js";

/**
 * The layer of a field as an image: first to the right, then up.
 * @param {import("../engine/engine.js").Answer} answer of `slice`
 * @param {string} field
 */
export function image({ body, arrays }, field) {
  const [w, h] = body.shape;
  const values = /** @type {Float32Array} */ (arrays.values);
  const c = colors();
  const ramp = diverging(c.negative, c.positive);
  const words = new Uint32Array(w * h);
  for (let i = 0; i < values.length; i++) {
    const v = values[i];
    if (v !== v) continue; // unknown: transparent
    // What is occupied has the color of what is behind a surface.
    words[i] = ramp[field === "occupancy" ? step(1 - 2 * v, -1, 1) : step(v, -body.most, body.most)];
  }
  return { width: w, height: h, bytes: new Uint8Array(words.buffer) };
}

/** The ramp for a legend: zero is the paper itself. */
export function rampCss() {
  const c = colors();
  return `linear-gradient(to right, ${c.negative}, ${c.paper}, ${c.positive})`;
}

/** A layer of a field as a quad in 3-D, with a thin frame. */
export class Cut {
  constructor() {
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(12), 3));
    this.geometry.setAttribute(
      "uv",
      new THREE.BufferAttribute(new Float32Array([0, 0, 1, 0, 1, 1, 0, 1]), 2),
    );
    this.geometry.setIndex([0, 1, 2, 0, 2, 3]);
    this.material = new THREE.MeshBasicMaterial({
      transparent: true,
      side: THREE.DoubleSide,
      depthWrite: false,
    });
    this.quad = new THREE.Mesh(this.geometry, this.material);
    this.frame = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial());
    this.frame.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(24), 3));
    for (const o of [this.quad, this.frame]) {
      o.frustumCulled = false;
      o.visible = false;
    }
  }

  /**
   * @param {import("../engine/engine.js").Answer} answer
   * @param {string} field
   */
  show(answer, field) {
    const { corner, axes, sides } = answer.body;
    const at = (/** @type {number} */ u, /** @type {number} */ v) => {
      const p = [...corner];
      p[axes[0]] += u * sides[0];
      p[axes[1]] += v * sides[1];
      return p;
    };
    const corners = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
    this.geometry.getAttribute("position").array.set(corners.flat());
    this.geometry.getAttribute("position").needsUpdate = true;
    this.frame.geometry
      .getAttribute("position")
      .array.set([0, 1, 1, 2, 2, 3, 3, 0].flatMap((i) => corners[i]));
    this.frame.geometry.getAttribute("position").needsUpdate = true;
    const { width, height, bytes } = image(answer, field);
    this.material.map?.dispose();
    const map = new THREE.DataTexture(bytes, width, height, THREE.RGBAFormat, THREE.UnsignedByteType);
    map.magFilter = THREE.NearestFilter;
    map.minFilter = THREE.NearestFilter;
    map.needsUpdate = true;
    this.material.map = map;
    this.material.needsUpdate = true;
    this.quad.visible = this.frame.visible = true;
    this.redraw();
  }

  hide() {
    this.quad.visible = this.frame.visible = false;
  }

  redraw() {
    const [r, g, b] = rgb(colors().truth).map((v) => v / 255);
    this.frame.material.color.setRGB(r, g, b);
  }
}
