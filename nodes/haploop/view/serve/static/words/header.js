// The answer at a glance: the verdict, the state of the run and the numbers that tell how it goes.

import { amount, amountOf, fixed, isNumber, NONE, plain, power, steady } from "../drawing/amounts.js";
import { byId, put, sign } from "../dom.js";

const WORDS = { lost: "not connected" };
const VERDICTS = new Set(["steady", "limit-cycle", "growing", "diverged", "no-contact", "undecided"]);
// What is seen in the last half second says nothing about stability: that is judged when the run has ended. Its signs:
const SIGNS = {
  swinging: "limit-cycle", growing: "growing", "force ripples": "limit-cycle", "no contact": "no-contact",
  "not finite": "diverged",
};
const SWINGS = new Set(["swinging", "growing", "dying away"]);
/** Whether a swing is seen, or would be if that lasted. */
export const isSwinging = (sight) => SWINGS.has(sight?.word) || SWINGS.has(sight?.so_far_word);
const NOT_YET = { awaited: "being judged", unknown: "not known" };

/** The state of the verdict, in a word; where the picture still shows a swing, `steady` is that of the loop held still. */
export function told(state) {
  const { verdict, verdict_is: is, sight, phase } = state;
  if (isJudged(state)) return verdict === "steady" && moved(state) ? "steady if held" : verdict;
  return NOT_YET[is] ?? (sight?.so_far && phase === "ended" ? "too short" : sight?.word);
}

/** Whether there is a word that rests on more than what was seen. */
export const isJudged = ({ verdict, verdict_is: is }) => is === "judged" || verdict === "diverged";

/** Show a state; `phase` is its phase, or "lost" without a connection. */
export function showHeader(state, phase) {
  document.body.dataset.phase = phase;
  const sought = byId("phase");
  sought.dataset.phase = phase;
  sign(sought, `phase-${phase}`, WORDS[phase] ?? phase);
  put(byId("title"), state.title || "haploop");
  byId("title").title = state.title || "";
  put(document.querySelector("title"), state.title ? `${phase === "failed" ? phase : told(state) || phase}: ${state.title}` : "haploop");
  showVerdict(state);
  const { sight } = state;
  put(byId("oscillation"), amount(sight?.oscillation_m, "m"));
  put(byId("frequency"), sight ? frequency(sight) : NONE);
  put(byId("ripple"), amount(sight?.force_swing_N, "N"));
  put(byId("stiffness"), stiffness(state));
  put(byId("residual"), share(state));
  byId("residual").title = state.balance ?? "";
  put(byId("factor"), factor(state));
  byId("factor").title = lateness(state);
  put(byId("skipped"), isNumber(state.skipped_ticks) ? `${state.skipped_ticks} ticks` : NONE);
  showTime(state);
}

/** The frequency of the swing; none if that has stopped in the last half second. */
export const frequency = ({ oscillation_m: width, force_swing_N: force, frequency_Hz: hz }) => (width || force ? amount(hz, "Hz") : NONE);

function showVerdict(state) {
  const { sight, verdict_is: is } = state;
  const word = isJudged(state) ? state.verdict : is in NOT_YET ? "" : SIGNS[sight?.word];
  const known = VERDICTS.has(word) ? word : "none";
  const still = isJudged(state) ? moved(state) : "";
  const sought = byId("verdict");
  sought.dataset.verdict = known;
  const provisos = isJudged(state) ? (state.summary?.stability?.provisos ?? []) : [];
  sought.toggleAttribute("data-proviso", provisos.length > 0 || still !== "");
  sought.dataset.is = isJudged(state) ? "judged" : (is ?? "seen");
  sought.title = (isJudged(state) ? state.verdict_rule : sight?.why) ?? "";
  put(byId("seen"), isJudged(state) ? [...provisos, still].filter(Boolean).join(", ") : is in NOT_YET ? "" : seen(state));
  sign(sought, `verdict-${still && known === "steady" ? "limit-cycle" : known}`, told(state) || "no verdict");
}

/** What the picture still shows where a loop is judged steady, or cannot be judged. */
function moved({ verdict, sight }) {
  if (!["steady", "undecided"].includes(verdict) || !sight) return "";
  const { oscillation_m: width, ripple_N: ripple, rests } = sight;
  const word = sight.so_far_word || sight.word;
  if (rests && (word === "moving" || SWINGS.has(word))) return "";
  if (word === "force ripples") return `force still ripples by ${amount(ripple, "N")}`;
  if (word === "moving") return `still moves by ${amount(width, "m")}`;
  if (SWINGS.has(word)) return `still swings by ${amount(width, "m")}${word === "swinging" || sight.so_far ? "" : `, ${word}`}`;
  return word in SIGNS ? `last seen: ${word}` : "";
}

/** The time to which a word refers: how much of the half second that it needs has passed, or from when to when. */
function seen({ sight, hand_moves: handMoves }) {
  if (!sight) return "";
  const { from_s: from, to_s: to, so_far: soFar } = sight;
  if (soFar) return `so far: ${steady(to - from, 2)} of 0.5 s`;
  const mayBeIts = handMoves && (isSwinging(sight) || sight.word === "moving");
  return `in ${steady(from, 2)}–${steady(to, 2)} s${mayBeIts ? ", while its hand moves" : ""}`;
}

function stiffness({ displayed_stiffness_N_m: displayed, wall, sight, verdict }) {
  if (isSwinging(sight) || verdict === "diverged") return NONE; // force over depth of a swing is no stiffness
  const isSpring = isNumber(displayed) && wall?.into_wall && !wall.kind;
  return isSpring ? amountOf(displayed, wall.stiffness, "N/m") : amount(displayed, "N/m");
}

function share({ residual_J: residual, moved_J: moved }) {
  return isNumber(residual) && moved > 0 ? power(Math.abs(residual) / moved) : NONE;
}

function factor({ real_time_factor: now, pace, summary, was_paused: paused, lateness: late }) {
  if (late?.clock === "plant" && late.ticks) return `${fixed((100 * late.late_ticks) / late.ticks, 2)} % late`;
  const real = summary?.real_time_factor ?? now;
  if (!isNumber(real)) return NONE;
  if (summary && paused) return `${fixed(real)}×, with pauses`;
  return isNumber(pace) && pace !== 1 && !summary ? `${Math.round((100 * real) / pace)} % of ${plain(pace)}×` : `${fixed(real)}×`;
}

function lateness({ lateness: late }) {
  if (!late?.ticks) return "";
  const [half, most, all] = [late.median_s, late.percent_99_s, late.most_s].map((seconds) => amount(seconds, "s"));
  const what = late.clock === "plant" ? "answers came" : "ticks were late by";
  return `${what} ${half} (median), ${most} (99 %), ${all} at most; ${late.late_ticks} of ${late.ticks} too late`;
}

function showTime({ tick, end_tick: end, control_rate: rate }) {
  const known = isNumber(tick) && isNumber(rate) && rate > 0;
  put(byId("time"), known ? `${steady(tick / rate, 3)} of ${plainSeconds(end / rate)} s` : NONE);
  byId("time").title = known ? `tick ${tick} of ${end}` : "";
  byId("progress").value = known && end > 0 ? tick / end : 0;
}

const plainSeconds = (seconds) => (isNumber(seconds) ? String(Number(seconds.toPrecision(6))) : NONE);
