// @ts-check
import { el } from "./controls.js";

/**
 * Words of the field, each in a sentence for who meets it for the first time.
 * @type {Record<string, string>}
 */
const TERMS = {
  "signed distance": "How far it is to the nearest surface: positive in front of it, negative behind it.",
  truncation: "Signed distances are kept only so near to surfaces; farther away they say “at least so far”.",
  weight: "How much a cell has seen: every observation adds its own weight, up to W_max.",
  W_max: "The largest weight of a cell. The smaller it is, the sooner the map forgets what has gone.",
  prior: "What the cell believed before the scan.",
  posterior: "What it believes after the scan.",
  gain: "The share of what is new in an observation that the estimate takes over.",
  "half-life": "Observations until half of an old error is left.",
  contour: "The line where the signed distance is zero: the surface that the map has found.",
  ghost: "What a map still shows where something stood that has gone.",
  carve: "Fuse the free space in front of surfaces, too, so that what has gone is taken away.",
  filter: "An estimate that every observation moves a little, by how much it is trusted.",
  occupancy: "The probability that something stands in a cell.",
  "Euclidean field":
    "The distance to the nearest surface in whatever direction it lies, as planners need it.",
  certified: "The exact distance to the map's surface lies between the bounds, rounding included.",
  unknown: "Nobody looked there. The map says so and does not guess.",
  gradient: "The direction in which the distance grows fastest: away from the nearest surface.",
  representation: "A way to keep a map: cells in an array, a tree, distances, lines, points.",
  voxel: "A cell of a 3-D map: a cube.",
  mesh: "Triangles where the signed distance is zero: the surface that the map has found.",
  slice: "A layer of cells, each in the color of its value.",
  TSDF: "Truncated signed distance field: signed distances near surfaces, fused from all scans.",
  ESDF: "Euclidean signed distance field: the distance to the nearest surface in any direction.",
  brick: "8 by 8 by 8 voxels, the piece in which maps grow.",
  "density field": "How much every place stops light: what NeRF and its kin fit to pictures.",
  "gradient descent": "Changing the field a little, over and over, in the direction that lowers the error.",
};

/** The one note that is shown at a time. @type {HTMLElement | undefined} */
let note;

/**
 * A text in which `{words}` explain themselves, where the pointer rests or the focus is; `{word|as written}`.
 * @param {string} text
 * @returns {(Node | string)[]}
 */
export function explained(text) {
  return text.split(/(\{[^}]*\})/).map((part) => {
    if (!part.startsWith("{")) return part;
    const [word, written] = part.slice(1, -1).split("|");
    return term(word, written ?? word);
  });
}

/** @param {string} word @param {string} written */
function term(word, written) {
  const what = TERMS[word];
  if (what === undefined) throw new Error(`there is no explanation of ${word}`);
  const node = el("abbr", { class: "term", tabindex: 0, "aria-label": `${written}: ${what}` }, written);
  node.onpointerenter = node.onfocus = () => show(node, what);
  node.onpointerleave = node.onblur = hide;
  node.onkeydown = (event) => {
    if (event.key === "Escape") hide();
  };
  return node;
}

/** @param {HTMLElement} at @param {string} what */
function show(at, what) {
  if (!note) {
    note = el("div", { id: "explained", role: "tooltip" });
    document.body.append(note);
  }
  note.textContent = what;
  note.hidden = false;
  const { left, bottom, top } = at.getBoundingClientRect();
  const { offsetWidth: w, offsetHeight: h } = note;
  const below = bottom + 6 + h < innerHeight;
  note.style.left = `${Math.max(8, Math.min(left, innerWidth - w - 8))}px`;
  note.style.top = `${below ? bottom + 6 : top - 6 - h}px`;
}

function hide() {
  if (note) note.hidden = true;
}

/** The sentence above a picture: what is seen, and why one should care. @param {string} text */
export function lead(text) {
  return el("p", { class: "lead" }, ...explained(text));
}
