// @ts-check

/** @typedef {import("../views/fusion.js").Fusion} Fusion */

/**
 * What a link says of settings, scan, chair and cell.
 * @param {Fusion} view
 * @returns {Record<string, string>}
 */
export function write({ last, scene, settings, shown }) {
  const moves = scene.moves.map(([scan, [x, y]]) => `${scan},${x.toFixed(4)},${y.toFixed(4)}`);
  return {
    ...settings.link(),
    scan: String(last.at),
    ...(scene.cell ? { cell: scene.cell.join(",") } : {}),
    ...(shown.field.value === "weight" ? { shows: "weight" } : {}),
    ...(moves.length ? { chair: moves.join(";") } : {}),
  };
}

/** Makes what a link says. @param {Fusion} view @param {URLSearchParams} link */
export async function restore(view, link) {
  const settings = view.settings.wanted(link);
  if (settings) await view.tryAsk({ op: "set", settings });
  const number = (/** @type {string | number | null} */ scan) => Math.max(0, Math.floor(Number(scan)) || 0);
  for (const text of (link.get("chair") ?? "").split(";")) {
    const [since, x, y] = text.split(",").map(Number);
    if (!text || ![since, x, y].every(Number.isFinite)) continue;
    await view.tryAsk({ op: "seek", scan: number(since) });
    await view.tryAsk({ op: "move_chair", to: [x, y] });
  }
  if (link.has("scan")) await view.tryAsk({ op: "seek", scan: number(link.get("scan")) });
  view.takeIn();
  if (link.get("shows") === "weight") {
    view.shown.field.value = "weight";
    view.showField("weight");
  }
  const cell = (link.get("cell") ?? "").split(",").map(Number);
  if (link.has("cell") && cell.length === 2 && cell.every(Number.isInteger))
    await view.choose([cell[0], cell[1]]);
  view.canvas2d.restore(link);
}
