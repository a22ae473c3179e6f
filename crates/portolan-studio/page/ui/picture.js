// @ts-check
import { colors } from "./theme.js";

/**
 * Canvases on one picture, below each other in columns, with a title: what a view saves as PNG.
 * @param {string} title
 * @param {(HTMLCanvasElement | null)[][]} columns
 */
export function compose(title, columns) {
  const c = colors();
  const gap = 12;
  const head = 34;
  const sizes = columns.map((col) => col.filter((x) => x !== null));
  const widths = sizes.map((col) => Math.max(0, ...col.map((x) => x.width)));
  const heights = sizes.map((col) => col.reduce((h, x) => h + x.height + gap, 0));
  const out = document.createElement("canvas");
  out.width = widths.reduce((w, x) => w + x + gap, gap);
  out.height = head + Math.max(...heights, 0) + gap;
  const g = /** @type {CanvasRenderingContext2D} */ (out.getContext("2d"));
  g.fillStyle = c.bg;
  g.fillRect(0, 0, out.width, out.height);
  g.fillStyle = c.ink;
  g.font = "600 16px system-ui, sans-serif";
  g.fillText(title, gap, 23);
  let x = gap;
  for (const [i, col] of sizes.entries()) {
    let y = head;
    for (const canvas of col) {
      g.drawImage(canvas, x, y);
      y += canvas.height + gap;
    }
    x += widths[i] + gap;
  }
  return out;
}
