// A chart over simulated time: lines of one unit, the events that changed the run, a cursor shared with its neighbours.

import { amount, named, steady } from "../drawing/amounts.js";
import { bareAxis, bottomAxis, leftAxis } from "../drawing/axes.js";
import { boxOf, make, onSight, seldom } from "../dom.js";
import { Legend, stroke } from "../drawing/legend.js";
import { drawMarks, drawMeasured, nameMarks } from "../drawing/marks.js";
import { ClimbingUnit } from "../drawing/climbing.js";
import { colour } from "../drawing/palette.js";
import { boxes, drawStrips, halfPlane, line as linePath, strips } from "../drawing/paths.js";
import { extent, Range } from "../drawing/range.js";
import { between, Marked, readingsAt, told } from "../drawing/readings.js";
import { newest, scaled, times } from "../snapshot.js";

const CURSORS = "haploop";
// Where the charts lie one below the other, each has its own times: those of the last chart are out of sight.
const NARROW = matchMedia("(max-width: 699px)");
// How much of a chart's height the times below it take, and a letter of the name beside it.
const [TIMES_PX, LETTER_PX] = [46, 6.2];
// No size for the axis is known yet: it covers one of its unit.
const WHERE_ALL_IS_ZERO = [-0.5, 0.5];
const OVERLAY = { key: "overlay", line: { colour: "overlay", width: 1.2 } };
// From this many pixels on, an interval of which only the extremes are kept is a box: a line would show swings that nothing made.
const BOX_PX = 4;

export class TimeChart {
  /**
   * @param {HTMLElement} host takes the chart.
   * @param {object} options label, SI unit and first prefix of the left axis; least: it never covers less, in SI, nor than a
   *   share of its largest number; zero:
   *   it always shows 0; times: whether the times are below the chart.
   * @param {import("../viewport.js").Viewport} viewport what dragging in the chart changes.
   */
  constructor(host, options, viewport) {
    Object.assign(this, { host, options, viewport });
    this.unit = new ClimbingUnit(options.unit, options.prefix);
    this.range = new Range(options.least * this.unit.factor, options.share);
    this.legend = new Legend(host, () => this.retoggle());
    this.plot = host.appendChild(make("div", { class: "plot" }));
    this.box = boxOf(this.plot, () => this.resize());
    this.lines = [];
    this.rough = [];
    this.names = [];
    this.isEnvelope = false;
    this.overlay = null;
    this.marked = new Marked();
    this.columns = [];
    this.t = new Float64Array(0);
    this.span = [0, 1];
    this.marks = [];
    this.wall = null;
    this.note = "";
    this.isSeen = true;
    this.tellSeldom = seldom(() => this.tell());
    this.build();
    onSight(host, (isSeen) => {
      this.isSeen = isSeen;
      this.draw();
    });
    this.turn = () => this.build();
    NARROW.addEventListener("change", this.turn);
  }

  remove() {
    NARROW.removeEventListener("change", this.turn);
    this.u.destroy();
    this.host.remove();
  }

  build() {
    this.u?.destroy();
    const { times } = this.options;
    const series = this.lines.map(({ line, label: name, key }) => ({
      label: name,
      stroke: stroke(line),
      width: line.width,
      dash: line.dash,
      show: this.legend.isShown(key),
      auto: false,
      points: { show: false },
      paths: (u, i) => {
        this.rough[i] = null;
        if (this.isCoarse()) return { stroke: boxes(u, u.data[0], u.data[i]) };
        this.rough[i] = strips(u, u.data[0], u.data[i]);
        return this.rough[i] ? null : { stroke: linePath(u, u.data[0], u.data[i]) };
      },
    }));
    const options = {
      ...this.size(),
      padding: [8, 26, 2, 0], // room for half of the last label of the time axis
      legend: { show: false },
      scales: {
        x: { time: false, auto: false, range: (u, min, max) => [min, max] },
        y: { auto: false, range: () => this.range.now },
      },
      series: [{}, ...series],
      axes: [times || NARROW.matches ? bottomAxis("simulated time (s)") : bareAxis(), leftAxis(this.axisName())],
      cursor: {
        y: false,
        points: { show: false },
        drag: { x: true, y: false, setScale: false, dist: 6 },
        sync: { key: CURSORS, scales: ["x", null], filters: { sub: (type) => type === "mousemove" } },
        bind: { dblclick: () => () => this.viewport.live() },
      },
      hooks: {
        drawSeries: [(u, i) => this.rough[i] && drawStrips(u, this.rough[i], this.lines[i - 1].line)],
        drawClear: [(u) => this.shade(u)],
        drawAxes: [(u) => drawMarks(u, this.marks)],
        draw: [(u) => this.layOver(u), (u) => nameMarks(u, this.marks), (u) => drawMeasured(u, this.viewport.measured)],
        setCursor: [() => this.tell()],
        setSelect: [(u) => this.select(u)],
      },
    };
    this.u = new uPlot(options, [this.t, ...this.columns], this.plot);
    this.u.over.addEventListener("click", () => this.viewport.mark(this.u.posToVal(this.u.cursor.left, "x")));
    this.draw();
  }

