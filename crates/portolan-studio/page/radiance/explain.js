// @ts-check
import { el, facts, group } from "../ui/controls.js";

/** Three digits that mean something. @param {number | null} v */
export function digits(v) {
  if (v === null || v === undefined) return "–";
  if (v === 0) return "0";
  const size = Math.abs(v);
  const text = size >= 1e5 || size < 1e-3 ? v.toExponential(size < 1e-9 ? 0 : 1) : v.toPrecision(3);
  return text.replaceAll("-", "−").replace("e+", "e");
}

const CHANNELS = [
  { key: "depth", title: "Depth", units: ["m", "m²"] },
  { key: "reflectance", title: "Reflectance", units: ["", "m"] },
  { key: "second_moment", title: "Spread (second moment)", units: ["m²", "m³"] },
];

/** Channels that a way of fitting uses. @type {Record<string, number>} */
const USED = { depth: 1, reflectance: 2, spread: 3 };

/** The gradient of one bin's density: the factors of every ray's pull, and their sum. */
export class Explanation {
  /** @param {{worst: () => void, close: () => void}} o */
  constructor({ worst, close }) {
    this.title = el(
      "p",
      { id: "radiance-bin" },
      "Click a bin, or move to it with the arrows and press Enter.",
    );
    this.facts = facts([
      ["bin-density", "density σ"],
      ["bin-optical", "optical depth σδ"],
      ["bin-opacity", "ends of the light that comes"],
      ["bin-reflectance", "reflectance"],
    ]);
    this.tables = CHANNELS.map(termTable);
    this.sums = facts([
      ["bin-pulls", "sum of pulls, ∂J/∂σ"],
      ["bin-chain", "× ∂σ/∂θ"],
      ["bin-prior", "+ prior"],
      ["bin-sum", "= ∂J/∂θ"],
      ["bin-gradient", "the optimizer has"],
      ["bin-phi", "by the reflectance, ∂J/∂φ"],
    ]);
    this.hint = el("p", { class: "note", id: "bin-hint" });
    this.unused = el("p", { class: "note", id: "bin-unused" });
    this.close = el(
      "button",
      { type: "button", id: "bin-close", title: "Look at no bin (Esc)", onclick: close, hidden: true },
      "Close",
    );
    this.details = el(
      "div",
      { class: "group", hidden: true },
      this.facts.node,
      el(
        "p",
        { class: "note" },
        "Residuals count noises s. Slope = δ × passes × contrast; pull = residual × slope ÷ s. " +
          "A pull below zero asks for more density.",
      ),
      ...this.tables.map((t) => t.table),
      this.unused,
      this.sums.node,
      this.hint,
    );
    this.node = group(
      "Why a bin moves, or does not",
      this.title,
      el(
        "div",
        { class: "row" },
        el(
          "button",
          {
            type: "button",
            id: "bin-worst",
            title: "The bin with the most matter in empty space (W)",
            onclick: worst,
          },
          "Most misplaced bin",
        ),
        this.close,
      ),
      this.details,
    );
  }

  /** How well each channel is measured. @param {Record<string, number>} noise */
  setNoise(noise) {
    for (const { key, title, unit, caption } of this.tables)
      set(caption, `${title}, s = ${noise[key]}${unit && ` ${unit}`}`);
  }

  /** @param {any} bin its terms, or null @param {string} channels */
  take(bin, channels) {
    this.details.hidden = this.close.hidden = !bin;
    if (!bin) {
      set(this.title, "Click a bin, or move to it with the arrows and press Enter.");
      return;
    }
    const rays = bin.terms.length;
    set(
      this.title,
      `Bin ${bin.bin}, ${bin.low.toFixed(1)} to ${bin.high.toFixed(1)} m, on ${rays} training ` +
        `ray${rays === 1 ? "" : "s"}.`,
    );
    this.facts.set({
      "bin-density": `${digits(bin.density)} /m`,
      "bin-optical": digits(bin.optical_depth),
      "bin-opacity": `${digits(100 * bin.opacity)} %`,
      "bin-reflectance": digits(bin.reflectance),
    });
    for (const [i, { key, table, body }] of this.tables.entries()) {
      table.hidden = i >= USED[channels];
      if (!table.hidden)
        fill(
          body,
          bin.terms.map((/** @type {any} */ t) => row(t, t[key])),
        );
    }
    const unused = CHANNELS.slice(USED[channels]).map((c) => c.title.replace(/ \(.*/, "").toLowerCase());
    set(this.unused, unused.length ? `Not measured: ${unused.join(", ")}. It pulls on nothing.` : "");
    this.sums.set({
      "bin-pulls": `${digits(bin.pulls)} m`,
      "bin-chain": `${digits(bin.chain)} /m`,
      "bin-prior": digits(bin.prior),
      "bin-sum": digits(bin.sum),
      "bin-gradient": digits(bin.gradient),
      "bin-phi": digits(bin.by_reflectance),
    });
    set(this.hint, bin.hint ?? "");
  }
}

/** @param {any} terms @param {any} term @returns {string[]} */
const row = (terms, term) => [
  String(terms.ray + 1),
  digits(100 * terms.passes),
  digits(term.residual),
  digits(term.contrast),
  digits(term.slope),
  digits(term.pull),
];

/**
 * Writes only what is another: a table that is drawn anew sixty times a second cannot be read aloud.
 * @param {HTMLTableSectionElement} body
 * @param {string[][]} rows
 */
function fill(body, rows) {
  while (body.rows.length > rows.length) body.deleteRow(-1);
  for (const [i, values] of rows.entries()) {
    const tr = body.rows[i] ?? body.insertRow();
    for (const [k, text] of values.entries()) set(tr.cells[k] ?? tr.insertCell(), text);
  }
}

/** @param {HTMLElement} node @param {string} text */
function set(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** The table of a channel: a row per ray. @param {(typeof CHANNELS)[number]} channel */
function termTable({ key, title, units }) {
  const unit = (/** @type {string} */ u) => (u ? el("span", { class: "unit" }, ` ${u}`) : "");
  const columns = [
    ["ray"],
    ["passes", "%"],
    ["residual", "× s"],
    ["contrast", units[0]],
    ["slope", units[1]],
    ["pull", "m"],
  ];
  const heads = columns.map(([name, u]) =>
    el("th", { scope: "col" }, name, u ? el("br") : "", unit(u ?? "")),
  );
  const caption = el("caption", {}, title);
  const body = el("tbody", { id: `terms-${key.replace("_", "-")}` });
  const table = el("table", { class: "terms" }, caption, el("thead", {}, el("tr", {}, ...heads)), body);
  return { key, title, unit: units[0], caption, table, body };
}
