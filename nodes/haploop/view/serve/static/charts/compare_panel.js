// Before and after the last change side by side: position and force over half a second each, and what is seen of them.

import { amount, amounts, NONE } from "../drawing/amounts.js";
import { make, put } from "../dom.js";
import { frequency, isSwinging } from "../words/header.js";
import { colour } from "../drawing/palette.js";

const SIDES = ["before", "after"];
const TRACES = [["x", "position", "m"], ["force", "force", "N"]];
const HEIGHT = 74;
const FIGURES = [
  ["seen", ({ word }) => word],
  ["swing p-p", ({ oscillation_m: width }) => amount(width, "m")],
  ["at", frequency],
  ["applied force p-p", ({ force_swing_N: swing }) => amount(swing, "N")],
  ["displayed stiffness", (sight) => (isSwinging(sight) ? NONE : amount(sight.stiffness_N_m, "N/m"))],
];

export class ComparePanel {
  /** @param {HTMLElement} host takes figures and table. */
  constructor(host) {
    this.title = make("h2", {}, "Before and after a change");
    this.pictures = TRACES.map(([, label]) => make("figure", {}, make("figcaption", {}, label), ...SIDES.map(() => make("canvas", { height: HEIGHT }))));
    this.body = make("tbody");
    const head = make("tr", {}, ...["", ...SIDES].map((text) => make("th", { scope: "col" }, text)));
    this.table = make("table", { class: "compared" }, make("thead", {}, head), this.body);
    this.about = make("p", { class: "about" });
    this.sides = make("p", { class: "sides", "aria-hidden": "true" }, ...SIDES.map((side) => make("span", {}, side)));
    host.append(this.title, this.about, this.sides, ...this.pictures, this.table);
    this.show({ tables: {} });
  }

  show({ change, tables }) {
    const sides = SIDES.map((name) => tables[name]);
    const isThere = Boolean(change);
    for (const part of [this.sides, ...this.pictures, this.table]) part.hidden = !isThere;
    put(this.about, isThere ? words(change, sides) : "Swap an element or set a number: the loop before and after it is shown here side by side.");
    if (!isThere) return;
    TRACES.forEach(([name, , unit], i) => this.draw(this.pictures[i], sides.map((side) => side?.columns.find((c) => c.name === name)?.values), unit));
    this.fill(sides);
  }

  /** Both sides on one scale. */
  draw(picture, traces, unit) {
    const all = traces.filter(Boolean).flatMap((values) => [...values]);
    const [low, high] = [Math.min(...all), Math.max(...all)];
    const most = Math.max(...traces.map((values) => values?.length ?? 0));
    put(picture.firstChild, `${picture.firstChild.textContent.split(",")[0]}, ${amounts(low, high, unit)}`);
    picture.querySelectorAll("canvas").forEach((canvas, side) => {
      const ratio = devicePixelRatio;
      const width = Math.round(canvas.clientWidth * ratio);
      if (canvas.width !== width || canvas.height !== HEIGHT * ratio) Object.assign(canvas, { width, height: HEIGHT * ratio });
      const ctx = canvas.getContext("2d");
      ctx.clearRect(0, 0, canvas.width, canvas.height);
      const values = traces[side];
      if (!values) return;
      ctx.strokeStyle = colour(side ? "accent" : "ink");
      ctx.lineWidth = 1.2 * ratio;
      ctx.beginPath();
      values.forEach((value, i) => {
        const y = canvas.height * (0.06 + 0.88 * (high > low ? (high - value) / (high - low) : 0.5));
        ctx.lineTo((i / Math.max(1, most - 1)) * canvas.width, y);
      });
      ctx.stroke();
    });
  }

  fill(sides) {
    const rows = FIGURES.map(([name, of]) => [name, ...sides.map((side) => (side ? of(side.sight) : NONE))]);
    const names = new Set(sides.flatMap((side) => side?.budget?.rows.map((row) => row.name) ?? []));
    for (const name of names) rows.push([name, ...sides.map((side) => power(side, name))]);
    const known = JSON.stringify(rows);
    if (known === this.known) return;
    this.known = known;
    this.body.replaceChildren(...rows.map(([name, ...cells]) => make("tr", {}, make("th", { scope: "row" }, name), ...cells.map((cell) => make("td", {}, cell)))));
  }
}

/** What a cause takes out of the device, in watts; below zero it feeds the device. */
function power(side, name) {
  const { rows, from_s: from, to_s: to } = side?.budget ?? {};
  const row = rows?.find((one) => one.name === name);
  if (!row || !(to > from)) return NONE;
  const largest = Math.max(...rows.map((one) => Math.abs(one.window_J)));
  return amount(Math.abs(row.window_J) < 1e-9 * largest ? 0 : row.window_J / (to - from), "W"); // the rest is rounding
}

function words({ tick }, [before, after]) {
  const lost = before ? "" : " What was before it is no longer kept.";
  const short = after && !after.sight.so_far ? "" : " So far, less than half a second is after it.";
  return `Tick ${tick}; watts below zero feed the device.${lost}${short}`;
}
