// @ts-check

/**
 * Saves a file as the browser does.
 * @param {string} name
 * @param {Blob} blob
 */
export function save(name, blob) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/**
 * Saves the file that an engine's answer holds.
 * @param {import("../engine/engine.js").Answer} answer with `name` and the array `file`
 */
export function saveAnswer(answer) {
  save(
    answer.body.name,
    new Blob([/** @type {any} */ (answer.arrays.file)], { type: "application/octet-stream" }),
  );
}
