// @ts-check

/**
 * Pointers and wheel on the canvas: pan, zoom, clicks, drags.
 * @param {import("./canvas2d.js").Canvas2d} view
 */
export function listen(view) {
  const { canvas, pointers } = view;
  /** @type {[number, number] | undefined} where the first pointer went down */
  let down;
  /** @type {((p: [number, number], last: boolean) => void) | undefined} */
  let taken;
  let moved = false;
  const at = (/** @type {PointerEvent | WheelEvent} */ e) =>
    /** @type {[number, number]} */ ([e.offsetX, e.offsetY]);
  canvas.onpointerdown = (e) => {
    canvas.setPointerCapture(e.pointerId);
    pointers.set(e.pointerId, at(e));
    if (pointers.size > 1) return;
    down = at(e);
    moved = false;
    taken = view.ondrag?.(view.camera().toWorld(...down));
  };
  canvas.onpointermove = (e) => {
    const before = pointers.get(e.pointerId);
    const now = at(e);
    if (!before) return view.onhover?.(view.camera().toWorld(...now));
    pointers.set(e.pointerId, now);
    if (down && Math.hypot(now[0] - down[0], now[1] - down[1]) > 4) moved = true;
    if (pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== e.pointerId)?.[1] ?? now;
      const ratio =
        Math.hypot(now[0] - other[0], now[1] - other[1]) /
        Math.max(1, Math.hypot(before[0] - other[0], before[1] - other[1]));
      view.zoomAt(ratio, (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
    } else if (taken) {
      if (moved) taken(view.camera().toWorld(...now), false);
    } else if (moved) view.pan(now[0] - before[0], now[1] - before[1]);
  };
  canvas.onpointerup = canvas.onpointercancel = (e) => {
    if (!pointers.delete(e.pointerId) || pointers.size > 0) return;
    const p = view.camera().toWorld(...at(e));
    if (taken && moved) taken(p, true);
    else if (!moved && e.type === "pointerup") view.onclick?.(p, e);
    taken = undefined;
  };
  canvas.onpointerleave = () => view.onhover?.(undefined);
  canvas.addEventListener(
    "wheel",
    (e) => {
      e.preventDefault();
      view.zoomAt(Math.exp(-e.deltaY * (e.deltaMode ? 0.05 : 0.0015)), ...at(e));
    },
    { passive: false },
  );
  canvas.ondblclick = () => view.reset();
}
