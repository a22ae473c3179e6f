// @ts-check
import { choice, el, group } from "../ui/controls.js";

/** Steps that a link may ask for. */
const MOST_STEPS = 500_000;
/** Ways of fitting that a link may have in a row. */
const MOST_PHASES = 32;

/** @typedef {{channels: string, optimizer: string}} Way how is fitted */

/**
 * Where a run begins and what it learns from.
 * @param {{begin: (seed: number) => void, goOn: () => void}} o `goOn`: another way of fitting was chosen
 */
export function start({ begin, goOn }) {
  const shows = el("p", { class: "note", id: "radiance-shows" });
  const named = choice({
    id: "radiance-named",
    label: "Start",
    value: "",
    options: [],
    onchange: (v) => v !== "" && begin(Number(v)),
  });
  const select = /** @type {HTMLSelectElement} */ (named.node.querySelector("select"));
  const number = el("input", {
    id: "radiance-seed",
    type: "number",
    min: 0,
    max: Number.MAX_SAFE_INTEGER,
    step: 1,
    value: 0,
    style: "width: 9.5em",
  });
  number.onchange = () => {
    if (number.value !== "" && number.checkValidity()) begin(Number(number.value));
    else number.reportValidity();
  };
  const reroll = () => begin(Math.floor(Math.random() * 2 ** 32));
  const channels = choice({
    id: "radiance-channels",
    label: "Measured",
    value: "depth",
    options: [
      ["depth", "depth only"],
      ["reflectance", "depth and reflectance"],
      ["spread", "depth, reflectance, spread"],
    ],
    onchange: () => goOn(),
  });
  const optimizer = choice({
    id: "radiance-optimizer",
    label: "Optimiser",
    value: "descent",
    options: [
      ["descent", "gradient descent"],
      ["adam", "Adam"],
    ],
    onchange: () => goOn(),
  });
  const node = group(
    "The fit",
    named.node,
    el(
      "div",
      { class: "row control" },
      el("label", { for: "radiance-seed" }, "Seed"),
      el(
        "span",
        {},
        number,
        " ",
        el(
          "button",
          { type: "button", id: "radiance-reroll", title: "Another start (R)", onclick: () => reroll() },
          "Re-roll",
        ),
      ),
    ),
    shows,
    channels.node,
    optimizer.node,
    el(
      "p",
      { class: "note" },
      "What is changed here goes on from the field as it stands; ",
      el("em", {}, "Start over"),
      " takes the same start again.",
    ),
  );

  return {
    node,
    reroll,
    nextChannels() {
      const order = ["depth", "reflectance", "spread"];
      channels.value = order[(order.indexOf(channels.value) + 1) % order.length];
      goOn();
    },
    /** The seed of the run. */
    get seed() {
      return Number(number.value);
    },
    /** @returns {Way} */
    get way() {
      return { channels: channels.value, optimizer: optimizer.value };
    },
    set way(way) {
      // A list that is open under the pointer keeps what is chosen in it.
      if (document.activeElement !== channels.node.querySelector("select")) channels.value = way.channels;
      if (document.activeElement !== optimizer.node.querySelector("select")) optimizer.value = way.optimizer;
    },
    /** @param {{name: string, seed: number, shows: string}[]} seeds @param {number} seed */
    show(seeds, seed) {
      if (select.options.length === 0) {
        select.append(
          ...seeds.map((s) => el("option", { value: s.seed }, s.name.replaceAll("-", " "))),
          el("option", { value: "" }, "random"),
        );
      }
      const known = seeds.find((s) => s.seed === seed);
      select.value = known ? String(seed) : "";
      number.value = String(seed);
      const text = known?.shows ?? "a random start: thin fog and three clumps anywhere";
      shows.textContent = text[0].toUpperCase() + text.slice(1) + ".";
    },
  };
}

/**
 * What a link says of a run: its seed, and every way of fitting with its steps.
 * @param {{seed: number, phases: (Way & {steps: number})[]}} run
 */
export function writeRun({ seed, phases }) {
  return { seed: String(seed), run: phases.map((p) => `${p.channels}-${p.optimizer}-${p.steps}`).join(".") };
}

/** @param {URLSearchParams} state @returns {{seed: number, phases: (Way & {steps: number})[]} | undefined} */
export function readRun(state) {
  const seed = Number(state.get("seed") ?? NaN);
  if (!Number.isSafeInteger(seed) || seed < 0) return undefined;
  const phases = (state.get("run") ?? "depth-descent-0")
    .split(".")
    .slice(0, MOST_PHASES)
    .map((text) => {
      const [channels, optimizer, steps] = text.split("-");
      return { channels, optimizer, steps: Number(steps) };
    });
  const all = phases.reduce((n, p) => n + p.steps, 0);
  if (!phases.every((p) => Number.isSafeInteger(p.steps) && p.steps >= 0) || all > MOST_STEPS)
    throw new Error(`the link's run is none, or has more than ${MOST_STEPS} steps`);
  return { seed, phases };
}
