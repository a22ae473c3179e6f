// @ts-check
import { el } from "../ui/controls.js";
import { button, Player } from "../ui/player.js";

/** Scans a second; the last is as many as can be fused. */
const FASTEST = 1000;
const SPEEDS = [1, 5, 20, 60, 200, FASTEST];

/** The strip below the map: play, step and scrub through the scans of the log. */
export class Scans {
  /**
   * @param {{step: (scans: number) => Promise<unknown>, seek: (scan: number) => Promise<unknown>, ontoggle:
   *   (playing: boolean) => void}} o
   */
  constructor({ step, seek, ontoggle }) {
    this.seekTo = seek;
    /** Scans that are fused, in a lap, in all laps. */
    this.at = 0;
    this.lap = 1;
    this.most = 1;
    /** Scans that should have been fused by now. */
    this.due = 0;
    /** Where it stops by itself. */
    this.until = Infinity;
    const start = () => this.seek(0);
    const back = () => this.seek(this.at - 1);
    const on = () => this.seek(this.at + 1);
    const end = () => this.seek(this.lapEnd(this.at + 1));
    this.player = new Player({
      id: "",
      label: "Speed",
      speeds: SPEEDS.map((s) => [s, nameOf(s)]),
      speed: 20,
      keys: { ".": on, ",": back, Home: start, End: end },
      due: (seconds, rate, idle) => this.#due(seconds, rate, idle),
      step,
      ontoggle: (playing) => {
        this.due = 1;
        if (!playing) this.until = Infinity;
        ontoggle(playing);
      },
    });
    this.scrub = el("input", {
      type: "range",
      id: "scrub",
      min: 0,
      max: 1,
      step: 1,
      value: 0,
      "aria-label": "Scan",
    });
    this.scrub.oninput = () => this.seek(Number(this.scrub.value));
    this.text = el("output", { id: "at", for: "scrub" });
    this.node = el(
      "div",
      { class: "strip" },
      this.player.button,
      button("start", "Start", "To the start (Home)", start),
      button("back", "−1", "One scan back (,)", back),
      button("step", "+1", "One scan on (.)", on),
      button("end", "End", "To the end of the lap (End)", end),
      this.scrub,
      this.text,
      this.player.speeds,
    );
  }

  /** Goes to where so many scans are fused, and stays there. @param {number} scan */
  seek(scan) {
    this.player.pause();
    const to = Math.max(0, Math.min(this.most, scan));
    this.player.ask(() => this.seekTo(to));
  }

  /** Plays a lap for who has just come. */
  arrive() {
    this.until = this.lap;
    this.player.arrive();
  }

  /** The end of the lap that scan `scan` is in. @param {number} scan */
  lapEnd(scan) {
    return this.lap * Math.max(1, Math.ceil(scan / this.lap));
  }

  /** @param {number} seconds @param {number} rate @param {boolean} idle */
  #due(seconds, rate, idle) {
    const end = Math.min(this.most, this.until);
    if (this.at >= end) return null;
    // What a slow machine is behind is not made up for: a picture would take long.
    this.due = Math.min(this.due + seconds * rate, rate >= FASTEST ? 12 : Math.max(1, rate / 8));
    const n = idle ? Math.min(Math.floor(this.due), end - this.at) : 0;
    this.due -= n;
    return n;
  }

  /** Shows where the engine is. @param {number} at @param {number} lap @param {number} most */
  show(at, lap, most) {
    [this.at, this.lap, this.most] = [at, lap, most];
    // The bar is one lap, as the text is.
    this.scrub.min = String(this.lapEnd(at) - lap);
    this.scrub.max = String(Math.min(most, this.lapEnd(at)));
    this.scrub.value = String(at);
    const inLap = at ? ((at - 1) % lap) + 1 : 0;
    this.text.textContent =
      most > lap
        ? `scan ${inLap} of ${lap}, lap ${Math.max(1, Math.ceil(at / lap))}`
        : `scan ${at} of ${lap}`;
    this.scrub.setAttribute("aria-valuetext", this.text.textContent);
  }
}

/** @param {number} speed */
function nameOf(speed) {
  return speed === FASTEST ? "as fast as possible" : `${speed} scan${speed > 1 ? "s" : ""} a second`;
}
