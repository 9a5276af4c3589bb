// Short functions for what every part of the page does to it.

/** The element with this id. */
export const byId = (id) => document.getElementById(id);

/** An element with attributes and children; text children stay text. */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** Sets an element's text, touching it only if that changes: screen readers and layout are not disturbed. */
export function put(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Shows a shape of index.html in the svg of an element, and a word beside it. */
export function sign(element, shape, word) {
  element.querySelector("use").setAttribute("href", `#${shape}`);
  put(element.querySelector("span"), word);
}

// What is due waits this long for the next picture, to be part of it: a separate picture costs the browser as much again.
const NEXT_PICTURE_MS = 50;

/** A beat: acts wrapped by it are done at most once in `gap_ms`, all in one picture, the last time with the last arguments. */
export function beat(gap_ms) {
  const waiting = new Map();
  let [due, timer] = [0, 0];
  const run = () => {
    if (!waiting.size) return;
    clearTimeout(timer);
    [due, timer] = [performance.now() + gap_ms, 0];
    const acts = [...waiting];
    waiting.clear();
    for (const [act, last] of acts) act(...last);
  };
  return (act) => (...now) => {
    waiting.set(act, now);
    const wait_ms = due - performance.now();
    if (wait_ms <= 0) queueMicrotask(run);
    else timer ||= setTimeout(run, wait_ms + NEXT_PICTURE_MS);
  };
}

/** The beat for texts: often enough for the eye, and one layout for all of them. */
export const seldom = beat(120);

/** Tells `turned` whether an element can be seen, whenever that changes: what cannot be seen need not be drawn. */
export function onSight(element, turned) {
  new IntersectionObserver((entries) => turned(entries.at(-1).isIntersecting), { rootMargin: "200px" }).observe(element);
}

/**
 * The size of a box in whole pixels, as the browser last reported it; calls `turned` after each report. Nothing else
 * measures the box: a size measured between two layouts would stay when the box is again as reported.
 */
export function boxOf(element, turned) {
  const box = { width: 0, height: 0 };
  new ResizeObserver(([{ contentRect: { width, height } }]) => {
    if (!width) return; // out of sight: it keeps its size
    Object.assign(box, { width: Math.floor(width), height: Math.floor(height) });
    turned();
  }).observe(element);
  return box;
}

/** Keeps the pixels of a canvas equal to those of its box; calls `again` after they have changed. No frame asks for the layout. */
export function fitCanvas(canvas, height_px, again) {
  new ResizeObserver(([{ contentRect }]) => {
    const [width, height] = [contentRect.width, height_px].map((px) => Math.round(px * devicePixelRatio));
    if (!width || (canvas.width === width && canvas.height === height)) return;
    Object.assign(canvas, { width, height });
    again();
  }).observe(canvas);
}
