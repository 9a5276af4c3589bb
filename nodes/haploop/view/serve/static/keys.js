// The keyboard: one table of keys, which the help shows as well.

import { byId, make } from "./dom.js";

const TYPES = "input[type=text], select, textarea";
// These use space and arrows themselves.
const PRESSES = "button, input, select, textarea, summary, a, [tabindex]";
const OWN = new Set([" ", "ArrowLeft", "ArrowRight"]);

/** Listen to the keys, for the controls of time and view. */
export function listen(time, view, steerable) {
  const viewport = view.viewport;
  const keys = [
    [[" "], "Space", "pause or resume", () => time.toggle(), true],
    [[".", "1"], ". or 1", "step 1 tick", () => time.step(1), true],
    [["2"], "2", "step 10 ticks", () => time.step(10), true],
    [["3"], "3", "step 100 ticks", () => time.step(100), true],
    [["-"], "−", "pace 0.1×", () => time.pace("0.1"), true],
    [["="], "=", "pace 1×", () => time.pace("1"), true],
    [["+"], "+", "pace free", () => time.pace("free"), true],
    [["x"], "x", "stop the run (asks first)", () => time.askToStop(), true],
    [["s"], "s", "swap an element: go to the form", () => byId("swap-kind").focus(), true],
    [["e"], "e", "set a number: go to the form", () => document.querySelector("#set input")?.focus(), true],
    [["["], "[", "show a shorter time", () => viewport.widen(-1), false],
    [["]"], "]", "show a longer time", () => viewport.widen(1), false],
    [["f"], "f", "freeze, or go live", () => viewport.freeze(), false],
    [["ArrowLeft"], "←", "earlier", () => viewport.shift(-0.5), false],
    [["ArrowRight"], "→", "later", () => viewport.shift(0.5), false],
    [["?"], "?", "these keys", () => byId("keys").showModal(), false],
  ];
  for (const [, name, does] of keys) {
    byId("key-list").append(make("div", {}, make("dt", {}, make("kbd", {}, name)), make("dd", {}, does)));
  }
  byId("help").addEventListener("click", () => byId("keys").showModal());
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (event.target.matches(TYPES) || (OWN.has(event.key) && event.target.matches(PRESSES))) return;
    const found = keys.find(([names]) => names.includes(event.key));
    if (!found || (found[4] && !steerable())) return;
    event.preventDefault();
    found[3]();
  });
}
