// @ts-check
import { Picture } from "../gallery/layers.js";
import { bytesOf, time, timeOf, whole } from "../gallery/format.js";
import { panels } from "../gallery/panels.js";
import { cloudPanel, costTable, errorTable, fieldTable, treePanel } from "../gallery/tables.js";
import { answersOf, decades, legendOf, ofFusion, verdict } from "../gallery/words.js";
import { choice, el, facts, group } from "../ui/controls.js";
import { compose } from "../ui/picture.js";

/**
 * What can be asked of a map: name in the engine, on the button, in a sentence.
 * @type {[string, string, string][]}
 */
const WORKLOADS = [
  ["occupancy", "Occupancy", "Is this point occupied?"],
  ["distance", "Distance", "How far is the nearest surface?"],
  ["surface", "Surface", "Where are the surfaces, as lines?"],
];
const PROBES = ["10000", "30000", "100000", "300000"];

/** @type {import("../main.js").View} */
export default {
  id: "gallery",
  title: "Gallery",
  mount(root, app) {
    /** @type {Picture | undefined} */
    let picture;
    /** Number of the map that is shown. @type {number | null} */
    let revision = null;
    /** @type {any} */
    let costs;
    /** The workload that was run last. @type {string | undefined} */
    let ran;
    let busy = false;
    /** Whether the middle of the picture is asked about. */
    let middle = false;
    /** The theme that the pictures have the colours of. */
    let theme = document.documentElement.dataset.theme;

    const six = panels(app.meter, {
      oncamera: () => (app.changed(), middle && pointAtMiddle()),
      onhover: (p) => !middle && point(p),
    });
    const probes = choice({
      id: "gallery-probes",
      label: "Points to ask at",
      value: "100000",
      options: PROBES.map((n) => [n, whole(Number(n))]),
      onchange: () => app.changed(),
    });
    const buttons = WORKLOADS.map(([name, text, question]) =>
      el(
        "button",
        {
          type: "button",
          id: `gallery-run-${name}`,
          "aria-pressed": "false",
          title: question,
          onclick: () => run(name),
        },
        text,
      ),
    );
    const result = el("p", { id: "gallery-result", role: "status" });
    const measured = el("p", { class: "note", id: "gallery-measured" });
    const made = facts([
      ["gallery-log", "log"],
      ["gallery-scans", "scans"],
      ["gallery-cells", "cells"],
      ["gallery-truncation", "truncation"],
      ["gallery-clamp", "clamp W_max"],
      ["gallery-fused", "sweep, weights"],
      ["gallery-seconds", "built and measured in"],
    ]);
    const moved = el("p", { class: "note", id: "gallery-moved" });
    const scale = el("p", { class: "note", id: "gallery-scale" });
    const errors = el("div", { class: "scroll" });
    const errorNote = el("p", { class: "note" });
    const all = el("div", { class: "scroll" });
    const fields = el("div", { class: "scroll" });
    const tree = treePanel();
    const cloud = cloudPanel();
    const measureTrees = el(
      "button",
      { type: "button", id: "gallery-trees-run", onclick: () => runTrees() },
      "Measure leaves from 1.75 to 10 cm",
    );
    const treesNote = el("p", { class: "note", id: "gallery-trees-note" });
    const theLegend = el("div", { class: "strip" });

    root.append(
      el("div", { class: "field" }, six.node, theLegend),
      el(
        "div",
        { class: "side" },
        el(
          "div",
          { class: "group" },
          el("h2", {}, "Run a workload"),
          el("div", { class: "row", role: "group", "aria-label": "Workload" }, ...buttons),
          probes.node,
          result,
          measured,
          scale,
        ),
        group("Made of", made.node, moved),
        group(
          "Where a tree breaks even",
          tree.words,
          tree.out,
          el("div", { class: "row" }, measureTrees),
          treesNote,
          tree.curve.node,
        ),
        group("The cloud against the ESDF", cloud.words, cloud.curve.node),
        group("How wrong", errors, errorNote),
        group("All that was measured", all),
        group("Three ways to the ESDF", fields),
      ),
    );

    /** Takes everything in. @param {import("../engine/engine.js").Answer} answer */
    function take({ body, arrays }) {
      const first = picture === undefined;
      revision = body.revision;
      picture = new Picture(body.picture, arrays);
      six.plane.home = picture.box();
      if (first) six.plane.setHome(picture.box());
      else six.plane.oncamera();
      six.show(picture);
      const { settings, ...of } = body.of;
      const { shape, resolution } = body.picture.grid;
      made.set({
        "gallery-log": of.log,
        "gallery-scans": `${whole(of.scans)} of ${whole(Math.max(of.lap, of.scans))}`,
        "gallery-cells": `${shape[0]} × ${shape[1]}, ${(100 * resolution).toFixed(1)} cm`,
        "gallery-truncation": `${settings.truncation.toFixed(2)} m`,
        "gallery-clamp": settings.w_max === null ? "none" : String(settings.w_max),
        "gallery-fused": `${settings.sweep}, ${settings.weights}`,
        "gallery-seconds": time(body.seconds),
      });
      moved.textContent = ofFusion(body);
      const truth = body.picture.truth !== null;
      theLegend.replaceChildren(legendOf(truth));
      errorNote.textContent = truth
        ? `Occupancy: share of wrong answers more than half a cell from a surface. Distance and surface: median / 95 % of the error in mm. Median ‖∇D‖ of the truncated field: ${body.truth_and_trees.tsdf_gradient?.toFixed(3) ?? "–"}.`
        : "A recorded log has no truth to be compared with.";
      tree.show(body.truth_and_trees);
      fields.replaceChildren(fieldTable(body.truth_and_trees.fields));
      treesNote.textContent = "";
      measured.textContent = `First look: ${whole(of.probes)} points, ${whole(of.probes / 50)} for searches. Run a workload to measure it now.`;
      tell(body.costs);
    }

    /** Takes costs in. @param {any} told */
    function tell(told) {
      costs = told;
      const seconds = costs.rows
        .flatMap((/** @type {any} */ r) => [r.update, r.occupancy, r.distance, r.surface])
        .filter((/** @type {any} */ c) => c && c.seconds > 0)
        .map((/** @type {any} */ c) => c.seconds);
      const sizes = costs.rows
        .map((/** @type {any} */ r) => r.memory_bytes)
        .filter((/** @type {number} */ b) => b > 0);
      const scales = { memory: decades(sizes, [3, 6]), time: decades(seconds, [-9, -2]) };
      six.meters(costs, scales);
      const ends = (/** @type {[number, number]} */ [a, b], /** @type {(power: number) => string} */ f) =>
        `${f(a)} to ${f(b)}`;
      scale.textContent = `Bars are logarithmic: memory from ${ends(scales.memory, bytesOf)}, times from ${ends(scales.time, timeOf)}.`;
      errors.replaceChildren(errorTable(costs));
      all.replaceChildren(costTable(costs));
      cloud.show(costs.cloud);
      frame();
    }

    /** Frames and the sentence for the workload that was run. */
    function frame() {
      const winner =
        ran === undefined ? undefined : costs.winners.find((/** @type {any} */ w) => w.workload === ran);
      six.frames(winner, costs.rows);
      WORKLOADS.forEach(([name], i) => buttons[i].setAttribute("aria-pressed", String(name === ran)));
      result.textContent = winner ? verdict(winner, costs.rows) : "";
    }

    /** Asks the engine while the buttons rest. @param {string} what @param {object} question */
    async function working(what, question) {
      if (busy) return undefined;
      busy = true;
      for (const b of [...buttons, measureTrees]) b.disabled = true;
      six.node.setAttribute("aria-busy", "true");
      app.say(what);
      try {
        return await app.engine.ask("gallery", question);
      } catch (error) {
        app.fail(error);
        return undefined;
      } finally {
        busy = false;
        for (const b of [...buttons, measureTrees]) b.disabled = false;
        six.node.removeAttribute("aria-busy");
      }
    }

    async function open() {
      const answer = await working("Building all representations, and measuring …", {
        op: "open",
        have: revision,
      });
      if (!answer) return;
      if (!answer.body.picture) return app.say("");
      const again = ran;
      ran = undefined;
      app.meter.measure(() => take(answer));
      app.say("Zoom one panel and all zoom. Run a workload to see who wins it.");
      if (again) await run(again);
    }

    /** @param {string} workload */
    async function run(workload) {
      const n = Number(probes.value);
      const answer = await working(`Measuring ${workload} …`, { op: "run", workload, probes: n });
      if (!answer) return;
      if (answer.body.revision !== revision) return open();
      ran = workload;
      app.meter.measure(() => tell(answer.body.costs));
      const asked =
        workload === "surface"
          ? "three extractions each, the median counts"
          : `five rounds of ${whole(n)} points (${whole(Math.ceil(n / 50))} for searches), the median counts`;
      measured.textContent = `Measured now in ${time(answer.body.seconds)}: ${asked}.`;
      app.say(result.textContent ?? "");
      app.changed();
    }

    async function runTrees() {
      const answer = await working("Fusing trees of other leaves …", { op: "trees" });
      if (!answer) return;
      const { every, sizes } = answer.body;
      tree.sizes(sizes);
      treesNote.textContent = `Lines: the formula; dots: trees fused just now${every > 1 ? ` of one scan in ${every}` : ""}. Orange: the chapter's 20 bytes a node; blue: ours, 9 an inner one. Below the dashed 1 a tree is the smaller one. A tree is refined along the border of what was never seen, too, which the formula leaves out.`;
      app.say("");
    }

    // Answers under the pointer: one question at a time, the latest place next.
    /** @type {[number, number] | undefined} */
    let wanted;
    let asking = false;
    /** @param {[number, number] | undefined} p */
    async function point(p) {
      wanted = p;
      if (!p) return six.point(undefined, {});
      if (asking || busy || !picture) return;
      asking = true;
      try {
        while (wanted) {
          const at = /** @type {[number, number]} */ (wanted);
          const { body } = await app.engine.ask("gallery", { op: "answers", at });
          if (wanted) app.meter.measure(() => six.point(at, answersOf(body)));
          if (wanted === at) break;
        }
      } catch (error) {
        app.fail(error);
      }
      asking = false;
    }
    const pointAtMiddle = () => {
      const { clientWidth: w, clientHeight: h } = six.plane.canvas;
      point(six.plane.camera().toWorld(w / 2, h / 2));
    };

    function recolor() {
      theme = document.documentElement.dataset.theme;
      picture?.recolor();
      tree.curve.redraw();
      cloud.curve.redraw();
      six.draw();
    }

    return {
      async show(state) {
        if (theme !== document.documentElement.dataset.theme) recolor();
        if (PROBES.includes(state.get("probes") ?? "")) probes.value = state.get("probes") ?? "";
        await open();
        const workload = WORKLOADS.find(([name]) => name === state.get("run"))?.[0];
        six.plane.restore(state);
        if (state.has("at")) six.plane.oncamera();
        if (workload) await run(workload);
        if (state.get("middle") === "1") ((middle = true), pointAtMiddle());
        six.draw();
      },
      hide() {},
      state: () => ({
        ...(ran ? { run: ran } : {}),
        ...(probes.value === "100000" ? {} : { probes: probes.value }),
        ...(middle ? { middle: "1" } : {}),
        ...six.plane.state(),
      }),
      picture: () =>
        compose(
          `portolan studio · gallery · ${document.getElementById("gallery-log")?.textContent}${ran ? ` · who answers for ${ran}` : ""}`,
          six.canvases(),
        ),
      key(event) {
        const workload = WORKLOADS.find(([name]) => name[0] === event.key)?.[0];
        if (workload) return (run(workload), true);
        if (event.key === "x") {
          middle = !middle;
          if (middle) pointAtMiddle();
          else point(undefined);
          app.changed();
          return true;
        }
        return six.plane.key(event);
      },
      keys: [
        ["O D S", "run occupancy, distance, surface"],
        ["X", "ask at the middle of the picture, and stop"],
        ["Arrows", "move all pictures"],
        ["+ − 0", "larger, smaller, all"],
      ],
      redraw: recolor,
    };
  },
};
