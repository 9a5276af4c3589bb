// The spectrum of force and position: amplitudes over frequency on two axes, the line that stands out named.

import { amount, axisNumbers, named } from "../drawing/amounts.js";
import { bottomAxis, leftAxis } from "../drawing/axes.js";
import { ClimbingUnit } from "../drawing/climbing.js";
import { boxOf, make, put, seldom } from "../dom.js";
import { colour } from "../drawing/palette.js";
import { line as linePath } from "../drawing/paths.js";
import { Range, extent } from "../drawing/range.js";
import { scaled, times } from "../snapshot.js";

const SIDES = {
  x: { label: "position", axis: "position", unit: "m", prefix: "µ", colour: "accent", least: 1e-7 },
  force: { label: "applied force", axis: "force", unit: "N", prefix: "m", colour: "ink", least: 1e-4 },
};

export class SpectrumChart {
  /** @param {HTMLElement} host takes two charts, one below the other, and the names of their lines. */
  constructor(host) {
    this.note = make("p", { class: "about" });
    this.charts = Object.entries(SIDES).map(([name, side]) => {
      const said = make("p", { class: "line-name" });
      const plot = make("div", { class: "plot" });
      const card = make("section", { class: "chart", "aria-label": `spectrum of the ${side.label}` }, said, plot);
      host.append(card);
      return { card, ...this.chart(name, side, plot, said) };
    });
    host.append(this.note);
    this.tell = seldom((...what) => this.words(...what));
  }

  chart(name, side, plot, said) {
    const unit = new ClimbingUnit(side.unit, side.prefix);
    const range = new Range(side.least * unit.factor);
    const box = boxOf(plot, () => u.setSize(size()));
    const size = () => ({ width: Math.max(120, box.width), height: Math.max(80, box.height) });
    const u = new uPlot(
      {
        ...size(),
        padding: [8, 12, 2, 0],
        legend: { show: false },
        cursor: { y: false, points: { show: false }, drag: { x: false, y: false } },
        scales: {
          x: { time: false, auto: false, distr: 3, log: 10, range: (_, min, max) => [min, max] },
          y: { auto: false, range: (_, min, max) => [min, max] },
        },
        series: [{}, { stroke: () => colour(side.colour), width: 1.4, auto: false, points: { show: false } }],
        axes: [
          { ...bottomAxis("frequency (Hz)"), values: (_, splits) => splits.map((hz) => (isTold(hz) ? axisNumbers([hz], hz < 1 ? 0.1 : 1)[0] : null)) },
          leftAxis(named(side.axis, unit.name)),
        ],
      },
      [[1, 2], [0, 0]],
      plot,
    );
    return { name, side, unit, u, range, said };
  }

  show({ tables: { spectrum }, lines, coarse }) {
    for (const chart of this.charts) {
      const { name, side, unit, u } = chart;
      chart.card.hidden = !spectrum; // axes without a line would show numbers of nothing
      const column = spectrum?.columns.find((one) => one.name === name);
      const at = spectrum ? times(spectrum) : new Float64Array(0);
      if (unit.serve(Math.max(side.least, extent([column?.values ?? []])[1]))) {
        chart.range = new Range(side.least * unit.factor);
        u.axes[1].label = named(side.axis, unit.name);
      }
      const heights = column ? scaled(column.values, unit.factor) : new Float64Array(0);
      chart.range.follow(...extent([heights], [0]));
      u.setData([at, heights], false);
      u.setScale("y", { min: 0, max: chart.range.now[1] });
      if (at.length) u.setScale("x", { min: at[0], max: at.at(-1) });
    }
    this.tell(spectrum ? lines : null, coarse);
  }

  words(lines, coarse) {
    for (const { name, side, said } of this.charts) put(said, lines ? `${side.label}, ${told(lines[name], side.unit)}` : side.label);
    const missing = coarse ? "No spectrum: for this time only the minimum and maximum of each interval are kept here." : "Too few samples for a spectrum.";
    put(this.note, lines ? `Amplitudes, ${lines.from_s.toFixed(2)} to ${lines.to_s.toFixed(2)} s.` : missing);
  }

  refit() {
    for (const { range } of this.charts) range.forget();
  }
}

/** Whether a frequency gets a number on the axis: 1, 2 and 5 are far enough apart on a logarithmic axis, 8 and 10 are not. */
const isTold = (hz) => hz != null && [1, 2, 5].includes(Math.round(hz / 10 ** Math.floor(Math.log10(hz) + 1e-9)));

/** The main line in words. */
function told(line, unit) {
  if (!line) return `no line stands out`;
  return `main line: ${amount(line.frequency_Hz, "Hz")}, ${amount(line.width, unit)} p-p`;
}
