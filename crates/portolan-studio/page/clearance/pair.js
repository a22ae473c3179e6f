// @ts-check
import { el } from "../ui/controls.js";

/**
 * Two buttons of which one is pressed.
 * @param {{id: string, label: string, options: [string, string][], value: string, onchange: (v: string) =>
 *   void}} o
 */
export function pair({ id, label, options, value, onchange }) {
  const buttons = options.map(([v, text]) =>
    el("button", { type: "button", id: `${id}-${v}`, onclick: () => choose(v) && onchange(v) }, text),
  );
  const press = () =>
    buttons.forEach((b, i) => b.setAttribute("aria-pressed", String(options[i][0] === value)));
  /** @param {string} v @returns {boolean} whether it is another than before */
  const choose = (v) => {
    if (v === value || !options.some(([o]) => o === v)) return false;
    value = v;
    press();
    return true;
  };
  press();
  const name = el("span", { id: `${id}-label` }, label);
  const group = el("div", { class: "pair", role: "group", "aria-labelledby": `${id}-label` }, ...buttons);
  return {
    node: el("div", { class: "row" }, name, group),
    get value() {
      return value;
    },
    set value(v) {
      choose(v);
    },
    next() {
      const at = options.findIndex(([o]) => o === value);
      buttons[(at + 1) % options.length].click();
    },
  };
}
