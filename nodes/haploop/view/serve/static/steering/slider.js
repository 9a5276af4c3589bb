// A slider beside a number above zero: from a tenth to ten times of it, the part beyond the loop's limit shaded.

import { amount, plain } from "../drawing/amounts.js";
import { make, put } from "../dom.js";

const STEPS = 200;
const DIGITS = 3;
// The choice is made when no key has come for this long.
const KEYS_MS = 400;

export class Slider {
  /**
   * @param {import("./field.js").Field} field whose number it moves.
   * @param {() => void} released called when a new number has been chosen.
   */
  constructor(field, released) {
    this.field = field;
    this.centre = 0;
    this.byKey = false;
    this.limit = null;
    this.input = make("input", { type: "range", min: String(-STEPS), max: String(STEPS), "aria-label": `${field.name}, coarse` });
    this.input.addEventListener("input", () => {
      field.input.value = plain(Number((this.centre * field.factor * 10 ** (Number(this.input.value) / STEPS)).toPrecision(DIGITS)));
      field.input.dispatchEvent(new Event("input", { bubbles: true }));
    });
    // A key that is held down is one choice, not one for each step.
    let waiting = null;
    const settle = (after_ms) => {
      clearTimeout(waiting);
      waiting = setTimeout(released, after_ms);
    };
    this.input.addEventListener("keydown", () => (this.byKey = true));
    this.input.addEventListener("pointerdown", () => (this.byKey = false));
    this.input.addEventListener("change", () => (this.byKey ? settle(KEYS_MS) : settle(0)));
    this.why = make("span", { class: "unit" });
    field.element.append(this.input, this.why);
  }

  /** Show the present number and its limit, in SI, or why none is known; no slider for a number that is not above zero. */
  show(value, limit = null, why = "") {
    this.input.hidden = !(value > 0);
    if (this.input.hidden) return put(this.why, "");
    if (!this.field.touched && (this.centre === 0 || Math.abs(Math.log10(value / this.centre)) > 0.7)) this.centre = value;
    if (!this.field.touched && document.activeElement !== this.input) this.input.value = String(Math.round(STEPS * Math.log10(value / this.centre)));
    put(this.why, limit ? this.told(limit) : why ? `no limit is shaded: ${why}` : "");
    if (limit === this.limit && this.shadedFor === this.centre) return;
    Object.assign(this, { limit, shadedFor: this.centre });
    const share = limit ? 50 + 50 * Math.log10(limit / this.centre) : 100;
    this.input.style.setProperty("--safe", `${Math.min(100, Math.max(0, share))}%`);
    this.input.title = limit ? `Beyond ${amount(limit, this.field.quantity.unit)} the loop as it is now, without friction, quantisation and noise, is unstable.` : "";
  }

  /** Where the limit is, in words: a finger cannot hover. */
  told(limit) {
    const isOff = Math.log10(limit / this.centre) >= 1;
    return `${isOff ? "not on this scale" : "shaded"}: above ${amount(limit, this.field.quantity.unit)} unstable if friction, quantisation and noise are left out`;
  }
}
