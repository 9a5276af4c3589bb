// The runs there are: live ones and those that were recorded. One is on show, another may be drawn behind it.

import { byId, make, put } from "./dom.js";

export class RunChoice {
  /** @param {import("./steering.js").Steering} steering carries the choice: it is that of all pages of this viewer. */
  constructor(steering) {
    this.known = "";
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
    // One that has ended stays on show, though nobody can open it again by this name.
    const over = shown && ![...live, ...past].some(({ id }) => id === shown) ? [{ id: shown, title: title ?? shown, told: "ended" }] : [];
    const known = JSON.stringify([live, past, over]);
    if (known !== this.known) {
      this.known = known;
      byId("run").replaceChildren(group(`live (${live.length})`, live), group("recorded, in runs/", past), ...(over.length ? [group("on show", over)] : []));
      byId("overlay").replaceChildren(make("option", { value: "" }, "no other run"), ...past.map(option));
      byId("runs").hidden = live.length + past.length === 0;
    }
    this.mark();
  }

  /** The run that is drawn over the one on show: its name, what came of it, and whether its numbers leave room for others. */
  behind() {
    const { overlay, past = [], overlay_diverged: diverged } = this.listing ?? {};
    const { title = overlay, told } = past.find(({ id }) => id === overlay) ?? {};
    return { label: `over: ${title}`, fits: !diverged, told };
  }

  mark() {
    const { shown, overlay } = this.listing;
    if (document.activeElement !== byId("run")) byId("run").value = shown ?? "";
    if (document.activeElement !== byId("overlay")) byId("overlay").value = overlay ?? "";
    const others = this.listing.live.filter(({ id }) => id !== shown);
    byId("others").hidden = others.length === 0;
    put(byId("how-many"), others.length === 1 ? "1 other run is live" : `${others.length} other runs are live`);
    byId("open-other").value = others.at(-1)?.id ?? "";
    byId("open-other").title = others.at(-1)?.title ?? "";
    const { label, told } = this.behind();
    byId("behind").hidden = !overlay;
    put(byId("behind"), [label, told].filter(Boolean).join(": "));
  }
}

/** The name comes first: what follows it may be cut off. */
const option = ({ id, title, told }) => {
  const words = [title, told].filter(Boolean).join(", ");
  return make("option", { value: id, title: words }, title === id ? words : `${words} (${id})`);
};

const group = (label, runs) => make("optgroup", { label }, ...runs.map(option));
