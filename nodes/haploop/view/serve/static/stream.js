// The connection to haploop view. A lost one is opened again automatically.

const FIRST_WAIT_MS = 250;
const LONGEST_WAIT_MS = 2000;
const LOST = "The connection to haploop view is lost, so nothing was sent.";
const UNANSWERED = "The connection to haploop view was lost before the answer came; check whether it took effect.";

/** The token of the link that haploop view printed; it is the part after the #, which no server ever sees. */
const token = () => new URLSearchParams(location.hash.slice(1)).get("token") ?? "";

/** Whether the page was opened with a link that lets it steer. */
export const maySteer = () => token() !== "";

export class Stream {
  /**
   * @param {object} handlers what to call: connected(boolean), state(state), events(list), snapshot(buffer),
   *   runs(listing).
   */
  constructor(handlers) {
    this.handlers = handlers;
    this.request = null;
    this.waiting = new Map();
    this.commands = 0;
    this.waitMs = FIRST_WAIT_MS;
    this.open();
  }

  open() {
    this.socket = new WebSocket(`ws://${location.host}/stream`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      this.waitMs = FIRST_WAIT_MS;
      this.handlers.connected(true);
      if (this.request) this.send(this.request);
    };
    this.socket.onmessage = ({ data }) => {
      if (typeof data === "string") this.receive(JSON.parse(data));
      else this.handlers.snapshot(data);
    };
    this.socket.onclose = () => {
      for (const answer of this.waiting.values()) answer({ ok: false, text: UNANSWERED });
      this.waiting.clear();
      this.handlers.connected(false);
      setTimeout(() => this.open(), this.waitMs);
      this.waitMs = Math.min(2 * this.waitMs, LONGEST_WAIT_MS);
    };
  }

  receive(message) {
    if (message.type === "state") this.handlers.state(message);
    else if (message.type === "events") this.handlers.events(message.events);
    else if (message.type === "runs") this.handlers.runs(message);
    else if (message.type === "answer") {
      this.waiting.get(message.id)?.(message);
      this.waiting.delete(message.id);
    }
  }

  send(message) {
    const open = this.socket.readyState === WebSocket.OPEN;
    if (open) this.socket.send(JSON.stringify(message));
    return open;
  }

  /** Asks for snapshots of an interval of time: {span_s, points, end_s}. Sent again after every new connection. */
  watch(request) {
    this.request = { type: "watch", ...request };
    this.send(this.request);
  }

  /** Send the run a command; the answer, {ok, text}, comes whatever happens. */
  command(verb, args) {
    const id = ++this.commands;
    return new Promise((answer) => {
      this.waiting.set(id, answer);
      if (!this.send({ type: "command", id, token: token(), verb, arguments: args })) {
        this.waiting.delete(id);
        answer({ ok: false, text: LOST });
      }
    });
  }
}
