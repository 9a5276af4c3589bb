// The page: what the server tells goes to the charts, tables and forms; what is done with them goes back to it.

import { Charts } from "./charts.js";
import { byId, put } from "./dom.js";
import { showEvents } from "./events.js";
import { showHeader } from "./header.js";
import { listen } from "./keys.js";
import { Look } from "./look.js";
import { marksOf } from "./marks.js";
import { showNodes } from "./nodes.js";
import { onSchemeChange } from "./palette.js";
import { decode } from "./picture.js";
import { SetForm } from "./set_form.js";
import { allow, obstacle, Steering } from "./steering.js";
import { Stream } from "./stream.js";
import { showSummary } from "./summary.js";
import { SwapForm } from "./swap_form.js";
import { TimeControls } from "./time_controls.js";
import { ViewControls } from "./view_controls.js";

let state = { phase: "waiting", nodes: [] };
let connected = false;
let marks = [];
let newest = null;
let picture = null;
let drawn = 0;

const phase = () => (connected ? state.phase : "lost");

const look = new Look(() => {
  stream.watch(look.wish());
  view.update();
  charts.refit();
});
const charts = new Charts(look);
const stream = new Stream({ connected: onConnection, state: onState, events: onEvents, picture: onPicture });
const steering = new Steering(stream);
const time = new TimeControls(steering);
const view = new ViewControls(look);
const swapForm = new SwapForm(steering);
const setForm = new SetForm(steering);

function onConnection(isThere) {
  connected = isThere;
  showState();
}

function onState(now) {
  const isNew = now.run !== state.run;
  state = now;
  look.first_s = now.first_s ?? 0;
  look.last_s = now.control_rate ? now.tick / now.control_rate : 0;
  if (isNew) newRun();
  showState();
}

function newRun() {
  look.live();
  charts.refit();
}

function showState() {
  showHeader(state, phase());
  showNodes(state.nodes ?? []);
  showSummary(state.summary, state.out);
  time.update(state);
  const goesOn = Boolean(state.options) && !state.summary;
  byId("swap").hidden = byId("set").hidden = !goesOn;
  byId("nothing-yet").hidden = goesOn || Boolean(state.summary);
  if (state.options) {
    swapForm.update(state.options);
    setForm.update(state.options);
  }
  allow(phase(), state.why);
}

function onEvents(events) {
  marks = marksOf(events);
  showEvents(events, look);
  redraw();
}

/** Only the newest picture is ever drawn; one that came too early for the screen is forgotten. */
function onPicture(buffer) {
  if (!newest) requestAnimationFrame(draw);
  newest = buffer;
}

function draw() {
  picture = decode(newest);
  newest = null;
  drawn += 1;
  redraw();
}

function redraw() {
  if (picture) charts.show(picture, state, marks);
}

listen(time, view, () => obstacle(phase()) === "");
onSchemeChange(redraw);
addEventListener("hashchange", showState);
setInterval(() => {
  put(byId("rate"), String(drawn));
  drawn = 0;
}, 1000);
stream.watch(look.wish());
view.update();
showEvents([], look);
showState();
