// Own columns of elements over time, as a plugin declares them: a chart for each unit.

import { make, put } from "../dom.js";
import { linesOf } from "../drawing/palette.js";
import { times } from "../snapshot.js";
import { TimeChart } from "./time_chart.js";

const NOTHING = "No element showed columns of its own in this time.";

export class OwnPanel {
  /** @param {HTMLElement} host takes the charts. @param {import("../viewport.js").Viewport} viewport what they change. */
  constructor(host, viewport) {
    Object.assign(this, { host, viewport });
    this.note = host.appendChild(make("p", { class: "about" }));
    this.charts = [];
    this.units = "";
  }

  show({ from_s: from, to_s: to, tables }, state, marks) {
    const own = Object.values(tables).filter(({ name }) => name.startsWith("own."));
    const units = JSON.stringify(own.map(({ columns: [{ unit }] }) => unit));
    if (units !== this.units) this.build(own, units);
    put(this.note, own.length ? "" : NOTHING);
    own.forEach((table, i) => {
      this.charts[i].show([from, to], times(table), linesOf(table), { isEnvelope: table.envelope, marks });
    });
  }

  build(own, units) {
    this.units = units;
    for (const chart of this.charts) chart.remove();
    this.charts = own.map(({ columns: [{ unit }] }, i) => {
      const host = this.host.appendChild(make("section", { class: "chart", "aria-label": `own columns in ${unit || "pure numbers"}` }));
      const times = i === own.length - 1;
      return new TimeChart(host, { label: "", unit, prefix: "", least: 1e-9, share: 0.01, zero: false, times }, this.viewport);
    });
  }

  refit() {
    for (const { range } of this.charts) range.forget();
  }
}
