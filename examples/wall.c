// A controller in C: a spring wall, to the bits of haploop's own.
//
//   cc -O2 -ffp-contract=off -o wall examples/wall.c $(pkg-config --cflags --libs libzmq msgpack)
//   haploop run fig6a.toml --node controller=./wall
//
// Written from protocol/README.md; examples/README.md says what to install. A `set` of the wall is carried out, every
// other change is refused, and a scene that asks for more than this law ends the run with a sentence.
#include <signal.h>

#include "wire.h"

enum { WIDTH = 6, MOST_ROWS = 1000, FLUSH_MS = 10, SAY_MS = 200 };
enum { LINGER_MS = 20000 };  // so long what was sent may still take to go out to a logger that is held up
static const char* const COLUMNS[WIDTH] = {"x", "v", "a", "wall", "total", "in_contact"};

static struct {
  double position, stiffness, into_wall, period, x, v;
} law;
static double rows[MOST_ROWS][WIDTH];
static int held;                  // rows since the last block
static int64_t tick, told_ms;     // the next tick to answer; when the clock last heard of us
static msgpack_sbuffer* history;  // the newest blocks, packed as maps
static int64_t *ends, covered;    // tick after each; ticks that a command may be on its way
static size_t blocks;
static msgpack_sbuffer refusals[2];  // sentences and changes, packed
static int refused;
static bool subscribed;
static void *clock_socket, *telemetry, *loop;

static void fail(const char* reason) {
  begin(FAILED, 2), put_int(-1), put_text(reason), send_frame(clock_socket);
  zmq_close(clock_socket), zmq_close(telemetry);
  fprintf(stderr, "%s\n", reason);
  usleep(100000), exit(1);
}

// One tick: the row of what was seen and done. The order of every sum and product is the page's.
static double answer(double x) {
  double* row = rows[held++];
  double v = (x - (tick ? law.x : x)) / law.period, a = (v - law.v) / law.period, gap = law.position - x;
  bool contact = gap * law.into_wall < 0;
  double force = contact ? law.stiffness * gap : 0;
  law.x = x, law.v = v, tick++;
  row[0] = x, row[1] = v, row[2] = a, row[3] = row[4] = force, row[5] = contact;
  return force;
}

static void put_block(msgpack_packer* to, bool as_map) {
  const char* names[] = {"from_tick", "ticks", "columns", "elements", "wall"};
  if (as_map) msgpack_pack_map(to, 5);
  for (int part = 0; part < 5; part++) {
    if (as_map) msgpack_pack_str_with_body(to, names[part], strlen(names[part]));
    if (part == 0) msgpack_pack_int64(to, tick - held);
    if (part == 1) msgpack_pack_int64(to, held);
    if (part == 2) {
      msgpack_pack_map(to, WIDTH);
      for (int column = 0; column < WIDTH; column++) {
        msgpack_pack_str_with_body(to, COLUMNS[column], strlen(COLUMNS[column]));
        msgpack_pack_bin(to, 8 * held);
        for (int row = 0; row < held; row++) msgpack_pack_bin_body(to, &rows[row][column], 8);
      }
    }
    if (part == 3) msgpack_pack_array(to, 0);
    if (part == 4) {
      msgpack_pack_map(to, 3);
      msgpack_pack_str_with_body(to, "position", 8), msgpack_pack_double(to, law.position);
      msgpack_pack_str_with_body(to, "stiffness", 9), msgpack_pack_double(to, law.stiffness);
      msgpack_pack_str_with_body(to, "into_wall", 9), msgpack_pack_double(to, law.into_wall);
    }
  }
}

static void publish(void) { zmq_send(telemetry, "controller", 10, ZMQ_SNDMORE), send_frame(telemetry); }

