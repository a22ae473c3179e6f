// @ts-check
import { colors } from "../ui/theme.js";

/** Gradients shorter than this are dots: there is no direction in them. */
const NONE = 0.05;
/**
 * Longer ones are drawn as if they were of this length: projective distances can grow faster than one walks.
 */
const MOST = 1.3;

/**
 * Arrows of one field, as long as the gradients are: one of length 1 takes most of its square.
 * @param {CanvasRenderingContext2D} g
 * @param {import("../canvas2d/canvas2d.js").Camera} camera
 * @param {import("./scene.js").Arrows} arrows
 */
export function drawArrows(g, camera, { points, gradients, spacing }) {
  const unit = 0.72 * spacing * camera.scale;
  const head = Math.min(5, 0.3 * unit);
  g.strokeStyle = g.fillStyle = colors().ink;
  g.globalAlpha = 0.62;
  g.lineWidth = 1;
  g.beginPath();
  for (let i = 0; i < points.length; i += 2) {
    const [x, y] = camera.toScreen(points[i], points[i + 1]);
    const [gx, gy] = [gradients[i], -gradients[i + 1]];
    const norm = Math.hypot(gx, gy);
    if (norm < NONE) continue;
    const scale = (unit * Math.min(norm, MOST)) / norm;
    arrow(g, x - 0.5 * gx * scale, y - 0.5 * gy * scale, gx * scale, gy * scale, head);
  }
  g.stroke();
  for (let i = 0; i < points.length; i += 2) {
    if (Math.hypot(gradients[i], gradients[i + 1]) >= NONE) continue;
    const [x, y] = camera.toScreen(points[i], points[i + 1]);
    g.fillRect(x - 0.75, y - 0.75, 1.5, 1.5);
  }
  g.globalAlpha = 1;
}

/**
 * Adds an arrow from x, y by dx, dy.
 * @param {CanvasRenderingContext2D} g
 * @param {number} x
 * @param {number} y
 * @param {number} dx
 * @param {number} dy
 * @param {number} head
 */
function arrow(g, x, y, dx, dy, head) {
  const length = Math.hypot(dx, dy);
  const [ux, uy] = [dx / length, dy / length];
  g.moveTo(x, y);
  g.lineTo(x + dx, y + dy);
  g.moveTo(x + dx - head * (ux + 0.6 * uy), y + dy - head * (uy - 0.6 * ux));
  g.lineTo(x + dx, y + dy);
  g.lineTo(x + dx - head * (ux - 0.6 * uy), y + dy - head * (uy + 0.6 * ux));
}

/**
 * The probe: the circle in which nothing is, the one in which something is, and the gradient of the field
 * that is shown.
 * @param {CanvasRenderingContext2D} g
 * @param {import("../canvas2d/canvas2d.js").Camera} camera
 * @param {import("./scene.js").Scene} s
 */
export function drawProbe(g, camera, s) {
  if (!s.probe) return;
  const c = colors();
  const [x, y] = camera.toScreen(...s.probe);
  const answer =
    s.answer && s.answer.at[0] === s.probe[0] && s.answer.at[1] === s.probe[1] ? s.answer : undefined;
  // While the answer for this place is under way, that of the last one is drawn where it was given.
  const last = answer ?? s.answer;
  if (last) {
    const [cx, cy] = camera.toScreen(last.at[0], last.at[1]);
    const { lower, upper, status } = last.euclidean;
    const color = status === "known" || status === "saturated" ? c.accent : c.warn;
    if (lower !== null && lower > 0) {
      const r = lower * camera.scale;
      circle(g, cx, cy, r);
      g.fillStyle = `${color}22`;
      g.fill();
      g.setLineDash([]);
      stroked(g, c.paper, 3.5);
      stroked(g, color, 1.75);
      if (upper !== null && (upper - lower) * camera.scale > 1) {
        circle(g, cx, cy, upper * camera.scale);
        g.setLineDash([4, 4]);
        stroked(g, color, 1);
        g.setLineDash([]);
      }
    }
    // What the truncated field takes for the distance: the same wherever it is a constant.
    const kept = last.truncated.distance;
    if (s.image?.which === "truncated" && kept) {
      circle(g, cx, cy, Math.abs(kept) * camera.scale);
      g.setLineDash([3, 3]);
      stroked(g, c.ink, 1.25);
      g.setLineDash([]);
    }
    const gradient = last[s.image?.which === "truncated" ? "truncated" : "euclidean"].gradient;
    if (gradient && Math.hypot(gradient[0], gradient[1]) >= NONE) {
      const length = 44 * Math.min(1, MOST / Math.hypot(gradient[0], gradient[1]));
      g.beginPath();
      arrow(g, cx, cy, length * gradient[0], -length * gradient[1], 8);
      g.lineCap = "round";
      stroked(g, c.paper, 5);
      stroked(g, c.ink, 2.25);
    }
  }
  g.beginPath();
  g.arc(x, y, 4.5, 0, 2 * Math.PI);
  g.fillStyle = c.ink;
  g.fill();
  stroked(g, c.paper, 1.5);
}

/** @param {CanvasRenderingContext2D} g @param {number} x @param {number} y @param {number} r */
function circle(g, x, y, r) {
  g.beginPath();
  g.arc(x, y, r, 0, 2 * Math.PI);
}

/** @param {CanvasRenderingContext2D} g @param {string} color @param {number} width */
function stroked(g, color, width) {
  g.strokeStyle = color;
  g.lineWidth = width;
  g.stroke();
}
