// @ts-check
import { connect } from "./engine/socket.js";
import { Shell } from "./shell/shell.js";
import { startDialog } from "./shell/start.js";
import { fail } from "./shell/status.js";
import { Tour } from "./shell/tour.js";
import { applyTheme } from "./ui/theme.js";
import clearance from "./views/clearance.js";
import fusion from "./views/fusion.js";
import gallery from "./views/gallery.js";
import radiance from "./views/radiance.js";
import view3d from "./views/view3d.js";

async function main() {
  applyTheme();
  const engine = await connect();
  engine.onClosed(fail);
  /** @type {import("./shell/start.js").About} */
  const about = (await engine.ask("studio", { op: "about" })).body;
  const shell = new Shell(engine, [fusion, gallery, clearance, radiance, view3d], about);
  const tour = new Tour(shell, about.given === null || about.given.in_3d);
  startDialog(about, () => void tour.go(0));
  await shell.followAddress();
}

main().catch((error) => {
  fail(error);
  // Nothing else is on the page: it says why where one looks.
  const stage = document.getElementById("stage");
  if (!stage || stage.childElementCount > 0) return;
  const note = document.createElement("p");
  note.className = "alone error";
  note.textContent = error instanceof Error ? error.message : String(error);
  stage.append(note);
});