// Ends a block: publishes its rows and keeps them for those who subscribe later.
static void cut(void) {
  if (!held) return;
  begin(CONTROLLER_BLOCK, 5), put_block(&out, false), publish();
  while (blocks > 1 && tick - held - ends[0] > covered) {
    msgpack_sbuffer_destroy(&history[0]), blocks--;
    memmove(history, history + 1, blocks * sizeof *history), memmove(ends, ends + 1, blocks * sizeof *ends);
  }
  history = realloc(history, (blocks + 1) * sizeof *history), ends = realloc(ends, (blocks + 1) * sizeof *ends);
  msgpack_sbuffer_init(&history[blocks]), ends[blocks] = tick;
  msgpack_packer packer = {&history[blocks++], msgpack_sbuffer_write};
  put_block(&packer, true), held = 0;
}

// Publishes and reports what was held back, and answers new subscriptions.
static void flush(void) {
  bool asked = false, news = held || refused;
  unsigned char request[64];
  int size;
  for (int taken = 0; taken < 200 && (size = zmq_recv(telemetry, request, sizeof request, ZMQ_DONTWAIT)) >= 0; taken++)
    if (size && request[0] == 1 && size <= 11 && !memcmp("controller", request + 1, size - 1)) asked = true;
  cut();
  if (news) {
    begin(PROGRESS, 2), put_int(tick), put_map(refused ? 2 : 0);
    for (int list = 0; refused && list < 2; list++) {
      put_text(list ? "refused_changes" : "refused"), msgpack_pack_array(&out, refused);
      msgpack_sbuffer_write(&written, refusals[list].data, refusals[list].size), msgpack_sbuffer_clear(&refusals[list]);
    }
    refused = 0;
  } else if (now_ms() - told_ms > SAY_MS) {
    begin(WAITING, 2), put_int(tick), put_text("plant"), news = true;
  }
  if (news) send_frame(clock_socket), told_ms = now_ms();
  if (!asked) return;
  subscribed = true;
  begin(STATE, 2), put_int(tick), put_map(1), put_text("history"), msgpack_pack_array(&out, blocks);
  for (size_t i = 0; i < blocks; i++) msgpack_sbuffer_write(&written, history[i].data, history[i].size);
  publish();
}

// What the clock has granted: up to which tick, and the changes on the way, packed until their tick comes.
static int64_t until;
static struct change {
  int64_t tick;
  msgpack_sbuffer packed;
}* changes;
static size_t waiting;

static void heed_clock(struct frame* frame) {
  for (int code; (code = receive(clock_socket, frame));) {
    if (code == ABORT) exit(1);
    if (code == REFUSED) fail(text(frame->field[0]));
    if (code == WELCOME) return;
    if (code != GRANT || frame->fields < 3) continue;
    until = (int64_t)number(frame->field[0]);
    msgpack_object_array events = frame->field[2].via.array;
    for (size_t i = 0; i < events.size; i++) {
      msgpack_object* pair = events.ptr[i].via.array.ptr;
      if (at(pair[1], "set").type == MSGPACK_OBJECT_NIL && at(pair[1], "swap").type == MSGPACK_OBJECT_NIL) continue;
      changes = realloc(changes, (waiting + 1) * sizeof *changes);
      changes[waiting].tick = (int64_t)number(pair[0]);
      msgpack_sbuffer_init(&changes[waiting].packed);
      msgpack_packer packer = {&changes[waiting++].packed, msgpack_sbuffer_write};
      msgpack_pack_object(&packer, pair[1]);
    }
  }
}

