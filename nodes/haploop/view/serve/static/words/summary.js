// The result of a run that has ended: the figures and books of its summary.json.

import { amount, amounts, fixed, isNumber, NONE, programName } from "../drawing/amounts.js";
import { byId, make } from "../dom.js";
import { isJudged, told } from "./header.js";

const CAUSES = { sampling_and_hold_J: "sampling and hold", quantisation_J: "quantisation", delay_J: "delay" };
const HOW = { done: "to its end", stopped: "stopped early", diverged: "ended by divergence", failed: "failed" };

/** Show the summary of a state and where it lies; hidden while there is none. */
export function showSummary(state) {
  const { summary, out } = state;
  const panel = byId("summary");
  panel.hidden = !summary;
  const known = summary ? `${summary.trajectory_sha256} ${out} ${state.verdict_is} ${told(state)}` : "";
  if (!summary || panel.dataset.known === known) return;
  panel.dataset.known = known;
  panel.replaceChildren(
    make("h2", { id: "summary-title" }, `${summary.ended === "failed" ? "Failed" : "Ended"}: ${told(state) ?? NONE}`),
    make("p", { class: "about" }, (isJudged(state) ? summary.verdict_rule : state.sight?.why) ?? ""),
    make("p", { id: "cause" }, state.cause ?? ""),
    make("p", { class: "balance" }, summary.energy?.balance ?? ""),
    rows({ ...pushed(summary.stability ?? {}), ...figures(summary, state.was_paused), ...foreign(summary.programs) }),
    books(summary.energy ?? {}),
    make("p", { class: "about" }, "In ", make("code", {}, out)),
  );
}

/** What the loop did when it was held still and pushed; nothing if it was not watched until there was an answer. */
function pushed({ rate_1_s: rate, error_1_s: error, ...found }) {
  if (!isNumber(rate)) return {};
  const how = [found.frequency_Hz && `at ${amount(found.frequency_Hz, "Hz")}`, found.felt ? "felt" : "not felt"];
  return {
    "pushed, it swings":
      found.width_m < 1e-9 ? "less than 1 nm" : `${amount(found.width_m, "m")} ± ${amount(found.spread_m, "m", 2)}`,
    "that is": [...how, found.chaotic && "chaotic"].filter(Boolean).join(", "),
    "pushed, it ripples": `${amount(found.force_ripple_N, "N")} above about 30 Hz, commanded`,
    ...(found.width_m < 1e-9 ? {} : { growth: `${fixed(rate)} ± ${fixed(error, 2)} 1/s` }),
    ...(isNumber(found.settles_s) ? { "settles within": `${amount(found.settles_s, "s")}, to 5 %` } : {}),
    ...(found.blown ? { [`after a blow of ${amount(found.blow_N, "N")}`]: found.blown } : {}),
    ...(found.deeper ? { [`held ${amount(found.deeper_N, "N")} harder`]: found.deeper } : {}),
    ...(found.frictionless ? { "without its friction": found.frictionless } : {}),
    ...(isNumber(found.own_share) ? { "its share of the run's swing": share(found.own_share) } : {}),
  };
}

const share = (own) => (own < 0.01 ? "less than 1 %" : `${Math.round(100 * own)} %`);

function figures({ duration_s, ended, extremes = {}, window = {}, real_time_factor: factor, lost = {} }, wasPaused) {
  const last = `last ${amount(duration_s - window.from_s, "s", 2)}`;
  return {
    ran: `${isNumber(duration_s) ? fixed(duration_s, 4) : NONE} s, ${HOW[ended] ?? ended}`,
    "position from": amounts(extremes.x_min_m, extremes.x_max_m, "m"),
    // As the summary has them: the position with its trend, the force of the command; the figures above the charts differ.
    ...(isNumber(window.oscillation_m) ? { [`oscillation, ${last}`]: `${amount(window.oscillation_m, "m")} p-p` } : {}),
    ...(isNumber(window.force_swing_N) ? { "commanded force": `${amount(window.force_swing_N, "N")} p-p` } : {}),
    // The ripple of the run itself: it includes noise and the hand, which the pushed copies do not have.
    ...(isNumber(window.force_ripple_N) ? { "its own ripple": `${amount(window.force_ripple_N, "N")} above about 30 Hz, commanded` } : {}),
    "largest force": amount(extremes.force_max_N, "N"),
    "real time": isNumber(factor) ? `${fixed(factor)}×${wasPaused ? ", pauses included" : ""}` : NONE,
    "commands lost, dropped": `${lost.commands_lost ?? 0}, ${lost.commands_dropped ?? 0}`,
  };
}

/** Plant and controller where they are not haploop's own. */
function foreign(programs = {}) {
  const strangers = Object.entries(programs).filter(([, program]) => !program.own);
  return Object.fromEntries(strangers.map(([role, program]) => [`${role} not haploop's own`, programName(program)]));
}

function rows(texts) {
  const entries = Object.entries(texts).map(([name, text]) => make("div", {}, make("dt", {}, name), make("dd", {}, text)));
  return make("dl", { class: "rows" }, ...entries);
}

/** Every book with what it took as sampled and in truth. */
function books({ wall = {}, elements = [], actuator_J: kept, moved_J: moved, residual_J: residual, unmodelled_work_J: unmodelled }) {
  const head = ["book", "sampled", "true"].map((text) => make("th", { scope: "col" }, text));
  const rows = [["wall", wall.sampled_J, wall.true_J]];
  for (const [key, words] of Object.entries(CAUSES)) {
    const estimates = key === "quantisation_J" && isNumber(wall.dissipated_J) ? " and estimates" : "";
    if (wall.leak) rows.push([`leak by ${words}${estimates}`, undefined, wall.leak[key]]);
  }
  if (isNumber(wall.dissipated_J)) rows.push(["taken by the law of the wall", undefined, wall.dissipated_J]);
  if (wall.changes_J) rows.push(["changes of the wall in contact", undefined, -wall.changes_J]);
  for (const { kind, from_tick: from, to_tick: to, sampled_J, true_J } of elements) {
    rows.push([`${kind}, ticks ${from} to ${to}`, sampled_J, true_J]);
  }
  if (kept) rows.push(["kept back by the actuator's limits", undefined, kept]); // the books above are of commanded forces
  const left = isNumber(unmodelled) ? ["hand, as the remainder", undefined, unmodelled] : ["residual", undefined, residual];
  rows.push(["moved in total", undefined, moved], left);
  const cell = (value) => make("td", {}, value === undefined ? "" : amount(value, "J"));
  const body = rows.map(([name, ...numbers]) => make("tr", {}, make("th", { scope: "row" }, name), ...numbers.map(cell)));
  return make("table", {}, make("thead", {}, make("tr", {}, ...head)), make("tbody", {}, ...body));
}
