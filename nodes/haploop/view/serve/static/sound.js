// The buzz as sound: the force on the device, sample by sample, as loud as it is; off until it is asked for.

import { byId } from "./dom.js";
import { say } from "./steering/steering.js";

// A force of this size, in N, has full volume; a force that does not change is silent.
const FULL_N = 1;
const AHEAD_S = 0.08;

export class Sound {
  /** @param {import("./viewport.js").Viewport} viewport is told that the samples are wanted. */
  constructor(viewport) {
    this.viewport = viewport;
    this.heard_s = 0;
    this.next = 0;
    this.mean = 0;
    byId("sound").addEventListener("click", () => this.toggle());
  }

  toggle() {
    const on = !this.viewport.sound;
    this.context ??= new AudioContext();
    if (on) this.context.resume();
    else this.context.suspend();
    byId("sound").setAttribute("aria-pressed", String(on));
    this.viewport.listen(on);
    say({ ok: true, text: on ? "Sound is on: the force on the device, at the speed of the run." : "" });
  }

  /** Play what has come since the last time. */
  play({ tables: { sound } }, { phase, real_time_factor: factor }) {
    if (!this.viewport.sound || !sound || phase !== "running" || !(factor > 0.02)) return;
    const { t0_s: t0, dt_s: dt, columns: [{ values }] } = sound;
    const from = Math.max(0, Math.round((this.heard_s - t0) / dt));
    const isNew = this.heard_s < t0 || this.heard_s > t0 + values.length * dt;
    const samples = isNew ? values : values.subarray(from);
    this.heard_s = t0 + values.length * dt;
    if (samples.length < 2) return;
    const buffer = this.context.createBuffer(1, samples.length, Math.min(96_000, Math.max(8000, Math.round(1 / dt))));
    buffer.copyToChannel(this.swings(samples, dt), 0);
    const source = new AudioBufferSourceNode(this.context, { buffer, playbackRate: factor / (dt * buffer.sampleRate) });
    source.connect(this.context.destination);
    const now = this.context.currentTime;
    if (this.next < now || this.next > now + 4 * AHEAD_S) this.next = now + AHEAD_S;
    source.start(this.next);
    this.next += samples.length * dt / factor;
  }

  /** The samples about their running mean over 50 ms, between -1 and 1. */
  swings(samples, dt) {
    const follow = Math.min(1, dt / 0.05);
    return Float32Array.from(samples, (force) => {
      if (force - force !== 0) return 0;
      this.mean += follow * (force - this.mean);
      return Math.tanh((force - this.mean) / FULL_N);
    });
  }
}
