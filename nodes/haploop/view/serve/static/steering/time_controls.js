// The controls of the run's time: pause and resume, step, pace, stop.

import { byId, put } from "../dom.js";

export class TimeControls {
  /** @param {import("./steering.js").Steering} steering carries the orders. */
  constructor(steering) {
    this.steering = steering;
    this.state = {};
    byId("pause").addEventListener("click", () => this.toggle());
    for (const button of document.querySelectorAll("[data-step]")) {
      button.addEventListener("click", () => this.step(Number(button.dataset.step)));
    }
    for (const radio of document.getElementsByName("pace")) {
      radio.addEventListener("change", () => this.pace(radio.value));
    }
    byId("stop").addEventListener("click", () => this.askToStop());
    byId("stopping").addEventListener("close", () => {
      if (byId("stopping").returnValue === "stop") this.steering.order("stop");
    });
  }

  /** Follow the run. */
  update(state) {
    this.state = state;
    put(byId("pause"), state.phase === "paused" ? "Resume" : "Pause");
    for (const radio of document.getElementsByName("pace")) radio.checked = radio.value === String(state.pace);
    if (state.phase !== "running" && state.phase !== "paused") byId("stopping").close();
  }

  toggle() {
    return this.steering.order(this.state.phase === "paused" ? "resume" : "pause");
  }

  step(ticks) {
    return this.steering.order("step", { ticks });
  }

  /** Continue at "free" or at this many simulated seconds per second; after a refusal the choice goes back to what it was. */
  async pace(value) {
    const answer = await this.steering.order("pace", { pace: value === "free" ? value : Number(value) });
    if (!answer.ok) this.update(this.state);
  }

  askToStop() {
    byId("stopping").returnValue = "";
    byId("stopping").showModal();
  }
}
