// The frames of protocol/README.md in C: a msgpack array [version, code, field, ...] in one ZeroMQ message.
#include <msgpack.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <zmq.h>

enum { VERSION = 1 };
enum { JOIN = 1, WELCOME, REFUSED, READY, GRANT, PROGRESS, WAITING, ENDED, DONE, FAILED, ABORT, LEAVE };
enum { HELLO = 20, SAMPLES, COMMANDS, LAST, STATE = 30, PLANT_BLOCK, CONTROLLER_BLOCK, ENERGY_BLOCK, END };

static msgpack_sbuffer written;
static msgpack_packer out;

static void put_int(int64_t value) { msgpack_pack_int64(&out, value); }
static void put_text(const char* text) { msgpack_pack_str_with_body(&out, text, strlen(text)); }
static void put_map(size_t keys) { msgpack_pack_map(&out, keys); }

static void begin(int code, size_t fields) {
  if (!written.alloc) msgpack_sbuffer_init(&written), msgpack_packer_init(&out, &written, msgpack_sbuffer_write);
  msgpack_sbuffer_clear(&written);
  msgpack_pack_array(&out, 2 + fields);
  put_int(VERSION), put_int(code);
}

static void send_frame(void* socket) { zmq_send(socket, written.data, written.size, 0); }

// Sends JOIN with the address of a telemetry socket, or with none, and the name of this program.
static void join(void* clock, const char* role, const char* secret, const char* telemetry, const char* program) {
  begin(JOIN, 6), put_text(role), put_text(secret), put_int(getpid());
  put_map(telemetry ? 1 : 0);
  if (telemetry) put_text("telemetry"), put_text(telemetry);
  msgpack_pack_true(&out);
  put_map(1), put_text("name"), put_text(program);
  send_frame(clock);
}

// A message that has come; what `field` points to lives until the next one is received into it.
struct frame {
  zmq_msg_t message;
  msgpack_unpacked in;
  msgpack_object* field;
  size_t fields;
};

// Takes the message that is there and returns its code; 0 where none is there, -1 where it is no frame of this version.
static int receive(void* socket, struct frame* frame) {
  int more = 1;
  size_t size = sizeof more;
  while (more) {  // telemetry comes behind its topic
    zmq_msg_close(&frame->message), zmq_msg_init(&frame->message);
    if (zmq_msg_recv(&frame->message, socket, ZMQ_DONTWAIT) < 0) return 0;
    zmq_getsockopt(socket, ZMQ_RCVMORE, &more, &size);
  }
  const char* data = zmq_msg_data(&frame->message);
  if (msgpack_unpack_next(&frame->in, data, zmq_msg_size(&frame->message), NULL) != MSGPACK_UNPACK_SUCCESS) return -1;
  msgpack_object_array items = frame->in.data.via.array;
  if (frame->in.data.type != MSGPACK_OBJECT_ARRAY || items.size < 3 ||
      items.ptr[0].type != MSGPACK_OBJECT_POSITIVE_INTEGER || items.ptr[0].via.u64 != VERSION ||
      items.ptr[1].type != MSGPACK_OBJECT_POSITIVE_INTEGER)
    return -1;
  frame->field = items.ptr + 2, frame->fields = items.size - 2;
  return (int)items.ptr[1].via.u64;
}

// Returns a number, 0 for what is none.
static double number(msgpack_object o) {
  if (o.type == MSGPACK_OBJECT_FLOAT64 || o.type == MSGPACK_OBJECT_FLOAT32) return o.via.f64;
  if (o.type == MSGPACK_OBJECT_POSITIVE_INTEGER) return (double)o.via.u64;
  return o.type == MSGPACK_OBJECT_NEGATIVE_INTEGER ? (double)o.via.i64 : 0;
}

// Returns what a map has under a key, nil for nothing.
static msgpack_object at(msgpack_object map, const char* key) {
  if (map.type == MSGPACK_OBJECT_MAP)
    for (msgpack_object_kv* kv = map.via.map.ptr; kv < map.via.map.ptr + map.via.map.size; kv++)
      if (kv->key.type == MSGPACK_OBJECT_STR && kv->key.via.str.size == strlen(key) &&
          !memcmp(kv->key.via.str.ptr, key, strlen(key)))
        return kv->val;
  return (msgpack_object){.type = MSGPACK_OBJECT_NIL};
}

// Copies a text, "" for what is none, into a static buffer that the next call uses again.
static const char* text(msgpack_object o) {
  static char copy[512];
  snprintf(copy, sizeof copy, "%.*s", o.type == MSGPACK_OBJECT_STR ? (int)o.via.str.size : 0,
           o.type == MSGPACK_OBJECT_STR ? o.via.str.ptr : "");
  return copy;
}

static void* open_socket(void* context, int kind, int linger_ms, const char* address) {
  void* socket = zmq_socket(context, kind);
  zmq_setsockopt(socket, ZMQ_LINGER, &linger_ms, sizeof linger_ms);
  if (address && zmq_connect(socket, address)) perror(address), exit(1);
  return socket;
}

// Returns the process that leads the run of a directory, 0 where there is none.
static int launcher(const char* directory) {
  char path[600];
  int pid = 0;
  snprintf(path, sizeof path, "%s/run.json", directory);
  FILE* file = fopen(path, "r");
  if (file && fscanf(file, "{\"pid\": %d", &pid) != 1) pid = 0;
  if (file) fclose(file);
  return pid;
}

static int64_t now_ms(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1000LL + t.tv_nsec / 1000000;
}
