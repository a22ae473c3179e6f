// @ts-check
import { choice, el, group } from "../ui/controls.js";

/** @typedef {{channels: string, optimizer: string}} Way how is fitted */

const CHANNELS = /** @type {[string, string][]} */ ([
  ["depth", "depth only"],
  ["reflectance", "depth and reflectance"],
  ["spread", "depth, reflectance, spread"],
]);
const OPTIMIZERS = /** @type {[string, string][]} */ ([
  ["descent", "gradient descent"],
  ["adam", "Adam"],
]);

/** Where a run begins and what it learns from. */
export class StartPanel {
  /**
   * @param {{begin: (seed: number) => void, goOn: () => void}} o `goOn`: another way of fitting was chosen
   */
  constructor({ begin, goOn }) {
    this.begin = begin;
    this.goOn = goOn;
    this.named = choice({
      id: "radiance-named",
      label: "Start",
      value: "",
      options: [],
      onchange: (v) => v !== "" && begin(Number(v)),
    });
    const size = { min: 0, max: Number.MAX_SAFE_INTEGER, step: 1, value: 0, style: "width: 9.5em" };
    this.number = el("input", { id: "radiance-seed", type: "number", ...size });
    this.number.onchange = () => {
      if (this.number.value !== "" && this.number.checkValidity()) begin(this.seed);
      else this.number.reportValidity();
    };
    this.channels = choice({
      id: "radiance-channels",
      label: "Measured",
      value: "depth",
      options: CHANNELS,
      onchange: goOn,
    });
    this.optimizer = choice({
      id: "radiance-optimizer",
      label: "Optimizer",
      value: "descent",
      options: OPTIMIZERS,
      onchange: goOn,
    });
    this.shows = el("p", { class: "note", id: "radiance-shows" });
    const choices = [this.channels.node, this.optimizer.node];
    this.node = group("The fit", this.named.node, this.#seedRow(), this.shows, ...choices, note());
  }

  #seedRow() {
    const button = { type: "button", id: "radiance-reroll", title: "Another start (R)" };
    const reroll = el("button", { ...button, onclick: () => this.reroll() }, "Re-roll");
    const label = el("label", { for: "radiance-seed" }, "Seed");
    return el("div", { class: "row control" }, label, el("span", {}, this.number, " ", reroll));
  }

  reroll() {
    this.begin(Math.floor(Math.random() * 2 ** 32));
  }

  nextChannels() {
    const at = CHANNELS.findIndex(([id]) => id === this.channels.value);
    this.channels.value = CHANNELS[(at + 1) % CHANNELS.length][0];
    this.goOn();
  }

  /** The seed of the run. */
  get seed() {
    return Number(this.number.value);
  }

  /** @returns {Way} */
  get way() {
    return { channels: this.channels.value, optimizer: this.optimizer.value };
  }

  set way({ channels, optimizer }) {
    const show = (/** @type {ReturnType<typeof choice>} */ list, /** @type {string} */ value) => {
      // A list that is open under the pointer keeps what is chosen in it.
      if (document.activeElement !== list.node.querySelector("select")) list.value = value;
    };
    show(this.channels, channels);
    show(this.optimizer, optimizer);
  }

  /** @param {{name: string, seed: number, shows: string}[]} seeds @param {number} seed */
  show(seeds, seed) {
    const select = /** @type {HTMLSelectElement} */ (this.named.node.querySelector("select"));
    if (select.options.length === 0) {
      const names = seeds.map((s) => el("option", { value: s.seed }, s.name.replaceAll("-", " ")));
      select.append(...names, el("option", { value: "" }, "random"));
    }
    const known = seeds.find((s) => s.seed === seed);
    select.value = known ? String(seed) : "";
    this.number.value = String(seed);
    const text = known?.shows ?? "a random start: thin fog and three clumps anywhere";
    this.shows.textContent = `${text[0].toUpperCase()}${text.slice(1)}.`;
  }
}

function note() {
  const again = el("em", {}, "Start over");
  const text = "What is changed here goes on from the field as it stands; ";
  return el("p", { class: "note" }, text, again, " takes the same start again.");
}
