// @ts-check
import { strokeFaces, strokeLines } from "../canvas2d/lines.js";
import { colors } from "../ui/theme.js";
import { drawPath } from "./path_layer.js";
import { drawArrows, drawProbe } from "./probe_layer.js";
import { drawRings } from "./rings_layer.js";

/**
 * What is drawn: the last answers, and what is chosen on the canvas.
 * @typedef {object} Scene
 * @property {import("./map.js").FieldImage | undefined} image
 * @property {Float32Array} contour
 * @property {Uint32Array} lines
 * @property {Float32Array} obstacles centers of cells that are obstacles without a surface
 * @property {any} truth faces, of the simulated world
 * @property {Rings | undefined} rings
 * @property {Arrows | undefined} arrows
 * @property {[number, number] | undefined} probe where it is (world)
 * @property {any} answer what the engine answered there
 * @property {[number, number][]} waypoints
 * @property {import("./path_layer.js").Checked | undefined} checked the path as it was answered last
 * @property {number} radius of the robot (metres)
 * @property {{rings: boolean, arrows: boolean, contour: boolean, truth: boolean}} visible
 *
 * @typedef {{points: Float32Array, starts: Uint32Array, levels: Float32Array, spacing: number}} Rings
 * @typedef {{points: Float32Array, gradients: Float32Array, spacing: number}} Arrows
 */

/** Nothing yet. @returns {Scene} */
export function newScene() {
  return {
    image: undefined,
    contour: new Float32Array(),
    lines: new Uint32Array([0]),
    obstacles: new Float32Array(),
    truth: null,
    rings: undefined,
    arrows: undefined,
    probe: undefined,
    answer: undefined,
    waypoints: [],
    checked: undefined,
    radius: 0.2,
    visible: { rings: true, arrows: true, contour: true, truth: false },
  };
}

/**
 * What stays while the probe moves, from back to front.
 * @param {Scene} s
 * @returns {import("../canvas2d/canvas2d.js").Layer[]}
 */
export function stillLayers(s) {
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
      if (s.image) fillCells(g, camera, s.obstacles, s.image.grid.resolution);
    },
  ];
}

/**
 * Whole cells, as large as they are, and no smaller than can be seen.
 * @param {CanvasRenderingContext2D} g
 * @param {import("../canvas2d/canvas2d.js").Camera} camera
 * @param {Float32Array} centers x, y pairs
 * @param {number} size (metres)
 */
function fillCells(g, camera, centers, size) {
  g.fillStyle = colors().contour;
  for (let i = 0; i < centers.length; i += 2) {
    const [x0, y0] = camera.toScreen(centers[i] - 0.5 * size, centers[i + 1] + 0.5 * size);
    const [x1, y1] = camera.toScreen(centers[i] + 0.5 * size, centers[i + 1] - 0.5 * size);
    const [w, h] = [Math.max(x1 - x0, 2), Math.max(y1 - y0, 2)];
    g.fillRect(0.5 * (x0 + x1 - w), 0.5 * (y0 + y1 - h), w, h);
  }
}

/** What moves, over it. @param {Scene} s @returns {import("../canvas2d/canvas2d.js").Layer[]} */
export function movingLayers(s) {
  return [(g, camera) => drawPath(g, camera, s), (g, camera) => drawProbe(g, camera, s)];
}
