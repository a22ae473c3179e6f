// @ts-check

/**
 * A view: built when it is first shown, then shown and hidden.
 *
 * Every view is made of the same parts: a file in `views/` that puts them together, and a folder of its name
 * with the scene that is drawn, the strip of controls below it, the panels beside it, and the link that
 * restores it.
 *
 * @typedef {object} View
 * @property {string} id also in the address
 * @property {string} [formerly] what older links call it
 * @property {string} title on its tab
 * @property {string} lead the sentence above its picture, with `{terms}` that explain themselves
 * @property {boolean} [in_3d] which scans it shows; left out: none
 * @property {(root: HTMLElement, app: App) => Shown} mount fills `root`, a section that is not on the page
 *   yet
 *
 * A view that was built.
 * @typedef {object} Shown
 * @property {(link: URLSearchParams) => Promise<void> | void} show the view is on the page now; `link` is the
 *   address without the view's name, empty when the view was chosen by its tab
 * @property {() => void} hide
 * @property {() => Record<string, string>} state the link that makes another page show the same
 * @property {() => Promise<HTMLCanvasElement> | HTMLCanvasElement} picture of what is shown
 * @property {(event: KeyboardEvent) => boolean} key handles a key and returns whether it has a meaning here;
 *   never called while text is typed
 * @property {[string, string][]} keys each key with its meaning
 * @property {() => void} redraw after the theme has changed
 *
 * What views share.
 * @typedef {object} App
 * @property {import("../engine/engine.js").Engine} engine
 * @property {import("../ui/meter.js").Meter} meter measures the work per picture
 * @property {(text: string) => void} say in the status line
 * @property {(error: unknown) => void} fail in the status line, in red
 * @property {import("../shell/start.js").About} about what the studio was given
 * @property {(what: string) => void} strange says what of a link cannot be shown
 * @property {() => void} changed call it when `state` has changed: the address follows
 */

export {};
