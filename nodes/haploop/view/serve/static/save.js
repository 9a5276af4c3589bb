// Saves what is on the page as files: a picture of its charts, and the numbers that they draw.

import { byId, make } from "./dom.js";
import { colour } from "./drawing/palette.js";

const GAP = 10;
const TITLE_PX = 18;
const SWATCH_PX = 26;
const TABLES = ["position", "force", "energy", "spectrum", "loop", "momentum", "before", "after"];

/** Save all visible charts, one below the other with the names of their lines, under the run's title and verdict. */
export function savePicture({ title, run }) {
  const ratio = devicePixelRatio;
  const charts = [...document.querySelectorAll(".chart, #motion, #compare figure")].filter((one) => one.querySelector("canvas") && one.getClientRects().length);
  const picture = make("canvas");
  const ctx = picture.getContext("2d");
  const [line, gap, plain] = [TITLE_PX * ratio, GAP * ratio, `${12 * ratio}px sans-serif`];
  ctx.font = plain;
  const parts = charts.map((chart) => {
    const canvases = [...chart.querySelectorAll("canvas")].filter((one) => one.width && one.height && one.getClientRects().length);
    const wide = canvases.reduce((sum, { width }) => sum + width + gap, 0);
    const names = placed(ctx, namesOf(chart), wide, ratio);
    const top = (1 + (names.at(-1)?.row ?? 0)) * line;
    return { canvases, names, wide, top, high: Math.max(0, ...canvases.map(({ height }) => height)) + top + gap };
  });
  const head = 2 * (line + gap);
  picture.width = Math.max(1, ...parts.map(({ wide }) => wide));
  picture.height = head + parts.reduce((sum, { high }) => sum + high, 0);
  ctx.fillStyle = colour("card");
  ctx.fillRect(0, 0, picture.width, picture.height);
  ctx.fillStyle = colour("ink");
  ctx.textBaseline = "top";
  ctx.font = `bold ${14 * ratio}px sans-serif`;
  ctx.fillText(title ?? "haploop", gap, gap);
  drawVerdict(ctx, gap, gap + line, ratio);
  ctx.font = plain;
  let y = head;
  for (const { canvases, names, top, high } of parts) {
    for (const { x, row, ...name } of names) drawName(ctx, name, x, y + row * line, ratio);
    let x = 0;
    for (const canvas of canvases) {
      ctx.drawImage(canvas, x, y + top);
      x += canvas.width + gap;
    }
    y += high;
  }
  return new Promise((done) => picture.toBlob((blob) => done(save(blob, `haploop-${run}.png`))));
}

/** What is written above a chart: the lines that are shown, with their looks and numbers, and notes. */
function namesOf(chart) {
  const lines = [...chart.querySelectorAll(".legend li")].filter((one) => one.querySelector('[aria-pressed="true"]'));
  const notes = [...chart.querySelectorAll(".head .note, .line-name, figcaption")].filter((note) => note.innerText);
  return [...lines.map((one) => ({ text: one.innerText, look: one.querySelector("line") })), ...notes.map((note) => ({ text: note.innerText }))].map(
    ({ text, look }) => ({ text: text.replaceAll(/\s+/g, " "), look }),
  );
}

/** Names with their places, in as many rows as their width needs. */
function placed(ctx, names, width, ratio) {
  let [x, row] = [GAP * ratio, 0];
  return names.map((name) => {
    const wide = ctx.measureText(name.text).width + ((name.look ? SWATCH_PX : 0) + GAP) * ratio;
    if (x + wide > width && x > GAP * ratio) [x, row] = [GAP * ratio, row + 1];
    const place = { ...name, x, row };
    x += wide;
    return place;
  });
}

function drawName(ctx, { text, look }, x, y, ratio) {
  if (look) {
    ctx.strokeStyle = getComputedStyle(look).stroke;
    ctx.lineWidth = Number(look.getAttribute("stroke-width")) * ratio;
    ctx.setLineDash((look.getAttribute("stroke-dasharray") ?? "").split(" ").filter(Boolean).map((length) => Number(length) * ratio));
    ctx.beginPath();
    ctx.moveTo(x, y + 6 * ratio);
    ctx.lineTo(x + 20 * ratio, y + 6 * ratio);
    ctx.stroke();
  }
  ctx.fillStyle = colour("ink");
  ctx.fillText(text, x + (look ? SWATCH_PX * ratio : 0), y);
}

/** The verdict as the page has it: filled where it is judged, else an outline. */
function drawVerdict(ctx, x, y, ratio) {
  const sought = byId("verdict");
  const text = [sought.querySelector("span"), byId("seen")].map(({ textContent }) => textContent).filter(Boolean).join(": ");
  const isJudged = sought.dataset.is === "judged";
  ctx.fillStyle = ctx.strokeStyle = getComputedStyle(sought).getPropertyValue("--tone");
  ctx.lineWidth = 2 * ratio;
  ctx.beginPath();
  ctx.roundRect(x, y, ctx.measureText(text).width + 2 * GAP * ratio, (TITLE_PX + 4) * ratio, 8 * ratio);
  if (isJudged) ctx.fill();
  else ctx.stroke();
  ctx.fillStyle = isJudged ? "#fff" : colour("ink");
  ctx.fillText(text, x + GAP * ratio, y + 4 * ratio);
}

/** Save what is drawn as lines of table, place (s, or Hz of a spectrum), quantity, unit, value in SI. */
export function saveData({ tables }, { run }) {
  const lines = ["table,place,quantity,unit,value"];
  for (const name of Object.keys(tables).filter((one) => TABLES.includes(one) || one.startsWith("own."))) {
    const { t0_s: t0, dt_s: dt, columns } = tables[name];
    for (const { name: quantity, unit, values } of columns) {
      values.forEach((value, i) => lines.push(`${name},${Number((t0 + i * dt).toPrecision(10))},${quantity},${unit},${value}`));
    }
  }
  save(new Blob([lines.join("\n"), "\n"], { type: "text/csv" }), `haploop-${run}.csv`);
}

function save(blob, name) {
  const href = URL.createObjectURL(blob);
  make("a", { href, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(href), 10_000);
}
