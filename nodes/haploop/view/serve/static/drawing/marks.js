// Marks in a chart over time: a line at the tick of everything that changed the run, with a short label.

import { FONT } from "./axes.js";
import { colour } from "./palette.js";

const CHANGES = new Set(["swap", "set", "stop", "restored"]);
const LANES = 2;
const TEXT_PX = 12;
const GAP_PX = 4;

/** What took effect, tick by tick: [{tick, t_s, words, changes}], in order. */
export function marksOf(events) {
  const marks = new Map();
  for (const { tick, t_s, kind } of events) {
    if (kind === "refused") continue;
    const mark = marks.get(tick) ?? { tick, t_s, words: [], changes: false };
    if (!mark.words.includes(kind)) mark.words.push(kind);
    mark.changes ||= CHANGES.has(kind);
    marks.set(tick, mark);
  }
  return [...marks.values()].sort((a, b) => a.tick - b.tick);
}

const tone = (mark) => colour(mark.changes ? "mark" : "grey");

/** The marks that lie in a chart, each with its place. */
function shown(u, marks) {
  const { left, width } = u.bbox;
  const { min, max } = u.scales.x;
  return marks
    .filter(({ t_s }) => t_s >= min && t_s <= max)
    .map((mark) => ({ ...mark, x: Math.round(left + ((mark.t_s - min) / (max - min)) * width) + 0.5 }));
}

/** Lets `draw` draw only within a chart. */
function within(u, draw) {
  const { left, top, width, height } = u.bbox;
  u.ctx.save();
  u.ctx.beginPath();
  u.ctx.rect(left, top, width, height);
  u.ctx.clip();
  draw(u.ctx, devicePixelRatio);
  u.ctx.restore();
}

/** Draw the lines of the marks, behind those of the chart. */
export const drawMarks = (u, marks) => within(u, (ctx, ratio) => {
  const { top, height } = u.bbox;
  ctx.lineWidth = ratio;
  for (const mark of shown(u, marks)) {
    const { x } = mark;
    ctx.strokeStyle = tone(mark);
    ctx.setLineDash(mark.changes ? [] : [2 * ratio, 3 * ratio]);
    ctx.beginPath();
    ctx.moveTo(x, top);
    ctx.lineTo(x, top + height);
    ctx.stroke();
  }
});

/** Write the names of the marks over all lines, which show through a veil behind the names; a name without room is left out. */
export const nameMarks = (u, marks) => within(u, (ctx, ratio) => {
  const free = Array(LANES).fill(-Infinity);
  ctx.font = `${TEXT_PX * ratio}px ${FONT}`;
  ctx.textBaseline = "top";
  ctx.textAlign = "left";
  for (const mark of shown(u, marks)) drawLabel(ctx, `${mark.tick} ${mark.words.join(", ")}`, tone(mark), mark.x, u.bbox, free, ratio);
});

/** Write a label beside its line, in the first lane that is free there. */
function drawLabel(ctx, text, tone, x, { left, top, width }, free, ratio) {
  const wide = ctx.measureText(text).width + 2 * GAP_PX * ratio;
  const start = x + wide > left + width ? x - wide : x;
  const lane = free.findIndex((end) => end <= start);
  if (lane < 0) return;
  free[lane] = start + wide;
  const y = top + lane * (TEXT_PX + GAP_PX) * ratio;
  ctx.fillStyle = colour("veil");
  ctx.fillRect(start + ratio, y, wide - 2 * ratio, (TEXT_PX + 3) * ratio);
  ctx.fillStyle = tone;
  ctx.fillText(text, start + GAP_PX * ratio, y + 2 * ratio);
}

/** Draw the times between which the charts measure. */
export function drawMeasured(u, measured) {
  const { left, top, width, height } = u.bbox;
  u.ctx.fillStyle = colour("accent");
  for (const t of measured) {
    const x = Math.round(u.valToPos(t, "x", true));
    if (x >= left && x <= left + width) u.ctx.fillRect(x, top, devicePixelRatio, height);
  }
}
