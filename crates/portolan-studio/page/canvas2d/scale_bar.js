// @ts-check
import { colors } from "../ui/theme.js";

/**
 * A round length at the lower left.
 * @param {CanvasRenderingContext2D} g
 * @param {import("./canvas2d.js").Camera} camera
 * @param {number} height
 */
export function scaleBar(g, camera, height) {
  const wanted = 90 / camera.scale;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const metres = [5, 2, 1].map((n) => n * power).find((n) => n <= wanted) ?? power;
  const length = metres * camera.scale;
  const [x, y] = [14, height - 14];
  g.strokeStyle = g.fillStyle = colors().muted;
  g.lineWidth = 1.5;
  g.beginPath();
  g.moveTo(x, y - 5);
  g.lineTo(x, y);
  g.lineTo(x + length, y);
  g.lineTo(x + length, y - 5);
  g.stroke();
  g.font = "11px system-ui, sans-serif";
  g.fillText(textOf(metres), x + length + 6, y);
}

/** @param {number} metres a round length */
function textOf(metres) {
  if (metres >= 1) return `${metres} m`;
  return metres >= 0.01 ? `${Math.round(metres * 100)} cm` : `${Math.round(metres * 1000)} mm`;
}
