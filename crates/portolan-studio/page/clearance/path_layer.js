// @ts-check
import { colors } from "../ui/theme.js";

/**
 * A path as the engine has checked it: lines of its parts, and the verdict on each.
 * @typedef {{points: Float32Array, starts: Uint32Array, pieces: {from: number, to: number, verdict: Verdict,
 *   cause: string | null}[]}} Checked
 * @typedef {"certified" | "violated" | "undecided"} Verdict
 */

/**
 * Colors by the names of style.css, and dashes: the verdicts differ without color, too.
 * @type {Record<Verdict, {color: string, dash: number[]}>}
 */
export const VERDICTS = {
  certified: { color: "good", dash: [] },
  violated: { color: "bad", dash: [7, 5] },
  undecided: { color: "warn", dash: [2, 5] },
};

/** More waypoints than this have no handles. */
const HANDLES = 60;

/**
 * @param {CanvasRenderingContext2D} g
 * @param {import("../canvas2d/canvas2d.js").Camera} camera
 * @param {import("./scene.js").Scene} s
 */
export function drawPath(g, camera, s) {
  const c = colors();
  g.lineJoin = g.lineCap = "round";
  const { checked, waypoints } = s;
  if (checked) {
    const trace = (/** @type {number} */ k) => {
      g.beginPath();
      for (let i = checked.starts[k]; i < checked.starts[k + 1]; i++)
        g.lineTo(...camera.toScreen(checked.points[2 * i], checked.points[2 * i + 1]));
    };
    // The room that the robot takes; one stroke each, so that it is even.
    for (let k = 0; k < checked.pieces.length; k++) {
      trace(k);
      g.lineCap = "butt";
      g.globalAlpha = 0.16;
      g.strokeStyle = c[VERDICTS[checked.pieces[k].verdict].color];
      g.lineWidth = Math.max(1, 2 * s.radius * camera.scale);
      g.stroke();
    }
    g.globalAlpha = 1;
    for (let k = 0; k < checked.pieces.length; k++) {
      const { color, dash } = VERDICTS[checked.pieces[k].verdict];
      trace(k);
      g.setLineDash([]);
      g.lineCap = "butt";
      g.strokeStyle = c.paper;
      g.lineWidth = 5.5;
      g.stroke();
      g.setLineDash(dash);
      g.strokeStyle = c[color];
      g.lineWidth = 3;
      g.stroke();
    }
    g.setLineDash([]);
  }
  if (waypoints.length === 0) return;
  const shown = waypoints.length > HANDLES ? [waypoints[0], waypoints[waypoints.length - 1]] : waypoints;
  for (const [i, p] of shown.entries()) {
    const [x, y] = camera.toScreen(...p);
    g.beginPath();
    g.arc(x, y, i === 0 ? 6 : 4.5, 0, 2 * Math.PI);
    g.fillStyle = c.paper;
    g.fill();
    g.strokeStyle = c.ink;
    g.lineWidth = 2;
    g.stroke();
  }
}
