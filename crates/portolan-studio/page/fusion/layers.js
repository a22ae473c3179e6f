// @ts-check
import { strokeFaces, strokeLines, strokeRays } from "../canvas2d/lines.js";
import { colors } from "../ui/theme.js";

/**
 * @typedef {import("../canvas2d/canvas2d.js").Camera} Camera
 * @typedef {import("./scene.js").Box} Box
 * @typedef {(g: CanvasRenderingContext2D, camera: Camera, s: import("./scene.js").Scene) => void} DrawLayer
 */

/**
 * Layers from back to front.
 * @param {import("./scene.js").Scene} s
 * @returns {import("../canvas2d/canvas2d.js").Layer[]}
 */
export function layers(s) {
  const all = [cells, beams, truth, contour, chair, robot, chosen];
  return all.map((draw) => (g, camera) => draw(g, camera, s));
}

/** @type {DrawLayer} */
const cells = (g, camera, s) => s.field?.cells.draw(g, camera);

/** The beams of the last scan. @type {DrawLayer} */
function beams(g, camera, s) {
  if (!s.visible.beams || !s.pose) return;
  g.strokeStyle = colors().beam;
  g.lineWidth = 0.7;
  g.globalAlpha = 0.4;
  strokeRays(g, camera, [s.pose[0], s.pose[1]], s.beams);
  g.globalAlpha = 1;
  g.fillStyle = colors().beam;
  for (let i = 0; i < s.kinds.length; i++) {
    if (s.kinds[i] !== 0) continue;
    const [x, y] = camera.toScreen(s.beams[2 * i], s.beams[2 * i + 1]);
    g.fillRect(x - 1.25, y - 1.25, 2.5, 2.5);
  }
}

/** The walls of the simulated world. @type {DrawLayer} */
function truth(g, camera, s) {
  if (!s.visible.truth || !s.truth) return;
  g.strokeStyle = colors().truth;
  g.lineWidth = 1.25;
  g.setLineDash([5, 4]);
  strokeFaces(g, camera, s.truth.faces);
}

/** The extracted contour. @type {DrawLayer} */
function contour(g, camera, s) {
  if (!s.visible.contour) return;
  g.strokeStyle = colors().contour;
  // Of a map seen from afar the line must not be wider than its walls.
  g.lineWidth = Math.min(1.8, Math.max(0.7, 0.35 * (s.field?.grid.resolution ?? 1) * camera.scale));
  g.lineJoin = "round";
  strokeLines(g, camera, s.contour, s.lines);
}

/** Where the chair is, and where it was. @type {DrawLayer} */
function chair(g, camera, s) {
  g.strokeStyle = colors().chair;
  if (s.ghost) {
    g.setLineDash([3, 3]);
    outline(g, camera, s.ghost);
    label(g, camera, s.ghost, "it was here");
  }
  g.setLineDash([]);
  g.lineWidth = 2;
  if (s.truth) {
    const box = s.held ?? s.truth.chair;
    const why = s.held && s.heldRefused;
    if (why) g.strokeStyle = colors().bad;
    if (s.held) {
      g.fillStyle = why ? colors().bad : colors().good;
      g.globalAlpha = 0.3;
      fill(g, camera, box);
      g.globalAlpha = 1;
    }
    outline(g, camera, box);
    label(g, camera, box, why ? `not here: ${why}` : "chair");
  }
}

/** Where the last scan was taken. @type {DrawLayer} */
function robot(g, camera, s) {
  if (!s.pose) return;
  const [x, y] = camera.toScreen(s.pose[0], s.pose[1]);
  const r = Math.max(7, 0.16 * camera.scale);
  g.translate(x, y);
  g.rotate(-s.pose[2]);
  g.fillStyle = colors().robot;
  g.strokeStyle = colors().paper;
  g.beginPath();
  g.moveTo(r, 0);
  g.lineTo(-0.7 * r, 0.65 * r);
  g.lineTo(-0.4 * r, 0);
  g.lineTo(-0.7 * r, -0.65 * r);
  g.closePath();
  g.fill();
  g.stroke();
}

/** The cell that is followed. @type {DrawLayer} */
function chosen(g, camera, s) {
  if (!s.cell || !s.field) return;
  const [x, y] = camera.toScreen(...s.field.center(s.cell));
  const half = Math.max(4, 0.5 * s.field.grid.resolution * camera.scale);
  for (const [width, color] of /** @type {[number, string][]} */ ([
    [4, colors().paper],
    [2, colors().ink],
  ])) {
    g.lineWidth = width;
    g.strokeStyle = color;
    g.strokeRect(x - half, y - half, 2 * half, 2 * half);
  }
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {import("../canvas2d/canvas2d.js").Camera} camera
 * @param {Box} box
 */
function outline(g, camera, { min, max }) {
  const [x, y] = camera.toScreen(min[0], max[1]);
  g.strokeRect(x, y, (max[0] - min[0]) * camera.scale, (max[1] - min[1]) * camera.scale);
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {import("../canvas2d/canvas2d.js").Camera} camera
 * @param {Box} box
 */
function fill(g, camera, { min, max }) {
  const [x, y] = camera.toScreen(min[0], max[1]);
  g.fillRect(x, y, (max[0] - min[0]) * camera.scale, (max[1] - min[1]) * camera.scale);
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {import("../canvas2d/canvas2d.js").Camera} camera
 * @param {Box} box
 * @param {string} text
 */
function label(g, camera, { min, max }, text) {
  if (camera.scale < 40) return;
  const [x, y] = camera.toScreen((min[0] + max[0]) / 2, max[1]);
  g.font = "600 11px system-ui, sans-serif";
  g.textAlign = "center";
  g.lineWidth = 3;
  const stroke = g.strokeStyle;
  g.strokeStyle = colors().paper;
  g.strokeText(text, x, y - 5);
  g.strokeStyle = stroke;
  g.fillStyle = colors().chair;
  g.fillText(text, x, y - 5);
  g.lineWidth = 1.5;
}
