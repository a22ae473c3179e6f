// @ts-check

/**
 * @typedef {import("./picture.js").Scene} Scene
 * @typedef {import("./picture.js").Fit} Fit
 * @typedef {import("./picture.js").Frame} Frame
 */

/**
 * Density as bars, as high as the share of light that ends in the bin; what of the chosen ray's light does,
 * solid in them, and how much of it is left, as a curve; reflectance as a strip; and what descent wants of
 * every bin.
 * @param {CanvasRenderingContext2D} g
 * @param {Frame} f
 * @param {Scene} scene
 * @param {Fit} fit
 * @param {Record<string, string>} c
 */
export function drawField(g, f, scene, fit, c) {
  const y = (/** @type {number} */ share) => f.field.bottom - share * (f.field.bottom - f.field.top);
  marks(g, f, scene, c, y);
  const { opacity, reflectance, gradient, light, light_at: at, ends } = fit.arrays;
  const [held, chosen] = [
    fit.body.look.ray !== null && scene.rays[fit.body.look.ray].held_out,
    fit.body.look.ray,
  ];
  const ray = held ? c.contour : c.beam;
  const edge = (/** @type {number} */ i) => f.x(i * scene.resolution);

  g.fillStyle = `${c.positive}66`;
  for (let i = 0; i < scene.bins; i++)
    g.fillRect(edge(i) + 0.5, y(opacity[i]), edge(i + 1) - edge(i) - 1, f.field.bottom - y(opacity[i]));
  if (ends) {
    g.fillStyle = ray;
    for (let i = 0; i < scene.bins; i++)
      g.fillRect(edge(i) + 0.5, y(ends[i]), edge(i + 1) - edge(i) - 1, f.field.bottom - y(ends[i]));
  }
  truth(g, f, scene, c, y);
  if (light) {
    g.strokeStyle = ray;
    g.lineWidth = 2.2;
    g.lineJoin = "round";
    g.beginPath();
    light.forEach((share, i) => g[i ? "lineTo" : "moveTo"](f.x(at[i]), y(share)));
    g.stroke();
    g.fillStyle = ray;
    g.beginPath();
    g.arc(f.x(at[0]), y(1), 4, 0, 7);
    g.fill();
  }
  strip(g, f, scene, reflectance, c);
  pulls(g, f, scene, gradient, c);

  g.textBaseline = "bottom";
  g.textAlign = "left";
  g.fillStyle = c.muted;
  g.fillText("density (1/m)", 8, f.field.top - 8);
  if (chosen !== null) {
    g.textAlign = "right";
    g.fillText(`light of ray ${chosen + 1} that is left`, f.right + 50, f.field.top - 8);
  }
}

/**
 * Left the densities, right the shares of light: the same height.
 * @param {CanvasRenderingContext2D} g
 * @param {Frame} f
 * @param {Scene} scene
 * @param {Record<string, string>} c
 * @param {(s: number) => number} y
 */
