// The form that sets numbers of the running loop: the wall, the delay, the gains of the elements.

import { byId, put } from "../dom.js";
import { Field, firstWrong, refuse } from "./field.js";
import { Slider } from "./slider.js";

const STIFFNESS = "wall.stiffness";

export class SetForm {
  /** @param {import("./steering.js").Steering} steering carries the order. */
  constructor(steering) {
    this.steering = steering;
    this.fields = [];
    this.sliders = [];
    this.known = "";
    const form = byId("set");
    form.addEventListener("input", () => this.note());
    form.addEventListener("reset", (event) => {
      event.preventDefault();
      this.reset();
    });
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.set();
    });
  }

  /** Follow the run: the keys that can be set and their present values. What is being typed stays. */
  update({ settable }, { limit_N_m, no_limit } = {}) {
    const known = JSON.stringify(Object.entries(settable).map(([key, { value, ...quantity }]) => [key, quantity]));
    if (known !== this.known) {
      this.known = known;
      this.rebuild(settable);
    }
    for (const field of this.fields) field.show(settable[field.name].value);
    for (const slider of this.sliders) {
      const limit = slider.field.name === STIFFNESS ? [limit_N_m ?? null, no_limit] : [];
      slider.show(settable[slider.field.name].value, ...limit);
    }
    this.note();
  }

  rebuild(settable) {
    const typed = new Map(this.changed().map((field) => [field.name, field.input.value]));
    const focused = this.fields.find(({ input }) => input === document.activeElement)?.name;
    this.fields = Object.entries(settable).map(([key, quantity]) => new Field(`set-${key}`, key, quantity));
    this.sliders = this.fields.filter(({ quantity, choices }) => quantity.unit !== "s" && !choices).map((field) => new Slider(field, () => this.set()));
    byId("set-fields").replaceChildren(...this.fields.map(({ element }) => element));
    for (const field of this.fields) {
      field.show(settable[field.name].value);
      if (typed.has(field.name)) field.input.value = typed.get(field.name);
      if (field.name === focused) field.input.focus();
    }
  }

  changed() {
    return this.fields.filter((field) => field.touched);
  }

  /** Mark what was changed, and allow setting it. */
  note() {
    for (const { element, touched } of this.fields) element.classList.toggle("changed", touched);
    byId("set-do").disabled = byId("set-reset").disabled = this.changed().length === 0;
  }

  reset() {
    for (const field of this.fields) field.reset();
    put(byId("set-problem"), "");
    this.note();
  }

  async set() {
    put(byId("set-problem"), "");
    const changed = this.changed();
    if (!changed.length || firstWrong(changed)) return;
    const values = Object.fromEntries(changed.map((field) => [field.name, field.value()]));
    const answer = await this.steering.order("set", { set: values }, { quiet: true });
    if (!answer.ok) refuse(answer.text, changed, byId("set-problem"));
    else for (const field of changed) field.settle();
    this.note();
  }
}
