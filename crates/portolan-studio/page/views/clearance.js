// @ts-check
import { latest } from "../clearance/latest.js";
import { FieldImage } from "../clearance/map.js";
import { meterPanel } from "../clearance/meter_panel.js";
import { drag, MOST } from "../clearance/path_edit.js";
import { pathPanel } from "../clearance/path_panel.js";
import { probePanel } from "../clearance/probe_panel.js";
import { movingLayers, stillLayers } from "../clearance/scene.js";
import { shownPanel } from "../clearance/shown_panel.js";
import { Still } from "../clearance/still.js";
import { Plane } from "../plane/plane.js";
import { el, group } from "../ui/controls.js";
import { saveAnswer } from "../ui/files.js";
import { compose } from "../ui/picture.js";

/** @typedef {[number, number]} Point */

/** @type {import("../main.js").View} */
export default {
  id: "clearance",
  title: "Clearance",
  mount(root, app) {
    /** @type {import("../clearance/scene.js").Scene} */
    const scene = {
      image: undefined,
      contour: new Float32Array(),
      lines: new Uint32Array([0]),
      truth: null,
      rings: undefined,
      arrows: undefined,
      probe: undefined,
      said: undefined,
      waypoints: [],
      checked: undefined,
      radius: 0.2,
      visible: { rings: true, arrows: true, contour: true, truth: false },
    };
    /** What the engine has made of which map. @type {any} */
    let opened;
    let drawing = false;
    let reopening = false;
    /** The path is the driven way, or will be once there is a map. */
    let driven = false;

    const plane = new Plane({
      id: "clearance-canvas",
      label: "The distance field of the map, a probe into it and a path through it",
      meter: app.meter,
    });
    const still = new Still(stillLayers(scene));
    plane.layers = [still.draw, ...movingLayers(scene)];
    /** Everything is drawn anew. */
    const redraw = () => {
      still.changed();
      plane.draw();
    };
    plane.oncamera = () => {
      askArrows();
      app.changed();
    };

    const shown = shownPanel({
      visible: scene.visible,
      field(which) {
        scene.image?.show(which);
        probe.mark(which);
        [scene.rings, scene.arrows] = [undefined, undefined];
        askRings();
        askArrows();
        redraw();
        app.changed();
      },
      unknown: () => (askProbe(), askPath(), app.changed()),
      spacing: () => (askRings(), app.changed()),
      toggled: () => (askArrows(), redraw(), app.changed()),
    });
    const probe = probePanel();
    const meter = meterPanel();
    const path = pathPanel({
      radius: scene.radius,
      setRadius(v) {
        scene.radius = v;
        askPath();
        plane.draw();
        app.changed();
      },
      undo: () => edit(() => scene.waypoints.pop()),
      clear: () => edit(() => (scene.waypoints.length = 0)),
      way: () => (edit(() => (scene.waypoints = way())), (driven = true)),
      draw: (on) => (drawing = on),
    });
    const exportFile = (/** @type {string} */ file, /** @type {string} */ name) =>
      el(
        "button",
        {
          type: "button",
          id: `clearance-export-${file}`,
          onclick: () => app.engine.ask("fusion", { op: "export", file }).then(saveAnswer, app.fail),
        },
        name,
      );
    root.append(
      el("div", { class: "field" }, plane.node, shown.strip),
      el(
        "div",
        { class: "side" },
        shown.node,
        probe.node,
        path.node,
        meter.node,
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
    path.count(0);
    probe.mark("euclidean");

    const ask = (/** @type {object} */ question) => app.engine.ask("clearance", question);
    /**
     * Takes an answer in, within the picture's work, and asks for everything again where the map has become
     * another.
     * @template Q
     * @param {(a: import("../engine/engine.js").Answer, q: Q) => void} take
     */
    const taking =
      (take) => (/** @type {import("../engine/engine.js").Answer} */ answer, /** @type {Q} */ question) => {
        app.meter.measure(() => take(answer, question));
        plane.draw();
        if (opened && answer.body.revision !== opened.revision) open();
      };
    const askFor = {
      probe: latest(
        ask,
        taking((answer, /** @type {any} */ question) => {
          scene.said = answer.body;
          probe.show(answer.body, question.unknown);
          meter.probe(answer.body);
        }),
        app.fail,
      ),
      rings: latest(
        ask,
        taking(({ body, arrays }, /** @type {any} */ question) => {
          if (question.field !== scene.image?.which) return;
          const f = /** @type {any} */ (arrays);
          scene.rings = { points: f.points, starts: f.starts, levels: f.levels, spacing: body.spacing };
          shown.tellRings(body, opened?.truncation);
          still.changed();
        }),
        app.fail,
      ),
      arrows: latest(
        ask,
        taking(({ body, arrays }, /** @type {any} */ question) => {
          if (question.field !== scene.image?.which) return;
          const f = /** @type {any} */ (arrays);
          scene.arrows = { points: f.points, gradients: f.gradients, spacing: body.spacing };
          still.changed();
        }),
        app.fail,
      ),
      path: latest(
        ask,
        taking((answer) => {
          if (scene.waypoints.length === 0) return;
          const f = /** @type {any} */ (answer.arrays);
          scene.checked = { points: f.points, starts: f.starts, pieces: answer.body.pieces };
          path.show(answer);
        }),
        app.fail,
      ),
    };

    function askProbe() {
      if (opened && scene.probe) askFor.probe({ op: "probe", at: scene.probe, unknown: shown.unknown });
    }
    function askRings() {
      if (opened && scene.visible.rings)
        askFor.rings({ op: "rings", field: shown.field, spacing: shown.spacing });
    }
    function askArrows() {
      if (!opened || !scene.visible.arrows || plane.canvas.clientWidth === 0) return;
      const camera = plane.camera();
      const { clientWidth: w, clientHeight: h } = plane.canvas;
      askFor.arrows({
        op: "arrows",
        field: shown.field,
        bounds: [camera.toWorld(0, h), camera.toWorld(w, 0)],
        spacing: round(30 / camera.scale),
      });
    }
    function askPath() {
      if (opened && scene.waypoints.length > 0)
        askFor.path({ op: "path", points: scene.waypoints, clearance: scene.radius, unknown: shown.unknown });
    }

    /** The way on which the map was made. @returns {Point[]} */
    const way = () => (opened?.way ?? []).map((/** @type {Point} */ p) => [...p]);

    /** Changes the path. @param {() => void} how */
    function edit(how) {
      driven = false;
      how();
      if (scene.waypoints.length === 0) scene.checked = undefined;
      path.count(scene.waypoints.length);
      askPath();
      plane.draw();
      app.changed();
    }

    /** Puts the probe there. @param {Point} p */
    function put(p) {
      scene.probe = p;
      askProbe();
      plane.draw();
      app.changed();
    }

    /** Moves the probe by cells, and the picture after it. @param {number} dx @param {number} dy */
    function nudge(dx, dy) {
      const r = scene.image?.grid.resolution ?? 0.05;
      const [x, y] = scene.probe ?? plane.center;
      const p = /** @type {Point} */ ([x + dx * r, y + dy * r]);
      const [px, py] = plane.camera().toScreen(...p);
      const { clientWidth: w, clientHeight: h } = plane.canvas;
      const by = [
        Math.max(24 - px, 0) - Math.max(px - w + 24, 0),
        Math.max(24 - py, 0) - Math.max(py - h + 24, 0),
      ];
      if (by[0] || by[1]) plane.pan(by[0], by[1]);
      put(p);
    }

    /** Everything of the map as it is now, where the page has not drawn it already. */
    async function open() {
      if (reopening) return;
      reopening = true;
      try {
        const { body, arrays } = await ask({ op: "open", have: opened?.revision ?? null });
        if (!body.unchanged) app.meter.measure(() => takeIn(body, /** @type {any} */ (arrays)));
      } finally {
        reopening = false;
      }
    }

    /** @param {any} body @param {any} arrays */
    function takeIn(body, arrays) {
      const before = scene.image?.grid;
      opened = body;
      const image = new FieldImage(body.grid);
      image.samples = { euclidean: arrays.euclidean, truncated: arrays.truncated };
      image.which = shown.field;
      image.reach = Math.max(body.truncation, body.usual_length);
      image.paint();
      scene.image = image;
      [scene.contour, scene.lines, scene.truth] = [arrays.contour, arrays.lines, body.truth];
      if (JSON.stringify(before) !== JSON.stringify(body.grid)) plane.setHome(image.box());
      scene.probe ??= body.start ?? undefined;
      if (driven) scene.waypoints = way();
      path.count(scene.waypoints.length);
      shown.tellMap(body, image.reach);
      meter.show(body.meter);
      app.say(
        `${body.name} after ${body.at} scans: both fields made in ${(1000 * body.seconds).toFixed(0)} ms. Move the pointer, click a path.`,
      );
      askProbe();
      askRings();
      askArrows();
      askPath();
      redraw();
    }

    plane.onhover = (p) => p && put(p);
    plane.onclick = (p) => {
      put(p);
      if (scene.waypoints.length < MOST) edit(() => scene.waypoints.push(p));
    };
    plane.ondrag = (from) =>
      drag(
        {
          points: scene.waypoints,
          scale: () => plane.camera().scale,
          drawing,
          changed: () => edit(() => {}),
        },
        from,
      );

    return {
      async show(state) {
        if (state.size > 0) restore(state);
        await open();
        if (state.has("at")) plane.restore(state);
        // Nothing could be asked about what is seen while nothing was.
        askArrows();
        plane.draw();
      },
      hide() {},
      state: () => ({
        ...shown.state(),
        radius: scene.radius.toFixed(2),
        ...(scene.probe ? { probe: texts([scene.probe]) } : {}),
        ...(driven ? { path: "driven" } : scene.waypoints.length > 0 ? { path: texts(scene.waypoints) } : {}),
        ...plane.state(),
      }),
      picture() {
        plane.paint();
        const field = shown.field === "euclidean" ? "Euclidean" : "truncated";
        return compose(`portolan studio · clearance · ${field} field`, [
          [plane.canvas],
          [scene.checked ? path.plot.canvas() : null, meter.plot.canvas()],
        ]);
      },
      key(event) {
        const far = event.shiftKey ? 10 : 1;
        const here = () => scene.probe && scene.waypoints.length < MOST && scene.waypoints.push(scene.probe);
        /** @type {Record<string, () => void>} */
        const does = {
          ArrowLeft: () => nudge(-far, 0),
          ArrowRight: () => nudge(far, 0),
          ArrowUp: () => nudge(0, far),
          ArrowDown: () => nudge(0, -far),
          Enter: () => edit(here),
          Backspace: () => edit(() => scene.waypoints.pop()),
          Escape: () => edit(() => (scene.waypoints.length = 0)),
          f: () => shown.toggleField(),
          u: () => shown.toggleUnknown(),
          r: () => shown.toggle("rings"),
          g: () => shown.toggle("arrows"),
          d: () => path.toggleDrawing(),
          w: () => document.getElementById("path-way")?.click(),
          "[": () => resize(-0.01),
          "]": () => resize(0.01),
        };
        const what = does[event.key];
        what?.();
        return what !== undefined || plane.key(event);
      },
      keys: [
        ["Arrows", "move the probe by a cell; with Shift by ten"],
        ["Enter", "a waypoint where the probe is"],
        ["Backspace", "remove the last waypoint"],
        ["Esc", "remove the path"],
        ["[ ]", "a smaller, a larger robot"],
        ["F", "Euclidean or truncated field"],
        ["U", "unknown space an obstacle or not"],
        ["R G", "rings, gradient arrows"],
        ["D", "draw by dragging, or not"],
        ["W", "the way that was driven"],
        ["+ − 0", "larger, smaller, all"],
      ],
      redraw() {
        scene.image?.paint();
        path.plot.redraw();
        meter.plot.redraw();
        redraw();
      },
    };

    /** @param {number} by */
    function resize(by) {
      path.radius.value = scene.radius = Math.round(100 * Math.min(1, Math.max(0, scene.radius + by))) / 100;
      askPath();
      plane.draw();
      app.changed();
    }

    /** Makes what a link says. @param {URLSearchParams} state */
    function restore(state) {
      shown.restore(state);
      const radius = Number(state.get("radius") ?? NaN);
      if (radius >= 0 && radius <= 1) path.radius.value = scene.radius = radius;
      const [at] = points(state.get("probe"));
      if (at) scene.probe = at;
      if (state.has("path")) {
        driven = state.get("path") === "driven";
        scene.waypoints = driven ? way() : points(state.get("path")).slice(0, MOST);
      }
      path.count(scene.waypoints.length);
      if (opened) {
        scene.image?.show(shown.field);
        redraw();
        [askProbe, askRings, askArrows, askPath].forEach((f) => f());
      }
      probe.mark(shown.field);
    }
  },
};

/** The next length of 1, 2 or 5 times a power of ten. @param {number} length */
function round(length) {
  const power = 10 ** Math.floor(Math.log10(length));
  return ([1, 2, 5].find((n) => n * power >= length) ?? 10) * power;
}

/** @param {Point[]} points */
const texts = (points) => points.map((p) => p.map((v) => v.toFixed(3)).join(",")).join(";");

/** @param {string | null} text @returns {Point[]} */
function points(text) {
  const all = (text ?? "").split(";").map((p) => p.split(",").map(Number));
  return /** @type {Point[]} */ (all.filter((p) => p.length === 2 && p.every(Number.isFinite)));
}
