// The controls of what is shown: span, freeze, earlier and later. They change nothing in the run.

import { byId, put } from "./dom.js";

const PART = 0.5;
const ALL = "all";

export class ViewControls {
  /** @param {import("./look.js").Look} look what they change. */
  constructor(look) {
    this.look = look;
    for (const radio of document.getElementsByName("span")) {
      radio.addEventListener("change", () => look.show(radio.value === ALL ? null : Number(radio.value)));
    }
    byId("freeze").addEventListener("click", () => look.freeze());
    byId("earlier").addEventListener("click", () => look.shift(-PART));
    byId("later").addEventListener("click", () => look.shift(PART));
  }

  /** Show how it is looked now. */
  update() {
    const { span_s: span, frozen } = this.look;
    for (const radio of document.getElementsByName("span")) {
      radio.checked = radio.value === (span === null ? ALL : String(span));
    }
    byId("freeze").setAttribute("aria-pressed", String(frozen));
    put(byId("freeze"), frozen ? "Go live" : "Freeze");
    byId("earlier").disabled = span === null;
    byId("later").disabled = !frozen;
  }
}
