// @ts-check
import { calmly, choice, el, facts, group, slider, toggle } from "../ui/controls.js";
import { saveAnswer } from "../ui/files.js";
import { compose } from "../ui/picture.js";
import { image, rampCss } from "../space/cut.js";
import { Inspector } from "../space/inspector.js";
import { gradient, stops } from "../space/ramps.js";
import { Stage } from "../space/stage.js";
import { LARGE } from "../space/surface.js";

const SPEEDS = [2, 5, 10, 30, Infinity];
const RESOLUTIONS = [0.01, 0.015, 0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1, 0.15, 0.2, 0.3];
const COLORS = /** @type {[string, string][]} */ ([
  ["height", "height"],
  ["color", "colour"],
  ["weight", "weight"],
  ["error", "error"],
]);
const FIELDS = /** @type {[string, string][]} */ ([
  ["none", "no slice"],
  ["tsdf", "TSDF"],
  ["esdf", "ESDF"],
  ["occupancy", "occupancy"],
]);
/** Milliseconds between pictures while a mesh comes in. */
const LOADING = 300;

const cm = (/** @type {number} */ m) => `${(100 * m).toFixed(1).replace(/\.0$/, "")} cm`;
const bytes = (/** @type {number | null} */ n) =>
  n === null ? "—" : n >= 1 << 20 ? `${(n / (1 << 20)).toFixed(1)} MiB` : `${(n / 1024).toFixed(0)} KiB`;
