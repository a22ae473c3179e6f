// @ts-check
import { Plane } from "../plane/plane.js";
import { chairPanel } from "../fusion/chair.js";
import { Field } from "../fusion/field.js";
import { Inspector } from "../fusion/inspector.js";
import { player } from "../fusion/player.js";
import { layers } from "../fusion/scene.js";
import { settings } from "../fusion/settings.js";
import { choice, el, facts, group, legend, toggle } from "../ui/controls.js";
import { saveAnswer } from "../ui/files.js";
import { compose } from "../ui/picture.js";

/** Where the chapter's experiment puts the chair, from where it stands first (metres). */
const CHAPTER_MOVE = [1.38, -1.62];

/** @type {import("../main.js").View} */
export default {
  id: "fusion",
  title: "Fusion",
  mount(root, app) {
    /** @type {import("../fusion/scene.js").Scene} */
    const scene = {
      field: undefined,
      contour: new Float32Array(),
      lines: new Uint32Array([0]),
      beams: new Float32Array(),
      kinds: new Uint8Array(),
      pose: null,
      truth: null,
      ghost: undefined,
      held: undefined,
      cell: undefined,
      visible: { beams: true, contour: true, truth: true },
    };
    /** Answers that came since the last picture. @type {import("../engine/engine.js").Answer[]} */
    const arrived = [];
    /** @type {any} */
    let last;
    let opened = false;
    let greeted = false;
    /** Where the chair stood first. @type {import("../fusion/scene.js").Box | undefined} */
    let home;
    /** When the chair was moved, and where to. @type {[number, [number, number]][]} */
    let moves = [];

    const plane = new Plane({
      id: "fusion-canvas",
      label: "The truncated signed distance field while it is fused",
      meter: app.meter,
      before: takeIn,
    });
    plane.layers = layers(scene);
    plane.oncamera = app.changed;

    /** @param {object} question */
    async function ask(question) {
      try {
        const answer = await app.engine.ask("fusion", question);
        if (answer.body && "at" in answer.body) {
          arrived.push(answer);
          plane.draw();
        }
        return answer;
      } catch (error) {
        app.fail(error);
        throw error;
      }
    }
    /** Asks; what is refused is in the status line already. @param {object} question */
    const tryAsk = (question) => ask(question).catch(() => undefined);

    const play = player({
      step: async (scans) => void (await ask({ op: "step", scans })),
      seek: async (scan) => (void (await ask({ op: "seek", scan })), app.changed()),
      ontoggle: (on) => on && app.meter.reset(),
    });
    const panel = settings((values) => tryAsk({ op: "set", settings: values }).then(app.changed));
    const inspector = new Inspector({
      move: (dx, dy) => scene.cell && choose([scene.cell[0] + dx, scene.cell[1] + dy]),
      close: () => choose(undefined),
    });
    const chair = chairPanel({
      move: () => {
        const box = scene.truth?.chair;
        if (!box) return;
        const sign = home && Math.hypot(box.min[0] - home.min[0], box.min[1] - home.min[1]) < 1e-9 ? 1 : -1;
        moveChair([
          (box.min[0] + box.max[0]) / 2 + sign * CHAPTER_MOVE[0],
          (box.min[1] + box.max[1]) / 2 + sign * CHAPTER_MOVE[1],
        ]);
      },
      toCell: () => scene.cell && scene.field && moveChair(scene.field.center(scene.cell)),
    });
    const numbers = facts([
      ["scan-cells", "cells touched by the scan"],
      ["scan-beams", "beams: hits, free, lost"],
      ["observed", "cells observed"],
      ["map-bytes", "memory of the map"],
      ["step-ms", "computed in"],
      ["under", "under the pointer"],
    ]);
    const shows = choice({
      id: "shows",
      label: "Show",
      value: "distance",
      options: [
        ["distance", "signed distance D"],
        ["weight", "weight W"],
      ],
      onchange: (v) => {
        if (!scene.field) return;
        scene.field.shows = v === "weight" ? "weight" : "distance";
        recolor();
        app.changed();
      },
    });
    const shown = (/** @type {"beams" | "contour" | "truth"} */ what, /** @type {string} */ label) =>
      toggle({
        id: `show-${what}`,
        label,
        value: true,
        onchange: (v) => ((scene.visible[what] = v), plane.draw()),
      });
    const truthToggle = shown("truth", "Truth");
    const exportFile = (/** @type {string} */ file, /** @type {string} */ name) =>
      el(
        "button",
        {
          type: "button",
          id: `export-${file}`,
          onclick: () => tryAsk({ op: "export", file }).then((answer) => answer && saveAnswer(answer)),
        },
        name,
      );

    const legendOf = (/** @type {boolean} */ simulated) =>
      legend([
        {
          color: "",
          text: "behind, in front of a surface",
          ramp: "linear-gradient(90deg, var(--negative), transparent, color-mix(in srgb, var(--positive) 50%, transparent))",
        },
        { color: "beam", text: "beams" },
        { color: "contour", text: "contour" },
        ...(simulated
          ? [
              { color: "truth", text: "truth", dashed: true },
              { color: "chair", text: "chair" },
            ]
          : []),
        { color: "unknown", text: "never observed" },
      ]);
    const theLegend = el("div");

    root.append(
      el("div", { class: "field" }, plane.node, play.node),
      el(
        "div",
        { class: "side" },
        el(
          "div",
          { class: "group" },
          shows.node,
          shown("beams", "Beams of the scan").node,
          shown("contour", "Extracted contour").node,
          truthToggle.node,
          theLegend,
        ),
        inspector.node,
        chair.node,
        panel.node,
        group("This scan", numbers.node),
        group(
          "Take away",
          el(
            "div",
            { class: "row" },
            exportFile("esdf", "esdf.bin"),
            exportFile("contour", "contour.geojson"),
            exportFile("map", "map.portolan"),
          ),
        ),
      ),
    );

    /** Takes in what arrived; part of the picture's work. */
    function takeIn() {
      for (const { body, arrays } of arrived.splice(0)) {
        const f = /** @type {any} */ (arrays);
        if (body.all) {
          const { settings: s, grid, truth, block, name } = body.all;
          if (!scene.field || JSON.stringify(scene.field.grid) !== JSON.stringify(grid)) {
            const before = scene.field?.grid;
            scene.field = new Field(grid, block);
            scene.field.shows = /** @type {any} */ (shows.value);
            const [x, y] = grid.origin;
            const [w, h] = grid.shape;
            if (!before) plane.setHome([x, y, x + w * grid.resolution, y + h * grid.resolution]);
            else if (before.resolution !== grid.resolution) scene.cell = undefined;
          }
          scene.truth = truth;
          home ??= truth?.chair;
          moves = body.all.moves;
          scene.held = undefined;
          panel.show(s, truth !== null);
          chair.node.hidden = truthToggle.node.hidden = truth === null;
          if (!greeted) theLegend.append(legendOf(truth !== null));
          scene.field.setColors(s.truncation, s.w_max ?? 256);
          if (!greeted)
            app.say(`${name}: ${body.lap} scans. Play, click a cell${truth ? ", move the chair" : ""}.`);
          greeted = true;
        }
        if (body.fresh) scene.field?.clear();
        scene.field?.apply(f.blocks, f.distance, f.weight);
        [scene.contour, scene.lines] = [f.contour, f.lines];
        scene.pose = body.pose;
        scene.beams = f.beam_ends ?? new Float32Array();
        scene.kinds = f.beam_kinds ?? new Uint8Array();
        scene.ghost = body.ghost?.old;
        last = body;
      }
      if (!last || last.told) return;
      last.told = true;
      play.show(last.at, last.lap, last.most);
      if (last.inspected || scene.cell === undefined) inspector.take(last.inspected);
      chair.show(last.ghost);
      chair.canGoToCell(scene.cell !== undefined);
      const b = last.beams;
      numbers.set({
        "scan-cells": String(b.cells),
        "scan-beams": `${b.hit}, ${b.max_range}, ${b.no_return + b.dropped}`,
        observed: String(last.observed),
        "map-bytes": `${(last.bytes / 1024).toFixed(0)} KiB`,
        "step-ms": `${(1000 * last.seconds).toFixed(2)} ms`,
      });
      const half = last.half_life;
      const note =
        half === null
          ? "Nothing is ever forgotten."
          : `A saturated cell forgets half of an error in ${half.toFixed(2)} observations of weight 1.`;
      const out = document.getElementById("half-life-note");
      if (out && out.textContent !== note) out.textContent = note;
    }

    /** Follows this cell, or none. @param {[number, number] | undefined} cell */
    async function choose(cell) {
      const shape = scene.field?.grid.shape;
      if (cell && shape && (cell[0] < 0 || cell[1] < 0 || cell[0] >= shape[0] || cell[1] >= shape[1])) return;
      scene.cell = cell;
      chair.canGoToCell(cell !== undefined);
      plane.draw();
      const answer = await tryAsk({ op: "watch", cell: cell ?? null });
      // Another may have been chosen meanwhile.
      if (answer && scene.cell === cell) app.meter.measure(() => inspector.take(answer.body));
      app.changed();
    }

    /** @param {[number, number]} to */
    async function moveChair(to) {
      const answer = await tryAsk({ op: "move_chair", to });
      scene.held = undefined;
      plane.draw();
      if (answer) app.say("The chair was moved. Play on, and watch the ghost fade.");
      app.changed();
    }

    function recolor() {
      if (scene.field) scene.field.setColors(panel.values.truncation, panel.values.w_max ?? 256);
      plane.draw();
    }

    const middle = () => {
      const { clientWidth: w, clientHeight: h } = plane.canvas;
      return plane.camera().toWorld(w / 2, h / 2);
    };
    plane.onclick = (p) => choose(scene.field?.cellAt(p));
    plane.onhover = (p) => {
      const cell = p && scene.field?.cellAt(p);
      if (!cell || !scene.field) return numbers.set({ under: "–" });
      const { distance, weight } = scene.field.at(cell);
      numbers.set({
        under: weight > 0 ? `D ${distance.toFixed(4)} m, W ${weight.toFixed(1)}` : "never observed",
      });
    };
    plane.ondrag = (from) => {
      const box = scene.truth?.chair;
      if (!box || [0, 1].some((k) => from[k] < box.min[k] || from[k] > box.max[k])) return undefined;
      play.pause();
      return (p, done) => {
        const by = [p[0] - from[0], p[1] - from[1]];
        scene.held = {
          min: [box.min[0] + by[0], box.min[1] + by[1]],
          max: [box.max[0] + by[0], box.max[1] + by[1]],
        };
        plane.draw();
        if (done)
          moveChair([
            (scene.held.min[0] + scene.held.max[0]) / 2,
            (scene.held.min[1] + scene.held.max[1]) / 2,
          ]);
      };
    };

    return {
      async show(state) {
        if (!opened || state.size > 0) {
          opened = true;
          await ask({ op: "open" });
          takeIn();
          await restore(state);
        }
        plane.draw();
      },
      hide: () => play.pause(),
      state: () => ({ ...(last ? stateOf(last.at) : {}), ...plane.state() }),
      picture() {
        plane.paint();
        return compose(`portolan studio · fusion · ${document.getElementById("at")?.textContent}`, [
          [plane.canvas],
          [inspector.plot.canvas()],
        ]);
      },
      key(event) {
        /** @type {Record<string, () => void>} */
        const does = {
          Enter: () => choose(scene.field?.cellAt(middle())),
          Escape: () => choose(undefined),
          m: () => document.getElementById("chair-to-cell")?.click(),
          w: () => step(0, 1),
          a: () => step(-1, 0),
          s: () => step(0, -1),
          d: () => step(1, 0),
        };
        const step = (/** @type {number} */ dx, /** @type {number} */ dy) =>
          scene.cell && choose([scene.cell[0] + dx, scene.cell[1] + dy]);
        if (event.key in does) return (does[event.key](), true);
        return play.key(event) || plane.key(event);
      },
      keys: [
        ["Space", "play or pause"],
        [". ,", "one scan on, one back"],
        ["Home End", "start, end of the lap"],
        ["< >", "slower, faster"],
        ["Arrows", "move the picture"],
        ["+ − 0", "larger, smaller, all"],
        ["Enter", "follow the cell in the middle"],
        ["W A S D", "the cell above, left, below, right"],
        ["Esc", "follow no cell"],
        ["M", "put the chair on the chosen cell"],
      ],
      redraw() {
        recolor();
        inspector.redraw();
        chair.redraw();
      },
    };

    /** What a link says of the settings and the scan. @param {number} at @returns {Record<string, string>} */
    function stateOf(at) {
      const { w_max, ...rest } = panel.values;
      const texts = Object.entries({ ...rest, w_max: w_max ?? "inf" }).map(([k, v]) => [k, String(v)]);
      return {
        ...Object.fromEntries(texts),
        scan: String(at),
        ...(scene.cell ? { cell: scene.cell.join(",") } : {}),
        ...(shows.value === "weight" ? { shows: "weight" } : {}),
        ...(moves.length
          ? { chair: moves.map(([scan, [x, y]]) => `${scan},${x.toFixed(4)},${y.toFixed(4)}`).join(";") }
          : {}),
      };
    }

    /** Makes what a link says. @param {URLSearchParams} state */
    async function restore(state) {
      const now = panel.values;
      /** @type {any} */
      const wanted = { ...now };
      for (const [key, value] of Object.entries(now)) {
        const text = state.get(key);
        if (text === null) continue;
        if (key === "w_max") wanted[key] = text === "inf" ? null : Number(text);
        else
          wanted[key] =
            typeof value === "number" ? Number(text) : typeof value === "boolean" ? text === "true" : text;
      }
      if (JSON.stringify(wanted) !== JSON.stringify(now)) await tryAsk({ op: "set", settings: wanted });
      const numbersOf = (/** @type {string} */ key) => (state.get(key) ?? "").split(",").map(Number);
      for (const text of (state.get("chair") ?? "").split(";")) {
        const [since, x, y] = text.split(",").map(Number);
        if (!text || ![since, x, y].every(Number.isFinite)) continue;
        await tryAsk({ op: "seek", scan: Math.max(0, Math.floor(since)) });
        await tryAsk({ op: "move_chair", to: [x, y] });
      }
      if (state.has("scan"))
        await tryAsk({ op: "seek", scan: Math.max(0, Math.floor(Number(state.get("scan"))) || 0) });
      takeIn();
      if (state.get("shows") === "weight" && scene.field) {
        shows.value = scene.field.shows = "weight";
        recolor();
      }
      const cell = numbersOf("cell");
      if (state.has("cell") && cell.length === 2 && cell.every(Number.isInteger))
        await choose([cell[0], cell[1]]);
      plane.restore(state);
    }
  },
};
