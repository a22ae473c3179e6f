// @ts-check

/** Pixels within which a waypoint or a leg is caught. */
const CATCH = 9;
/** Pixels from point to point of a line that is drawn by dragging. */
const STRIDE = 14;
/** Waypoints that the engine takes. */
export const MOST = 1000;

/** @typedef {[number, number]} Point */

/**
 * The waypoint that a place is on; -1: none.
 * @param {Point[]} points
 * @param {Point} p
 * @param {number} scale pixels per metre
 */
export function waypointAt(points, p, scale) {
  // The last one lies on top.
  for (let i = points.length - 1; i >= 0; i--)
    if (Math.hypot(points[i][0] - p[0], points[i][1] - p[1]) * scale <= CATCH) return i;
  return -1;
}

/**
 * The leg that a place is on, by its first waypoint; -1: none.
 * @param {Point[]} points
 * @param {Point} p
 * @param {number} scale
 */
function legAt(points, p, scale) {
  for (let i = points.length - 2; i >= 0; i--) {
    const [a, b] = [points[i], points[i + 1]];
    const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    const t = Math.max(0, Math.min(1, ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / (dx * dx + dy * dy || 1)));
    if (Math.hypot(a[0] + t * dx - p[0], a[1] + t * dy - p[1]) * scale <= CATCH) return i;
  }
  return -1;
}

/**
 * What a drag that begins at `from` does to a path: moves a waypoint, bends a leg, or (where `drawing`) draws
 * a line on from the end. `undefined`: the picture pans.
 *
 * @param {{points: Point[], scale: () => number, drawing: boolean, changed: () => void}} path `points` is
 *   changed in place
 * @param {Point} from
 * @returns {((p: Point, last: boolean) => void) | undefined}
 */
export function drag({ points, scale, drawing, changed }, from) {
  let at = waypointAt(points, from, scale());
  if (at < 0) {
    const leg = drawing ? -1 : legAt(points, from, scale());
    if (leg < 0 && !drawing) return undefined;
    if (leg < 0) return drawOn(points, from, scale, changed);
    let made = false;
    return (p) => {
      if (!made) {
        if (points.length >= MOST) return;
        points.splice(leg + 1, 0, p);
      }
      made = true;
      points[leg + 1] = p;
      changed();
    };
  }
  return (p) => {
    // It may have been removed by a key meanwhile.
    at = Math.min(at, points.length - 1);
    if (at < 0) return;
    points[at] = p;
    changed();
  };
}

/** @param {Point[]} points @param {Point} from @param {() => number} scale @param {() => void} changed */
function drawOn(points, from, scale, changed) {
  let begun = false;
  return (/** @type {Point} */ p, /** @type {boolean} */ last) => {
    if (!begun && points.length < MOST) points.push(from);
    begun = true;
    const [x, y] = points[points.length - 1];
    if (points.length < MOST && (last || Math.hypot(p[0] - x, p[1] - y) * scale() >= STRIDE)) {
      points.push(p);
      changed();
    }
  };
}
