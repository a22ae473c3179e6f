// @ts-check
import { el } from "../ui/controls.js";

const SPEEDS = [1, 5, 20, 60, 200, 1000];

/**
 * Play, step, scrub, speed. It asks for scans and waits for its answer before it asks again.
 * @param {{step: (n: number) => Promise<void>, seek: (scan: number) => Promise<void>, ontoggle: (playing:
 *   boolean) => void}} o
 */
export function player(o) {
  let playing = false;
  let busy = false;
  let [at, lap, most] = [0, 1, 1];
  let [due, then] = [0, 0];
  /** @type {number | undefined} */
  let wanted;

  const button = (
    /** @type {string} */ id,
    /** @type {string} */ text,
    /** @type {string} */ label,
    /** @type {() => void} */ onclick,
  ) => el("button", { type: "button", id, title: label, "aria-label": label, onclick }, text);
  const play = button("play", "Play", "Play or pause (Space)", () => toggle());
  const scrub = el("input", {
    type: "range",
    id: "scrub",
    min: 0,
    max: 1,
    step: 1,
    value: 0,
    "aria-label": "Scan",
  });
  scrub.oninput = () => (pause(), seek(Number(scrub.value)));
  const text = el("output", { id: "at", for: "scrub" });
  const speed = el(
    "select",
    { id: "speed", "aria-label": "Speed" },
    ...SPEEDS.map((s) =>
      el("option", { value: s }, s === 1000 ? "as fast as it goes" : `${s} scan${s > 1 ? "s" : ""} a second`),
    ),
  );
  speed.value = "20";

  /**
   * One question at a time; of the places that were wanted meanwhile, the last.
   * @param {() => Promise<void>} question
   */
  async function ask(question) {
    busy = true;
    try {
      await question();
    } catch {
      pause();
    } finally {
      busy = false;
    }
    if (wanted !== undefined) {
      const to = wanted;
      wanted = undefined;
      seek(to);
    }
  }

  /** @param {number} scan */
  function seek(scan) {
    const to = Math.max(0, Math.min(most, scan));
    if (busy) wanted = to;
    else ask(() => o.seek(to));
  }

  function tick(/** @type {number} */ now) {
    if (!playing) return;
    requestAnimationFrame(tick);
    const rate = Number(speed.value);
    due = Math.min(due + ((now - then) / 1000) * rate, rate >= 1000 ? 12 : Math.max(1, rate / 8));
    then = now;
    const n = Math.min(Math.floor(due), most - at);
    if (at >= most) pause();
    else if (n >= 1 && !busy) {
      due -= n;
      ask(() => o.step(n));
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
    if (playing) {
      [due, then] = [1, performance.now()];
      requestAnimationFrame(tick);
    }
  }
  play.setAttribute("aria-pressed", "false");

  return {
    node: el(
      "div",
      { class: "strip" },
      play,
      button("start", "Start", "To the start (Home)", () => (pause(), seek(0))),
      button("back", "−1", "One scan back (,)", () => (pause(), seek(at - 1))),
      button("step", "+1", "One scan on (.)", () => (pause(), seek(at + 1))),
      button(
        "end",
        "End",
        "To the end of the lap (End)",
        () => (pause(), seek(lap * Math.max(1, Math.ceil((at + 1) / lap)))),
      ),
      scrub,
      text,
      speed,
    ),
    /** The engine is there now. @param {number} a @param {number} l @param {number} m */
    show(a, l, m) {
      [at, lap, most] = [a, l, m];
      scrub.max = String(Math.min(most, lap * Math.max(1, Math.ceil(at / lap))));
      scrub.value = String(at);
      text.textContent =
        most > lap
          ? `scan ${at ? ((at - 1) % lap) + 1 : 0} of ${lap}, lap ${Math.max(1, Math.ceil(at / lap))}`
          : `scan ${at} of ${lap}`;
      scrub.setAttribute("aria-valuetext", text.textContent);
    },
    toggle,
    pause,
    seek,
    get playing() {
      return playing;
    },
    /** Keys of the player. @param {KeyboardEvent} e */
    key(e) {
      /** @type {Record<string, () => void>} */
      const does = {
        " ": toggle,
        ".": () => (pause(), seek(at + 1)),
        ",": () => (pause(), seek(at - 1)),
        Home: () => (pause(), seek(0)),
        End: () => (pause(), seek(lap * Math.max(1, Math.ceil((at + 1) / lap)))),
        "<": () => faster(-1),
        ">": () => faster(1),
      };
      does[e.key]?.();
      return e.key in does;
    },
  };

  /** @param {number} by */
  function faster(by) {
    speed.selectedIndex = Math.max(0, Math.min(SPEEDS.length - 1, speed.selectedIndex + by));
  }
}
