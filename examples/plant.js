// A plant in Node.js: device and hand as one mass on a spring with dampers, stepped by Runge and Kutta's method of
// order 4.
//
//   haploop run fig6b.toml --node plant="node examples/plant.js"
//
// Takes a hand's force of kind constant or ramp and a quantised position; a scene that asks for more ends the run.
"use strict";
const zmq = require("zeromq");
const { take_seat, frame, floats, read, column } = require("./seat.js");

const KNOWN = [
  "title",
  "duration",
  "seed",
  "diverged_beyond",
  "clock",
  "device",
  "hand",
  "encoder",
  "wall",
  "dissipation",
  "velocity",
  "acceleration",
  "event",
  "run",
];
const DELAY = "clock.round_trip_delay";

class Motion {
  constructor({ device, hand }, h) {
    const { mass = 0, damping = 0, stiffness = 0, rest = 0, force } = hand ?? {};
    if (force && !["constant", "ramp"].includes(force.kind))
      throw new Error(`This plant does not support a hand force of kind ${force.kind}.`);
    this.h = h;
    [this.x, this.v] = [device.position, device.velocity];
    const push = (t) => (force ? force.value * (force.kind === "ramp" ? Math.min(t / force.rise_time, 1) : 1) : 0);
    this.rate = (x, v, t, f) =>
      (f + push(t) + stiffness * (rest - x) - (device.damping + damping) * v) / (device.mass + mass);
  }

  // Goes on by one plant step under a force that is held.
  step(number, f) {
    const { x, v, h } = this,
      t = number * h;
    const a1 = this.rate(x, v, t, f);
    const [v2, a2] = [v + (h / 2) * a1, this.rate(x + (h / 2) * v, v + (h / 2) * a1, t + h / 2, f)];
    const [v3, a3] = [v + (h / 2) * a2, this.rate(x + (h / 2) * v2, v + (h / 2) * a2, t + h / 2, f)];
    const [v4, a4] = [v + h * a3, this.rate(x + h * v3, v + h * a3, t + h, f)];
    this.x = x + (h / 6) * (v + 2 * v2 + 2 * v3 + v4);
    this.v = v + (h / 6) * (a1 + 2 * a2 + 2 * a3 + a4);
  }
}

// To whole counts; halves go to the even one, as IEEE 754 rounds.
function encoded(x, { resolution, rounding } = {}) {
  if (!resolution) return x;
  const counts = x / resolution,
    down = Math.floor(counts),
    half = counts - down;
  if (rounding === "floor") return resolution * down;
  return resolution * (half < 0.5 || (half === 0.5 && down % 2 === 0) ? down : down + 1);
}

take_seat("plant", async (seat) => {
  const loop = new zmq.Router({ mandatory: true, maxMessageSize: 4 * 1024 * 1024 });
  const binds = { loop: await seat.bind(loop, "loop") };
  await seat.join(binds, { name: "plant.js", version: "1" });
  const { scene, timebase: time } = seat,
    n = time.plant_rate / time.control_rate;
  const strange = Object.keys(scene).find((key) => !KNOWN.includes(key) && scene[key] != null);
  if (strange || scene.acceleration?.source)
    throw new Error(`This plant does not support ${strange ?? "an accelerometer"}.`);
  const motion = new Motion(scene, 1 / time.plant_rate);
  let rows = [],
    force = 0,
    command = -1,
    delay = time.delay_steps;
  const coming = []; // commands on their way: [step from which on, force, tick]
  seat.tick = 0;
  seat.state = () => [seat.tick, { tick: seat.tick, x: motion.x, v: motion.v, force, command }];
  seat.cut = () => {
    const ticks = rows.length / n;
    if (!ticks) return;
    const all = [...rows, [motion.x, motion.v, 0, force, command]]; // a block ends with the state that the next begins with
    const columns = Object.fromEntries(
      ["x", "v", "x_low", "force", "command"].map((name, i) => [name, column(all, i)]),
    );
    seat.publish("PLANT_BLOCK", seat.tick - ticks, ticks, columns);
    seat.tell("PROGRESS", seat.tick, {});
    rows = [];
  };

  let partner;
  const say = async (data) => {
    try {
      await loop.send([partner, data]);
    } catch (error) {
      if (error.code !== "EHOSTUNREACH") throw error; // the controller has gone, which the clock sees and tells
    }
  };
  const hear = async () => {
    for (;;) {
      const [sender, ...frames] = await loop.receive();
      if (partner ? sender.equals(partner) : is_hello(frames.at(-1), seat.start.secret))
        return [sender, read(frames.at(-1))];
    }
  };
  seat.awaits = "controller";
  [partner] = await hear();
  await say(frame("HELLO", seat.start.secret));
  seat.awaits = "logger";
  await seat.news(() => seat.answered);
  seat.tell("READY", 0);
  seat.awaits = "clock";
  let reason = "";
  while (!reason) {
    if (seat.tick >= seat.until) seat.tell("PROGRESS", seat.tick, {}); // a pace waits for it, not for the block
    await seat.news(() => seat.until > seat.tick || seat.last);
    if (seat.tick >= seat.until) break;
    const tick = seat.tick;
    for (let due; (due = seat.due(tick));)
      if (due[1].set?.[DELAY] !== undefined) delay = Math.round(due[1].set[DELAY] * time.plant_rate);
    await say(floats("SAMPLES", tick, [[encoded(motion.x, scene.encoder)]]));
    seat.awaits = "controller";
    const [, [name, from, forces]] = await hear();
    seat.awaits = "clock";
    if (name !== "COMMANDS" || from !== tick || forces?.length !== 1)
      throw new Error(`A command of tick ${tick} was expected, but ${name} of tick ${from} came.`);
    if (!Number.isFinite(forces[0]))
      reason = `command ${tick} was ${forces[0]}, which no device can apply, at tick ${tick}`;
    coming.push([tick * n + delay, forces[0], tick]);
    for (let step = tick * n; !reason && step < (tick + 1) * n; step++) {
      for (const [from, f, of] of coming) if (from <= step && of > command) [force, command] = [f, of];
      while (coming.length && coming[0][2] <= command) coming.shift();
      rows.push([motion.x, motion.v, 0, force, command]);
      motion.step(step, force);
    }
    if (reason) break;
    seat.tick++;
    if (!(Math.abs(motion.x) <= scene.diverged_beyond))
      reason = `the device was at ${motion.x} m, beyond the limit of ${scene.diverged_beyond} m, at tick ${seat.tick}`;
    if (rows.length >= n * scene.run.block_ticks) seat.flush();
  }
  await say(frame("LAST", seat.tick));
  seat.cut();
  if (reason) seat.tell("ENDED", seat.tick, reason);
  await seat.publish("END", seat.tick, reason, null);
  loop.close();
});

function is_hello(data, secret) {
  try {
    const [name, said] = read(data);
    return name === "HELLO" && said === secret;
  } catch {
    return false;
  }
}
