// The names of a chart's lines, each with its number; a click hides a line or brings it back.

import { make, put } from "../dom.js";
import { colour } from "./palette.js";

const SVG = "http://www.w3.org/2000/svg";

/** A short piece of the line as it is drawn. */
function swatch({ colour: name, width, dash = [] }) {
  const svg = document.createElementNS(SVG, "svg");
  const line = document.createElementNS(SVG, "line");
  for (const [key, value] of Object.entries({ x1: 0, x2: 20, y1: 5, y2: 5, "stroke-width": width + 0.6 })) {
    line.setAttribute(key, value);
  }
  if (dash.length) line.setAttribute("stroke-dasharray", dash.join(" "));
  line.style.stroke = `var(--${name})`;
  svg.setAttribute("viewBox", "0 0 20 10");
  svg.setAttribute("aria-hidden", "true");
  svg.append(line);
  return svg;
}

/** Keeps the rows that numbers once needed: a row that came and went would move the chart from under the cursor. */
function keepRows(head) {
  let width = 0;
  new ResizeObserver(() => {
    if (head.clientWidth !== width) head.style.minHeight = "";
    width = head.clientWidth;
    head.style.minHeight = `${head.offsetHeight}px`;
  }).observe(head);
}

export class Legend {
  /** @param {(key: string) => void} toggled called when a line was hidden or brought back. */
  constructor(host, toggled) {
    this.list = make("ul", { class: "legend" });
    this.note = make("p", { class: "note" });
    this.head = make("div", { class: "head" }, this.list, this.note);
    host.prepend(this.head);
    keepRows(this.head);
    this.toggled = toggled;
    this.hidden = new Set();
    this.values = [];
  }

  /** Name these lines: [{key, label, line}]. What was hidden stays hidden. */
  name(entries) {
    this.values = entries.map(() => make("output"));
    this.head.style.minHeight = "";
    this.list.replaceChildren(...entries.map((entry, i) => this.entry(entry, this.values[i])));
  }

  entry({ key, label, line }, value) {
    const shown = () => String(!this.hidden.has(key));
    const name = make("span", { class: "name" }, label.replace(/^element /, ""));
    const button = make("button", { type: "button", "aria-pressed": shown(), title: `${label}: hide or show` });
    button.append(swatch(line), name);
    button.addEventListener("click", () => {
      if (!this.hidden.delete(key)) this.hidden.add(key);
      button.setAttribute("aria-pressed", shown());
      this.toggled(key);
    });
    return make("li", {}, button, value);
  }

  isShown(key) {
    return !this.hidden.has(key);
  }

  /** The numbers beside the names, in their order, and a note at the end of the row. */
  tell(texts, note) {
    texts.forEach((text, i) => put(this.values[i], text));
    put(this.note, note);
  }
}

/** For uPlot, which asks for a colour at every drawing. */
export const stroke = (line) => () => colour(line.colour);
