// @ts-check
import { connect } from "./engine/socket.js";
import { Meter } from "./ui/meter.js";
import { applyTheme, nextTheme } from "./ui/theme.js";
import { save } from "./ui/files.js";
import clearance from "./views/clearance.js";
import fusion from "./views/fusion.js";
import gallery from "./views/gallery.js";
import radiance from "./views/radiance.js";
import space from "./views/space.js";

/**
 * A view: made when it is first shown, then shown and hidden.
 *
 * @typedef {object} View
 * @property {string} id also in the address
 * @property {string} title on its tab
 * @property {(root: HTMLElement, app: App) => Shown} mount fills `root`, a section that is not on the page
 *   yet
 *
 * @typedef {object} Shown
 * @property {(state: URLSearchParams) => Promise<void> | void} show the view is on the page now; `state` is
 *   what the
 *   address says, and empty where it says nothing
 * @property {() => void} hide
 * @property {() => Record<string, string>} state what the address must say so that another page shows the
 *   same
 * @property {() => Promise<HTMLCanvasElement> | HTMLCanvasElement} picture of what is shown
 * @property {(event: KeyboardEvent) => boolean} key whether the key meant something; never called while a
 *   text is typed
 * @property {[string, string][]} keys which key does what
 * @property {() => void} redraw after the theme has changed
 *
 * What views share.
 * @typedef {object} App
 * @property {import("./engine/engine.js").Engine} engine
 * @property {Meter} meter measures the work per picture
 * @property {(text: string) => void} say in the status line
 * @property {(error: unknown) => void} fail in the status line, in red
 * @property {() => void} changed the state of the view is another: the address follows
 */

/** @type {View[]} */
const VIEWS = [fusion, gallery, clearance, radiance, space];

const $ = (/** @type {string} */ id) => /** @type {HTMLElement} */ (document.getElementById(id));
const status = $("status");

/** @param {string} text */
function say(text) {
  status.classList.remove("error");
  status.textContent = text;
}

/** @param {unknown} error */
function fail(error) {
  status.classList.add("error");
  status.textContent = error instanceof Error ? error.message : String(error);
}

/**
 * What is mounted, and the theme that it was drawn in.
 * @type {Map<string, {section: HTMLElement, shown: Shown, theme?: string}>}
 */
const mounted = new Map();
/** @type {View | undefined} */
let current;

