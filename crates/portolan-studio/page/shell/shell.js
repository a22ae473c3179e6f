// @ts-check
import { save } from "../ui/files.js";
import { Meter } from "../ui/meter.js";
import { lead } from "../ui/terms.js";
import { applyTheme, nextTheme } from "../ui/theme.js";
import { handleKeys, showKeys } from "./keys.js";
import { byId, fail, say } from "./status.js";

/**
 * @typedef {import("../views/view.js").View} View
 * @typedef {import("../views/view.js").Shown} Shown
 * @typedef {{section: HTMLElement, shown: Shown, theme?: string}} Mounted `theme`: the one that it was drawn
 *   in
 * @typedef {import("./start.js").About} About
 */

/** What is around the views: tabs, tools, address, keys. */
export class Shell {
  /**
   * @param {import("../engine/engine.js").Engine} engine
   * @param {View[]} views in the order of their tabs
   * @param {About} about what the studio was given
   */
  constructor(engine, views, about) {
    this.views = views;
    this.about = about;
    /** @type {Map<string, Mounted>} */
    this.mounted = new Map();
    /** @type {View | undefined} */
    this.current = undefined;
    /** What a link asks for and nobody can show, in words. @type {string[]} */
    this.strange = [];
    let pending = 0;
    /** @type {import("../views/view.js").App} */
    this.app = {
      engine,
      meter: new Meter(byId("meter")),
      say,
      fail,
      about,
      strange: (what) => void this.strange.push(what),
      changed: () => {
        clearTimeout(pending);
        pending = window.setTimeout(() => this.#writeAddress(), 150);
      },
    };
    this.#makeTabs();
    this.#listenToTools();
    handleKeys(this);
    // Back and forward show a view as it was left; an address that was typed is followed.
    window.addEventListener("popstate", ({ state }) => {
      const view = this.views.find((v) => v.id === state?.view);
      if (view && this.mounted.has(view.id)) this.open(view);
      else this.followAddress();
    });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      applyTheme();
      this.#redraw();
    });
  }

  /** The view that is on the page. @returns {Shown | undefined} */
  get shown() {
    return this.current && this.mounted.get(this.current.id)?.shown;
  }

  #makeTabs() {
    const tabs = byId("tabs");
    for (const [i, view] of this.views.entries()) {
      const tab = document.createElement("button");
      tab.type = "button";
      tab.id = `tab-${view.id}`;
      tab.role = "tab";
      tab.textContent = view.title;
      tab.title = `Key ${i + 1}`;
      tab.setAttribute("aria-controls", `view-${view.id}`);
      tab.onclick = () => this.choose(view);
      tabs.append(tab);
    }
    tabs.onkeydown = (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step || !this.current) return;
      event.preventDefault();
      event.stopPropagation();
      const { views } = this;
      const next = views[(views.indexOf(this.current) + step + views.length) % views.length];
      this.choose(next);
      byId(`tab-${next.id}`).focus();
    };
  }

  /** Shows another view; Back leads to the one before. @param {View} view */
  choose(view) {
    if (view !== this.current) {
      this.#writeAddress();
      history.pushState({ view: view.id }, "", `#view=${view.id}`);
    }
    return this.open(view);
  }

  /** Shows a view, as a link says. @param {View} view */
  async open(view, link = new URLSearchParams()) {
    const entry = this.mounted.get(view.id) ?? this.#mount(view);
    if (this.current !== view) this.shown?.hide();
    this.current = view;
    for (const v of this.views) {
      const selected = v === view;
      byId(`tab-${v.id}`).setAttribute("aria-selected", String(selected));
      byId(`tab-${v.id}`).tabIndex = selected ? 0 : -1;
      if (selected) byId(`tab-${v.id}`).scrollIntoView({ block: "nearest", inline: "nearest" });
      const section = this.mounted.get(v.id)?.section;
      if (section) section.hidden = !selected;
    }
    try {
      await entry.shown.show(link);
      const { theme } = document.documentElement.dataset;
      if (entry.theme && entry.theme !== theme) entry.shown.redraw();
      entry.theme = theme;
      this.app.changed();
      this.#tellStrange();
    } catch (error) {
      fail(error);
    }
  }

  #tellStrange() {
    const strange = this.strange.splice(0);
    if (strange.length) say(`The link asks for what is not here: ${strange.join("; ")}.`);
  }

  /** @param {View} view @returns {Mounted} */
  #mount(view) {
    const section = document.createElement("section");
    section.id = `view-${view.id}`;
    section.className = "view";
    section.setAttribute("role", "tabpanel");
    section.setAttribute("aria-labelledby", `tab-${view.id}`);
    const entry = { section, shown: view.mount(section, this.app) };
    section.querySelector(".field")?.prepend(this.#lead(view));
    this.mounted.set(view.id, entry);
    byId("stage").append(section);
    return entry;
  }

  /** The sentence above the picture, and whose scans it shows where these are not those that were given. @param {View} view */
  #lead({ lead: text, in_3d }) {
    const { given } = this.about;
    const other = given && in_3d !== undefined && in_3d !== given.in_3d;
    const shown = in_3d ? "the simulated building" : "the simulated flat";
    return lead(
      other ? `${text} (${given.name} is ${given.in_3d ? "3-D" : "2-D"}: here is ${shown}.)` : text,
    );
  }

  /** Shows what the address says. */
  followAddress() {
    const link = new URLSearchParams(location.hash.slice(1));
    const name = link.get("view");
    const { opens } = this.about;
    const find = (/** @type {string | null} */ id) =>
      this.views.find((v) => v.id === id || (id && v.formerly === id));
    const view = find(name) ?? find(opens) ?? this.views[0];
    if (name && !find(name)) this.app.strange(`a view “${name}”`);
    // Whoever arrives without a link sees something move.
    if (link.size === 0) link.set("play", "1");
    link.delete("view");
    return this.open(view, link);
  }

  #writeAddress() {
    if (!this.current) return;
    const { id } = this.current;
    history.replaceState({ view: id }, "", `#${new URLSearchParams({ view: id, ...this.shown?.state() })}`);
  }

  #redraw() {
    const entry = this.current && this.mounted.get(this.current.id);
    if (!entry) return;
    entry.shown.redraw();
    entry.theme = document.documentElement.dataset.theme;
  }

  #listenToTools() {
    byId("theme").onclick = () => {
      say(`Theme: ${nextTheme()}`);
      this.#redraw();
    };
    byId("share").onclick = async () => {
      this.#writeAddress();
      try {
        await navigator.clipboard.writeText(location.href);
        say("The link is in the clipboard.");
      } catch {
        say(`The link is in the address line: ${location.href}`);
      }
    };
    byId("picture").onclick = async () => {
      const { current } = this;
      const canvas = await this.shown?.picture();
      canvas?.toBlob((blob) => blob && save(`portolan-${current?.id}.png`, blob), "image/png");
    };
    const menu = byId("menu");
    const open = (/** @type {boolean} */ on) => menu.setAttribute("aria-expanded", String(on));
    menu.onclick = () => open(menu.getAttribute("aria-expanded") !== "true");
    byId("tools").addEventListener("click", () => open(false));
    byId("help").onclick = () => showKeys(this.shown?.keys ?? []);
  }
}
