// What is on the page as files: a picture of its charts, and the numbers that they draw.

import { make } from "./dom.js";
import { colour } from "./palette.js";

const GAP = 10;
const TITLE_PX = 18;
const TABLES = ["position", "force", "energy", "spectrum", "loop", "momentum", "before", "after"];

/** Save all visible charts, one below the other, under the run's title. */
export function savePicture({ title, run }) {
  const ratio = devicePixelRatio;
  const charts = [...document.querySelectorAll(".chart, #motion, #compare figure")].filter((one) => one.querySelector("canvas") && one.getClientRects().length);
  const parts = charts.map((chart) => ({ text: wordsOf(chart), canvases: [...chart.querySelectorAll("canvas")] }));
  const line = TITLE_PX * ratio;
  const wide = ({ canvases }) => canvases.reduce((sum, { width }) => sum + width + GAP * ratio, 0);
  const high = ({ canvases }) => Math.max(...canvases.map(({ height }) => height)) + line + GAP * ratio;
  const picture = make("canvas", { width: Math.max(...parts.map(wide)), height: line + GAP * ratio + parts.reduce((sum, part) => sum + high(part), 0) });
  const ctx = picture.getContext("2d");
  ctx.fillStyle = colour("card");
  ctx.fillRect(0, 0, picture.width, picture.height);
  ctx.fillStyle = colour("ink");
  ctx.textBaseline = "top";
  ctx.font = `bold ${14 * ratio}px sans-serif`;
  ctx.fillText(title ?? "haploop", GAP * ratio, GAP * ratio);
  ctx.font = `${12 * ratio}px sans-serif`;
  let y = line + GAP * ratio;
  for (const part of parts) {
    ctx.fillText(part.text, GAP * ratio, y);
    let x = 0;
    for (const canvas of part.canvases) {
      ctx.drawImage(canvas, x, y + line);
      x += canvas.width + GAP * ratio;
    }
    y += high(part);
  }
  return new Promise((done) => picture.toBlob((blob) => done(save(blob, `haploop-${run}.png`))));
}

const wordsOf = (chart) => (chart.querySelector(".head, .line-name, figcaption")?.innerText ?? "").replaceAll(/\s+/g, " ");

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
