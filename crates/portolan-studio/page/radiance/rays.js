// @ts-check

/**
 * @typedef {import("./picture.js").Scene} Scene
 * @typedef {import("./picture.js").Fit} Fit
 * @typedef {import("./picture.js").Frame} Frame
 */

/**
 * One row per ray: a line from its origin to what it measured, a ring at what it renders, the residual
 * between them, and where a bin is looked at, what the ray wants of it.
 * @param {CanvasRenderingContext2D} g
 * @param {Frame} f
 * @param {Scene} scene
 * @param {Fit} fit
 * @param {Record<string, string>} c
 */
export function drawRays(g, f, scene, fit, c) {
  g.textBaseline = "middle";
  const bin = fit.body.bin;
  const largest = bin ? Math.max(...bin.terms.map((/** @type {any} */ t) => Math.abs(t.pull)), 1e-30) : 1;
  for (const [i, ray] of scene.rays.entries()) {
    const y = f.row(i);
    const chosen = fit.body.look.ray === i;
    const rendered = fit.body.rays[i];
    if (chosen) {
      g.fillStyle = c.soft;
      g.fillRect(0, y - f.pitch / 2, f.right + f.left, f.pitch);
    }
    const color = ray.held_out ? c.contour : c.beam;
    line(g, f, ray, y, color, chosen);
    residual(g, f, ray, rendered, y, c, color);
    g.textAlign = "left";
    g.fillStyle = chosen ? c.ink : c.muted;
    g.fillText(`${i + 1}${ray.ascending ? " ›" : " ‹"}`, 26, y + 0.5);
    const off = rendered.residual;
    g.fillText(
      off === null ? "–" : `${off < 0 ? "−" : "+"}${Math.abs(off).toFixed(2)} m`,
      f.right + 8,
      y + 0.5,
    );
    const term = bin?.terms.find((/** @type {any} */ t) => t.ray === i);
    if (term) wants(g, f.x((bin.low + bin.high) / 2), y, term.pull, largest, f.pitch, c);
  }
  g.fillStyle = c.muted;
  g.textAlign = "right";
  g.fillText("rendered − measured", f.right + f.left - 8, f.rays.top - 2);
  turned(g, "training", 12, (f.row(0) + f.row(6)) / 2, c.muted);
  turned(g, "held out", 12, (f.row(7) + f.row(9)) / 2, c.muted);
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {Frame} f
 * @param {Scene["rays"][number]} ray
 * @param {number} y
 * @param {string} color
 * @param {boolean} chosen
 */
function line(g, f, ray, y, color, chosen) {
  const [from, to] = [f.x(ray.origin), f.x(ray.at)];
  g.strokeStyle = g.fillStyle = color;
  g.lineWidth = chosen ? 2.4 : 1.5;
  if (ray.held_out) g.setLineDash([6, 3]);
  g.beginPath();
  g.moveTo(from, y);
  g.lineTo(to, y);
  g.stroke();
  g.setLineDash([]);
  g.beginPath();
  g.arc(from, y, 3, 0, 7);
  g.fill();
  // What was measured: a wall.
  g.lineWidth = 2.4;
  g.beginPath();
  g.moveTo(to, y - 5);
  g.lineTo(to, y + 5);
  g.stroke();
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {Frame} f
 * @param {Scene["rays"][number]} ray
 * @param {{at: number | null}} rendered
 * @param {number} y
 * @param {Record<string, string>} c
 * @param {string} color
 */
function residual(g, f, ray, rendered, y, c, color) {
  if (rendered.at === null) return;
  const measured = f.x(ray.at);
  const exact = f.x(rendered.at);
  // The far plane lies beyond the corridor: an arrow at its end says so.
  const at = Math.max(f.left - 6, Math.min(f.right + 4, exact));
  g.strokeStyle = g.fillStyle = c.negative;
  g.lineWidth = 3.5;
  g.beginPath();
  g.moveTo(measured, y);
  g.lineTo(at, y);
  g.stroke();
  if (at !== exact) {
    const way = Math.sign(exact - at);
    g.beginPath();
    g.moveTo(at + way * 2, y);
    g.lineTo(at - way * 5, y - 5);
    g.lineTo(at - way * 5, y + 5);
    g.fill();
    return;
  }
  g.fillStyle = c.paper;
  g.strokeStyle = color;
  g.lineWidth = 1.8;
  g.beginPath();
  g.arc(at, y, 4, 0, 7);
  g.fill();
  g.stroke();
}

/**
 * A wedge: up where the ray wants more density in the bin.
 * @param {CanvasRenderingContext2D} g
 * @param {number} x
 * @param {number} y
 * @param {number} pull
 * @param {number} largest
 * @param {number} pitch
 * @param {Record<string, string>} c
 */
function wants(g, x, y, pull, largest, pitch, c) {
  // What is too little to matter would be a speck.
  if (Math.abs(pull) < 1e-3 * largest) return;
  const size = (0.25 + 0.75 * Math.sqrt(Math.abs(pull) / largest)) * Math.min(9, pitch * 0.6);
  const way = pull < 0 ? -1 : 1;
  g.fillStyle = pull < 0 ? c.positive : c.negative;
  g.strokeStyle = c.paper;
  g.lineWidth = 1.5;
  g.beginPath();
  g.moveTo(x, y + way * size);
  g.lineTo(x - size * 0.8, y - way * size * 0.5);
  g.lineTo(x + size * 0.8, y - way * size * 0.5);
  g.closePath();
  g.stroke();
  g.fill();
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {string} text
 * @param {number} x
 * @param {number} y
 * @param {string} color
 */
function turned(g, text, x, y, color) {
  g.save();
  g.translate(x, y);
  g.rotate(-Math.PI / 2);
  g.textAlign = "center";
  g.fillStyle = color;
  g.fillText(text, 0, 0);
  g.restore();
}
