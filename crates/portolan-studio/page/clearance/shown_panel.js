// @ts-check
import { choice, el, legend, toggle } from "../ui/controls.js";

/**
 * @typedef {import("./map.js").Which} Which
 * @typedef {"pessimistic" | "optimistic"} Unknown
 */

/** Metres between rings. */
const SPACINGS = ["0.05", "0.1", "0.25", "0.5", "1"];

/**
 * What is shown, and what unknown space is to mean.
 * @param {{visible: Record<string, boolean>, field: (which: Which) => void, unknown: () => void, spacing: ()
 *   => void, toggled: () => void}} o
 */
export function shownPanel(o) {
  const field = pair(
    "field",
    "Field",
    [
      ["euclidean", "Euclidean"],
      ["truncated", "Truncated"],
    ],
    "euclidean",
    (v) => o.field(/** @type {Which} */ (v)),
  );
  const unknown = pair(
    "unknown",
    "Unknown space",
    [
      ["pessimistic", "obstacle"],
      ["optimistic", "no obstacle"],
    ],
    "pessimistic",
    o.unknown,
  );
  const spacing = choice({
    id: "ring-spacing",
    label: "Rings every",
    value: "0.25",
    options: SPACINGS.map((v) => [v, `${v} m`]),
    onchange: o.spacing,
  });
  const toggles = Object.fromEntries(
    Object.entries({ rings: "Level rings", arrows: "Gradients", contour: "Contour", truth: "Truth" }).map(
      ([what, label]) => [
        what,
        toggle({
          id: `clearance-${what}`,
          label,
          value: o.visible[what],
          onchange: (v) => ((o.visible[what] = v), what === "rings" && v && o.spacing(), o.toggled()),
        }),
      ],
    ),
  );
  const rings = el("p", { class: "note", id: "ring-note" });
  const ramp = el("i", { class: "ramp", "aria-hidden": "true" });
  ramp.style.background = "linear-gradient(90deg, var(--negative), var(--paper), var(--positive))";
  const reach = el("span", { id: "ramp-reach" });
  const strip = el(
    "div",
    { class: "strip" },
    el(
      "ul",
      { class: "legend", "aria-label": "Legend" },
      el("li", {}, ramp, reach),
      ...legend([
        { color: "contour", text: "contour" },
        { color: "accent", text: "nothing is nearer" },
        { color: "good", text: "certified" },
        { color: "bad", text: "violated", dashed: true },
        { color: "warn", text: "not certifiable", dashed: true },
      ]).children,
      el("li", {}, el("i", { class: "hatch", "aria-hidden": "true" }), "unknown"),
    ),
  );
  const node = el(
    "div",
    { class: "group" },
    field.node,
    unknown.node,
    spacing.node,
    rings,
    el("div", { class: "toggles" }, ...Object.values(toggles).map((t) => t.node)),
  );

  return {
    node,
    strip,
    get field() {
      return /** @type {Which} */ (field.value);
    },
    get unknown() {
      return /** @type {Unknown} */ (unknown.value);
    },
    get spacing() {
      return Number(spacing.value);
    },
    toggleField: () => field.next(),
    toggleUnknown: () => unknown.next(),
    /** @param {string} what */
    toggle(what) {
      document.getElementById(`clearance-${what}`)?.click();
    },
    /** @param {any} body @param {number} length at the ends of the ramp */
    tellMap(body, length) {
      reach.textContent = `−${length.toFixed(2)} to ${length.toFixed(2)} m`;
      toggles.truth.node.hidden = body.truth === null;
    },
    /** @param {any} body of the rings @param {number} truncation */
    tellRings(body, truncation) {
      const first = Number(spacing.value);
      const wider =
        body.spacing > first ? `Drawn every ${body.spacing} m: closer they would be too many. ` : "";
      const none =
        body.largest < body.spacing
          ? `No ring: the field ends ${truncation} m from the surface. `
          : field.value === "truncated"
            ? `The rings end where the field does, ${truncation} m from the surface. `
            : "";
      rings.textContent = wider + none;
      rings.hidden = rings.textContent === "";
    },
    /** @returns {Record<string, string>} */
    state: () => ({
      field: field.value,
      unknown: unknown.value,
      rings: o.visible.rings ? spacing.value : "none",
      ...(o.visible.arrows ? {} : { arrows: "none" }),
      ...(o.visible.contour ? {} : { contour: "none" }),
      ...(o.visible.truth ? { truth: "shown" } : {}),
    }),
    /** @param {URLSearchParams} state */
    restore(state) {
      field.value = state.get("field") ?? field.value;
      unknown.value = state.get("unknown") ?? unknown.value;
      const every = state.get("rings");
      if (every && SPACINGS.includes(every)) spacing.value = every;
      for (const what of ["rings", "arrows", "contour"])
        if (state.get(what) === "none") toggles[what].value = o.visible[what] = false;
      if (state.get("truth") === "shown") toggles.truth.value = o.visible.truth = true;
    },
  };
}

/**
 * Two buttons of which one is pressed.
 * @param {string} id
 * @param {string} label
 * @param {[string, string][]} options
 * @param {string} value
 * @param {(v: string) => void} onchange
 */
function pair(id, label, options, value, onchange) {
  const buttons = options.map(([v, text]) =>
    el(
      "button",
      {
        type: "button",
        id: `${id}-${v}`,
        "aria-pressed": String(v === value),
        onclick: () => choose(v, true),
      },
      text,
    ),
  );
  const choose = (/** @type {string} */ v, /** @type {boolean} */ tell) => {
    if (v === value || !options.some(([o]) => o === v)) return;
    value = v;
    for (const [i, b] of buttons.entries()) b.setAttribute("aria-pressed", String(options[i][0] === v));
    if (tell) onchange(v);
  };
  const name = el("span", { id: `${id}-label` }, label);
  return {
    node: el(
      "div",
      { class: "row" },
      name,
      el("div", { class: "pair", role: "group", "aria-labelledby": `${id}-label` }, ...buttons),
    ),
    get value() {
      return value;
    },
    set value(v) {
      choose(v, false);
    },
    next: () => choose(options[(options.findIndex(([o]) => o === value) + 1) % options.length][0], true),
  };
}
