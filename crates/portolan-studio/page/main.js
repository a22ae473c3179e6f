// @ts-check
import { connect } from "./engine/socket.js";
import { Shell } from "./shell/shell.js";
import { fail } from "./shell/status.js";
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
  const shell = new Shell(engine, [fusion, gallery, clearance, radiance, view3d]);
  await shell.followAddress();
}

main().catch(fail);
