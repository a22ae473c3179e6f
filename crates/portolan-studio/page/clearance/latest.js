// @ts-check

/**
 * Asks one question at a time: while one is under way only the latest of those that come waits, the others
 * are never asked.
 *
 * @template Q, A
 * @param {(question: Q) => Promise<A>} ask
 * @param {(answer: A, question: Q) => void} take
 * @param {(error: unknown) => void} fail
 * @returns {(question: Q) => void}
 */
export function latest(ask, take, fail) {
  let busy = false;
  /** @type {{question: Q} | undefined} */
  let waiting;
  const run = async (/** @type {Q} */ question) => {
    busy = true;
    try {
      const answer = await ask(question);
      take(answer, question);
    } catch (error) {
      fail(error);
    }
    busy = false;
    const next = waiting;
    waiting = undefined;
    if (next) run(next.question);
  };
  return (question) => {
    if (busy) waiting = { question };
    else run(question);
  };
}
