// @ts-check
import { Curves } from "../radiance/curves.js";
import { digits, Explanation } from "../radiance/explain.js";
import { Picture } from "../radiance/picture.js";
import { player } from "../radiance/player.js";
import { readRun, start, writeRun } from "../radiance/start.js";
import { choice, el, facts, group, legend } from "../ui/controls.js";
import { compose } from "../ui/picture.js";

/** Steps that the engine makes at once at most. */
const MOST_AT_ONCE = 2000;
/** Milliseconds between two drawings of the curves while playing. */
const CALM = 40;

/** @type {import("../main.js").View} */
export default {
  id: "radiance",
  title: "Radiance",
  mount(root, app) {
    /** Answers that came since the last picture. @type {import("../engine/engine.js").Answer[]} */
    const arrived = [];
    /** The last answer. @type {any} */
    let last;
    let opened = false;
    let plotted = 0;
    /** Counts what is played back, so that what comes later ends what came before. */
    let turn = 0;

    const picture = new Picture({ meter: app.meter, before: takeIn });
    const curves = new Curves();

    /** @param {object} question */
    async function ask(question) {
      try {
        const answer = await app.engine.ask("radiance", question);
        arrived.push(answer);
        picture.draw();
        return answer;
      } catch (error) {
        app.fail(error);
        throw error;
      }
    }
    /** Asks; what is refused is in the status line already. @param {object} question */
    const tryAsk = (question) =>
      ask(question).then(
        (answer) => (app.changed(), answer),
        () => undefined,
      );

    const play = player({
      step: (steps) => (turn++, ask({ op: "step", steps })),
      restart: () => begin(panel.seed),
      ontoggle: (on) => (on ? app.meter.reset() : (app.changed(), picture.draw())),
    });
    const panel = start({ begin, goOn: () => (turn++, tryAsk({ op: "go_on", ...panel.way })) });
    const explanation = new Explanation({ worst, close: () => look({ bin: null }) });
    const ray = choice({
      id: "radiance-ray",
      label: "Light of ray",
      value: "none",
      options: [["none", "none"]],
      onchange: (v) => look({ ray: v === "none" ? null : Number(v) }),
    });
    const numbers = facts([
      ["radiance-j", "objective J"],
      ["radiance-misplaced", "matter in empty space, Σ σδ"],
    ]);
    const residuals = residualTable();

    root.append(
      el("div", { class: "field" }, picture.node, curves.node, play.node),
      el(
        "div",
        { class: "side" },
        panel.node,
        el(
          "div",
          { class: "group" },
          ray.node,
          legend([
            { color: "positive", text: "density" },
            { color: "beam", text: "training ray, its light" },
            { color: "contour", text: "held-out ray, its light", dashed: true },
            { color: "negative", text: "residual" },
            { color: "truth", text: "truth, noise", dashed: true },
            { color: "", text: "reflectance 0 to 1", ramp: "linear-gradient(90deg, #000, #fff)" },
          ]),
        ),
        group("Residuals, root mean square", residuals.node, numbers.node),
        explanation.node,
      ),
    );

    /** Takes in what arrived; part of the picture's work. */
    function takeIn() {
      for (const { body, arrays } of arrived.splice(0)) {
        if (body.all) {
          picture.scene = body.all;
          explanation.setNoise(body.all.noise);
          panel.show(body.all.named, body.seed);
          if (ray.node.querySelectorAll("option").length === 1) {
            ray.node
              .querySelector("select")
              ?.append(
                ...body.all.rays.map((/** @type {any} */ r, /** @type {number} */ i) =>
                  el(
                    "option",
                    { value: i },
                    `${i + 1} ${r.ascending ? "›" : "‹"} ${r.origin.toFixed(2)} m${r.held_out ? ", held out" : ""}`,
                  ),
                ),
              );
          }
        }
        picture.fit = { body, arrays: /** @type {any} */ (arrays) };
        curves.take(body, /** @type {Float32Array} */ (arrays.curve));
        last = body;
      }
      if (!last) return;
      const now = performance.now();
      if (!play.playing || now - plotted > CALM) {
        plotted = now;
        curves.show(play.playing);
      }
      const way = last.phases[last.phases.length - 1];
      panel.way = way;
      ray.value = String(last.look.ray ?? "none");
      play.show(last.phases, last.made, last.seconds);
      explanation.take(last.bin, way.channels);
      residuals.show(last.training, last.held_out);
      numbers.set({ "radiance-j": digits(last.objective), "radiance-misplaced": digits(last.misplaced) });
    }

    /** A new run from the start of a seed. @param {number} seed */
    async function begin(seed) {
      turn++;
      await tryAsk({ op: "start", seed, ...panel.way });
      const shows = picture.scene?.named.find((n) => n.seed === seed)?.shows;
      app.say(`Seed ${seed}${shows ? `: ${shows}` : ""}.`);
    }

    /** Looks at another ray or bin. @param {{ray?: number | null, bin?: number | null}} what */
    const look = (what) => tryAsk({ op: "look", ray: last?.look.ray, bin: last?.look.bin, ...what });

    function worst() {
      if (last?.worst !== null) look({ bin: last.worst });
    }

    /**
     * Makes a run again, as a link tells it.
     * @param {number} seed
     * @param {{channels: string, optimizer: string, steps: number}[]} phases
     */
    async function replay(seed, phases) {
      const mine = ++turn;
      const all = phases.reduce((n, p) => n + p.steps, 0);
      let done = 0;
      for (const [i, { channels, optimizer, steps }] of phases.entries()) {
        await ask(
          i === 0 ? { op: "start", seed, channels, optimizer } : { op: "go_on", channels, optimizer },
        );
        for (let left = steps; left > 0 && mine === turn;) {
          const n = Math.min(left, MOST_AT_ONCE);
          await ask({ op: "step", steps: n });
          left -= n;
          done += n;
          app.say(`Making the run of the link again: ${done} of ${all} steps.`);
        }
        if (mine !== turn) return;
      }
      if (all > 0) app.say(`The run of the link was made again: ${all} steps.`);
    }

    picture.onpick = (bin, chosen) => {
      if (chosen !== undefined) look({ ray: chosen });
      else if (bin !== undefined) look({ bin });
    };

    /** @param {number} by */
    function moveCursor(by) {
      const bins = picture.scene?.bins ?? 1;
      const from = picture.cursor ?? last?.look.bin ?? 0;
      picture.cursor = Math.max(0, Math.min(bins - 1, from + by));
      picture.draw();
    }

    /** @param {number} by */
    function moveRay(by) {
      const count = picture.scene?.rays.length ?? 1;
      look({ ray: ((last?.look.ray ?? (by > 0 ? -1 : 0)) + by + count) % count });
    }

    return {
      async show(state) {
        const first = !opened;
        opened = true;
        if (first) {
          const { body } = await ask({ op: "open" });
          await ask({ op: "look", ray: 1, bin: body.worst });
          app.say("Play: gradient descent fits the field to seven rays. Then add reflectance.");
        }
        play.speed = state.get("speed") ?? play.speed;
        const run = readRun(state);
        if (run) {
          const number = (/** @type {string} */ key) => (state.has(key) ? Number(state.get(key)) : null);
          await ask({ op: "look", ray: number("ray"), bin: number("bin") });
          await replay(run.seed, run.phases);
        }
        picture.draw();
      },
      hide: () => play.pause(),
      state: () => {
        if (!last) return {};
        const { ray, bin } = last.look;
        return {
          ...writeRun(last),
          ...(ray === null ? {} : { ray: String(ray) }),
          ...(bin === null ? {} : { bin: String(bin) }),
          speed: play.speed,
        };
      },
      picture() {
        picture.paint();
        return compose(`portolan studio · radiance · seed ${last?.seed}, step ${last?.step}`, [
          [picture.canvas],
          curves.plots.map((p) => p.canvas()),
        ]);
      },
      key(event) {
        const far = event.shiftKey ? 10 : 1;
        /** @type {Record<string, () => void>} */
        const does = {
          ArrowLeft: () => moveCursor(-far),
          ArrowRight: () => moveCursor(far),
          ArrowUp: () => moveRay(-1),
          ArrowDown: () => moveRay(1),
          Enter: () => picture.cursor !== undefined && look({ bin: picture.cursor }),
          Escape: () => look({ bin: null }),
          w: worst,
          r: panel.reroll,
          c: panel.nextChannels,
        };
        if (event.key in does) return (does[event.key](), true);
        return play.key(event);
      },
      keys: [
        ["Space", "play or pause"],
        [". ,", "one step, as many as a picture has"],
        ["Home", "the same start again"],
        ["< >", "slower, faster"],
        ["R", "another start"],
        ["C", "other channels, from the field as it stands"],
        ["← →", "to another bin (with Shift ten further)"],
        ["Enter", "the gradient of that bin"],
        ["W", "the most misplaced bin"],
        ["Esc", "look at no bin"],
        ["↑ ↓", "the light of another ray"],
      ],
      redraw() {
        curves.redraw();
        picture.draw();
      },
    };
  },
};

/** Three channels, two kinds of rays. */
function residualTable() {
  const rows = [
    ["depth", "depth", " m"],
    ["reflectance", "reflectance", ""],
    ["second_moment", "second moment", " m²"],
  ];
  const cells = rows.map(([key]) =>
    ["training", "held-out"].map((kind) => el("td", { id: `radiance-${kind}-${key.replace("_", "-")}` })),
  );
  const head = ["", "training", "held out"].map((text) =>
    text ? el("th", { scope: "col" }, text) : el("td"),
  );
  return {
    node: el(
      "table",
      {},
      el("thead", {}, el("tr", {}, ...head)),
      el(
        "tbody",
        {},
        ...rows.map(([, name], i) => el("tr", {}, el("th", { scope: "row" }, name), ...cells[i])),
      ),
    ),
    /** @param {any} training @param {any} heldOut */
    show(training, heldOut) {
      for (const [i, [key, , unit]] of rows.entries())
        for (const [k, values] of [training, heldOut].entries()) {
          const text = digits(values[key]) + unit;
          if (cells[i][k].textContent !== text) cells[i][k].textContent = text;
        }
    },
  };
}
