// @ts-check
/** @type {import("../main.js").View} */
export default { id: "fusion", title: "Fusion", mount() { throw new Error("being written"); } };
