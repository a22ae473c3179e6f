// @ts-check
import * as THREE from "../vendor/three.js";

/** Radians that an arrow key turns the eye. */
const TURN = Math.PI / 24;

/** The camera, and the pointer and keys that move it around what is looked at. */
export class Eye {
  /** @param {HTMLCanvasElement} canvas @param {() => void} draw */
  constructor(canvas, draw) {
    this.canvas = canvas;
    this.draw = draw;
    this.camera = new THREE.PerspectiveCamera(45, 1, 0.05, 500);
    this.up = new THREE.Vector3(0, 0, 1);
    /** It was not moved by hand yet: it sees all that there is. */
    this.fitted = true;
    /** Called after it was moved. */
    this.moved = () => {};
    /** @type {any} */
    this.controls = undefined;
    this.#orbit();
  }

  #orbit() {
    const target = this.controls?.target.clone() ?? new THREE.Vector3();
    this.controls?.dispose();
    this.camera.up.copy(this.up);
    this.controls = new THREE.OrbitControls(this.camera, this.canvas);
    this.controls.target.copy(target);
    this.controls.zoomToCursor = true;
    this.controls.addEventListener("start", () => (this.fitted = false));
    this.controls.addEventListener("change", () => (this.draw(), this.moved()));
  }

  /** @param {number[]} up @returns {boolean} whether it is another than before */
  setUp(up) {
    if (this.up.x === up[0] && this.up.y === up[1] && this.up.z === up[2]) return false;
    this.up.set(up[0], up[1], up[2]);
    this.#orbit();
    return true;
  }

  /** @param {number} aspect width over height */
  setAspect(aspect) {
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
  }

  /** Sees a box from obliquely above. @param {number[][]} box lower and upper corner */
  fit(box) {
    const [a, b] = box.map((p) => new THREE.Vector3(...p));
    const middle = a.clone().add(b).multiplyScalar(0.5);
    const radius = Math.max(0.5 * a.distanceTo(b), 0.1);
    // Any two directions across `up`.
    const side = new THREE.Vector3(1, 0, 0);
    if (Math.abs(this.up.x) > 0.9) side.set(0, 1, 0);
    side.addScaledVector(this.up, -side.dot(this.up)).normalize();
    const ahead = side.clone().cross(this.up).normalize();
    const from = side
      .multiplyScalar(0.35)
      .add(ahead.multiplyScalar(0.72))
      .addScaledVector(this.up, 1.05)
      .normalize();
    const narrow = Math.min(1, this.camera.aspect);
    const far = (0.86 * radius) / Math.sin((this.camera.fov * Math.PI) / 360) / narrow;
    this.controls.target.copy(middle);
    this.camera.position.copy(middle).addScaledVector(from, far);
    this.#clip(radius + far);
    this.controls.update();
    this.draw();
  }

  /** @param {number} far */
  #clip(far) {
    this.camera.near = far / 2000;
    this.camera.far = far * 20;
    this.camera.updateProjectionMatrix();
  }

  /** Where the eye is and where it looks. @returns {number[]} */
  get() {
    return [...this.camera.position.toArray(), ...this.controls.target.toArray()];
  }

  /** @param {number[]} eye */
  set(eye) {
    this.fitted = false;
    this.camera.position.set(eye[0], eye[1], eye[2]);
    this.controls.target.set(eye[3], eye[4], eye[5]);
    this.#clip(2 * this.camera.position.distanceTo(this.controls.target));
    this.controls.update();
    this.draw();
  }

  /** Goes round by keys. @param {KeyboardEvent} event @returns {boolean} whether the key meant something */
  key(event) {
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    const zoom = { "+": 0.85, "=": 0.85, "-": 1 / 0.85, _: 1 / 0.85 }[event.key];
    if (!arrow && !zoom) return false;
    this.fitted = false;
    const offset = this.camera.position.clone().sub(this.controls.target);
    const side = this.up.clone().cross(offset).normalize();
    if (zoom) offset.multiplyScalar(zoom);
    else if (arrow && event.shiftKey) {
      const step = 0.06 * offset.length();
      const over = offset.clone().cross(side).normalize();
      const move = side.multiplyScalar(arrow[0] * step).addScaledVector(over, arrow[1] * step);
      this.controls.target.add(move);
    } else if (arrow) {
      offset.applyAxisAngle(this.up, arrow[0] * TURN);
      const turned = offset
        .clone()
        .applyAxisAngle(this.up.clone().cross(offset).normalize(), -arrow[1] * TURN);
      const high = turned.angleTo(this.up);
      if (high > 0.05 && high < Math.PI - 0.05) offset.copy(turned);
    }
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.draw();
    this.moved();
    return true;
  }

  /**
   * The ray from the eye through a place of the canvas, -1 to 1 to the right and up.
   * @param {number} x @param {number} y
   */
  ray(x, y) {
    this.camera.updateMatrixWorld();
    const through = new THREE.Vector3(x, y, 0.5).unproject(this.camera);
    return {
      origin: this.camera.position.toArray(),
      direction: through.sub(this.camera.position).normalize().toArray(),
    };
  }
}
