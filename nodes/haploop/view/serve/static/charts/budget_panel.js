// Where the energy comes from: a bar for every cause, to the left what feeds the device, to the right what takes from it.

import { amount } from "../drawing/amounts.js";
import { make, put } from "../dom.js";

const MODES = [["total", "since start"], ["window", "window"], ["power", "power"]];
// What a row that is no flow of energy is said to be, by its sign.
const NO_FLOW = {
  kept: ["commanded, but not given:", "commanded, but not given:"],
  store: ["given back from store", "put into store"],
};

export class BudgetPanel {
  /** @param {HTMLElement} host takes the bars. */
  constructor(host) {
    this.mode = "total";
    this.rows = new Map();
    const choice = make("div", { class: "joined", role: "radiogroup", "aria-label": "energy" });
    for (const [mode, words] of MODES) {
      const radio = make("input", { type: "radio", name: "budget", value: mode, ...(mode === this.mode ? { checked: "" } : {}) });
      radio.addEventListener("change", () => {
        this.mode = mode;
        this.draw();
      });
      choice.append(make("label", {}, radio, make("span", {}, words)));
    }
    this.list = make("dl", { class: "bars" });
    this.note = make("p", { class: "about" });
    const zero = make("p", { class: "zero", "aria-hidden": "true" }, make("span", {}, "◂ feeds"), make("b", {}, "0"), make("span", {}, "dissipates ▸"));
    host.append(make("h2", {}, "Where does the energy come from?"), choice, zero, this.list, this.note);
    this.budget = null;
    this.draw();
  }

  show({ budget }) {
    this.budget = budget;
    this.draw();
  }

  draw() {
    const { rows = [], from_s: from = 0, to_s: to = 0, about_s: about } = this.budget ?? {};
    const over = Math.max(to - from, 1e-9);
    const of = { total: (row) => row.total_J, window: (row) => row.window_J, power: (row) => row.window_J / over }[this.mode];
    const unit = this.mode === "power" ? "W" : "J";
    const largest = Math.max(...rows.map((row) => Math.abs(of(row))), 1e-15);
    const gone = new Set(this.rows.keys());
    for (const row of rows) {
      gone.delete(row.name);
      if (!this.rows.has(row.name)) this.add(row);
      this.fill(row, of(row), largest, unit);
    }
    for (const name of gone) {
      this.rows.get(name).row.remove();
      this.rows.delete(name);
    }
    const inOrder = rows.map(({ name }) => this.rows.get(name).row);
    if (inOrder.some((row, i) => this.list.children[i] !== row)) this.list.append(...inOrder);
    put(this.note, this.words(from, to, about));
  }

  words(from, to, about) {
    if (!this.budget) return "No energy is known yet.";
    const since = this.mode === "total" ? `From the start of the run to ${to.toFixed(3)} s` : `From ${from.toFixed(3)} to ${to.toFixed(3)} s`;
    const rough = about && this.mode !== "total" ? `, its beginning within ${amount(about, "s")}` : "";
    return `${since}${rough}. The bars sum to zero: the books close.`;
  }

  add({ name, is }) {
    const bar = make("span", { class: "bar" });
    const value = make("output");
    const row = make("div", is in NO_FLOW ? { class: "store" } : {}, make("dt", {}, name), make("dd", {}, make("span", { class: "track" }, bar), value));
    this.rows.set(name, { row, bar, value });
    this.list.append(row);
  }

  fill({ name, is }, value, largest, unit) {
    const { row, bar, value: output } = this.rows.get(name);
    const share = (50 * Math.abs(value)) / largest;
    bar.style.width = `${share}%`;
    bar.style.left = `${value < 0 ? 50 - share : 50}%`;
    row.dataset.does = value < 0 ? "feeds" : "dissipates";
    const isNothing = Math.abs(value) < 1e-9 * largest;
    put(output, amount(isNothing ? 0 : value, unit));
    row.title = `${name}: ${isNothing ? "about nothing," : verb(is, value)} ${amount(Math.abs(value), unit)}`;
  }
}

const verb = (is, value) => (NO_FLOW[is] ?? ["feeds the device", "takes out of the device"])[value < 0 ? 0 : 1];