// Carries the next change out, or notes it as refused: the event with its tick, and a sentence.
static void make_change(void) {
  msgpack_unpacked in;
  msgpack_unpacked_init(&in);
  msgpack_unpack_next(&in, changes[0].packed.data, changes[0].packed.size, NULL);
  msgpack_object event = in.data, set = at(event, "set");
  msgpack_object stiffness = at(set, "wall.stiffness"), position = at(set, "wall.position"),
                 delay = at(set, "clock.round_trip_delay");
  size_t known = (stiffness.type != MSGPACK_OBJECT_NIL) + (position.type != MSGPACK_OBJECT_NIL) +
                 (delay.type != MSGPACK_OBJECT_NIL);
  cut();
  if (set.type != MSGPACK_OBJECT_MAP || known < set.via.map.size) {
    msgpack_packer sentence = {&refusals[0], msgpack_sbuffer_write}, change = {&refusals[1], msgpack_sbuffer_write};
    char why[120];
    int length = snprintf(why, sizeof why, "The change at tick %lld was refused: this controller is only a wall.",
                          (long long)tick);
    msgpack_pack_str_with_body(&sentence, why, length);
    msgpack_pack_map(&change, event.via.map.size + 1);
    msgpack_pack_str_with_body(&change, "tick", 4), msgpack_pack_int64(&change, changes[0].tick);
    for (size_t i = 0; i < event.via.map.size; i++)
      msgpack_pack_object(&change, event.via.map.ptr[i].key), msgpack_pack_object(&change, event.via.map.ptr[i].val);
    refused++;
  } else {
    if (stiffness.type != MSGPACK_OBJECT_NIL) law.stiffness = number(stiffness);
    if (position.type != MSGPACK_OBJECT_NIL) law.position = number(position);
    int64_t on_the_way = (int64_t)(number(delay) / law.period) + 3;  // the delay itself is the plant's to change
    if (on_the_way > covered) covered = on_the_way;
  }
  msgpack_unpacked_destroy(&in), msgpack_sbuffer_destroy(&changes[0].packed);
  memmove(changes, changes + 1, --waiting * sizeof *changes);
}

static void begin_law(msgpack_object scene, msgpack_object timebase) {
  msgpack_object wall = at(scene, "wall"), elements = at(scene, "dissipation");
  if (wall.type != MSGPACK_OBJECT_MAP || (elements.type == MSGPACK_OBJECT_ARRAY && elements.via.array.size) ||
      at(scene, "velocity").type == MSGPACK_OBJECT_MAP || at(scene, "acceleration").type == MSGPACK_OBJECT_MAP ||
      (at(wall, "kind").type == MSGPACK_OBJECT_STR && strcmp(text(at(wall, "kind")), "spring")))
    fail("This controller is only a spring wall with plain differences, but the scene needs something else.");
  law.position = number(at(wall, "position")), law.stiffness = number(at(wall, "stiffness"));
  law.into_wall = strcmp(text(at(wall, "occupies")), "below") ? 1 : -1;
  law.period = 1 / number(at(timebase, "control_rate"));
  covered = (int64_t)(number(at(timebase, "delay_steps")) * number(at(timebase, "control_rate")) /
                      number(at(timebase, "plant_rate"))) +
            2;
}

// Copies the text that follows "key": in a line of JSON, "" for none; addresses and secrets need no escapes.
static void from_json(const char* line, const char* key, char* value, size_t size) {
  char quoted[32];
  snprintf(quoted, sizeof quoted, "\"%s\": \"", key);
  const char* from = strstr(line, quoted);
  from = from ? from + strlen(quoted) : "\"";
  snprintf(value, size, "%.*s", (int)strcspn(from, "\""), from);
}

