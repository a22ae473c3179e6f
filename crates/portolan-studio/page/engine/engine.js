// @ts-check
/**
 * The one thing that the page knows of what computes: it is asked and it answers. Today a socket to the
 * server stands behind it; the library compiled to WebAssembly can.
 *
 * @typedef {Float32Array | Uint32Array | Uint16Array | Uint8Array | Int8Array} Values
 *
 * @typedef {object} Answer
 * @property {any} body its JSON part
 * @property {Record<string, Values>} arrays typed arrays by their names
 *
 * @typedef {object} Engine
 * @property {(view: string, ask: object) => Promise<Answer>} ask rejects with an Error whose message is for
 *   people
 * @property {(listener: (why: string) => void) => void} onClosed called once, when there will be no more
 *   answers
 */

/** @type {Record<string, any>} */
const KINDS = { f32: Float32Array, u32: Uint32Array, u16: Uint16Array, u8: Uint8Array, i8: Int8Array };

/**
 * An answer with arrays, as `protocol.rs` lays it out.
 * @param {ArrayBuffer} buffer
 * @returns {{id: number, answer: Answer}}
 */
export function decode(buffer) {
  const bytes = new Uint8Array(buffer);
  if (String.fromCharCode(...bytes.subarray(0, 4)) !== "PSTU")
    throw new Error("the engine's answer does not begin with PSTU");
  const length = new DataView(buffer).getUint32(4, true);
  const header = JSON.parse(new TextDecoder().decode(bytes.subarray(8, 8 + length)));
  /** @type {Record<string, Values>} */
  const arrays = {};
  for (const a of header.arrays) arrays[a.name] = new KINDS[a.type](buffer, 8 + length + a.offset, a.length);
  return { id: header.id, answer: { body: header.ok, arrays } };
}
