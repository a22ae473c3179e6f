// @ts-check

/** Steps that a link may ask for. */
const MOST_STEPS = 500_000;
/** Ways of fitting that a link may have in a row. */
const MOST_PHASES = 32;
/** Steps that the engine makes at once at most. */
const MOST_AT_ONCE = 2000;

/**
 * @typedef {import("./start.js").Way} Way
 * @typedef {{seed: number, phases: (Way & {steps: number})[]}} Run a seed, and every way of fitting with its
 *   steps
 */

/** What a link says of a run. @param {Run} run @returns {Record<string, string>} */
export function writeRun({ seed, phases }) {
  return { seed: String(seed), run: phases.map((p) => `${p.channels}-${p.optimizer}-${p.steps}`).join(".") };
}

/** The run that a link asks for, if it does. @param {URLSearchParams} link @returns {Run | undefined} */
export function readRun(link) {
  const seed = Number(link.get("seed") ?? NaN);
  if (!Number.isSafeInteger(seed) || seed < 0) return undefined;
  const texts = (link.get("run") ?? "depth-descent-0").split(".").slice(0, MOST_PHASES);
  const phases = texts.map((text) => {
    const [channels, optimizer, steps] = text.split("-");
    return { channels, optimizer, steps: Number(steps) };
  });
  if (!phases.every((p) => Number.isSafeInteger(p.steps) && p.steps >= 0))
    throw new Error("the run in the link cannot be read: each part is channels-optimizer-steps");
  if (stepsOf(phases) > MOST_STEPS) throw new Error(`the run in the link has more than ${MOST_STEPS} steps`);
  return { seed, phases };
}

/**
 * Makes a run again, until something else is asked for.
 * @param {import("../views/radiance.js").Radiance} view
 * @param {Run} run
 */
export async function replay(view, { seed, phases }) {
  const turn = ++view.turn;
  const all = stepsOf(phases);
  let done = 0;
  for (const [i, { channels, optimizer, steps }] of phases.entries()) {
    await view.ask(
      i === 0 ? { op: "start", seed, channels, optimizer } : { op: "go_on", channels, optimizer },
    );
    for (let left = steps; left > 0 && turn === view.turn;) {
      const n = Math.min(left, MOST_AT_ONCE);
      await view.ask({ op: "step", steps: n });
      left -= n;
      done += n;
      view.app.say(`Making the run of the link again: ${done} of ${all} steps.`);
    }
    if (turn !== view.turn) return;
  }
  if (all > 0) view.app.say(`The run of the link was made again: ${all} steps.`);
}

/** @param {{steps: number}[]} phases */
const stepsOf = (phases) => phases.reduce((n, p) => n + p.steps, 0);