function marks(g, f, scene, c, y) {
  g.lineWidth = 1;
  g.textBaseline = "middle";
  g.strokeStyle = c["grid-line"];
  g.fillStyle = c.muted;
  let last = Infinity;
  for (const [density, share] of scene.marks) {
    g.beginPath();
    g.moveTo(f.left, Math.round(y(share)) + 0.5);
    g.lineTo(f.right, Math.round(y(share)) + 0.5);
    g.stroke();
    // The axis closes up towards opaque: a mark that has no room has no number.
    if (last - y(share) < 12) continue;
    last = y(share);
    g.textAlign = "right";
    g.fillText(String(density), f.left - 8, y(share));
  }
  g.textAlign = "left";
  for (const share of [0, 0.5, 1]) g.fillText(`${100 * share} %`, f.right + 8, y(share));
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {Frame} f
 * @param {Scene} scene
 * @param {Record<string, string>} c
 * @param {(s: number) => number} y
 */
function truth(g, f, scene, c, y) {
  g.strokeStyle = c.truth;
  g.lineWidth = 1.5;
  g.setLineDash([5, 4]);
  for (const [low, high] of scene.bodies) {
    const inside = scene.truth.opacity[Math.floor((low + high) / 2 / scene.resolution)];
    g.strokeRect(f.x(low), y(inside), f.x(high) - f.x(low), f.field.bottom - y(inside));
  }
  g.setLineDash([]);
  g.strokeStyle = c.line;
  g.lineWidth = 1;
  g.beginPath();
  g.moveTo(f.left, f.field.bottom + 0.5);
  g.lineTo(f.right, f.field.bottom + 0.5);
  g.stroke();
}

const gray = (/** @type {number} */ v) => {
  const level = Math.round(255 * Math.max(0, Math.min(1, v)));
  return `rgb(${level},${level},${level})`;
};

/**
 * What the bins reflect, and below it what the bodies do.
 * @param {CanvasRenderingContext2D} g
 * @param {Frame} f
 * @param {Scene} scene
 * @param {Float32Array} reflectance
 * @param {Record<string, string>} c
 */
function strip(g, f, scene, reflectance, c) {
  const { top, bottom } = f.strip;
  const middle = bottom - 7;
  for (let i = 0; i < scene.bins; i++) {
    const [a, b] = [f.x(i * scene.resolution), f.x((i + 1) * scene.resolution)];
    g.fillStyle = gray(reflectance[i]);
    g.fillRect(a, top, b - a + 0.5, middle - top);
    if (scene.truth.opacity[i] === 0) continue;
    g.fillStyle = gray(scene.truth.reflectance[i]);
    g.fillRect(a, middle, b - a + 0.5, bottom - middle);
  }
  g.strokeStyle = c.line;
  g.strokeRect(f.left, top + 0.5, f.right - f.left, middle - top);
  g.strokeStyle = c.truth;
  g.setLineDash([3, 2]);
  for (const [low, high] of scene.bodies)
    g.strokeRect(f.x(low), middle, f.x(high) - f.x(low), bottom - middle);
  g.setLineDash([]);
  g.fillStyle = c.muted;
  g.textAlign = "right";
  g.textBaseline = "middle";
  g.fillText("reflect.", f.left - 6, (top + middle) / 2);
}

/**
 * Up: descent wants more density in the bin; down: less. Heights are roots, so that small pulls are seen
 * beside the largest, which fills its half.
 * @param {CanvasRenderingContext2D} g
 * @param {Frame} f
 * @param {Scene} scene
 * @param {Float32Array} gradient
 * @param {Record<string, string>} c
 */
function pulls(g, f, scene, gradient, c) {
  const { top, bottom } = f.pull;
  const middle = (top + bottom) / 2;
  const largest = gradient.reduce((m, v) => Math.max(m, Math.abs(v)), 1e-30);
  g.strokeStyle = c.line;
  g.lineWidth = 1;
  g.beginPath();
  g.moveTo(f.left, Math.round(middle) + 0.5);
  g.lineTo(f.right, Math.round(middle) + 0.5);
  g.stroke();
  for (let i = 0; i < scene.bins; i++) {
    const [a, b] = [f.x(i * scene.resolution), f.x((i + 1) * scene.resolution)];
    const height = Math.sqrt(Math.abs(gradient[i]) / largest) * (middle - top);
    g.fillStyle = gradient[i] < 0 ? c.positive : c.negative;
    g.fillRect(a + 0.5, gradient[i] < 0 ? middle - height : middle, b - a - 1, height);
  }
  g.fillStyle = c.muted;
  g.textAlign = "right";
  g.textBaseline = "middle";
  g.fillText("more", f.left - 6, top + 6);
  g.fillText("less", f.left - 6, bottom - 5);
  g.textAlign = "left";
  g.fillText("−∂J/∂θ", f.right + 8, middle);
}
