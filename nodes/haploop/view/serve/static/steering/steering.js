// Who may steer, and how an order goes to the run and its answer comes back.

import { byId, put } from "../dom.js";
import { maySteer } from "../stream.js";

const WATCHING = "Watching only: open the link that haploop view printed to steer.";
const REASONS = {
  lost: "No connection to haploop view; trying again.",
  waiting: "Waiting for a run: start one with haploop run SCENE.",
  ended: "The run has ended.",
  failed: "The run has failed.",
};

/** Why nothing can be steered now; "" when it can. */
export const obstacle = (phase) => REASONS[phase] ?? (maySteer() ? "" : WATCHING);

/**
 * Enable or disable all that steers, and say why; `stays`: whether the page stays with a run that has ended, `missed`: a
 * sentence on a run that could not be shown.
 */
export function allow(phase, why, { stays = false, missed = "" } = {}) {
  const reason = obstacle(phase);
  for (const fieldset of document.querySelectorAll("fieldset[data-steers]")) fieldset.disabled = reason !== "";
  const told = { waiting: "", ended: stays ? reason : `${reason} A run that is started now will appear here.` }[phase] ?? reason; // the middle of the page says that it waits
  const because = why && why[0].toUpperCase() + why.slice(1).replace(/[^.]$/, "$&.");
  put(byId("notice"), [told, because, missed !== why && missed].filter(Boolean).join(" "));
}

export class Steering {
  /** @param {import("../stream.js").Stream} stream carries the orders. */
  constructor(stream) {
    this.stream = stream;
  }

  /** Give an order; returns the answer {ok, text}, which is also shown on the page unless `quiet` and refused. */
  async order(verb, args = {}, { quiet = false } = {}) {
    const answer = await this.stream.command(verb, args);
    if (answer.ok || !quiet) say(answer);
    else say({ ok: true, text: "" });
    return answer;
  }
}

// How long a result floats where the thumb is, on a narrow screen.
const NEW_MS = 6000;
let fades = null;

/** Show the result of an order. */
export function say({ ok, text, what = "Refused" }) {
  const said = byId("said");
  said.dataset.ok = String(ok);
  said.setAttribute("role", ok ? "status" : "alert");
  // The page has a button for what the text says about going back in a terminal.
  const told = text.replace(/; to go back: .*$/m, "").replace(/([^.])\n/g, "$1. ");
  put(said, ok ? told : `${what}: ${text}`);
  said.toggleAttribute("data-new", Boolean(text));
  clearTimeout(fades);
  fades = setTimeout(() => said.removeAttribute("data-new"), NEW_MS);
}