const count = (/** @type {number} */ n) => n.toLocaleString("en").replaceAll(",", " ");
const nextPicture = () => new Promise((resolve) => requestAnimationFrame(resolve));
const wait = (/** @type {number} */ ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** @type {import("../main.js").View} */
export default {
  id: "space",
  title: "Space",
  mount(root, app) {
    const ask = (/** @type {object} */ question) => app.engine.ask("space", question);

    // --- what is shown
    // -------------------------------------------------------------------------------------------
    /** The last answer's words, and what seldom changes. @type {any} */
    let body = null;
    /** @type {any} */
    let all = null;
    let visible = false;
    let playing = false;
    let driving = false;
    let speed = Infinity;
    /** Where the player goes by itself. @type {number | null} */
    let goal = null;
    /** @type {any} */
    let newSettings = null;
    /** @type {string | null} */
    let newColor = null;
    /** @type {number[] | null | undefined} undefined: no other than before */
    let newVoxel;
    /** @type {any} */
    let voxel = null;
    let voxelAt = -1;
    const slice = { field: "none", axis: 2, at: /** @type {number | null} */ (null) };
    /** @type {import("../engine/engine.js").Answer | null} */
    let cut = null;
    let cutAt = -1;
    let newCut = false;
    let lastPicture = 0;
    /** Load of the mesh: milliseconds and bytes, for who measures. */
    const load = { started: 0, transfer: 0, take: 0, bytes: 0, done: 0 };

    // --- the canvas
    // ----------------------------------------------------------------------------------------------
    const canvas = el("canvas", {
      id: "space-canvas",
      tabindex: 0,
      role: "application",
      "aria-label":
        "The map in space. Arrow keys go round it, with Shift sideways, plus and minus nearer and further, Enter looks at the voxel in the middle.",
    });
    const legendText = el("span", { id: "space-legend" });
    const legendRamp = el("i", {
      class: "ramp",
      "aria-hidden": "true",
      style:
        "display:inline-block;width:110px;height:10px;border:1px solid var(--line);vertical-align:-1px;margin:0 6px",
    });
    const low = el("span", { id: "space-low" });
    const high = el("span", { id: "space-high" });
    const cutLegend = el("div", { id: "space-cut-legend", hidden: true });
    const overlay = el(
      "div",
      {
        style:
          "position:absolute;left:12px;top:10px;font-size:12px;color:var(--muted);pointer-events:none;background:color-mix(in srgb,var(--panel) 85%,transparent);padding:4px 8px;border-radius:6px;font-variant-numeric:tabular-nums",
      },
      el("div", {}, legendText, low, legendRamp, high),
      cutLegend,
    );
    const cross = el("div", {
      "aria-hidden": "true",
      hidden: true,
      style:
        "position:absolute;left:50%;top:50%;width:15px;height:15px;margin:-8px 0 0 -8px;pointer-events:none;background:linear-gradient(var(--ink),var(--ink)) center/15px 1px no-repeat,linear-gradient(var(--ink),var(--ink)) center/1px 15px no-repeat",
    });
    const flat = el("canvas", {
      id: "space-flat",
      hidden: true,
      style: "image-rendering:pixelated;object-fit:contain",
      "aria-label": "The slice",
    });
    const frame = el("div", { class: "canvas" }, canvas, flat, overlay, cross);
    /** @type {Stage | null} */
    let stage = null;
    try {
      stage = new Stage(canvas, app.meter);
    } catch {
      canvas.hidden = true;
      flat.hidden = false;
      overlay.append(
        el(
          "p",
          { class: "error", id: "space-no-webgl" },
          "This browser draws nothing in three dimensions (no WebGL): the mesh is not shown, a slice is.",
        ),
      );
    }
    canvas.addEventListener("focus", () => (cross.hidden = !canvas.matches(":focus-visible")));
    canvas.addEventListener("blur", () => (cross.hidden = true));
    const changed = calmly(() => app.changed(), 200);
    if (stage) stage.moved = () => changed(null);

    // --- the strip
    // -----------------------------------------------------------------------------------------------
    const play = el(
      "button",
      { type: "button", id: "space-play", "aria-pressed": "false", title: "Space" },
      "Play",
    );
    const stepOne = el("button", { type: "button", id: "space-step", title: "N" }, "Step");
    const restart = el("button", { type: "button", id: "space-restart", title: "Home" }, "To start");
    const scrub = el("input", {
      type: "range",
      id: "space-frame",
      min: 0,
      max: 0,
      step: 1,
      value: 0,
      "aria-label": "Frame",
    });
    const where = el("output", {
      for: "space-frame",
      id: "space-at",
      style: "font-variant-numeric:tabular-nums;min-width:74px;text-align:right",
    });
    const speedChoice = choice({
      id: "space-speed",
      label: "Speed",
      value: "Infinity",
      options: SPEEDS.map((s) => [String(s), s === Infinity ? "as fast as it goes" : `${s} frames/s`]),
      onchange: (v) => (speed = Number(v)),
    });
    const strip = el("div", { class: "strip" }, play, stepOne, restart, scrub, where, speedChoice.node);
    play.onclick = () => setPlaying(!playing);
    stepOne.onclick = () => (setPlaying(false), seek((body?.at ?? 0) + 1));
    restart.onclick = () => (setPlaying(false), seek(0));
    scrub.oninput = () => (setPlaying(false), seekCalmly(Number(scrub.value)));
    const seekCalmly = calmly((/** @type {number} */ to) => seek(to), 120);

    /** @param {boolean} on */
    function setPlaying(on) {
      if (on && body && body.at >= body.frames) goal = 0;
      else if (on) goal = null;
      playing = on && body?.frames > 0;
      play.textContent = playing ? "Pause" : "Play";
      play.setAttribute("aria-pressed", String(playing));
      if (playing) app.meter.reset();
      drive();
    }

    /** @param {number} to */
    function seek(to) {
      goal = Math.max(0, Math.min(to, body?.frames ?? 0));
      drive();
    }

    // --- the side
    // ------------------------------------------------------------------------------------------------
    const state = facts([
      ["space-name", "Log"],
      ["space-hits", "Surfaces in the frame"],
      ["space-triangles", "Triangles"],
      ["space-bricks", "Bricks"],
      ["space-bytes", "TSDF"],
      ["space-bytes-occupancy", "Occupancy"],
      ["space-bytes-esdf", "ESDF"],
      ["space-bytes-mesh", "Mesh"],
      ["space-time", "Fused in"],
      ["space-time-mesh", "Meshed in"],
    ]);
    const trouble = el("p", { class: "error", id: "space-trouble", hidden: true });
    const colorNote = el("p", { class: "note", id: "space-color-note" });
    const colorPlace = el("div", {});
    let by = "height";
    function colorChoice() {
      const options = COLORS.filter(
        ([id]) => !all.colors.find((/** @type {any} */ c) => c.by === id)?.refused,
      );
      const made = choice({
        id: "space-color",
        label: "Colour by",
        value: by,
        options,
        onchange: (v) => ((newColor = v), drive()),
      });
      colorPlace.replaceChildren(made.node);
      const missing = all.colors.filter((/** @type {any} */ c) => c.refused);
      colorNote.textContent = missing
        .map((/** @type {any} */ c) => `No ${c.by === "color" ? "colour" : c.by}: ${c.refused}.`)
        .join(" ");
    }
    const fit = el("button", { type: "button", id: "space-fit", title: "F" }, "See all");
    fit.onclick = () => see();

    const fieldChoice = choice({
      id: "space-slice",
      label: "Slice",
      value: "none",
      options: FIELDS,
      onchange: (v) => cutThrough({ field: v }),
    });
    const axisChoice = choice({
      id: "space-axis",
      label: "across",
      value: "2",
      options: [
        ["0", "x"],
        ["1", "y"],
        ["2", "z"],
      ],
      onchange: (v) => cutThrough({ axis: Number(v), at: null }),
    });
    const atSlider = slider({
      id: "space-cut",
      label: "at",
      min: 0,
      max: 1,
      step: 0.01,
      value: 0,
      format: () => cutWords(),
      oninput: (v) => cutThrough({ at: v }),
    });
    const cutNote = el("p", { class: "note", id: "space-cut-note" });

    const settings = el("div", { class: "group", style: "border:0;padding:0" });
    const inspector = new Inspector();
    const file = (/** @type {string} */ id, /** @type {string} */ name, /** @type {string} */ what) => {
      const button = el("button", { type: "button", id: `space-${id}` }, name);
      button.onclick = async () => {
        button.disabled = true;
        try {
          app.say(`Making ${name} …`);
          saveAnswer(await ask({ op: "export", file: what }));
          app.say(`${name} is saved.`);
        } catch (error) {
          app.fail(error);
        } finally {
          button.disabled = false;
        }
      };
      return button;
    };
    const octree = file("octree", "octree.bt", "octree");
    root.append(
      el("div", { class: "field" }, frame, strip),
      el(
        "div",
        { class: "side" },
        group("Map", state.node, trouble),
        group("Surface", colorPlace, colorNote, el("div", { class: "row" }, fit)),
        group("Slice", fieldChoice.node, axisChoice.node, atSlider.node, cutNote),
        inspector.node,
        group("Settings", settings),
        group(
          "Files",
          el(
            "div",
            { class: "row", style: "justify-content:flex-start" },
            file("ply", "mesh.ply", "ply"),
            file("glb", "mesh.glb", "glb"),
            file("esdf", "esdf.bin", "esdf"),
            octree,
          ),
        ),
      ),
    );

    /** What the sliders set; the run begins again. @param {any} change */
    function set(change) {
      newSettings = { ...(newSettings ?? all.settings), ...change };
      drive();
    }
    const setCalmly = calmly((/** @type {any} */ change) => set(change), 250);
    function settingsControls() {
      if (all.fixed) {
        settings.replaceChildren(
          el(
            "p",
            { class: "note" },
            `The map was made before, in cells of ${cm(all.resolution)}, truncation ${cm(all.truncation)}.`,
          ),
        );
        return;
      }
      const s = all.settings;
      const sensor = choice({
        id: "space-sensor",
        label: "Sensor",
        value: s.sensor,
        options: [
          ["lidar", "lidar"],
          ["camera", "depth camera"],
        ],
        onchange: (v) => set({ sensor: v }),
      });
      const truncation = slider({
        id: "space-truncation",
        label: "Truncation",
        min: 1,
        max: 10,
        step: 0.5,
        value: s.truncation / s.resolution,
        format: (v) => `${v} cells`,
        oninput: (v) => setCalmly({ truncation: v * resolution.value }),
      });
      const resolution = slider({
        id: "space-resolution",
        label: "Resolution",
        values: RESOLUTIONS,
        value: s.resolution,
        format: cm,
        oninput: (v) => setCalmly({ resolution: v, truncation: truncation.value * v }),
      });
      const clamp = slider({
        id: "space-wmax",
        label: "W_max",
        values: [1, 2, 4, 8, 16, 32, 64, 128, 256],
        value: s.w_max,
        oninput: (v) => setCalmly({ w_max: v }),
      });
      const carve = toggle({
        id: "space-carve",
        label: "Carve free space",
        value: s.carve,
        onchange: (v) => set({ carve: v }),
      });
      const halfLife = el(
        "p",
        { class: "note", id: "space-half-life" },
        `Half-life of what has gone: ${all.half_life.toFixed(1)} observations.`,
      );
      const occupancy = toggle({
        id: "space-occupancy",
        label: "Occupancy too (slower)",
        value: s.occupancy,
        onchange: (v) => set({ occupancy: v }),
      });
      settings.replaceChildren(
        ...(all.simulated ? [sensor.node] : []),
        resolution.node,
        truncation.node,
        clamp.node,
        halfLife,
        carve.node,
        occupancy.node,
      );
    }

    // --- answers
    // -------------------------------------------------------------------------------------------------
    /** @param {import("../engine/engine.js").Answer} answer */
    function take(answer) {
      const before = body;
      body = answer.body;
      if (body.all) {
        all = body.all;
        by = body.color.by;
        stage?.setUp(all.up);
        stage?.showWay(all.way);
        colorChoice();
        settingsControls();
        octree.disabled = !all.occupancy;
        octree.title = all.occupancy ? "" : "Switch on occupancy in the settings";
        for (const id of ["play", "step", "restart", "frame"])
          /** @type {any} */ (strip.querySelector(`#space-${id}`)).disabled = body.frames === 0;
      }
      by = body.color.by;
      const news = stage?.surface.apply(answer) ?? false;
      stage?.showScan(/** @type {Float32Array} */ (answer.arrays.points), body.pose);
      if (
        stage?.fitted &&
        body.surface &&
        (!before?.surface || String(before.surface) !== String(body.surface))
      )
        stage.fit(body.surface);
      scrub.max = String(body.frames);
      if (document.activeElement !== scrub || goal === null) scrub.value = String(body.at);
      where.textContent = body.frames ? `${body.at} of ${body.frames}` : "";
      const ms = (/** @type {number} */ s) => `${(1000 * s).toFixed(1)} ms`;
      state.set({
        "space-name": all.name,
        "space-hits": body.hits === null ? "—" : count(body.hits),
        "space-triangles": count(body.mesh.triangles),
        "space-bricks": count(body.bricks),
        "space-bytes": bytes(body.bytes.tsdf),
        "space-bytes-occupancy": bytes(body.bytes.occupancy),
        "space-bytes-esdf": bytes(body.bytes.esdf),
        "space-bytes-mesh": bytes(body.bytes.mesh),
        "space-time": body.bytes?.occupancy
          ? `${ms(body.seconds.tsdf)} + occupancy ${ms(body.seconds.occupancy)}`
          : ms(body.seconds.tsdf),
        "space-time-mesh": ms(body.seconds.mesh),
      });
      const why =
        body.full ??
        (body.left_out.frames
          ? `${body.left_out.frames} frames were left out; the first: ${body.left_out.why}`
          : "");
      trouble.hidden = !why;
      trouble.textContent = why;
      legend();
      if (body.voxel) {
        voxel = { ...voxel, ...body.voxel };
        // What scans did to it is told when it rests.
        inspector.tell({ ...voxel, history: undefined });
      } else if (voxel) {
        // Another lattice has other voxels.
        voxel = null;
        inspector.clear();
        stage?.showVoxel(null, 0);
      }
      const now = performance.now();
      if (news || !before) {
        if (body.mesh.pending === 0 || (now - lastPicture > LOADING && body.mesh.triangles < LARGE)) {
          lastPicture = now;
          stage?.draw();
        } else app.meter.picture();
      } else if (body.mesh.pending === 0) stage?.draw();
      canvas.dataset.pending = String(body.mesh.pending);
    }

    function legend() {
      const { ramp } = body.color;
      legendText.textContent =
        {
          height: "Height ",
          color: "Colours as they were seen",
          weight: "Weight ",
          error: "Distance to the true surface ",
        }[/** @type {"height"} */ (by)] ?? "";
      legendRamp.hidden = low.hidden = high.hidden = !ramp;
      legendRamp.style.display = ramp ? "inline-block" : "none";
      if (!ramp) return;
      legendRamp.style.background = gradient(stops(by));
      const words = (/** @type {number | null} */ v) =>
        v === null
          ? ""
          : by === "error"
            ? `${v > 0 ? "+" : "−"}${cm(Math.abs(v))}`
            : `${by === "height" ? (v + all.height).toFixed(2) : v.toFixed(0)}${ramp.unit && ` ${ramp.unit}`}`;
      low.textContent = words(ramp.low);
      high.textContent = words(ramp.high);
    }

    // --- the slice
    // -----------------------------------------------------------------------------------------------
    const sliceNow = () =>
      slice.field === "none" || slice.at === null
        ? null
        : { field: slice.field, axis: slice.axis, at: slice.at };
    function cutWords() {
      return cut && slice.field !== "none" ? `${"xyz"[slice.axis]} = ${cut.body.world.toFixed(3)} m` : "";
    }

    /** @param {Partial<typeof slice>} change */
    function cutThrough(change) {
      Object.assign(slice, change);
      if (slice.field === "none") {
        cut = null;
        stage?.cut.hide();
        stage?.draw();
        cutNote.textContent = "";
        cutLegend.hidden = true;
        flat.getContext("2d")?.clearRect(0, 0, flat.width, flat.height);
      }
      newCut = true;
      // A map without occupancy is made again with it.
      if (slice.field === "occupancy" && !all.occupancy && !all.fixed) set({ occupancy: true });
      drive();
    }

    async function askCut() {
      newCut = false;
      if (slice.field === "none" || !body?.bounds) return;
      const [a, b] = body.bounds;
      const k = slice.axis;
      if (slice.at === null)
        slice.at = (body.surface ?? body.bounds)[0][k] * 0.5 + (body.surface ?? body.bounds)[1][k] * 0.5;
      slice.at = Math.min(Math.max(slice.at, a[k]), b[k]);
      const field = slice.field;
      const answer = await ask({ op: "slice", slice: sliceNow() });
      app.meter.measure(() => {
        cut = answer;
        cutAt = answer.body.revision;
        const input = /** @type {HTMLInputElement} */ (atSlider.node.querySelector("input"));
        input.min = String(a[k]);
        input.max = String(b[k]);
        input.step = String(all.resolution);
        atSlider.value = /** @type {number} */ (slice.at);
        stage?.cut.show(answer, field);
        if (!stage) paintFlat(answer, field);
        cutNote.textContent =
          field === "esdf" && answer.body.seconds > 0
            ? `The field was made in ${(1000 * answer.body.seconds).toFixed(0)} ms.`
            : "";
        if (answer.body.step > 1) cutNote.textContent += ` Every ${answer.body.step}. cell is shown.`;
        const ends =
          field === "occupancy"
            ? ["occupied", "free"]
            : [`−${cm(answer.body.most)}`, `+${cm(answer.body.most)}`];
        const name = FIELDS.find(([id]) => id === field)?.[1];
        cutLegend.hidden = false;
        cutLegend.replaceChildren(
          `Slice, ${name} ${ends[0]} `,
          el("i", {
            "aria-hidden": "true",
            style: `display:inline-block;width:110px;height:10px;border:1px solid var(--line);vertical-align:-1px;margin:0 2px;background:${rampCss()}`,
          }),
          ` ${ends[1]}`,
        );
        stage?.draw();
      });
      app.changed();
    }

    /** @param {import("../engine/engine.js").Answer} answer @param {string} field */
    function paintFlat(answer, field) {
      const { width, height, bytes } = image(answer, field);
      [flat.width, flat.height] = [width, height];
      const rows = new ImageData(width, height);
      for (let y = 0; y < height; y++)
        rows.data.set(bytes.subarray(4 * width * y, 4 * width * (y + 1)), 4 * width * (height - 1 - y));
      flat.getContext("2d")?.putImageData(rows, 0, 0);
    }

    // --- the voxel
    // -----------------------------------------------------------------------------------------------
    /** @param {number} x @param {number} y from -1 to 1, to the right and up */
    async function pick(x, y) {
      if (!stage) return;
      try {
        const { body: met } = await ask({ op: "pick", ...stage.ray(x, y), slice: cut ? sliceNow() : null });
        if (met) look(met.cell);
        else app.say("Nothing is there.");
      } catch (error) {
        app.fail(error);
      }
    }

    /** @param {number[] | null} cell */
    function look(cell) {
      newVoxel = cell;
      drive();
    }

    async function askVoxel() {
      const cell = newVoxel !== undefined ? newVoxel : voxel?.cell;
      newVoxel = undefined;
      const answer = await ask({ op: "voxel", cell });
      app.meter.measure(() => {
        voxel = answer.body;
        voxelAt = body.revision;
        inspector.tell(voxel);
        stage?.showVoxel(voxel?.corner ?? null, all.resolution);
      });
      app.changed();
    }

    // --- the one loop that asks
    // ----------------------------------------------------------------------------------
    async function drive() {
      if (driving || !visible) return;
      driving = true;
      /**
       * The next part of a large mesh, which the engine makes while this one is taken in.
       * @type {ReturnType<typeof ask> | null}
       */
      let ahead = null;
      try {
        while (visible || ahead) {
          const started = performance.now();
          /** @type {object | null} */
          let question = null;
          if (ahead) question = { op: "mesh" };
          else if (!all) question = { op: "open" };
          else if (newSettings) {
            const at = body.at;
            question = { op: "set", settings: newSettings };
            newSettings = null;
            if (!playing) goal = goal ?? at;
          } else if (newColor) {
            question = { op: "color", by: newColor };
            newColor = null;
          } else if (goal !== null && goal !== body.at && (goal < body.at || !body.full))
            question = { op: "seek", frame: goal };
          else if (body.mesh.pending > 0) question = { op: "mesh" };
          else if (newVoxel !== undefined) {
            await askVoxel();
            continue;
          } else if (newCut) {
            await askCut();
            continue;
          } else if (playing && body.at < body.frames && !body.full)
            question = { op: "step", frames: speed === Infinity ? 2 : 1 };
          if (question === null) {
            goal = null;
            if (playing) setPlaying(false);
            // It rests: what follows the map more slowly comes now.
            if (slice.field !== "none" && cutAt !== body.revision && body.bounds) await askCut();
            else if (voxel && voxelAt !== body.revision) await askVoxel();
            else if (voxel?.history && voxel.history.looked_at !== null) {
              const watched = voxel;
              const { body: history } = await ask({ op: "history" });
              watched.history = history;
              // Another may have been chosen meanwhile, or none.
              if (voxel === watched) app.meter.measure(() => inspector.history(history, watched.recorded));
            } else break;
            continue;
          }
          if (!load.started) load.started = started;
          const answer = await (ahead ?? ask(question));
          const arrived = performance.now();
          ahead = null;
          if (
            answer.body.mesh.pending > 0 &&
            answer.body.mesh.triangles >= LARGE &&
            !newSettings &&
            !newColor
          ) {
            ahead = ask({ op: "mesh" });
            // It is waited for below; until then nobody else need hear that it failed.
            ahead.catch(() => {});
          }
          // One answer per picture, so that the page stays light; a large mesh does not wait for pictures.
          await (body?.mesh.triangles < LARGE ? nextPicture() : wait(0));
          const taken = performance.now();
          app.meter.measure(() => take(answer));
          load.transfer += arrived - started;
          load.take += performance.now() - taken;
          load.bytes += Object.values(answer.arrays).reduce((n, a) => n + a.byteLength, 0);
          load.done = performance.now();
          if (goal === body.at) goal = null;
          if (
            slice.field !== "none" &&
            slice.field !== "esdf" &&
            cutAt !== body.revision &&
            body.mesh.pending === 0 &&
            body.bounds
          )
            await askCut();
          if (playing && goal === null && speed < Infinity)
            await wait(Math.max(0, 1000 / speed - (performance.now() - started)));
        }
      } catch (error) {
        playing = false;
        goal = null;
        play.textContent = "Play";
        play.setAttribute("aria-pressed", "false");
        app.fail(error);
      } finally {
        driving = false;
      }
      app.changed();
    }

    function see() {
      if (stage && body?.surface) {
        stage.fitted = true;
        stage.fit(body.surface);
        app.changed();
      }
    }

    // --- the pointer
    // ---------------------------------------------------------------------------------------------
    let down = [0, 0];
    canvas.addEventListener("pointerdown", (event) => (down = [event.clientX, event.clientY]));
    canvas.addEventListener("pointerup", (event) => {
      // A drag turns the eye.
      if (event.button !== 0 || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4) return;
      const box = canvas.getBoundingClientRect();
      pick(
        (2 * (event.clientX - box.left)) / box.width - 1,
        1 - (2 * (event.clientY - box.top)) / box.height,
      );
    });

    const numbers = (/** @type {string | null} */ text, /** @type {number} */ n) => {
      const all = (text ?? "").split(",").map(Number);
      return all.length === n && all.every(Number.isFinite) ? all : null;
    };

    // For who measures: `document.querySelector("#space-canvas").load`.
    Object.assign(canvas, { load, info: () => stage?.renderer.info });

    return {
      async show(params) {
        visible = true;
        const first = !all;
        const wanted = params.get("frame");
        const frameWanted = wanted !== null && Number.isInteger(Number(wanted)) ? Number(wanted) : null;
        const cutWanted = (params.get("slice") ?? "").split(",");
        const cutAtWanted = Number(cutWanted[2]);
        if (
          FIELDS.some(([id]) => id === cutWanted[0]) &&
          ["0", "1", "2"].includes(cutWanted[1]) &&
          Number.isFinite(cutAtWanted)
        ) {
          Object.assign(slice, { field: cutWanted[0], axis: Number(cutWanted[1]), at: cutAtWanted });
          fieldChoice.value = slice.field;
          axisChoice.value = cutWanted[1];
          newCut = true;
        }
        const eye = numbers(params.get("eye"), 6);
        if (eye) stage?.setEye(eye);
        const cell = numbers(params.get("voxel"), 3);
        if (cell) newVoxel = cell;
        if (first) {
          load.started = performance.now();
          const answer = await ask({ op: "open" });
          app.meter.measure(() => take(answer));
          const set = numbers(params.get("settings"), 5);
          if (set && !all.fixed) {
            const sensor = params.get("sensor") ?? all.settings.sensor;
            newSettings = {
              resolution: set[0],
              truncation: set[1],
              w_max: set[2],
              carve: set[3] !== 0,
              occupancy: set[4] !== 0,
              sensor,
            };
          }
          if (frameWanted !== null) goal = Math.max(0, Math.min(frameWanted, body.frames));
          else if (body.frames > 0) setPlaying(true);
          app.say(
            all.fixed ? `${all.name}: a map that was made before.` : `${all.name}: ${body.frames} frames.`,
          );
        } else if (frameWanted !== null) goal = Math.max(0, Math.min(frameWanted, body.frames));
        const color = params.get("color");
        // A link may come from another log, whose surface can be coloured in other ways.
        if (all.colors.some((/** @type {any} */ c) => c.by === color && !c.refused)) newColor = color;
        drive();
        stage?.draw();
      },
      hide() {
        visible = false;
        if (playing) {
          playing = false;
          play.textContent = "Play";
          play.setAttribute("aria-pressed", "false");
        }
        app.meter.note = "";
      },
      state() {
        if (!body || !all) return {};
        const s = all.settings;
        return {
          frame: String(body.at),
          color: by,
          ...(all.fixed
            ? {}
            : {
                settings: [s.resolution, s.truncation, s.w_max, Number(s.carve), Number(s.occupancy)]
                  .map((v) => Number(v.toFixed(4)))
                  .join(","),
                sensor: s.sensor,
              }),
          ...(sliceNow()
            ? { slice: `${slice.field},${slice.axis},${/** @type {number} */ (slice.at).toFixed(3)}` }
            : {}),
          ...(voxel ? { voxel: voxel.cell.join(",") } : {}),
          ...(stage && !stage.fitted
            ? {
                eye: stage
                  .eye()
                  .map((v) => v.toFixed(2))
                  .join(","),
              }
            : {}),
        };
      },
      picture() {
        const title = `${all?.name ?? "space"}, frame ${body?.at ?? 0} of ${body?.frames ?? 0}`;
        return compose(title, [
          [stage ? stage.picture() : flat],
          ...(voxel && inspector.plot.canvas() ? [[inspector.plot.canvas()]] : []),
        ]);
      },
      key(event) {
        if (event.key === " ") return (setPlaying(!playing), true);
        const k = event.key.toLowerCase();
        if (k === "n") return (stepOne.click(), true);
        if (k === "f") return (see(), true);
        if (event.key === "Home") return (restart.click(), true);
        if (event.key === "End") return (setPlaying(false), seek(body?.frames ?? 0), true);
        if (event.key === "Enter") return (pick(0, 0), true);
        if (event.key === "Escape" && voxel) return (look(null), true);
        const axis = "xyz".indexOf(k);
        if (k.length === 1 && axis >= 0 && voxel) {
          const cell = [...voxel.cell];
          cell[axis] += event.shiftKey ? -1 : 1;
          return (look(cell), true);
        }
        const move = { "[": -1, "]": 1, "{": -10, "}": 10 }[event.key];
        if (move && slice.at !== null && slice.field !== "none")
          return (cutThrough({ at: slice.at + move * all.resolution }), true);
        return stage?.key(event) ?? false;
      },
      keys: [
        ["Space", "play, pause"],
        ["N", "the next frame"],
        ["Home, End", "the first frame, the last"],
        ["arrows", "go round; with Shift sideways"],
        ["+ −", "nearer, further"],
        ["F", "see all"],
        ["Enter", "look at the voxel in the middle"],
        ["X Y Z", "the next voxel along the axis; with Shift the one before"],
        ["[ ]", "move the slice by a cell"],
        ["Esc", "look at no voxel"],
      ],
      redraw() {
        stage?.redraw();
        inspector.plot.redraw();
        if (!body) return;
        legend();
        if (cut) {
          stage?.cut.show(cut, slice.field);
          if (!stage) paintFlat(cut, slice.field);
          const ramp = /** @type {HTMLElement | null} */ (cutLegend.querySelector("i"));
          if (ramp) ramp.style.background = rampCss();
        }
        stage?.draw();
      },
    };
  },
};
