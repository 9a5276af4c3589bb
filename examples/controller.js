// A controller in Node.js: a spring wall and one element of the kind "damping", to the bits of haploop's own.
//
//   haploop run fig6b.toml --node controller="node examples/controller.js"
//
// A `set` of wall or damping is carried out, a swap is refused; a scene that asks for another law ends the run.
"use strict";
const zmq = require("zeromq");
const { take_seat, frame, floats, read, column } = require("./seat.js");

const COLUMNS = ["x", "v", "a", "wall", "dissipation.0", "total", "in_contact"];
// The last is the plant's to do.
const CAN_SET = ["wall.stiffness", "wall.position", "dissipation.0.damping", "clock.round_trip_delay"];

class Law {
  constructor({ wall, dissipation: [element, ...others] = [], velocity, acceleration }, rate) {
    const isSpring = wall && (wall.kind ?? "spring") === "spring";
    if (!isSpring || element?.kind !== "damping" || others.length || velocity || acceleration)
      throw new Error(
        "This controller is a spring wall with one damping and plain differences, but the scene needs something else.",
      );
    this.wall = { position: wall.position, stiffness: wall.stiffness, into_wall: wall.occupies === "below" ? -1 : 1 };
    this.element = {
      book: 0,
      kind: "damping",
      parameters: { damping: element.damping, acts: element.acts },
      from_tick: 0,
    };
    this.T = 1 / rate;
    this.v = 0;
  }

  // Returns the row of a tick. The order of every sum and product is the page's.
  tick(x) {
    const v = (x - (this.x ?? x)) / this.T;
    const a = (v - this.v) / this.T;
    [this.x, this.v] = [x, v];
    const out = this.wall.position - x;
    const contact = out * this.wall.into_wall < 0;
    const spring = contact ? this.wall.stiffness * out : 0;
    const { damping, acts } = this.element.parameters;
    const force = contact || acts === "always" ? -damping * v : 0;
    return [x, v, a, spring, force, spring + force, contact ? 1 : 0];
  }

  // Carries a change out; returns why not, or nothing.
  change(tick, { set }) {
    if (!set) return `The change at tick ${tick} was refused: this controller cannot swap its element.`;
    const strange = Object.keys(set).find((key) => !CAN_SET.includes(key));
    if (strange) return `The change at tick ${tick} was refused: this controller cannot set ${strange}.`;
    for (const [key, value] of Object.entries(set)) {
      const [table, name] = key.split(".");
      if (table === "wall") this.wall = { ...this.wall, [name]: value };
      if (table === "dissipation")
        this.element = {
          ...this.element,
          book: this.element.book + 1,
          parameters: { ...this.element.parameters, damping: value },
          from_tick: tick,
        };
    }
  }
}

take_seat("controller", async (seat) => {
  await seat.join({}, { name: "controller.js", version: "1" });
  const { scene, timebase: time } = seat;
  const law = new Law(scene, time.control_rate);
  let rows = [],
    history = [],
    refused = [],
    delay = time.delay_steps;
  seat.tick = 0;
  seat.state = () => [seat.tick, { history }];
  const block = () => {
    // wall and elements hold for the whole of a block
    if (!rows.length) return;
    const columns = Object.fromEntries(COLUMNS.map((name, i) => [name, column(rows, i)]));
    const made = {
      from_tick: seat.tick - rows.length,
      ticks: rows.length,
      columns,
      elements: [law.element],
      wall: law.wall,
    };
    seat.publish("CONTROLLER_BLOCK", ...Object.values(made));
    history.push(made); // all that may still be on its way
    while (history.length > 1 && seat.tick - history[1].from_tick > 2 + delay / (time.plant_rate / time.control_rate))
      history.shift();
    rows = [];
  };
  seat.cut = () => {
    if (!rows.length && !refused.length) return;
    block();
    seat.tell(
      "PROGRESS",
      seat.tick,
      refused.length ? { refused: refused.map((r) => r.why), refused_changes: refused.map((r) => r.change) } : {},
    );
    refused = [];
  };

  const loop = new zmq.Dealer({ linger: 0 });
  loop.connect(seat.endpoints.plant.loop);
  await loop.send(frame("HELLO", seat.start.secret));
  const [answer] = await loop.receive();
  if (read(answer)[1] !== seat.start.secret)
    throw new Error("The plant's greeting did not carry the secret of this run.");
  seat.awaits = "logger";
  await seat.news(() => seat.answered);
  seat.tell("READY", 0);
  seat.awaits = "plant";
  for await (const [data] of loop) {
    const [name, from, samples] = read(data);
    if (name === "LAST") break;
    if (name !== "SAMPLES" || from !== seat.tick)
      throw new Error(`Samples of tick ${seat.tick} were expected, but ${name} of tick ${from} came.`);
    await seat.news(() => seat.until >= from + samples.length); // the changes of these ticks come with the grant
    const forces = [];
    for (const [x] of samples) {
      for (let due; (due = seat.due(seat.tick));) {
        const [tick, event] = due;
        if (!event.set && !event.swap) continue;
        block();
        delay = Math.max(delay, (event.set?.["clock.round_trip_delay"] ?? 0) * time.plant_rate);
        const why = law.change(tick, event);
        if (why) refused.push({ why, change: { tick, ...event } });
      }
      rows.push(law.tick(x));
      forces.push(rows.at(-1)[5]);
      seat.tick++;
    }
    await loop.send(floats("COMMANDS", from, forces));
    if (rows.length >= scene.run.block_ticks) seat.flush();
  }
  seat.cut();
  await seat.publish("END", seat.tick, "", null);
});
