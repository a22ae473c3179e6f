// @ts-check
import { el } from "../ui/controls.js";
import { byId } from "./status.js";

/** @type {[string, string][]} */
const SHELL_KEYS = [
  ["1 … 5", "the views"],
  ["Back", "the view before"],
  ["L", "copy a link to what is shown"],
  ["P", "save the view as PNG"],
  ["T", "theme: light, dark, as the system"],
  ["?", "this list"],
];
/** Keys that a focused control has a use for itself, by its tag. @type {Record<string, string[]>} */
const OWN_KEYS = {
  BUTTON: ["Enter", " "],
  INPUT: ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown", " "],
};
/** @type {Record<string, string>} */
const TOOLS = { l: "share", p: "picture", t: "theme", "?": "help" };

/** @param {[string, string][]} keys of the view */
export function showKeys(keys) {
  const rows = [...keys, ...SHELL_KEYS].flatMap(([key, what]) => [
    el("dt", {}, el("kbd", {}, key)),
    el("dd", {}, what),
  ]);
  byId("keys-list").replaceChildren(...rows);
  /** @type {HTMLDialogElement} */ (byId("keys")).showModal();
}

/**
 * Keys of the page go to the shell, the others to the view that is shown.
 * @param {import("./shell.js").Shell} shell
 */
export function handleKeys(shell) {
  document.addEventListener("keydown", (event) => {
    if (document.querySelector("dialog[open]") || event.ctrlKey || event.metaKey || event.altKey) return;
    const on = /** @type {HTMLElement} */ (event.target);
    if (on.matches("select, textarea, input:not([type=checkbox]):not([type=range])")) return;
    if (OWN_KEYS[on.tagName]?.includes(event.key)) return;
    const tool = TOOLS[event.key];
    const view = shell.views[Number(event.key) - 1];
    if (tool) byId(tool).click();
    else if (view) shell.choose(view);
    else if (!shell.shown?.key(event)) return;
    event.preventDefault();
  });
}
