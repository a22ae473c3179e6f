// @ts-check
import { decode } from "./engine.js";

/**
 * The engine of this tab, at the other end of a socket.
 * @param {string} [url]
 * @returns {Promise<import("./engine.js").Engine>}
 */
export function connect(url = `ws://${location.host}/engine`) {
  const socket = new WebSocket(url);
  socket.binaryType = "arraybuffer";
  /** @type {Map<number, {resolve: (a: import("./engine.js").Answer) => void, reject: (e: Error) => void}>} */
  const waiting = new Map();
  /** @type {((why: string) => void)[]} */
  const listeners = [];
  let next = 1;
  /** How many answers are awaited: 0 when the page is at rest. */
  const count = () => (document.body.dataset.awaited = String(waiting.size));

  socket.onmessage = ({ data }) => {
    if (typeof data !== "string") {
      const { id, answer } = decode(data);
      waiting.get(id)?.resolve(answer);
      waiting.delete(id);
      count();
      return;
    }
    const message = JSON.parse(data);
    const who = waiting.get(message.id);
    waiting.delete(message.id);
    count();
    if (message.error !== undefined) who?.reject(new Error(message.error));
    else who?.resolve({ body: message.ok, arrays: {} });
  };

  return new Promise((resolve, reject) => {
    socket.onclose = (event) => {
      const why = event.reason || "the studio has stopped; start it again and reload this page";
      for (const { reject } of waiting.values()) reject(new Error(why));
      waiting.clear();
      listeners.splice(0).forEach((tell) => tell(why));
      reject(new Error(why));
    };
    socket.onopen = () =>
      resolve({
        ask(view, ask) {
          if (socket.readyState !== WebSocket.OPEN)
            return Promise.reject(new Error("the studio has stopped; start it again and reload this page"));
          const id = next++;
          return new Promise((resolve, reject) => {
            waiting.set(id, { resolve, reject });
            count();
            socket.send(JSON.stringify({ id, view, ask }));
          });
        },
        onClosed: (listener) => void listeners.push(listener),
      });
  });
}
