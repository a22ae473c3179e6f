// @ts-check
import { Plane } from "../plane/plane.js";
import { colors } from "../ui/theme.js";
import { el } from "../ui/controls.js";
import { bytes, time, times } from "./format.js";

/**
 * Panels: name in the engine's answers, heading, what it says to those who do not see it.
 * @type {[string, string, string][]}
 */
const PANELS = [
  ["grid", "Occupancy grid", "The occupancy grid: a byte per cell"],
  ["tree", "Quadtree", "The quadtree with the cells that pruning has left"],
  ["tsdf", "TSDF", "The truncated signed distance field, the extracted contour and the truth"],
  ["esdf", "ESDF", "The Euclidean distance field with its level rings"],
  ["contour", "Contour", "The extracted contour and the truth"],
  ["cloud", "Point cloud", "The end points of all beams"],
];
/** Meters of a panel, memory and then times. @type {[string, string][]} */
const METERS = [
  ["memory", "memory"],
  ["update", "update"],
  ["occupancy", "occupancy?"],
  ["distance", "distance?"],
  ["surface", "surface?"],
];

/**
 * Six views of one part of the world, with meters.
 * @param {import("../ui/meter.js").Meter} meter
 * @param {{oncamera: () => void, onhover: (p: [number, number] | undefined) => void}} o
 */
export function panels(meter, o) {
  /** Where all are asked. @type {[number, number] | undefined} */
  let place;
  const each = PANELS.map(([name, title, label]) => {
    const plane = new Plane({ id: `gallery-${name}`, label, meter });
    const badge = el("span", { class: "badge", id: `gallery-${name}-badge` });
    const answer = el("p", { class: "answer", id: `gallery-${name}-answer` });
    const rows = METERS.map(([key, text]) => {
      const bar = el("i", { style: "width: 0" });
      const value = el("output", { id: `gallery-${name}-${key}` }, "–");
      const by = el("span", { class: "note" });
      const head = el("dt", { "data-meter": key }, text, by);
      return {
        key,
        bar,
        value,
        by,
        head,
        row: el(
          "dd",
          { "data-meter": key },
          el("span", { class: "track", "aria-hidden": "true" }, bar),
          value,
        ),
      };
    });
    plane.node.append(answer);
    const node = el(
      "article",
      { class: "panel", id: `gallery-panel-${name}`, "aria-label": title },
      el("h2", {}, title, badge),
      plane.node,
      el("dl", { class: "meters" }, ...rows.flatMap((r) => [r.head, r.row])),
    );
    return { name, title, plane, node, badge, answer, rows };
  });

  // All six are one picture: drawn together, measured together.
  let asked = false;
  const draw = () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      if (each[0].plane.canvas.clientWidth === 0) return;
      meter.measure(paint);
      meter.picture();
    });
  };
  const paint = () => each.forEach(({ plane }) => plane.paint());
  let following = false;
  for (const { plane, name } of each) {
    // All have one scale.
    plane.bar = name === PANELS[0][0];
    plane.draw = draw;
    plane.oncamera = () => {
      if (following) return;
      following = true;
      for (const other of each)
        [other.plane.home, other.plane.center, other.plane.zoom] = [
          plane.home,
          [...plane.center],
          plane.zoom,
        ];
      following = false;
      o.oncamera();
      draw();
    };
    plane.onhover = (p) => o.onhover(p);
  }

  /** @type {import("../plane/plane.js").Layer} */
  const crosshair = (g, camera) => {
    if (!place) return;
    const [x, y] = camera.toScreen(...place).map((v) => Math.round(v) + 0.5);
    g.strokeStyle = colors().ink;
    g.lineWidth = 1;
    g.globalAlpha = 0.55;
    g.beginPath();
    g.moveTo(x, 0);
    g.lineTo(x, g.canvas.clientHeight);
    g.moveTo(0, y);
    g.lineTo(g.canvas.clientWidth, y);
    g.stroke();
  };

  return {
    node: el("div", { class: "panels" }, ...each.map((p) => p.node)),
    /** The camera of all. */
    plane: each[0].plane,
    draw,
    paint,
    /** @param {import("./layers.js").Picture} picture */
    show(picture) {
      const layers = picture.layers();
      for (const { plane, name } of each) plane.layers = [...layers[name], crosshair];
      draw();
    },
    /**
     * Crosshairs, and what each answers there.
     * @param {[number, number] | undefined} p
     * @param {Record<string, string>} answers
     */
    point(p, answers) {
      place = p;
      for (const { name, answer } of each) answer.textContent = answers[name] ?? "";
      draw();
    },
    /**
     * Bars over their scales.
     * @param {any} costs
     * @param {{memory: [number, number], time: [number, number]}} scales powers of ten
     */
    meters(costs, scales) {
      for (const { name, rows } of each) {
        const row = costs.rows.find((/** @type {any} */ r) => r.panel === name);
        if (!row) continue;
        for (const { key, bar, value, by, head } of rows) {
          const cost =
            key === "memory"
              ? { seconds: row.memory_bytes, by: row.derived ? "on top of the TSDF" : null }
              : row[key];
          const [low, high] = key === "memory" ? scales.memory : scales.time;
          const share = cost && cost.seconds > 0 ? (Math.log10(cost.seconds) - low) / (high - low) : 0;
          bar.style.width = `${Math.max(cost && cost.seconds > 0 ? 1 : 0, Math.min(100, 100 * share)).toFixed(1)}%`;
          value.textContent = !cost
            ? "–"
            : key === "memory"
              ? `${row.derived ? "+" : ""}${bytes(cost.seconds)}`
              : time(cost.seconds);
          value.title = head.title = !cost ? "cannot answer" : (cost.by ?? "");
          by.textContent = cost?.by && key !== "memory" ? ` ${cost.by}` : "";
        }
      }
    },
    /** Frames for a workload that was run; `undefined`: none. @param {any} winner @param {any[]} rows */
    frames(winner, rows) {
      for (const { name, node, badge, rows: meters } of each) {
        const own = rows.flatMap((/** @type {any} */ r, /** @type {number} */ i) =>
          r.panel === name ? [i] : [],
        );
        const first = own[0];
        const wins = winner !== undefined && own.includes(winner.row);
        const level = winner !== undefined && !wins && own.some((i) => winner.level.includes(i));
        node.classList.toggle("winner", wins);
        node.classList.toggle("level", level);
        for (const m of meters) m.head.classList.toggle("asked", m.key === winner?.workload);
        badge.textContent =
          winner === undefined || first === undefined
            ? ""
            : wins
              ? "fastest"
              : level
                ? "level with it"
                : behind(winner, rows[first], first);
      }
    },
    /** What they show as canvases with headings and meters, in three columns, for a picture. */
    canvases() {
      paint();
      const drawn = each.map(portrait);
      return [
        [drawn[0], drawn[3]],
        [drawn[1], drawn[4]],
        [drawn[2], drawn[5]],
      ];
    },
  };
}

