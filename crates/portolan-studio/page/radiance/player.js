// @ts-check
import { el } from "../ui/controls.js";

/** Steps per picture. */
const SPEEDS = [1, 5, 20, 50, 100, 200, 500, 1000, 2000];
/** Steps after which playing pauses: what the named seeds show, they show after so many. */
const REST = 20_000;

/**
 * Play, step, speed. It asks for steps and waits for the answer before it asks again.
 * @param {{step: (n: number) => Promise<unknown>, restart: () => void, ontoggle: (playing: boolean) => void}}
 *   o
 */
export function player(o) {
  let playing = false;
  let busy = false;
  /** Steps of the way of fitting that is in force. */
  let inPhase = 0;

  const button = (
    /** @type {string} */ id,
    /** @type {string} */ text,
    /** @type {string} */ label,
    /** @type {() => void} */ onclick,
  ) => el("button", { type: "button", id, title: label, "aria-label": label, onclick }, text);
  const play = button("radiance-play", "Play", "Play or pause (Space)", () => toggle());
  const speed = el(
    "select",
    { id: "radiance-speed" },
    ...SPEEDS.map((s) => el("option", { value: s }, String(s))),
  );
  speed.value = "50";
  const more = button(
    "radiance-more",
    "+50",
    "As many steps as a picture has (,)",
    () => (pause(), step(Number(speed.value))),
  );
  speed.onchange = () => void (more.textContent = `+${speed.value}`);
  const text = el("output", { id: "radiance-at", "aria-live": "off" });
  play.setAttribute("aria-pressed", "false");

  function tick() {
    if (!playing) return;
    requestAnimationFrame(tick);
    if (busy) return;
    step(Math.min(Number(speed.value), REST - (inPhase % REST)));
  }

  /** @param {number} n */
  async function step(n) {
    if (busy) return;
    busy = true;
    try {
      await o.step(n);
      inPhase += n;
      if (inPhase % REST === 0) pause();
    } catch {
      pause();
    } finally {
      busy = false;
    }
  }

  function pause() {
    if (playing) toggle();
  }

  function toggle() {
    playing = !playing;
    play.textContent = playing ? "Pause" : "Play";
    play.setAttribute("aria-pressed", String(playing));
    o.ontoggle(playing);
    if (playing) requestAnimationFrame(tick);
  }

  /** @param {number} by */
  function faster(by) {
    speed.selectedIndex = Math.max(0, Math.min(SPEEDS.length - 1, speed.selectedIndex + by));
    more.textContent = `+${speed.value}`;
  }

  return {
    node: el(
      "div",
      { class: "strip" },
      play,
      button("radiance-step", "+1", "One step (.)", () => (pause(), step(1))),
      more,
      button("radiance-restart", "Start over", "The same start again (Home)", () => (pause(), o.restart())),
      text,
      speed,
      el("label", { for: "radiance-speed" }, "steps a picture"),
    ),
    pause,
    /**
     * The engine is there now; the last answer made so many steps.
     * @param {{steps: number}[]} phases
     * @param {number} made
     * @param {number} seconds
     */
    show(phases, made, seconds) {
      inPhase = phases[phases.length - 1].steps;
      const all = phases.reduce((n, p) => n + p.steps, 0);
      text.textContent = `step ${all.toLocaleString("en").replaceAll(",", "\u202f")}${made > 0 && seconds > 0 ? ` · ${((1e6 * seconds) / made).toFixed(1)} µs a step` : ""}`;
    },
    get speed() {
      return speed.value;
    },
    set speed(v) {
      if (SPEEDS.includes(Number(v))) speed.value = v;
      more.textContent = `+${speed.value}`;
    },
    get playing() {
      return playing;
    },
    /** Keys of the player. @param {KeyboardEvent} e */
    key(e) {
      /** @type {Record<string, () => void>} */
      const does = {
        " ": toggle,
        ".": () => (pause(), step(1)),
        ",": () => (pause(), step(Number(speed.value))),
        Home: () => (pause(), o.restart()),
        "<": () => faster(-1),
        ">": () => faster(1),
      };
      does[e.key]?.();
      return e.key in does;
    },
  };
}
