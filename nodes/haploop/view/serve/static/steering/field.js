// One number or choice of a form: its name, unit and bounds, and whether what was typed can be used.

import { plain } from "../drawing/amounts.js";
import { make, put } from "../dom.js";

// Lengths and times are small: shown, and read, in thousandths of their SI unit.
const SHOWN_AS = { m: ["mm", 1e3], s: ["ms", 1e3] };
const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d{1,3})?$/i;
const WITH_UNIT = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d{1,3})?\s*[^\d\s.,+-].*$/i;
// How long an old number that comes after an order was accepted is not shown.
const HELD_MS = 2000;
const BOUNDS = [
  ["at_least", "at least", "≥", (value, bound) => value >= bound],
  ["above", "above", ">", (value, bound) => value > bound],
  ["at_most", "at most", "≤", (value, bound) => value <= bound],
  ["below", "below", "<", (value, bound) => value < bound],
];

/** A dotted name that may be broken after its dots and underscores. */
const breakable = (name) => name.split(/(?<=[._])/).flatMap((part, i) => (i ? [make("wbr"), part] : [part]));

export class Field {
  /**
   * @param {string} id of the input.
   * @param {string} name as the run calls the number.
   * @param {object} quantity unit (SI), and at_least, above, at_most, below: null where there is no such bound.
   */
  constructor(id, name, quantity) {
    this.name = name;
    this.quantity = quantity;
    [this.unit, this.factor] = SHOWN_AS[quantity.unit] ?? [quantity.unit, 1];
    this.choices = quantity.choices?.map((choice) => JSON.stringify(choice));
    this.input = this.choices
      ? make("select", { id }, ...this.choices.map((choice) => make("option", { value: choice }, String(JSON.parse(choice)))))
      : make("input", { id, type: "text", inputmode: "decimal", autocomplete: "off", spellcheck: "false" });
    this.input.setAttribute("aria-describedby", `${id}-unit ${id}-problem`);
    this.problem = make("span", { class: "problem", id: `${id}-problem`, role: "alert" });
    const unit = make("span", { class: "unit", id: `${id}-unit` }, [this.unit, this.bounds()].filter(Boolean).join(", "));
    const label = make("label", { for: id }, ...breakable(name));
    this.element = make("p", { class: "field" }, label, this.input, unit, this.problem);
    this.input.addEventListener("input", () => this.complain(this.complaint()));
    this.present = this.choices?.[0] ?? "";
    this.before = undefined;
    this.heldUntil = 0;
  }

  bounds() {
    return BOUNDS.filter(([key]) => this.quantity[key] != null)
      .map(([key, , sign]) => `${sign} ${plain(this.quantity[key] * this.factor)}`)
      .join(", ");
  }

  /** Take the present number, in SI; it is shown unless something else is being typed. */
  show(value) {
    if (performance.now() < this.heldUntil && value === this.before) return;
    const wasTouched = this.touched;
    this.before = value;
    if (this.choices) this.present = JSON.stringify(value ?? this.quantity.choices[0]);
    else this.present = value == null ? "" : plain(value * this.factor);
    if (!wasTouched && this.input.value !== this.present) this.input.value = this.present;
  }

  /** Whether the field holds something else than the present number. */
  get touched() {
    return this.input.value.trim() !== this.present;
  }

  /** What was typed was accepted: it stays until the run reports it, too, in its own words. */
  settle() {
    this.heldUntil = performance.now() + HELD_MS;
    this.present = this.input.value = this.text;
    this.complain("");
  }

  /** Go back to the present number. */
  reset() {
    this.input.value = this.present;
    this.complain("");
  }

  get text() {
    return this.input.value.trim().replaceAll("−", "-");
  }

  /** Why the content of the field cannot be used; "" when it can, as far as the page knows. */
  complaint() {
    const { text, unit } = this;
    if (this.choices) return "";
    if (!text) return "A number is needed.";
    if (/^[+-]?\d+,\d+/.test(text)) return `Write a point, not a comma: ${text.replace(",", ".")}`;
    if (!NUMBER.test(text)) {
      if (WITH_UNIT.test(text)) return ""; // the run knows all units
      return unit ? `It must be a number in ${unit}, or text with its unit such as "1 ${unit}".` : "It must be a number.";
    }
    if (!Number.isFinite(Number(text))) return "It must be a number that a float can hold.";
    const value = Number(text) / this.factor;
    const broken = BOUNDS.find(([key, , , holds]) => this.quantity[key] != null && !holds(value, this.quantity[key]));
    if (!broken) return "";
    const [key, words] = broken;
    return `${`It must be ${words} ${plain(this.quantity[key] * this.factor)} ${unit}`.trimEnd()}.`;
  }

  /** Show why it cannot be used, or that it can (""). */
  complain(problem) {
    put(this.problem, problem);
    if (problem) this.input.setAttribute("aria-invalid", "true");
    else this.input.removeAttribute("aria-invalid");
  }

  /** The content as the run takes it: a number in SI, or text with its unit, which the run converts exactly. */
  value() {
    if (this.choices) return JSON.parse(this.text);
    if (!NUMBER.test(this.text)) return this.text;
    return this.factor === 1 ? Number(this.text) : `${this.text} ${this.unit}`;
  }
}

/** Complain where needed; returns the first field that cannot be used, focused, or undefined. */
export function firstWrong(fields) {
  for (const field of fields) field.complain(field.complaint());
  const wrong = fields.find((field) => field.complaint());
  wrong?.input.focus();
  return wrong;
}

/** Show a refusal beside the field it names, or else in the form's own place. */
export function refuse(text, fields, place) {
  const words = text.match(/[\w.-]+/g) ?? [];
  const named = fields.find(({ name }) => words.some((word) => `.${word.replace(/\.$/, "")}`.endsWith(`.${name}`)));
  if (named) {
    named.complain(text);
    named.input.focus();
  } else put(place, text);
}
