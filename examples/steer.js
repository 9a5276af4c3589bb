// A steering client in Node.js: asks a run to do something and says what became of it.
//
//   node examples/steer.js RUN_JSON set '{"set": {"wall.stiffness": 200}}'
//   node examples/steer.js RUN_JSON pause
"use strict";
const fs = require("node:fs");
const zmq = require("zeromq");
const { frame, read } = require("./seat.js");

async function main([file, verb, given = "{}"]) {
  const clock = new zmq.Dealer({ linger: 1000, receiveTimeout: 5000 });
  clock.connect(JSON.parse(fs.readFileSync(file, "utf8")).clock);
  await clock.send(frame("COMMAND", verb, JSON.parse(given)));
  const [, ok, text, data] = read((await clock.receive())[0]);
  console.log(text, JSON.stringify(data));
  process.exitCode = ok ? 0 : 1;
}

main(process.argv.slice(2)).catch((error) => {
  console.error(error.code === "EAGAIN" ? "The run does not answer; is it still there?" : error.message);
  process.exitCode = 1;
});
