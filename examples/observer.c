// An observer in C: attaches to a run without holding its time back further than the window, and tells what it saw.
//
//   observer DIRECTORY_OF_THE_RUN        (the one with run.json; `haploop status` names the run)
//
// Prints a line when it has attached and one at the end: to which tick, between which positions and forces, what was
// missed.
#include <math.h>
#include <signal.h>

#include "wire.h"

struct stream {
  const char* role;
  void* socket;
  int64_t first, tick;  // of its STATE; up to which all has come
  bool known, ended;
};

struct range {
  double least, most;
};

static struct range position = {INFINITY, -INFINITY}, force = {INFINITY, -INFINITY};
static int64_t gap_ticks;

static void take_column(msgpack_object columns, const char* name, struct range* range) {
  msgpack_object bytes = at(columns, name);
  if (bytes.type != MSGPACK_OBJECT_BIN) return;
  for (const char* p = bytes.via.bin.ptr; p + 8 <= bytes.via.bin.ptr + bytes.via.bin.size; p += 8) {
    double value;
    memcpy(&value, p, 8);  // little-endian, as nearly every machine is
    range->least = value < range->least ? value : range->least, range->most = value > range->most ? value : range->most;
  }
}

static void take(struct stream* stream, int code, struct frame* frame) {
  int64_t tick = (int64_t)number(frame->field[0]);
  if (code == STATE && !stream->known) stream->known = true, stream->first = stream->tick = tick;
  if (code == STATE || !stream->known || tick < stream->tick) return;  // another's state, or from before ours
  gap_ticks += tick - stream->tick, stream->tick = tick;
  if (code == END) {
    stream->ended = true;
  } else if (frame->fields >= 3) {
    stream->tick += (int64_t)number(frame->field[1]);
    if (code == PLANT_BLOCK)
      take_column(frame->field[2], "x", &position), take_column(frame->field[2], "force", &force);
  }
}

int main(int argc, char** argv) {
  if (argc != 2) return fprintf(stderr, "usage: observer DIRECTORY_OF_THE_RUN\n"), 2;
  char address[512];
  int pid = launcher(argv[1]);
  if (!pid) return fprintf(stderr, "There is no run in %s.\n", argv[1]), 1;
  void* context = zmq_ctx_new();
  snprintf(address, sizeof address, "ipc://%s/clock.sock", argv[1]);
  void* clock = open_socket(context, ZMQ_DEALER, 1000, address);
  static struct frame frame;

  for (int code = 0; code != WELCOME;) {  // refused as long as the run has not begun
    join(clock, "observer in C", "", NULL, "observer.c");
    zmq_pollitem_t item = {clock, 0, ZMQ_POLLIN, 0};
    if (zmq_poll(&item, 1, 5000) < 1) return fprintf(stderr, "No clock answers at %s.\n", address), 1;
    code = receive(clock, &frame);
    if (code == REFUSED) fprintf(stderr, "%s\n", text(frame.field[0])), usleep(100000);
  }
  struct stream streams[2] = {{.role = "plant"}, {.role = "controller"}};
  for (int i = 0; i < 2; i++) {
    streams[i].socket = open_socket(context, ZMQ_SUB, 0, text(at(at(frame.field[3], streams[i].role), "telemetry")));
    zmq_setsockopt(streams[i].socket, ZMQ_SUBSCRIBE, streams[i].role, strlen(streams[i].role));
  }

  int64_t reported = -1, told_ms = now_ms();
  while (!streams[0].ended || !streams[1].ended) {
    zmq_pollitem_t items[] = {
        {clock, 0, ZMQ_POLLIN, 0}, {streams[0].socket, 0, ZMQ_POLLIN, 0}, {streams[1].socket, 0, ZMQ_POLLIN, 0}};
    if (!zmq_poll(items, 3, 200) && kill(pid, 0)) return fprintf(stderr, "The run's launcher is gone.\n"), 1;
    for (int i = 0, code; i < 2; i++)
      while ((code = receive(streams[i].socket, &frame)))
        if (code > 0) take(&streams[i], code, &frame);
    for (int code; (code = receive(clock, &frame));)
      if (code == ABORT) return fprintf(stderr, "%s\n", text(frame.field[0])), 1;
    if (!streams[0].known || !streams[1].known) continue;
    int64_t done = streams[0].tick < streams[1].tick ? streams[0].tick : streams[1].tick;
    if (reported < 0) {
      printf("attached: controller from tick %lld, plant from tick %lld\n", (long long)streams[1].first,
             (long long)streams[0].first);
      fflush(stdout);
      begin(READY, 1), put_int(done), send_frame(clock);
    } else if (done > reported) {
      begin(PROGRESS, 2), put_int(done), put_map(0), send_frame(clock);
    } else if (now_ms() - told_ms > 200) {
      begin(WAITING, 2), put_int(done), put_text("plant"), send_frame(clock);
    } else {
      continue;
    }
    reported = done, told_ms = now_ms();
  }
  begin(LEAVE, 1), put_int(reported), send_frame(clock);
  printf("to tick %lld: position %.17g to %.17g m, force %.17g to %.17g N, %lld ticks missed\n", (long long)reported,
         position.least, position.most, force.least, force.most, (long long)gap_ticks);
  for (int i = 0; i < 2; i++) zmq_close(streams[i].socket);
  return zmq_close(clock), zmq_ctx_term(context), 0;
}
