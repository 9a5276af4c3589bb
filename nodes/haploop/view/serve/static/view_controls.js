// The controls of what is shown: span, freeze, earlier and later. They change nothing in the run.

import { byId, put } from "./dom.js";

const PART = 0.5;
const ALL = "all";

export class ViewControls {
  /** @param {import("./viewport.js").Viewport} viewport what they change. */
  constructor(viewport) {
    this.viewport = viewport;
    this.isOver = false;
    for (const radio of document.getElementsByName("span")) {
      radio.addEventListener("change", () => viewport.show(radio.value === ALL ? null : Number(radio.value)));
    }
    byId("freeze").addEventListener("click", () => viewport.freeze());
    byId("earlier").addEventListener("click", () => viewport.shift(-PART));
    byId("later").addEventListener("click", () => viewport.shift(PART));
  }

  /** Show the present view; from a run that is over, nothing more will come. */
  update(isOver = this.isOver) {
    this.isOver = isOver;
    const { span_s: span, frozen } = this.viewport;
    for (const radio of document.getElementsByName("span")) {
      radio.checked = radio.value === (span === null ? ALL : String(span));
    }
    byId("freeze").setAttribute("aria-pressed", String(frozen));
    put(byId("freeze"), !frozen ? "Freeze" : isOver ? "To its end" : "Go live");
    byId("earlier").disabled = span === null;
    byId("later").disabled = !frozen;
  }
}
