// @ts-check
import { save } from "../ui/files.js";
import { Meter } from "../ui/meter.js";
import { applyTheme, nextTheme } from "../ui/theme.js";
import { handleKeys, showKeys } from "./keys.js";
import { byId, fail, say } from "./status.js";

/**
 * @typedef {import("../views/view.js").View} View
 * @typedef {import("../views/view.js").Shown} Shown
 * @typedef {{section: HTMLElement, shown: Shown, theme?: string}} Mounted `theme`: the one that it was drawn
 *   in
 */

/** What is around the views: tabs, tools, address, keys. */
export class Shell {
  /** @param {import("../engine/engine.js").Engine} engine @param {View[]} views in the order of their tabs */
  constructor(engine, views) {
    this.views = views;
    /** @type {Map<string, Mounted>} */
    this.mounted = new Map();
    /** @type {View | undefined} */
    this.current = undefined;
    let pending = 0;
    /** @type {import("../views/view.js").App} */
    this.app = {
      engine,
      meter: new Meter(byId("meter")),
      say,
      fail,
      changed: () => {
        clearTimeout(pending);
        pending = window.setTimeout(() => this.#writeAddress(), 150);
      },
    };
    this.#makeTabs();
    this.#listenToTools();
    handleKeys(this);
    window.addEventListener("hashchange", () => this.followAddress());
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
      tab.onclick = () => this.open(view);
      tabs.append(tab);
    }
    tabs.onkeydown = (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step || !this.current) return;
      event.preventDefault();
      event.stopPropagation();
      const { views } = this;
      const next = views[(views.indexOf(this.current) + step + views.length) % views.length];
      this.open(next);
      byId(`tab-${next.id}`).focus();
    };
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
      const section = this.mounted.get(v.id)?.section;
      if (section) section.hidden = !selected;
    }
    try {
      await entry.shown.show(link);
      const { theme } = document.documentElement.dataset;
      if (entry.theme && entry.theme !== theme) entry.shown.redraw();
      entry.theme = theme;
      this.app.changed();
    } catch (error) {
      fail(error);
    }
  }

  /** @param {View} view @returns {Mounted} */
  #mount(view) {
    const section = document.createElement("section");
    section.id = `view-${view.id}`;
    section.className = "view";
    section.setAttribute("role", "tabpanel");
    section.setAttribute("aria-labelledby", `tab-${view.id}`);
    const entry = { section, shown: view.mount(section, this.app) };
    this.mounted.set(view.id, entry);
    byId("stage").append(section);
    return entry;
  }

  /** Shows what the address says. */
  followAddress() {
    const link = new URLSearchParams(location.hash.slice(1));
    const name = link.get("view");
    const view = this.views.find((v) => v.id === name || (name && v.formerly === name)) ?? this.views[0];
    link.delete("view");
    return this.open(view, link);
  }

  #writeAddress() {
    if (!this.current) return;
    const link = new URLSearchParams({ view: this.current.id, ...this.shown?.state() });
    history.replaceState(null, "", `#${link}`);
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
    byId("help").onclick = () => showKeys(this.shown?.keys ?? []);
  }
}
