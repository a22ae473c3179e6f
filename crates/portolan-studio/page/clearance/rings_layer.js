// @ts-check
import { strokeLines } from "../canvas2d/lines.js";
import { colors } from "../ui/theme.js";

/** Pixels between labels of one ring, and the least between any two. */
const BETWEEN = 340;
const APART = 56;
/** Where there is no room, the next try is so many pixels further on. */
const NEXT = 24;

/**
 * Rings and their distances.
 * @param {CanvasRenderingContext2D} g
 * @param {import("../canvas2d/canvas2d.js").Camera} camera
 * @param {import("./scene.js").Rings} rings
 */
export function drawRings(g, camera, { points, starts, levels }) {
  g.lineWidth = 1;
  g.strokeStyle = colors().ink;
  g.globalAlpha = 0.5;
  strokeLines(g, camera, points, starts);
  g.globalAlpha = 1;
  const [width, height] = [g.canvas.width / devicePixelRatio, g.canvas.height / devicePixelRatio];
  /** Labels that are there, by squares of the least distance. @type {Map<number, [number, number][]>} */
  const placed = new Map();
  const square = (/** @type {number} */ x, /** @type {number} */ y) =>
    Math.floor(x / APART) * 65536 + Math.floor(y / APART);
  const room = (/** @type {number} */ x, /** @type {number} */ y) => {
    for (const dx of [-APART, 0, APART])
      for (const dy of [-APART, 0, APART])
        for (const [a, b] of placed.get(square(x + dx, y + dy)) ?? [])
          if (Math.hypot(a - x, b - y) < APART) return false;
    return true;
  };
  const [ox, oy] = camera.toScreen(0, 0);
  for (let k = 0; k < levels.length; k++) {
    // The first label after a quarter of the usual way, so that short rings have one.
    let way = 0.75 * BETWEEN;
    let [bx, by] = [NaN, NaN];
    for (let i = starts[k]; i < starts[k + 1]; i++) {
      const [nx, ny] = [ox + points[2 * i] * camera.scale, oy - points[2 * i + 1] * camera.scale];
      const length = Math.hypot(nx - bx, ny - by);
      if (length > 0) way += length;
      const [x, y] = [(nx + bx) / 2, (ny + by) / 2];
      if (way > BETWEEN && x > 10 && y > 10 && x < width - 10 && y < height - 10) {
        if (room(x, y)) {
          way = 0;
          const there = placed.get(square(x, y));
          if (there) there.push([x, y]);
          else placed.set(square(x, y), [[x, y]]);
          label(g, `${Number(levels[k].toFixed(3))}`, x, y, Math.atan2(ny - by, nx - bx));
        } else way = BETWEEN - NEXT;
      }
      [bx, by] = [nx, ny];
    }
  }
}

/** Labels as pictures: a text with a halo takes long to draw. @type {Map<string, OffscreenCanvas>} */
const pictures = new Map();

/**
 * @param {CanvasRenderingContext2D} g
 * @param {string} text
 * @param {number} x
 * @param {number} y
 * @param {number} angle
 */
function label(g, text, x, y, angle) {
  const [w, h] = [56, 18];
  const { paper, ink } = colors();
  const name = [text, paper, devicePixelRatio].join(" ");
  let picture = pictures.get(name);
  if (!picture) {
    if (pictures.size > 1000) pictures.clear();
    picture = new OffscreenCanvas(w * devicePixelRatio, h * devicePixelRatio);
    const p = /** @type {OffscreenCanvasRenderingContext2D} */ (picture.getContext("2d"));
    p.scale(devicePixelRatio, devicePixelRatio);
    p.font = "10.5px system-ui, sans-serif";
    p.textAlign = "center";
    p.textBaseline = "middle";
    p.lineJoin = "round";
    p.lineWidth = 4;
    p.strokeStyle = paper;
    p.strokeText(text, w / 2, h / 2);
    p.fillStyle = ink;
    p.fillText(text, w / 2, h / 2);
    pictures.set(name, picture);
  }
  g.save();
  g.translate(x, y);
  g.rotate(Math.abs(angle) > Math.PI / 2 ? angle + Math.PI : angle);
  g.drawImage(picture, -w / 2, -h / 2, w, h);
  g.restore();
}
