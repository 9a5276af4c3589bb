// The form that swaps a dissipation element: which one, what it becomes, and that kind's parameters.

import { byId, make, put } from "../dom.js";
import { Field, firstWrong, refuse } from "./field.js";

const REMOVE = "none";
// After a swap the next one waits this long, or until the form has been changed.
const LOCKED_MS = 700;

export class SwapForm {
  /** @param {import("./steering.js").Steering} steering carries the order. */
  constructor(steering) {
    this.steering = steering;
    this.kinds = {};
    this.elements = [];
    this.known = "";
    this.fields = [];
    this.locked = 0;
    // What people have begun to choose stays while the run goes on; else the form follows the elements at work.
    this.isBegun = this.isKindChosen = false;
    byId("swap").addEventListener("input", () => {
      this.isBegun = true;
      if (this.locked) this.unlock();
    });
    byId("swap-element").addEventListener("change", () => this.takeElement());
    byId("swap-kind").addEventListener("change", () => {
      this.isKindChosen = true;
      this.takeKind();
    });
    byId("swap").addEventListener("submit", (event) => {
      event.preventDefault();
      this.swap();
    });
  }

  /** Follow the run: its kinds, and the elements at work. What is being typed stays. */
  update(options) {
    const known = JSON.stringify([options.kinds, options.elements]);
    if (known === this.known) return;
    const isFirst = this.known === "";
    Object.assign(this, { known, kinds: options.kinds, elements: options.elements });
    const names = this.elements.map(({ kind }, i) => [String(i), `${i}: ${kind}`]);
    choices("swap-element", [...names, [String(this.elements.length), `${this.elements.length}: add one`]]);
    this.offerKinds();
    if (isFirst) {
      // What was chosen for another run does not stay.
      for (const id of ["swap-element", "swap-kind", "swap-acts"]) byId(id).selectedIndex = 0;
      this.takeElement();
    }
    else if (!this.isBegun) this.takeElement();
    else if (!byId("swap-kind").value) this.takeKind();
  }

  get index() {
    return Number(byId("swap-element").value);
  }

  offerKinds() {
    const kinds = Object.keys(this.kinds).map((kind) => [kind, kind]);
    choices("swap-kind", this.index < this.elements.length ? [...kinds, [REMOVE, "none: remove it"]] : kinds);
  }

  /** Another element is chosen: start from what it is now, unless what it becomes was chosen before. */
  takeElement() {
    const chosen = byId("swap-kind").value;
    this.offerKinds();
    if (this.isKindChosen && byId("swap-kind").value === chosen) return;
    const element = this.elements[this.index];
    if (element && element.kind in this.kinds) byId("swap-kind").value = element.kind;
    if (element?.acts) byId("swap-acts").value = element.acts;
    this.takeKind(element);
  }

  /** Another kind is chosen: its parameters, with their defaults or those of `element`, become fields. */
  takeKind(element) {
    const kind = byId("swap-kind").value;
    const { about = "", parameters = {} } = this.kinds[kind] ?? {};
    put(byId("swap-about"), kind === REMOVE ? "The element is removed; those after it move up." : about);
    byId("swap-where").hidden = kind === REMOVE;
    this.fields = Object.entries(parameters).map(([name, quantity]) => {
      const field = new Field(`swap-${name}`, name, quantity);
      field.show((element?.kind === kind ? element[name] : null) ?? quantity.default);
      return field;
    });
    byId("swap-fields").replaceChildren(...this.fields.map(({ element: row }) => row));
    put(byId("swap-problem"), "");
  }

  /** Another run: nothing that was chosen for the last one stays. */
  forget() {
    this.known = "";
    this.isBegun = this.isKindChosen = false;
  }

  /** One order at a time: three clicks are one swap, however slowly they follow one another. */
  async swap() {
    if (byId("swap-do").disabled) return;
    put(byId("swap-problem"), "");
    const kind = byId("swap-kind").value;
    if (!kind || firstWrong(this.fields)) return;
    const values = Object.fromEntries(this.fields.map((field) => [field.name, field.value()]));
    const table = kind === REMOVE ? { kind } : { kind, acts: byId("swap-acts").value, ...values };
    byId("swap-do").disabled = true;
    const answer = await this.steering.order("swap", { swap: table, element: this.index }, { quiet: true });
    this.isBegun = !answer.ok;
    this.isKindChosen &&= !answer.ok;
    if (!answer.ok) refuse(answer.text, this.fields, byId("swap-problem"));
    this.locked = setTimeout(() => this.unlock(), answer.ok ? LOCKED_MS : 0);
  }

  unlock() {
    clearTimeout(this.locked);
    this.locked = 0;
    byId("swap-do").disabled = false;
  }
}

/** Offer these [value, text] pairs in a select; what was chosen stays chosen where it still can be. */
function choices(id, pairs) {
  const select = byId(id);
  const before = select.value;
  select.replaceChildren(...pairs.map(([value, text]) => make("option", { value }, text)));
  if (pairs.some(([value]) => value === before)) select.value = before;
}
