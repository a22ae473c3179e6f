// @ts-check
import * as THREE from "../vendor/three.js";
import { colors, rgb } from "../ui/theme.js";
import { stops, texels } from "./ramps.js";

/**
 * A mesh of more triangles is drawn when all of it is there: drawing it again for every part would take
 * longer than it.
 */
export const LARGE = 800_000;
const MODES = ["height", "color", "weight", "error", "sigma", "passed"];
/** Parts of the buffers that lie no further apart than this are sent to the graphics card in one go. */
const GAP = 4096;

const VERTEX = `
attribute vec4 shade;
uniform vec3 up;
uniform vec2 range;
uniform int mode;
varying vec3 eye;
varying vec3 facing;
varying vec4 tint;
varying float level;
void main() {
  vec4 p = modelViewMatrix * vec4(position, 1.0);
  eye = p.xyz;
  facing = normalMatrix * normal;
  tint = shade;
  level = mode == 0 ? (dot(position, up) - range.x) / max(range.y - range.x, 1e-6) : shade.x;
  gl_Position = projectionMatrix * p;
}`;

const FRAGMENT = `
uniform sampler2D ramp;
uniform vec3 nothing;
uniform int mode;
varying vec3 eye;
varying vec3 facing;
varying vec4 tint;
varying float level;
void main() {
  vec3 base = texture2D(ramp, vec2((clamp(level, 0.0, 1.0) * 255.0 + 0.5) / 256.0, 0.5)).rgb;
  if (mode == 1) base = tint.rgb;
  if (mode != 0 && tint.a < 0.5) base = nothing;
  vec3 n = dot(facing, facing) > 0.01 ? normalize(facing) : normalize(cross(dFdx(eye), dFdy(eye)));
  // A lamp at the eye, and one above the shoulder, so that corners are seen.
  float head = abs(dot(n, normalize(-eye)));
  float side = 0.5 + 0.5 * dot(n, normalize(vec3(0.35, 0.8, 0.45)));
  gl_FragColor = vec4(base * (0.38 + 0.4 * head + 0.26 * side), 1.0);
}`;

/**
 * The mesh: one geometry, one draw call. The engine decides where in its buffers each brick's piece lies;
 * here it is copied there.
 */
