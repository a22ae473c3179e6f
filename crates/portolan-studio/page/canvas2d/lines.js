// @ts-check

/**
 * Lines in one array, as the engine sends them: points x, y, and where each line begins (in points, the end
 * included).
 * @param {CanvasRenderingContext2D} g
 * @param {import("./canvas2d.js").Camera} camera
 * @param {Float32Array} points
 * @param {Uint32Array} starts
 */
export function strokeLines(g, camera, points, starts) {
  const [ox, oy] = camera.toScreen(0, 0);
  const s = camera.scale;
  g.beginPath();
  for (let k = 0; k + 1 < starts.length; k++) {
    const [from, to] = [starts[k], starts[k + 1]];
    g.moveTo(ox + points[2 * from] * s, oy - points[2 * from + 1] * s);
    for (let i = from + 1; i < to; i++) g.lineTo(ox + points[2 * i] * s, oy - points[2 * i + 1] * s);
  }
  g.stroke();
}

/**
 * Segments from a point to the ends.
 * @param {CanvasRenderingContext2D} g
 * @param {import("./canvas2d.js").Camera} camera
 * @param {[number, number]} from
 * @param {Float32Array} ends
 */
export function strokeRays(g, camera, from, ends) {
  const [ox, oy] = camera.toScreen(0, 0);
  const [x, y] = camera.toScreen(...from);
  const s = camera.scale;
  g.beginPath();
  for (let i = 0; i < ends.length; i += 2) {
    g.moveTo(x, y);
    g.lineTo(ox + ends[i] * s, oy - ends[i + 1] * s);
  }
  g.stroke();
}

/**
 * Faces as pairs of points.
 * @param {CanvasRenderingContext2D} g
 * @param {import("./canvas2d.js").Camera} camera
 * @param {[[number, number], [number, number]][]} faces
 */
export function strokeFaces(g, camera, faces) {
  g.beginPath();
  for (const [a, b] of faces) {
    g.moveTo(...camera.toScreen(...a));
    g.lineTo(...camera.toScreen(...b));
  }
  g.stroke();
}
