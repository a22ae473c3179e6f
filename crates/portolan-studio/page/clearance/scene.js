// @ts-check
import { strokeFaces, strokeLines } from "../plane/lines.js";
import { colors } from "../ui/theme.js";
import { drawPath } from "./path_layer.js";
import { drawArrows, drawProbe } from "./probe_layer.js";

/**
 * What is drawn, as the last answers told it.
 * @typedef {object} Scene
 * @property {import("./map.js").FieldImage | undefined} image
 * @property {Float32Array} contour
 * @property {Uint32Array} lines
 * @property {any} truth faces, of the simulated world
 * @property {Rings | undefined} rings
 * @property {Arrows | undefined} arrows
 * @property {[number, number] | undefined} probe where it is (world)
 * @property {any} said what was answered there
 * @property {[number, number][]} waypoints
 * @property {import("./path_layer.js").Checked | undefined} checked the path as it was answered last
 * @property {number} radius of the robot (metres)
 * @property {{rings: boolean, arrows: boolean, contour: boolean, truth: boolean}} visible
 *
 * @typedef {{points: Float32Array, starts: Uint32Array, levels: Float32Array, spacing: number}} Rings
 * @typedef {{points: Float32Array, gradients: Float32Array, spacing: number}} Arrows
 */

/** Layers from back to front. @param {Scene} s @returns {import("../plane/plane.js").Layer[]} */
export function layers(s) {
  return [
    (g, camera) => s.image?.draw(g, camera),
    (g, camera) => s.visible.rings && s.rings && drawRings(g, camera, s.rings),
    (g, camera) => s.visible.arrows && s.arrows && drawArrows(g, camera, s.arrows),
    (g, camera) => {
      if (!s.visible.truth || !s.truth) return;
      g.strokeStyle = colors().truth;
      g.lineWidth = 1.25;
      g.setLineDash([5, 4]);
      strokeFaces(g, camera, s.truth.faces);
    },
    (g, camera) => {
      if (!s.visible.contour) return;
      g.strokeStyle = colors().contour;
      g.lineWidth = 1.8;
      g.lineJoin = "round";
      strokeLines(g, camera, s.contour, s.lines);
    },
    (g, camera) => drawPath(g, camera, s),
    (g, camera) => drawProbe(g, camera, s),
  ];
}

/** Pixels between labels of one ring, and the least between any two. */
const BETWEEN = 340;
const APART = 56;

/** @param {CanvasRenderingContext2D} g @param {import("../plane/plane.js").Camera} camera @param {Rings} rings */
function drawRings(g, camera, { points, starts, levels }) {
  const c = colors();
  g.lineWidth = 1;
  g.strokeStyle = c.ink;
  g.globalAlpha = 0.5;
  strokeLines(g, camera, points, starts);
  g.globalAlpha = 1;
  g.font = "10.5px system-ui, sans-serif";
  g.textAlign = "center";
  g.textBaseline = "middle";
  const { clientWidth: width, clientHeight: height } = g.canvas;
  /** @type {[number, number][]} */
  const placed = [];
  const at = (/** @type {number} */ i) => camera.toScreen(points[2 * i], points[2 * i + 1]);
  for (let k = 0; k < levels.length; k++) {
    const text = `${Number(levels[k].toFixed(3))}`;
    // The first label after a quarter of the usual way, so that short rings have one.
    let way = 0.75 * BETWEEN;
    let before = at(starts[k]);
    for (let i = starts[k] + 1; i < starts[k + 1]; i++) {
      const now = at(i);
      way += Math.hypot(now[0] - before[0], now[1] - before[1]);
      const [x, y] = [(now[0] + before[0]) / 2, (now[1] + before[1]) / 2];
      const seen = x > 10 && y > 10 && x < width - 10 && y < height - 10;
      if (way > BETWEEN && seen && placed.every(([a, b]) => Math.hypot(a - x, b - y) > APART)) {
        way = 0;
        placed.push([x, y]);
        let angle = Math.atan2(now[1] - before[1], now[0] - before[0]);
        if (Math.abs(angle) > Math.PI / 2) angle += Math.PI;
        g.save();
        g.translate(x, y);
        g.rotate(angle);
        g.strokeStyle = c.paper;
        g.lineWidth = 4;
        g.lineJoin = "round";
        g.strokeText(text, 0, 0);
        g.fillStyle = c.ink;
        g.fillText(text, 0, 0);
        g.restore();
      }
      before = now;
    }
  }
}