export class Surface {
  constructor() {
    this.geometry = new THREE.BufferGeometry();
    // Nothing is left out of sight: the buffers change too often to keep a box around them.
    this.geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(), Infinity);
    this.ramp = new THREE.DataTexture(
      texels(stops("height")),
      256,
      1,
      THREE.RGBAFormat,
      THREE.UnsignedByteType,
    );
    this.ramp.magFilter = THREE.LinearFilter;
    this.ramp.minFilter = THREE.LinearFilter;
    this.material = new THREE.ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      // Backs are not drawn: one looks into rooms from outside, as a ray does that asks for the free side.
      side: THREE.FrontSide,
      uniforms: {
        up: { value: new THREE.Vector3(0, 0, 1) },
        range: { value: [0, 1] },
        mode: { value: 0 },
        ramp: { value: this.ramp },
        nothing: { value: new THREE.Vector3(0.5, 0.5, 0.5) },
      },
    });
    this.mesh = new THREE.Mesh(this.geometry, this.material);
    this.mesh.frustumCulled = false;
    this.by = "height";
    /** What the colors mean that are drawn. @type {any} */
    this.color = null;
    /**
     * Colors of another kind, while they come in: the old ones are drawn until all of the new ones are there.
     * @type {Uint8Array | null}
     */
    this.coming = null;
    /** Pieces that were still to come when they began to, and now. */
    this.awaited = [0, 0];
    /** Vertices and indices that there is room for. */
    this.rooms = [0, 0];
    this.position = new Float32Array();
    this.normal = new Int8Array();
    this.shade = new Uint8Array();
    this.index = new Uint32Array();
    this.clear();
  }

  clear() {
    this.rooms = [0, 0];
    this.#allocate(1024, 4096);
    this.geometry.setDrawRange(0, 0);
    this.coming = null;
  }

  /** The share of the new colors that is there; `null`: none are awaited. */
  get recolored() {
    const [all, left] = this.awaited;
    return this.coming && all > 0 ? 1 - left / all : null;
  }

  /** @param {number} vertices @param {number} indices */
  #allocate(vertices, indices) {
    const old =
      this.rooms[0] > 0
        ? { position: this.position, normal: this.normal, shade: this.shade, index: this.index }
        : null;
    // Frees the graphics card's buffers of the old size.
    this.geometry.dispose();
    this.position = new Float32Array(3 * vertices);
    this.normal = new Int8Array(4 * vertices);
    this.shade = new Uint8Array(4 * vertices);
    this.index = new Uint32Array(indices);
    if (old) {
      this.position.set(old.position);
      this.normal.set(old.normal);
      this.shade.set(old.shade);
      if (this.coming) {
        const longer = new Uint8Array(4 * vertices);
        longer.set(this.coming);
        this.coming = longer;
      }
      this.index.set(old.index);
    }
    const attribute = (
      /** @type {any} */ array,
      /** @type {number} */ size,
      /** @type {boolean} */ normalized,
    ) => {
      const made = new THREE.BufferAttribute(array, size, normalized);
      made.setUsage(THREE.DynamicDrawUsage);
      return made;
    };
    this.geometry.setAttribute("position", attribute(this.position, 3, false));
    this.geometry.setAttribute("normal", attribute(this.normal, 4, true));
    this.geometry.setAttribute("shade", attribute(this.shade, 4, true));
    this.geometry.setIndex(attribute(this.index, 1, false));
    this.rooms = [vertices, indices];
  }

  /**
   * Writes what an answer brings of the mesh.
   * @param {import("../engine/engine.js").Answer} answer
   * @returns {boolean} whether there was something
   */
  apply({ body, arrays }) {
    const { fresh, vertices, indices } = body.mesh;
    const { holes, runs, positions, normals, shades } = /** @type {any} */ (arrays);
    const pieces = /** @type {Uint16Array} */ (/** @type {any} */ (arrays.indices));
    if (fresh) this.clear();
    this.#expect(body, fresh);
    if (vertices > this.rooms[0] || indices > this.rooms[1]) {
      // A large mesh comes with its whole size; one that grows gets more room than it needs now.
      const more = (/** @type {number} */ need, /** @type {number} */ has) =>
        need > has ? Math.ceil(Math.max(need * (fresh ? 1.02 : 1.4), 1024)) : has;
      this.#allocate(more(vertices, this.rooms[0]), more(indices, this.rooms[1]));
    }
    const index = this.index;
    /** @type {[number, number][]} */
    const moved = [];
    /** @type {[number, number][]} */
    const joined = [];
    for (let i = 0; i < holes.length; i += 2) {
      index.fill(0, holes[i], holes[i] + holes[i + 1]);
      joined.push([holes[i], holes[i] + holes[i + 1]]);
    }
    let v = 0;
    let t = 0;
    for (let i = 0; i < runs.length; i += 5) {
      const [v0, count, t0, triangles, room] = [runs[i], runs[i + 1], runs[i + 2], runs[i + 3], runs[i + 4]];
      this.position.set(positions.subarray(3 * v, 3 * (v + count)), 3 * v0);
      this.normal.set(normals.subarray(4 * v, 4 * (v + count)), 4 * v0);
      (this.coming ?? this.shade).set(shades.subarray(4 * v, 4 * (v + count)), 4 * v0);
      for (let k = 0; k < triangles; k++) index[t0 + k] = v0 + pieces[t + k];
      index.fill(0, t0 + triangles, t0 + room);
      moved.push([v0, v0 + count]);
      joined.push([t0, t0 + room]);
      v += count;
      t += triangles;
    }
    for (const [start, end] of together(moved)) {
      this.#touch("position", 3 * start, 3 * (end - start));
      this.#touch("normal", 4 * start, 4 * (end - start));
      this.#touch("shade", 4 * start, 4 * (end - start));
    }
    for (const [start, end] of together(joined)) this.#touch("index", start, end - start);
    this.geometry.setDrawRange(0, indices);
    if (this.coming && body.mesh.pending === 0) this.#arrive();
    // Whatever else is drawn meanwhile must not wait for triangles that are still to come.
    this.mesh.visible = body.mesh.pending === 0 || body.mesh.triangles < LARGE;
    if (!this.coming) this.#color(body.color);
    return fresh || runs.length > 0 || holes.length > 0;
  }

  /** Colors of another kind than are drawn are kept apart. @param {any} body @param {boolean} fresh */
  #expect({ color, mesh }, fresh) {
    if (fresh || this.color === null || (color.by === this.by && !this.coming)) return;
    if (!this.coming) {
      this.coming = new Uint8Array(this.shade.length);
      this.awaited[0] = 0;
    }
    this.awaited = [Math.max(this.awaited[0], mesh.pending), mesh.pending];
  }

  /** All new colors are there. */
  #arrive() {
    this.shade.set(/** @type {Uint8Array} */ (this.coming));
    this.coming = null;
    this.#touch("shade", 0, this.shade.length);
  }

  /** @param {string} name @param {number} start @param {number} count */
  #touch(name, start, count) {
    const attribute = name === "index" ? this.geometry.getIndex() : this.geometry.getAttribute(name);
    attribute.addUpdateRange(start, count);
    attribute.needsUpdate = true;
  }

  /** @param {{by: string, ramp: {low: number | null, high: number | null} | null}} color */
  #color(color) {
    const { by, ramp } = (this.color = color);
    const { uniforms } = this.material;
    if (by === "height" && ramp && ramp.low !== null && ramp.high !== null)
      uniforms.range.value = [ramp.low, ramp.high];
    if (by !== this.by) {
      this.by = by;
      this.redraw();
    }
  }

  /** @param {number[]} up */
  setUp(up) {
    this.material.uniforms.up.value.set(...up);
  }

  /** With the colors of the theme. */
  redraw() {
    this.material.uniforms.mode.value = MODES.indexOf(this.by);
    this.ramp.image.data.set(texels(stops(this.by)));
    this.ramp.needsUpdate = true;
    this.material.uniforms.nothing.value.set(...rgb(colors().truth).map((v) => v / 255));
  }
}

/** Ranges in their order, those near to each other joined. @param {[number, number][]} ranges */
function together(ranges) {
  ranges.sort((a, b) => a[0] - b[0]);
  /** @type {[number, number][]} */
  const out = [];
  for (const [start, end] of ranges) {
    const last = out.at(-1);
    if (last && start - last[1] < GAP) last[1] = Math.max(last[1], end);
    else out.push([start, end]);
  }
  return out;
}
