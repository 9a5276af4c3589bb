// What changed the run, each at its tick, the newest first; a click shows the moment in the charts.

import { byId, make } from "../dom.js";

const AROUND_S = 0.1;

/** List the events; `viewport` is told which moment to show. */
export function showEvents(events, viewport) {
  const items = events.toReversed().map(({ tick, t_s, text, kind }) => {
    const time = make("span", { class: "tick" }, `tick ${tick}`);
    const button = make("button", { type: "button", title: `${t_s} s: show this moment` }, time, ` ${text}`);
    button.addEventListener("click", () => viewport.at(t_s - AROUND_S, t_s + AROUND_S));
    return make("li", { "data-kind": kind }, button);
  });
  if (!items.length) items.push(make("li", { class: "nothing" }, "Nothing has been changed so far."));
  byId("events").replaceChildren(...items);
}