/** How far a row is behind, in words. @param {any} winner @param {any} row @param {number} i */
function behind(winner, row, i) {
  const cost = row[winner.workload];
  if (!cost) return "– cannot answer";
  return winner.times[i] === null ? `${time(cost.seconds)} more` : `${times(winner.times[i])} slower`;
}

/**
 * A panel as one canvas.
 * @param {{title: string, plane: Plane, node: HTMLElement, badge: HTMLElement, rows: any[]}} panel
 */
function portrait({ title, plane, node, badge, rows }) {
  const c = colors();
  const ratio = devicePixelRatio;
  const { width, height } = plane.canvas;
  const [head, line] = [28, 17];
  const out = document.createElement("canvas");
  [out.width, out.height] = [width, height + Math.round((head + rows.length * line + 12) * ratio)];
  const g = /** @type {CanvasRenderingContext2D} */ (out.getContext("2d"));
  g.fillStyle = c.panel;
  g.fillRect(0, 0, out.width, out.height);
  g.drawImage(plane.canvas, 0, Math.round(head * ratio));
  g.scale(ratio, ratio);
  const [w, foot] = [width / ratio, head + height / ratio + 18];
  const text = (
    /** @type {string} */ t,
    /** @type {number} */ x,
    /** @type {number} */ y,
    /** @type {CanvasTextAlign} */ align,
    colour = c.ink,
    font = "12px",
  ) => {
    [g.textAlign, g.fillStyle, g.font] = [align, colour, `${font} system-ui, sans-serif`];
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