async function main() {
  applyTheme();
  const engine = await connect();
  engine.onClosed(fail);
  let pending = 0;
  /** @type {App} */
  const app = {
    engine,
    meter: new Meter($("meter")),
    say,
    fail,
    changed() {
      clearTimeout(pending);
      pending = window.setTimeout(writeAddress, 150);
    },
  };

  const tabs = $("tabs");
  for (const [i, view] of VIEWS.entries()) {
    const tab = document.createElement("button");
    tab.type = "button";
    tab.id = `tab-${view.id}`;
    tab.role = "tab";
    tab.textContent = view.title;
    tab.title = `Key ${i + 1}`;
    tab.setAttribute("aria-controls", `view-${view.id}`);
    tab.onclick = () => open(view, new URLSearchParams());
    tabs.append(tab);
  }
  tabs.onkeydown = (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step || !current) return;
    event.preventDefault();
    event.stopPropagation();
    const next = VIEWS[(VIEWS.indexOf(current) + step + VIEWS.length) % VIEWS.length];
    open(next, new URLSearchParams());
    $(`tab-${next.id}`).focus();
  };

  /** @param {View} view @param {URLSearchParams} state */
  async function open(view, state) {
    let entry = mounted.get(view.id);
    if (!entry) {
      const section = document.createElement("section");
      section.id = `view-${view.id}`;
      section.className = "view";
      section.setAttribute("role", "tabpanel");
      section.setAttribute("aria-labelledby", `tab-${view.id}`);
      entry = { section, shown: view.mount(section, app) };
      mounted.set(view.id, entry);
      $("stage").append(section);
    }
    if (current && current !== view) mounted.get(current.id)?.shown.hide();
    current = view;
    for (const v of VIEWS) {
      const here = v === view;
      $(`tab-${v.id}`).setAttribute("aria-selected", String(here));
      $(`tab-${v.id}`).tabIndex = here ? 0 : -1;
      const section = mounted.get(v.id)?.section;
      if (section) section.hidden = !here;
    }
    try {
      await entry.shown.show(state);
      const { theme } = document.documentElement.dataset;
      if (entry.theme && entry.theme !== theme) entry.shown.redraw();
      entry.theme = theme;
      app.changed();
    } catch (error) {
      fail(error);
    }
  }

  function writeAddress() {
    if (!current) return;
    const state = new URLSearchParams({ view: current.id, ...mounted.get(current.id)?.shown.state() });
    history.replaceState(null, "", `#${state}`);
  }

  const readAddress = () => {
    const state = new URLSearchParams(location.hash.slice(1));
    const view = VIEWS.find((v) => v.id === state.get("view")) ?? VIEWS[0];
    state.delete("view");
    return open(view, state);
  };
  window.addEventListener("hashchange", readAddress);

  const redraw = () => {
    const entry = current && mounted.get(current.id);
    entry?.shown.redraw();
    if (entry) entry.theme = document.documentElement.dataset.theme;
  };
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => (applyTheme(), redraw()));
  $("theme").onclick = () => (say(`Theme: ${nextTheme()}`), redraw());
  $("share").onclick = async () => {
    writeAddress();
    try {
      await navigator.clipboard.writeText(location.href);
      say("The link is in the clipboard.");
    } catch {
      say(`The link is in the address line: ${location.href}`);
    }
  };
  $("picture").onclick = async () => {
    if (!current) return;
    const canvas = await mounted.get(current.id)?.shown.picture();
    canvas?.toBlob((blob) => blob && save(`portolan-${current?.id}.png`, blob), "image/png");
  };
  const keys = /** @type {HTMLDialogElement} */ ($("keys"));
  $("help").onclick = () => {
    const all = [...(current ? (mounted.get(current.id)?.shown.keys ?? []) : []), ...SHELL_KEYS];
    $("keys-list").replaceChildren(
      ...all.flatMap(([key, what]) => {
        const [dt, dd, kbd] = [
          document.createElement("dt"),
          document.createElement("dd"),
          document.createElement("kbd"),
        ];
        kbd.textContent = key;
        dt.append(kbd);
        dd.textContent = what;
        return [dt, dd];
      }),
    );
    keys.showModal();
  };

  document.addEventListener("keydown", (event) => {
    if (keys.open || event.ctrlKey || event.metaKey || event.altKey) return;
    const on = /** @type {HTMLElement} */ (event.target);
    const typing = on.matches("select, textarea, input:not([type=checkbox]):not([type=range])");
    if (typing) return;
    // A focused button or slider keeps the keys that it has a use for.
    const own = {
      BUTTON: ["Enter", " "],
      INPUT: ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown", " "],
    }[on.tagName];
    if (own?.includes(event.key)) return;
    const shell = { l: "share", p: "picture", t: "theme", "?": "help" }[event.key];
    const number = Number(event.key);
    if (shell) $(shell).click();
    else if (number >= 1 && number <= VIEWS.length) open(VIEWS[number - 1], new URLSearchParams());
    else if (!(current && mounted.get(current.id)?.shown.key(event))) return;
    event.preventDefault();
  });

  await readAddress();
}

/** @type {[string, string][]} */
const SHELL_KEYS = [
  ["1 … 5", "the views"],
  ["L", "copy a link to what is shown"],
  ["P", "save the view as PNG"],
  ["T", "light, dark, as the system has it"],
  ["?", "this list"],
];

main().catch(fail);