  /**
   * Show lines: a key, a name, a look and numbers each.
   *
   * @param {[number, number]} span first and last time, s.
   * @param {Float64Array} t times of the numbers, s.
   * @param {{key: string, label: string, line: object, values: ArrayLike<number>}[]} lines
   * @param {object} more isEnvelope: whether each pair of numbers is the extremes of one interval; wall: {values, side} to
   *   shade, or null; marks; note for the end of the legend; overlay: {table, label, fits} of another run, or null, and
   *   whether the axis has room for it.
   */
  show(span, t, lines, { isEnvelope = false, wall = null, marks = [], note = "", overlay = null } = {}) {
    const signature = (list) => JSON.stringify(list.map(({ key, label }) => [key, label]));
    const names = overlay ? [...lines, { ...OVERLAY, label: overlay.label }] : lines;
    const isNew = signature(names) !== signature(this.names);
    const climbs = this.climb(lines);
    const columns = lines.map(({ values }) => scaled(values, this.unit.factor));
    Object.assign(this, { span, t, lines, names, isEnvelope, wall, marks, note, overlay, columns });
    this.rerange();
    if (isNew || climbs) {
      this.legend.name(names);
      this.build();
    }
    this.draw();
  }

  /** Take another unit if these numbers need one; whether they did. */
  climb(lines) {
    const [low, high] = extent(lines.map(({ values }) => values));
    const largest = Math.max(Math.abs(low), Math.abs(high));
    const climbs = largest > 0 && this.unit.serve(Math.max(largest, this.options.least));
    if (climbs) Object.assign(this, { range: new Range(this.options.least * this.unit.factor, this.options.share) });
    return climbs;
  }

  rerange() {
    const shown = this.columns.filter((_, i) => this.legend.isShown(this.lines[i].key));
    if (this.overlay?.fits && this.legend.isShown(OVERLAY.key)) shown.push(scaled(this.overlay.table.columns[0].values, this.unit.factor));
    const [low, high] = extent(shown, this.options.zero && shown.length ? [0] : []);
    this.range.follow(...(low === 0 && high === 0 ? WHERE_ALL_IS_ZERO : [low, high]));
  }

  draw(isWanted = this.isSeen) {
    if (!isWanted) return;
    this.u.setData([this.t, ...this.columns], false);
    this.u.setScale("x", { min: this.span[0], max: this.span[1] });
    this.tellSeldom();
  }

  retoggle() {
    this.range.forget();
    this.rerange();
    this.lines.forEach(({ key }, i) => this.u.setSeries(i + 1, { show: this.legend.isShown(key) }, false));
    this.draw();
  }

  shade(u) {
    if (!this.wall || !this.legend.isShown("wall")) return;
    u.ctx.save();
    u.ctx.beginPath();
    u.ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    u.ctx.clip();
    u.ctx.fillStyle = colour("wall-fill");
    u.ctx.fill(halfPlane(u, this.t, scaled(this.wall.values, this.unit.factor), this.wall.side));
    u.ctx.restore();
  }

  /** Whether only the extremes of intervals are known, and these intervals are some pixels wide. */
  isCoarse() {
    const [begin, end] = this.span;
    return this.isEnvelope && this.t.length > 1 && (2 * (this.t[1] - this.t[0]) * this.u.bbox.width) / (end - begin) >= BOX_PX * devicePixelRatio;
  }

  /** The same quantity of another run. */
  layOver(u) {
    if (!this.overlay || !this.legend.isShown(OVERLAY.key)) return undefined;
    const { table } = this.overlay;
    const [t, values] = [times(table), scaled(table.columns[0].values, this.unit.factor)];
    const rough = strips(u, t, values);
    if (rough) return drawStrips(u, rough, OVERLAY.line);
    u.ctx.save();
    u.ctx.beginPath();
    u.ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    u.ctx.clip();
    u.ctx.setLineDash([]);
    u.ctx.strokeStyle = colour(OVERLAY.line.colour);
    u.ctx.lineWidth = OVERLAY.line.width * devicePixelRatio;
    u.ctx.stroke(linePath(u, t, values));
    return u.ctx.restore();
  }

  /** Show what the lines read under the cursor, or else last: all at one time. */
  tell() {
    if (!this.u) return undefined;
    const { t, lines, isEnvelope, unit: { factor } } = this;
    const at = this.u.cursor.idx;
    const here = at == null || at >= t.length ? null : readingsAt(t, lines, at, isEnvelope);
    const [one, other = here] = this.marked.look(this.viewport.measured, t, lines, isEnvelope, (mark) => this.u.valToIdx(mark));
    if (one && other) return this.measure(between(one, other));
    if (here) return this.legend.tell(lines.map(({ key }) => told(here.values.get(key), factor)), `at ${steady(here.t, 4)} s`);
    return this.legend.tell(lines.map((line) => told([newest(line), newest(line)], factor)), this.note || this.coarseness());
  }

  coarseness() {
    return this.isCoarse() ? `only ranges of ${amount(2 * (this.t[1] - this.t[0]), "s")} kept` : "";
  }

  /** Show time and differences; for lines of which no single samples are known, the range of the difference. */
  measure({ time, of }) {
    const texts = this.lines.map(({ key }) => `Δ ${told(of(key), this.unit.factor)}`);
    this.legend.tell(texts, `Δ ${steady(time, 4)} s${time ? `, ${amount(Math.abs(1 / time), "Hz")}` : ""}`);
  }

  select(u) {
    const { left, width } = u.select;
    if (width > 0) this.viewport.at(u.posToVal(left, "x"), u.posToVal(left + width, "x"));
    u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
  }

  size() {
    return { width: Math.max(120, this.box.width), height: Math.max(60, this.box.height) };
  }

  /** The name along the left axis: the unit alone where the chart is too low for more. */
  axisName() {
    const name = named(this.options.label, this.unit.name);
    const high = this.size().height - (this.options.times || NARROW.matches ? TIMES_PX : 0);
    return this.options.label && high < LETTER_PX * name.length ? this.unit.name : name;
  }

  resize() {
    const size = this.size();
    this.u.axes[1].label = this.axisName();
    if (size.width !== this.u.width || size.height !== this.u.height) this.u.setSize(size);
  }
}
