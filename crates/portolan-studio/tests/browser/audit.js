// What a person would complain about: text that is hard to read, controls that the keyboard does not reach. The file is one
// expression: an object of functions.
({
  /** Texts with less contrast than WCAG 2.1 asks for (1.4.3, AA): 4.5, or 3 where the text is large. */
  contrast() {
    // What fades from one colour to another is judged where it rests.
    for (const animation of document.getAnimations()) if (Number.isFinite(animation.effect?.getComputedTiming().endTime)) animation.finish();
    const canvas = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
    /** Any CSS colour as [r, g, b, alpha], each from 0 to 1. */
    const parsed = new Map();
    const color = (css) => {
      if (!parsed.has(css)) {
        canvas.clearRect(0, 0, 1, 1);
        canvas.fillStyle = css;
        canvas.fillRect(0, 0, 1, 1);
        parsed.set(css, [...canvas.getImageData(0, 0, 1, 1).data].map((v) => v / 255));
      }
      return parsed.get(css);
    };
    const over = (top, bottom, alpha) => [0, 1, 2].map((k) => alpha * top[k] + (1 - alpha) * bottom[k]);
    const luminance = (c) => {
      const [r, g, b] = c.map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
      return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    /** What is behind an element, and how much of it shows through: backgrounds from the page down. */
    const behind = (element) => {
      const chain = [];
      for (let e = element; e; e = e.parentElement) chain.unshift(e);
      const dark = getComputedStyle(document.documentElement).colorScheme === "dark";
      let ground = dark ? [0.07, 0.07, 0.07] : [1, 1, 1];
      let opacity = 1;
      for (const e of chain) {
        const style = getComputedStyle(e);
        opacity *= Number(style.opacity);
        const top = color(style.backgroundColor);
        ground = over(top, ground, top[3] * opacity);
      }
      return { ground, opacity };
    };
    const bad = [];
    const judge = (element, text) => {
      const style = getComputedStyle(element);
      const { ground, opacity } = behind(element);
      const ink = color(style.color);
      const [a, b] = [luminance(over(ink, ground, ink[3] * opacity)), luminance(ground)];
      const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
      const size = parseFloat(style.fontSize);
      const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
      if (contrast < (large ? 3 : 4.5) - 0.005) {
        bad.push(`${contrast.toFixed(2)}: "${text.trim().slice(0, 50)}" in ${element.tagName.toLowerCase()}#${element.closest("[id]")?.id}`);
      }
    };
    const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    for (let node = walk.nextNode(); node; node = walk.nextNode()) {
      const element = node.parentElement;
      if (!node.textContent.trim() || !element.checkVisibility({ visibilityProperty: true })) continue;
      // Controls that cannot be used need none; the words of a list are those of its box.
      if (element.closest(":disabled, option, noscript, script, style")) continue;
      judge(element, node.textContent);
    }
    for (const select of document.querySelectorAll("select:enabled")) {
      if (select.checkVisibility()) judge(select, select.selectedOptions[0]?.textContent ?? "");
    }
    return bad;
  },

  /** What the keyboard must reach: a number for each, kept as `data-stop`. Tabs that are not open are reached by arrows. */
  stops() {
    const all = [...document.querySelectorAll("button, select, input, textarea, a[href], summary, canvas[tabindex]")];
    for (const e of all) delete e.dataset.stop;
    const reached = all.filter((e) => e.checkVisibility({ visibilityProperty: true }) && !e.disabled && !e.matches("[role=tab][aria-selected=false], dialog *"));
    reached.forEach((e, i) => (e.dataset.stop = String(i)));
    return reached.map((e) => `${e.tagName.toLowerCase()}#${e.id}`);
  },

  /** Those that can still be used: a view that plays takes some away, and gives others. */
  usable() {
    return [...document.querySelectorAll("[data-stop]")].filter((e) => e.checkVisibility({ visibilityProperty: true }) && !e.disabled).map((e) => Number(e.dataset.stop));
  },

  /** Which of them has the focus now, and whether one sees it. */
  focused() {
    const e = document.activeElement;
    if (!e || e === document.body) return null;
    const { outlineStyle, outlineWidth } = getComputedStyle(e);
    return { stop: e.dataset.stop === undefined ? null : Number(e.dataset.stop), seen: outlineStyle !== "none" && parseFloat(outlineWidth) > 0 };
  },

  /** Controls and canvases without a name for who does not see them. */
  nameless() {
    const named = (e) =>
      e.ariaLabel || e.title || e.getAttribute("aria-labelledby") || (e.labels && e.labels.length > 0) || (e.matches("button, a, summary") && e.textContent.trim());
    return [...document.querySelectorAll("button, select, input, textarea, canvas[tabindex]")].filter((e) => !named(e)).map((e) => e.outerHTML.slice(0, 120));
  },

  /** Canvases whose pixels are not the screen's. */
  blurred() {
    const bad = [];
    for (const c of document.querySelectorAll("#stage canvas")) {
      if (!c.checkVisibility() || c.clientWidth === 0) continue;
      const want = [c.clientWidth, c.clientHeight].map((v) => Math.round(v * devicePixelRatio));
      // uPlot rounds up where the platform rounds down.
      if (Math.abs(c.width - want[0]) > 1 || Math.abs(c.height - want[1]) > 1) {
        bad.push(`${c.id || c.parentElement?.className}: ${c.width}x${c.height}, not ${want.join("x")}`);
      }
    }
    return bad;
  },

  /** Numbers that stick out of their panel, or have no room in their place. */
  clipped() {
    const bad = [];
    for (const node of document.querySelectorAll(".panel output, .panel dt, .panel h2, .facts dd")) {
      if (!node.checkVisibility() || !node.textContent.trim()) continue;
      const [inner, outer] = [node, node.closest(".panel, .side")].map((e) => e.getBoundingClientRect());
      if (inner.right > outer.right + 0.5 || inner.left < outer.left - 0.5 || node.scrollWidth > node.clientWidth + 1) bad.push(`#${node.id || node.closest("[id]")?.id}: ${node.textContent}`);
    }
    return bad;
  },

  /** Whether something is wider than the page. */
  overflow() {
    const { scrollWidth, clientWidth } = document.documentElement;
    return scrollWidth > clientWidth ? scrollWidth - clientWidth : 0;
  },
})
