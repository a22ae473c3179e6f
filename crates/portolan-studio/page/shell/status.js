// @ts-check

/** @param {string} id @returns {HTMLElement} */
export const byId = (id) => /** @type {HTMLElement} */ (document.getElementById(id));

/** Writes into the status line. @param {string} text */
export function say(text) {
  const status = byId("status");
  status.classList.remove("error");
  status.textContent = text;
}

/** Writes an error into the status line. @param {unknown} error */
export function fail(error) {
  const status = byId("status");
  status.classList.add("error");
  status.textContent = error instanceof Error ? error.message : String(error);
}
