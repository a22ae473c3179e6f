// @ts-check
import { el } from "../ui/controls.js";
import { byId } from "./status.js";

/**
 * What the studio was given, as the engine says it.
 * @typedef {{opens: string, given: {name: string, in_3d: boolean} | null}} About
 */

/** @typedef {[string, string, string]} World the address that shows it, its title, and what is to be seen */

/** @type {World} */
const FLAT = ["view=fusion&play=1", "A robot in a flat", "2-D: a laser scanner drives laps; move the chair."];
/** @type {World} */
const LIDAR = ["view=3d&sensor=lidar", "A lidar in a building", "3-D: 40 scans become a mesh."];
/** @type {World} */
const CAMERA = [
  "view=3d&sensor=camera&color=color",
  "A depth camera in the same building",
  "3-D and in color: 160 pictures.",
];
/** @type {World} */
const LINE = ["view=radiance", "Light on a line", "1-D: a density field fitted to seven rays."];

/**
 * The dialog that offers what there is to see.
 * @param {About} about
 * @param {() => void} tour
 */
export function startDialog({ given }, tour) {
  const dialog = /** @type {HTMLDialogElement} */ (byId("welcome"));
  const worlds = [...(given && !given.in_3d ? [] : [FLAT]), ...(given?.in_3d ? [] : [LIDAR, CAMERA]), LINE];
  const card = (/** @type {World} */ [address, title, what]) =>
    el("a", { href: `#${address}`, class: "card", onclick: () => dialog.close() }, el("b", {}, title), what);
  /** @type {World | null} */
  const own = given && [
    given.in_3d ? "view=3d" : "view=fusion",
    given.name,
    "What the studio was started with.",
  ];
  byId("welcome-worlds").replaceChildren(...(own ? [card(own)] : []), ...worlds.map(card));
  byId("welcome-tour").onclick = () => (dialog.close(), tour());
  byId("welcome-open").onclick = () => dialog.showModal();
  listenToDrops(dialog);
}

/**
 * A log is read where it lies, by the program: a file that is dropped here gets the command that shows it.
 * @param {HTMLDialogElement} dialog
 */
function listenToDrops(dialog) {
  document.addEventListener("dragover", (event) => event.preventDefault());
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    const name = event.dataTransfer?.files[0]?.name;
    if (!name) return;
    byId("welcome-command").textContent = `portolan studio ${/\s/.test(name) ? `"${name}"` : name}`;
    if (!dialog.open) dialog.showModal();
  });
}
