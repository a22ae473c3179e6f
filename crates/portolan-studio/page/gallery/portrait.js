// @ts-check
import { colors } from "../ui/theme.js";

/**
 * A panel as one canvas.
 * @param {import("./panel.js").Panel} panel
 */
export function portrait({ title, canvas2d, node, badge, meters: rows }) {
  const c = colors();
  const ratio = devicePixelRatio;
  const { width, height } = canvas2d.canvas;
  const [head, line] = [28, 17];
  const out = document.createElement("canvas");
  [out.width, out.height] = [width, height + Math.round((head + rows.length * line + 12) * ratio)];
  const g = /** @type {CanvasRenderingContext2D} */ (out.getContext("2d"));
  g.fillStyle = c.panel;
  g.fillRect(0, 0, out.width, out.height);
  g.drawImage(canvas2d.canvas, 0, Math.round(head * ratio));
  g.scale(ratio, ratio);
  const [w, foot] = [width / ratio, head + height / ratio + 18];
  const text = (
    /** @type {string} */ t,
    /** @type {number} */ x,
    /** @type {number} */ y,
    /** @type {CanvasTextAlign} */ align,
    color = c.ink,
    font = "12px",
  ) => {
    [g.textAlign, g.fillStyle, g.font] = [align, color, `${font} system-ui, sans-serif`];
    g.fillText(t, x, y);
  };
  text(title, 10, 19, "left", c.ink, "600 13px");
  text(badge.textContent ?? "", w - 10, 19, "right", node.classList.contains("winner") ? c.good : c.muted);
  rows.forEach((r, i) => {
    text(r.head.textContent, 10, foot + i * line, "left", c.muted);
    g.fillStyle = c.line;
    g.fillRect(180, foot + i * line - 7, w - 270, 6);
    g.fillStyle = c.accent;
    g.fillRect(180, foot + i * line - 7, ((w - 270) * parseFloat(r.bar.style.width || "0")) / 100, 6);
    text(r.value.textContent, w - 10, foot + i * line, "right");
  });
  g.strokeStyle = node.classList.contains("winner") || node.classList.contains("level") ? c.good : c.line;
  g.setLineDash(node.classList.contains("level") ? [6, 4] : []);
  g.lineWidth = node.classList.contains("winner") ? 6 : 3;
  g.strokeRect(0, 0, w, out.height / ratio);
  return out;
}