int main(int argc, char** argv) {
  char line[65536], address[512], secret[64], host[64], own[600];
  size_t size = sizeof own;
  const char* last = argc > 1 ? argv[argc - 1] : "";
  bool external = strlen(last) > 5 && !strcmp(last + strlen(last) - 5, ".json");  // the file of --external
  FILE* told = external ? fopen(last, "r") : stdin;
  if (!told || !fgets(line, sizeof line, told)) return fprintf(stderr, "There is no run to join here.\n"), 1;
  const char* slash = strrchr(last, '/');
  int pid = external ? launcher(slash ? strndup(last, slash - last) : ".") : 0;  // of a run on another host 0
  from_json(line, "address", address, sizeof address), from_json(line, "secret", secret, sizeof secret);
  from_json(line, "host", host, sizeof host);
  if (strstr(line, "\"keys\": {"))
    return fprintf(stderr, "This program does not support keys; run it without --keys.\n"), 1;
  if (*host) snprintf(own, sizeof own, "tcp://%s:*", host);
  else snprintf(own, sizeof own, "%.*s/controller.sock", (int)(strrchr(address, '/') - address), address);

  void* context = zmq_ctx_new();
  static struct frame from_clock, from_plant;
  msgpack_sbuffer_init(&refusals[0]), msgpack_sbuffer_init(&refusals[1]);
  clock_socket = open_socket(context, ZMQ_DEALER, LINGER_MS, address);
  telemetry = open_socket(context, ZMQ_XPUB, LINGER_MS, NULL);
  int backlog = 256, verbose = 1;
  int64_t largest = 1024;
  zmq_setsockopt(telemetry, ZMQ_SNDHWM, &backlog, sizeof backlog);
  zmq_setsockopt(telemetry, ZMQ_XPUB_VERBOSE, &verbose, sizeof verbose);
  zmq_setsockopt(telemetry, ZMQ_MAXMSGSIZE, &largest, sizeof largest);
  if (zmq_bind(telemetry, own)) fail("The telemetry socket cannot be bound.");
  zmq_getsockopt(telemetry, ZMQ_LAST_ENDPOINT, own, &size);
  join(clock_socket, "controller", secret, own, "wall.c");

  int64_t flushed_ms = told_ms = now_ms();
  bool greeted = false, ready = false, ended = false;
  int pending = 0;  // code of a message of the plant that waits for the clock
  while (!ended) {
    zmq_pollitem_t items[] = {{NULL, 0, ZMQ_POLLIN, 0}, {clock_socket, 0, ZMQ_POLLIN, 0}, {loop, 0, ZMQ_POLLIN, 0}};
    zmq_poll(items + external, (loop && !pending ? 3 : 2) - external, FLUSH_MS);
    if (items[0].revents && read(0, line, sizeof line) <= 0) return 1;  // the launcher is gone
    if (pid && kill(pid, 0)) return 1;
    heed_clock(&from_clock);
    if (!loop && from_clock.fields >= 6) {  // WELCOME
      begin_law(from_clock.field[1], from_clock.field[2]);
      loop = open_socket(context, ZMQ_DEALER, 0, text(at(at(from_clock.field[3], "plant"), "loop")));
      begin(HELLO, 1), put_text(secret), send_frame(loop);
    }
    if (loop && !pending && (pending = receive(loop, &from_plant)) == HELLO) greeted = true, pending = 0;
    if (greeted && subscribed && !ready) ready = true, begin(READY, 1), put_int(0), send_frame(clock_socket);
    if (pending == LAST) {
      ended = true;
    } else if (pending) {
      msgpack_object* field = from_plant.field;
      if (pending != SAMPLES || from_plant.fields < 2 || number(field[0]) != (double)tick ||
          field[1].type != MSGPACK_OBJECT_ARRAY)
        fail("The plant sent something other than the samples of the next tick.");
      msgpack_object_array samples = field[1].via.array;
      if (until >= tick + samples.size) {  // so that the changes of these ticks are known
        int64_t from = tick;
        double* forces = malloc((samples.size + 1) * sizeof *forces);
        for (size_t i = 0; i < samples.size; i++) {
          if (held == MOST_ROWS) cut();
          while (waiting && changes[0].tick <= tick) make_change();
          msgpack_object sample = samples.ptr[i];  // [x_m], or [x_m, acceleration], which this law does not use
          forces[i] = answer(
              number(sample.type == MSGPACK_OBJECT_ARRAY && sample.via.array.size ? sample.via.array.ptr[0] : sample));
        }
        begin(COMMANDS, 2), put_int(from), msgpack_pack_array(&out, samples.size);
        for (size_t i = 0; i < samples.size; i++) msgpack_pack_double(&out, forces[i]);
        send_frame(loop), free(forces), pending = 0;
      }
    }
    if (loop && (held >= MOST_ROWS / 2 || now_ms() - flushed_ms >= FLUSH_MS)) flush(), flushed_ms = now_ms();
  }
  flush();
  begin(END, 3), put_int(tick), put_text(""), msgpack_pack_nil(&out), publish();
  begin(DONE, 2), put_int(tick), put_map(0), send_frame(clock_socket);
  zmq_close(loop), zmq_close(telemetry), zmq_close(clock_socket);
  return zmq_ctx_term(context), 0;
}
