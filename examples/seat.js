// A seat in a run for programs in Node.js: starts, joins, hears the clock, publishes, ends. From protocol/README.md
// alone.
"use strict";
const fs = require("node:fs");
const path = require("node:path");
const { encode, decode } = require("@msgpack/msgpack");
const zmq = require("zeromq");

const VERSION = 1;
const CODE = {
  JOIN: 1,
  WELCOME: 2,
  REFUSED: 3,
  READY: 4,
  GRANT: 5,
  PROGRESS: 6,
  WAITING: 7,
  ENDED: 8,
  DONE: 9,
  FAILED: 10,
  ABORT: 11,
  COMMAND: 13,
  REPLY: 14,
  HELLO: 20,
  SAMPLES: 21,
  COMMANDS: 22,
  LAST: 23,
  STATE: 30,
  PLANT_BLOCK: 31,
  CONTROLLER_BLOCK: 32,
  END: 34,
};
const NAME = Object.fromEntries(Object.entries(CODE).map(([name, code]) => [code, name]));
const [FLUSH_MS, SAY_MS] = [10, 200];
const LINGER_MS = 20000; // so long what was sent may still take to go out to a logger that is held up

const frame = (name, ...fields) => encode([VERSION, CODE[name], ...fields]);
// JavaScript's numbers travel as integers where they are whole, -0 as 0: numbers of the loop are written as floats
// instead.
const floats = (name, tick, numbers) =>
  Buffer.concat([
    Buffer.of(0x94),
    ...[VERSION, CODE[name], tick].map((n) => encode(n)),
    encode(numbers, { forceIntegerToFloat: true }),
  ]);
const read = (data) => {
  const [version, code, ...fields] = decode(data);
  if (version !== VERSION)
    throw new Error(`Protocol version ${VERSION} was expected, but a frame of version ${version} came.`);
  return [NAME[code], ...fields];
};
const column = (rows, i) => Buffer.from(Float64Array.from(rows, (row) => row[i]).buffer); // little-endian on nearly all machines

class Seat {
  // Binds the sockets of a role, channel -> type, and connects to the clock.
  constructor(role, start, directory) {
    Object.assign(this, {
      role,
      start,
      directory,
      until: 0,
      last: false,
      events: [],
      subscribers: 0,
      answered: 0,
      told: Date.now(),
    });
    this.clock = new zmq.Dealer({ linger: LINGER_MS });
    this.telemetry = new zmq.XPublisher({
      linger: LINGER_MS,
      sendHighWaterMark: 256,
      verbosity: "allSubs",
      maxMessageSize: 1024,
    });
    this.sent = Promise.resolve();
    this.wake = () => {};
    this.failed = new Promise((_, reject) => (this.fail = reject));
  }

  async bind(socket, name) {
    const { host } = this.start.transport;
    const directory = path.dirname(this.start.address.replace("ipc://", ""));
    await socket.bind(host ? `tcp://${host}:*` : `ipc://${directory}/${name}.sock`);
    return socket.lastEndpoint;
  }

  // Joins with the addresses of what else this role binds; afterwards scene, timebase, endpoints and context are there.
  async join(binds = {}, program) {
    const telemetry = await this.bind(this.telemetry, this.role);
    this.clock.connect(this.start.address);
    this.listen().catch(this.fail);
    this.tell("JOIN", this.role, this.start.secret, process.pid, { ...binds, telemetry }, true, program);
    await this.news(() => this.scene);
    (async () => {
      for await (const [request] of this.telemetry)
        if (request[0] === 1 && this.role.startsWith(request.subarray(1))) this.subscribers++;
    })();
    // What the owner of the seat gives: `cut` publishes what it holds back and reports it, `state` is what STATE says.
    this.timer = setInterval(() => this.flush(), FLUSH_MS);
  }

  // Sends one after the other: ZeroMQ.js takes one message of a socket at a time.
  tell(name, ...fields) {
    this.told = Date.now();
    return (this.sent = this.sent.then(() => this.clock.send(frame(name, ...fields))));
  }

  publish(name, ...fields) {
    return (this.sent = this.sent.then(() => this.telemetry.send([this.role, frame(name, ...fields)])));
  }

  async listen() {
    for await (const [data] of this.clock) {
      const [name, ...fields] = read(data);
      if (name === "WELCOME") [, this.scene, this.timebase, this.endpoints, , this.context] = fields;
      if (name === "GRANT") (([this.until, this.last] = fields), this.events.push(...fields[2]));
      if (name === "REFUSED") throw new Error(fields[0]);
      if (name === "ABORT") process.exit(1);
      this.wake();
    }
  }

  // Waits until something holds that a message of the clock or a subscription may bring.
  async news(holds) {
    while (!holds()) await new Promise((resolve) => (this.wake = resolve));
  }

  // Takes the next event that is due at a tick, or none. Before the tick is granted nobody knows.
  due(tick) {
    return this.events.length && this.events[0][0] <= tick ? this.events.shift() : undefined;
  }

  flush() {
    this.cut?.();
    if (this.answered < this.subscribers && this.state) {
      this.answered = this.subscribers;
      this.publish("STATE", ...this.state());
      this.wake();
    }
    if (this.directory && !is_led(this.directory)) process.exit(1); // no stdin ends with the launcher
    if (Date.now() - this.told > SAY_MS) this.tell("WAITING", this.tick ?? 0, this.awaits ?? "clock");
  }
}

// Tells whether the launcher of a run on this host is there.
function is_led(directory) {
  try {
    return process.kill(JSON.parse(fs.readFileSync(`${directory}/run.json`)).pid, 0);
  } catch {
    return false;
  }
}

// Reads what the launcher says on stdin, or the file of `--external` named last; ends with the launcher.
function take_seat(role, work) {
  const last = process.argv.at(-1);
  const begin = async (text, directory) => {
    const start = JSON.parse(text);
    if (start.transport.keys)
      (console.error("This program does not support keys; run it without --keys."), process.exit(1));
    const seat = new Seat(role, start, directory);
    try {
      await Promise.race([work(seat), seat.failed]);
      await seat.tell("DONE", seat.tick, {});
    } catch (error) {
      await seat.tell("FAILED", -1, error.message);
      process.exitCode = 1;
    }
    clearInterval(seat.timer);
    (seat.clock.close(), seat.telemetry.close());
    process.stdin.destroy(); // nothing is left to wait for: Node.js ends; process.exit() would drop what has not gone out
  };
  if (last.endsWith(".json"))
    return begin(fs.readFileSync(last, "utf8"), is_led(path.dirname(last)) && path.dirname(last));
  let line = "";
  process.stdin
    .setEncoding("utf8")
    .on("end", () => process.exit(1))
    .on("data", (text) => {
      const begun = line.includes("\n");
      line += text;
      if (!begun && line.includes("\n")) begin(line);
    });
}

module.exports = { take_seat, frame, floats, read, column };
