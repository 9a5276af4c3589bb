// The runs, live ones and those that were recorded. One is on show, another may be drawn over it.

import { plain } from "../drawing/amounts.js";
import { byId, make, put } from "../dom.js";
import { maySteer } from "../stream.js";

const WATCHING = "Watching only: whoever has the link that haploop view printed chooses the run, for all pages.";

export class RunChoice {
  /**
   * @param {import("../steering/steering.js").Steering} steering carries the choice, which holds for all pages of this viewer.
   * @param {import("../viewport.js").Viewport} viewport what is shown.
   */
  constructor(steering, viewport) {
    this.viewport = viewport;
    this.known = "";
    this.words = new Map();
    byId("run").addEventListener("change", () => this.choose(steering, "open", byId("run")));
    byId("open-other").addEventListener("click", () => this.choose(steering, "open", byId("open-other")));
    byId("overlay").addEventListener("change", () => this.choose(steering, "overlay", byId("overlay")));
  }

  async choose(steering, verb, select) {
    const { ok } = await steering.order(verb, { run: select.value });
    if (!ok) this.mark();
  }

  /** Follow what the viewer lists. */
  update(listing) {
    this.listing = listing;
    const { live, past, shown, title } = listing;
    // A run that has ended stays on show, though nobody can open it again by this name.
    const over = shown && ![...live, ...past].some(({ id }) => id === shown) ? [{ id: shown, title: title ?? shown, told: "ended" }] : [];
    const known = JSON.stringify([live, past, over]);
    if (known !== this.known) {
      this.known = known;
      this.words = new Map([...live, ...past, ...over].map((run) => [run.id, words(run)]));
      byId("run").replaceChildren(none(), group(`live (${live.length})`, live), group("recorded, in runs/", past), ...(over.length ? [group("on show", over)] : []));
      byId("overlay").replaceChildren(make("option", { value: "" }, "no other run"), ...past.map(option));
      byId("runs").hidden = live.length + past.length === 0;
    }
    this.mark();
  }

  /** The run that is drawn over the one on show: its name, its result, and whether its numbers leave room for others. */
  behind() {
    const { overlay, past = [], overlay_diverged: diverged } = this.listing ?? {};
    const { title = overlay, told } = past.find(({ id }) => id === overlay) ?? {};
    return { label: `over: ${title}`, fits: !diverged, told };
  }

  /** Say why nothing of the run drawn over is seen, if everything shown comes after its end. */
  tellUnseen() {
    const { overlay_end_s: end } = this.listing ?? {};
    const isSeen = end == null || end > this.viewport.shown[0];
    put(byId("unseen"), isSeen ? "" : `It ended at ${plain(end)} s, before what is shown: show all, or drag the strip back.`);
  }

  /** Show what is chosen, and whether it may be chosen here. */
  mark() {
    if (!this.listing) return;
    const { shown, overlay } = this.listing;
    if (document.activeElement !== byId("run")) byId("run").value = shown ?? "";
    if (document.activeElement !== byId("overlay")) byId("overlay").value = overlay ?? "";
    const others = this.listing.live.filter(({ id }) => id !== shown);
    byId("others").hidden = others.length === 0;
    put(byId("how-many"), others.length === 1 ? "1 other run is live" : `${others.length} other runs are live`);
    byId("open-other").value = others.at(-1)?.id ?? "";
    const { label, told } = this.behind();
    byId("behind").hidden = !overlay;
    put(byId("over"), [label, told].filter(Boolean).join(": "));
    this.tellUnseen();
    for (const control of [byId("run"), byId("overlay"), byId("open-other")]) {
      control.disabled = !maySteer();
      control.title = maySteer() ? (this.words.get(control.value) ?? "") : WATCHING;
    }
  }
}

/** What tells runs apart comes first, for a folder named by its time the time of day: the rest may be cut off. */
const option = (run) => make("option", { value: run.id, title: words(run) }, words(run, run.id.replace(/^(.*)-\d{8}-(\d{6}.*)$/, "…$2 $1")));

const words = ({ id, title, told }, name = id) => [title === id ? name : `${name}: ${title}`, told].filter(Boolean).join(", ");

const group = (label, runs) => make("optgroup", { label }, ...runs.map(option));

/** Shown while there is no run. */
const none = () => make("option", { value: "", hidden: "", disabled: "" }, "none on show");
