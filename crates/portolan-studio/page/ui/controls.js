// @ts-check

/**
 * An element with attributes and children.
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag
 * @param {Record<string, any>} [attributes] `class`, `id`, `aria-…`, `data-…`, or properties such as
 *   `onclick`
 * @param {...(Node | string)} children
 * @returns {HTMLElementTagNameMap[K]}
 */
export function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined) continue;
    if (name.startsWith("on")) /** @type {any} */ (node)[name] = value;
    else if (value === true) node.setAttribute(name, "");
    else if (value !== false) node.setAttribute(name, String(value));
  }
  node.append(...children);
  return node;
}

/**
 * A slider with its name and value. `values`: the choices, for steps that are not equal.
 * @param {{id: string, label: string, values?: number[], min?: number, max?: number, step?: number, value:
 *   number, format?: (v: number) => string, oninput: (v: number) => void}} o
 */
export function slider(o) {
  const { values } = o;
  const range = values
    ? { min: 0, max: values.length - 1, step: 1 }
    : { min: o.min, max: o.max, step: o.step };
  const format = o.format ?? String;
  const output = el("output", { for: o.id }, format(o.value));
  const input = el("input", { type: "range", id: o.id, ...range });
  const nearest = (/** @type {number} */ v) =>
    values ? values.reduce((best, x, i) => (Math.abs(x - v) < Math.abs(values[best] - v) ? i : best), 0) : v;
  const read = () => (values ? values[Number(input.value)] : Number(input.value));
  const show = () => {
    output.textContent = format(read());
    input.setAttribute("aria-valuetext", format(read()));
  };
  input.value = String(nearest(o.value));
  show();
  input.oninput = () => (show(), o.oninput(read()));
  const node = el("div", { class: "control" }, el("label", { for: o.id }, o.label, output), input);
  return {
    node,
    get value() {
      return read();
    },
    set value(v) {
      input.value = String(values && v === Infinity ? values.length - 1 : nearest(v));
      show();
    },
  };
}

/**
 * A choice among words.
 * @param {{id: string, label: string, options: [string, string][], value: string, onchange: (v: string) =>
 *   void}} o
 */
export function choice(o) {
  const select = el(
    "select",
    { id: o.id },
    ...o.options.map(([value, text]) => el("option", { value }, text)),
  );
  select.value = o.value;
  select.onchange = () => o.onchange(select.value);
  const node = el("div", { class: "row control" }, el("label", { for: o.id }, o.label), select);
  return {
    node,
    get value() {
      return select.value;
    },
    set value(v) {
      select.value = v;
    },
  };
}

/**
 * Something that is on or off.
 * @param {{id: string, label: string, value: boolean, onchange: (v: boolean) => void}} o
 */
export function toggle(o) {
  const input = el("input", { type: "checkbox", id: o.id });
  input.checked = o.value;
  input.onchange = () => o.onchange(input.checked);
  const node = el("div", { class: "row control" }, el("label", { for: o.id }, o.label), input);
  return {
    node,
    get value() {
      return input.checked;
    },
    set value(v) {
      input.checked = v;
    },
  };
}

/**
 * Names and values, kept up to date by name.
 * @param {[string, string][]} rows id and label of each value
 */
export function facts(rows) {
  const outs = new Map(rows.map(([id]) => [id, el("dd", { id })]));
  const node = el(
    "dl",
    { class: "facts" },
    ...rows.flatMap(([id, label]) => [el("dt", {}, label), /** @type {HTMLElement} */ (outs.get(id))]),
  );
  return {
    node,
    /** @param {Record<string, string>} values */
    set(values) {
      for (const [id, text] of Object.entries(values)) {
        const out = outs.get(id);
        if (out && out.textContent !== text) out.textContent = text;
      }
    },
  };
}

/** A heading and what belongs to it. @param {string} title @param {...(Node | string)} children */
export function group(title, ...children) {
  return el("div", { class: "group" }, el("h2", {}, title), ...children);
}

/**
 * A legend: a color (or `ramp`), and what it means.
 * @param {{color: string, text: string, dashed?: boolean, ramp?: string}[]} items colors by the names of
 *   style.css
 */
export function legend(items) {
  return el(
    "ul",
    { class: "legend", "aria-label": "Legend" },
    ...items.map(({ color, text, dashed, ramp }) => {
      // What covers an area has a box; a line of its color would not be seen on the panel.
      const box = color === "unknown" ? `var(--${color})` : undefined;
      const shape = ramp ? "ramp" : box ? "box" : dashed ? "dashed" : "";
      const sign = el("i", { class: shape, "aria-hidden": "true" });
      if (ramp || box) sign.style.background = ramp ?? box ?? "";
      else sign.style.borderTopColor = `var(--${color})`;
      return el("li", {}, sign, text);
    }),
  );
}

/**
 * Calls at most every `ms` milliseconds, with the latest argument.
 * @template T
 * @param {(v: T) => void} f
 * @param {number} ms
 */
export function calmly(f, ms) {
  let timer = 0;
  /** @type {T} */
  let latest;
  return (/** @type {T} */ v) => {
    latest = v;
    if (!timer) timer = window.setTimeout(() => ((timer = 0), f(latest)), ms);
  };
}
