// @ts-check

/** Pictures that are remembered. */
const LAST = 240;

/** Measures what the main thread does per picture: answers taken in, and drawing. */
export class Meter {
  /** @param {HTMLElement} out */
  constructor(out) {
    this.out = out;
    /** Milliseconds of work, the latest last. @type {number[]} */
    this.work = [];
    this.open = 0;
    this.note = "";
  }

  /**
   * Does a piece of the work of the picture that is coming.
   * @template T
   * @param {() => T} work
   * @returns {T}
   */
  measure(work) {
    const start = performance.now();
    try {
      return work();
    } finally {
      this.open += performance.now() - start;
    }
  }

  /** The picture is drawn: what was measured since the last one was its work. */
  picture() {
    this.work.push(this.open);
    this.open = 0;
    if (this.work.length > LAST) this.work.shift();
    if (this.work.length % 20 === 0) this.show();
  }

  /** Median and worst of the pictures that are remembered (milliseconds). */
  summary() {
    const sorted = [...this.work].sort((a, b) => a - b);
    return { pictures: sorted.length, median: sorted[sorted.length >> 1] ?? 0, worst: sorted.at(-1) ?? 0 };
  }

  /** Forgets what was measured: what comes is of another kind. */
  reset() {
    this.work = [];
    this.open = 0;
  }

  show() {
    const { median, worst } = this.summary();
    const note = this.note && ` · ${this.note}`;
    this.out.textContent = `${median.toFixed(1)} ms a picture, worst ${worst.toFixed(1)}${note}`;
  }
}
