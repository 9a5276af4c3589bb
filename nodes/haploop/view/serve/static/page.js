// The page: what the server sends goes to the charts, tables and forms; what is done with them goes back to it.

import { Charts } from "./charts/charts.js";
import { byId, put, seldom } from "./dom.js";
import { showEvents } from "./words/events.js";
import { showHeader } from "./words/header.js";
import { listen } from "./keys.js";
import { Viewport } from "./viewport.js";
import { marksOf } from "./drawing/marks.js";
import { showNodes } from "./words/nodes.js";
import { onSchemeChange } from "./drawing/palette.js";
import { decode } from "./snapshot.js";
import { RunChoice } from "./words/runs.js";
import { saveData, savePicture } from "./save.js";
import { Scrubber } from "./scrubber.js";
import { Sound } from "./sound.js";
import { SetForm } from "./steering/set_form.js";
import { allow, obstacle, say, Steering } from "./steering/steering.js";
import { Stream } from "./stream.js";
import { showSummary } from "./words/summary.js";
import { SwapForm } from "./steering/swap_form.js";
import { TimeControls } from "./steering/time_controls.js";
import { ViewControls } from "./view_controls.js";

const TOLD_AT_ONCE = 2;
const TOLD_AFTER_MS = 50;

let state = { phase: "waiting", nodes: [] };
let connected = false;
let marks = [];
let snapshot = null;
let whole = {};
let drawn = 0;
let untold = 0;
let telling = 0;
let told = 0;
const waiting = [];

const phase = () => (connected ? state.phase : "lost");

const viewport = new Viewport(() => {
  stream.watch(viewport.request());
  view.update();
  charts.refit();
  redraw();
});
const charts = new Charts(viewport);
const stream = new Stream({ connected: onConnection, state: onState, events: onEvents, snapshot: onSnapshot, runs: onRuns });
const steering = new Steering(stream);
const time = new TimeControls(steering);
const view = new ViewControls(viewport);
const swapForm = new SwapForm(steering);
const setForm = new SetForm(steering);
const runs = new RunChoice(steering, viewport);
const scrubber = new Scrubber(viewport);
const sound = new Sound(viewport);
byId("save-picture").addEventListener("click", () => {
  charts.drawAll();
  queueMicrotask(() => savePicture(state)); // after the charts, which draw in microtasks of their own
});
byId("save-data").addEventListener("click", () => snapshot && saveData(snapshot, state));
// The address has to keep the token, so the jump is made here.
byId("to-forms").addEventListener("click", (event) => {
  event.preventDefault();
  byId("swap").scrollIntoView({ block: "center" });
});
byId("undo-do").addEventListener("click", () => steering.order("undo"));

function onConnection(isThere) {
  connected = isThere;
  showState();
}

function onState(now) {
  const isNew = now.run !== state.run;
  state = now;
  viewport.first_s = now.first_s ?? 0;
  viewport.last_s = now.control_rate ? now.tick / now.control_rate : 0;
  if (isNew) newRun();
  showSoon();
}

function newRun() {
  whole = {};
  viewport.live();
  charts.refit();
  swapForm.forget();
  say({ ok: true, text: "" }); // an answer belongs to the run before
}

function showState() {
  showHeader(state, phase());
  showNodes(state.nodes ?? []);
  showSummary(state);
  charts.panels.offer(state);
  time.update(state);
  const goesOn = Boolean(state.options) && !state.summary;
  byId("swap").hidden = byId("set").hidden = byId("to-forms").hidden = !goesOn;
  byId("undo").hidden = !goesOn || !marks.some(({ changes }) => changes);
  byId("nothing-yet").hidden = goesOn || Boolean(state.summary) || ["ended", "failed"].includes(phase());
  if (state.options) {
    swapForm.update(state.options);
    setForm.update(state.options, state);
  }
  allow(phase(), state.why, runs.listing);
  runs.mark();
  if (snapshot) scrubber.show(snapshot, marks); // the last tick comes after the last picture
  view.update(!["running", "paused"].includes(phase()));
}

const showSoon = seldom(showState); // with the texts of the charts, in one picture

function onRuns(listing) {
  runs.update(listing);
  showSoon();
}

function onEvents(events) {
  marks = marksOf(events);
  showEvents(events, viewport);
  for (const { kind, text } of events.slice(told)) if (kind === "restored") say({ ok: false, text, what: "Taken back" });
  told = events.length;
  redraw();
}

/** Every snapshot gets its own picture: the server sends no more than four that it does not know to be drawn. */
function onSnapshot(buffer) {
  if (waiting.push(buffer) === 1) requestAnimationFrame(draw);
}

function draw() {
  snapshot = decode(waiting.shift());
  if (snapshot.beside === false) snapshot = { ...whole, ...snapshot, tables: { ...whole.tables, ...snapshot.tables } };
  else whole = snapshot;
  document.body.toggleAttribute("data-blank", Object.keys(snapshot.tables).length === 0);
  clearTimeout(telling);
  if (++untold < TOLD_AT_ONCE) telling = setTimeout(tellDrawn, TOLD_AFTER_MS);
  else tellDrawn(); // the next ones are made meanwhile
  if (waiting.length) requestAnimationFrame(draw);
  drawn += 1;
  redraw();
}

/** Tells the server how many snapshots were drawn: of two at once, which is less work for it than of each. */
function tellDrawn() {
  stream.send({ type: "drawn", snapshots: untold });
  untold = 0;
}

function redraw() {
  if (!snapshot) return;
  charts.show(snapshot, state, marks, runs.behind());
  runs.tellUnseen();
  scrubber.show(snapshot, marks);
  sound.play(snapshot, state);
}

listen(time, view, () => obstacle(phase()) === "");
onSchemeChange(redraw);
addEventListener("hashchange", showState);
setInterval(() => {
  put(byId("rate"), String(drawn));
  drawn = 0;
}, 1000);
stream.watch(viewport.request());
view.update();
showEvents([], viewport);
showState();
