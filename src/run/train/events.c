#include "run/train/log.h"

#include <ini.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/text.h"

/* Most bytes of an event's head (wall time, step, length prefix), and of a scalar. */
enum { HEAD_BYTES = 40, SCALAR_BYTES = EVENTS_TAG_MAX + 20, PAYLOAD_MAX = 128 * SCALAR_BYTES };

/* CRC-32C (Castagnoli), reflected polynomial 0x82f63b78. Bit by bit is fast enough, because a
 * row of the log has a few kilobytes. */
uint32_t events_crc32c(const void *data, size_t size) {
    const unsigned char *bytes = data;
    uint32_t crc = 0xffffffffu;
    for (size_t i = 0; i < size; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++) {
            crc = (crc >> 1) ^ (0x82f63b78u & (0u - (crc & 1u)));
        }
    }
    return ~crc;
}

/* TFRecord's masked form: a plain CRC is weak over data that contains CRCs. */
static uint32_t masked_crc(const void *data, size_t size) {
    uint32_t crc = events_crc32c(data, size);
    return ((crc >> 15) | (crc << 17)) + 0xa282ead8u;
}

/* ---- protobuf wire format: key = field number * 8 + type; 0 varint, 1 eight bytes, 2
 * length-delimited, 5 four bytes ---- */
enum { WIRE_VARINT = 0, WIRE_64 = 1, WIRE_BYTES = 2, WIRE_32 = 5 };

typedef struct {
    unsigned char *data;
    size_t size;
} Buffer;

static void put_little_endian(Buffer *buffer, uint64_t value, int bytes) {
    for (int i = 0; i < bytes; i++) {
        buffer->data[buffer->size++] = (unsigned char)(value >> (8 * i));
    }
}

static void put_varint(Buffer *buffer, uint64_t value) {
    while (value >= 0x80) {
        buffer->data[buffer->size++] = (unsigned char)(value | 0x80);
        value >>= 7;
    }
    buffer->data[buffer->size++] = (unsigned char)value;
}

static void put_key(Buffer *buffer, int field, int wire) {
    put_varint(buffer, (uint64_t)field * 8 + (uint64_t)wire);
}

static void put_double(Buffer *buffer, int field, double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_key(buffer, field, WIRE_64);
    put_little_endian(buffer, bits, 8);
}

static void put_float(Buffer *buffer, int field, float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_key(buffer, field, WIRE_32);
    put_little_endian(buffer, bits, 4);
}

static void put_bytes(Buffer *buffer, int field, const void *data, size_t size) {
    put_key(buffer, field, WIRE_BYTES);
    put_varint(buffer, size);
    memcpy(buffer->data + buffer->size, data, size);
    buffer->size += size;
}

/* Makes the bytes from `begin` on one field: moves them and writes key and length before them. */
static void enclose(Buffer *buffer, size_t begin, int field) {
    unsigned char head[20];
    Buffer before = {head, 0};
    put_key(&before, field, WIRE_BYTES);
    put_varint(&before, buffer->size - begin);
    memmove(buffer->data + begin + before.size, buffer->data + begin, buffer->size - begin);
    memcpy(buffer->data + begin, head, before.size);
    buffer->size += before.size;
}

static int write_record(FILE *file, const Buffer *record) {
    unsigned char head[12], tail[4];
    Buffer head_buffer = {head, 0}, tail_buffer = {tail, 0};
    put_little_endian(&head_buffer, record->size, 8);
    put_little_endian(&head_buffer, masked_crc(head, 8), 4);
    put_little_endian(&tail_buffer, masked_crc(record->data, record->size), 4);
    return fwrite(head, sizeof head, 1, file) == 1 &&
                   fwrite(record->data, 1, record->size, file) == record->size &&
                   fwrite(tail, sizeof tail, 1, file) == 1
               ? 0
               : -1;
}

/* Event: wall_time = 1 double, step = 2 int64, file_version = 3 string, summary = 5, session_log
 * = 7. */
static Buffer event_begin(unsigned char *data, double wall_time, int64_t step) {
    Buffer event = {data, 0};
    put_double(&event, 1, wall_time);
    if (step) {
        put_key(&event, 2, WIRE_VARINT);
        put_varint(&event, (uint64_t)step);
    }
    return event;
}

int events_write_version(FILE *file, double wall_time) {
    unsigned char data[HEAD_BYTES + 16];
    Buffer event = event_begin(data, wall_time, 0);
    put_bytes(&event, 3, "brain.Event:2", 13);
    return write_record(file, &event);
}

int events_write_start(FILE *file, double wall_time, int64_t step) {
    unsigned char data[HEAD_BYTES + 8];
    Buffer event = event_begin(data, wall_time, step);
    static const unsigned char session_start[] = {1 * 8 + WIRE_VARINT,
                                                  1}; /* SessionLog.status = START */
    put_bytes(&event, 7, session_start, sizeof session_start);
    return write_record(file, &event);
}

int events_write_scalars(FILE *file, double wall_time, int64_t step, const char *const *tags,
                         const double *values, int count) {
    static _Thread_local unsigned char summary_data[PAYLOAD_MAX],
        event_data[PAYLOAD_MAX + HEAD_BYTES];
    while (count > 0) { /* a wide row becomes several events of the same step */
        Buffer summary = {summary_data, 0};
        int taken = 0;
        for (; taken < count && summary.size + SCALAR_BYTES <= PAYLOAD_MAX; taken++) {
            unsigned char value_data[SCALAR_BYTES];
            Buffer value = {value_data,
                            0}; /* Summary.Value: tag = 1 string, simple_value = 2 float */
            if (isnan(values[taken])) {
                continue;
            }
            put_bytes(&value, 1, tags[taken], strnlen(tags[taken], EVENTS_TAG_MAX));
            put_float(&value, 2, (float)values[taken]);
            put_bytes(&summary, 1, value.data, value.size);
        }
        Buffer event = event_begin(event_data, wall_time, step);
        put_bytes(&event, 5, summary.data, summary.size);
        if (write_record(file, &event) != 0) {
            return -1;
        }
        tags += taken;
        values += taken;
        count -= taken;
    }
    return 0;
}

/* ---- a text, and the hyperparameters: tensors that a plugin of TensorBoard reads ---- */

/* SummaryMetadata: plugin_data = 1 {plugin_name = 1 string, content = 2 bytes}, data_class = 4.
 * The buffer holds the content. Turns it into the metadata of a Summary.Value. */
static void enclose_metadata(Buffer *buffer, const char *plugin) {
    enclose(buffer, 0, 2);
    put_bytes(buffer, 1, plugin, strlen(plugin));
    enclose(buffer, 0, 1);
    put_key(buffer, 4, WIRE_VARINT);
    put_varint(buffer, 2); /* DATA_CLASS_TENSOR */
    enclose(buffer, 0, 9);
}

/* TensorProto: dtype = 1 enum, tensor_shape = 2, float_val = 5, string_val = 8. text NULL: the
 * number 0, for plugins that read the metadata only. */
static void put_tensor(Buffer *buffer, const char *text) {
    enum { TYPE_FLOAT = 1, TYPE_STRING = 7 };
    size_t begin = buffer->size;
    put_key(buffer, 1, WIRE_VARINT);
    put_varint(buffer, text ? TYPE_STRING : TYPE_FLOAT);
    put_bytes(buffer, 2, "", 0); /* a scalar */
    if (text) {
        put_bytes(buffer, 8, text, strlen(text));
    } else {
        put_float(buffer, 5, 0);
    }
    enclose(buffer, begin, 8); /* Summary.Value.tensor */
}

/* The buffer holds the plugin's content. Writes the event around it. */
static int write_tensor(FILE *file, Buffer *buffer, double wall_time, const char *tag,
                        const char *plugin, const char *text) {
    enclose_metadata(buffer, plugin);
    put_bytes(buffer, 1, tag, strnlen(tag, EVENTS_TAG_MAX));
    put_tensor(buffer, text);
    enclose(buffer, 0, 1); /* Summary.value */
    enclose(buffer, 0, 5); /* Event.summary */
    put_double(buffer, 1, wall_time);
    return write_record(file, buffer);
}

enum { TENSOR_BYTES = EVENTS_TAG_MAX + 200 }; /* most that write_tensor adds to content and text */

int events_write_text(FILE *file, double wall_time, const char *tag, const char *text) {
    Buffer buffer = {malloc(strlen(text) + TENSOR_BYTES), 0};
    int failed = !buffer.data || write_tensor(file, &buffer, wall_time, tag, "text", text) != 0;
    free(buffer.data);
    return failed ? -1 : 0;
}

/* google.protobuf.Value: number_value = 2 double, string_value = 3, bool_value = 4. */
static void put_value(Buffer *buffer, const char *text) {
    double number;
    if (text_double(text, &number)) {
        put_double(buffer, 2, number);
    } else if (strcmp(text, "true") == 0 || strcmp(text, "false") == 0) {
        put_key(buffer, 4, WIRE_VARINT);
        put_varint(buffer, text[0] == 't');
    } else {
        put_bytes(buffer, 3, text, strlen(text));
    }
}

/* SessionStartInfo: hparams = 1 map of string (1) to Value (2), start_time_secs = 5 double. It is
 * field 3 of HParamsPluginData. */
static void put_session(Buffer *buffer, const Settings *settings, double wall_time) {
    for (int i = 0; i < settings->count; i++) {
        size_t entry = buffer->size;
        put_bytes(buffer, 1, settings->list[i].key, strlen(settings->list[i].key));
        size_t value = buffer->size;
        put_value(buffer, settings->list[i].value);
        enclose(buffer, value, 2);
        enclose(buffer, entry, 1);
    }
    put_double(buffer, 5, wall_time);
    enclose(buffer, 0, 3);
}

int events_write_settings(FILE *file, double wall_time, const Settings *settings) {
    enum { PAIR_BYTES = 40 }; /* keys and lengths around the texts, or a number */
    size_t size = TENSOR_BYTES;
    for (int i = 0; i < settings->count; i++) {
        size += strlen(settings->list[i].key) + strlen(settings->list[i].value) + PAIR_BYTES;
    }
    Buffer buffer = {malloc(size), 0};
    int failed = !buffer.data;
    if (!failed) {
        put_session(&buffer, settings, wall_time);
        failed = write_tensor(file, &buffer, wall_time, "_hparams_/session_start_info", "hparams",
                              NULL) != 0;
    }
    free(buffer.data);
    return failed ? -1 : 0;
}

/* inih's handler. Returns 0 when memory runs out. */
static int take(void *self, const char *section, const char *key, const char *value) {
    Settings *settings = self;
    Setting *list = realloc(settings->list, ((size_t)settings->count + 1) * sizeof *list);
    if (!list) {
        return 0;
    }
    settings->list = list;
    size_t size = strlen(section) + strlen(key) + 2;
    Setting setting = {malloc(size), strdup(value)};
    if (!setting.key || !setting.value) {
        free(setting.key);
        free(setting.value);
        return 0;
    }
    snprintf(setting.key, size, "%s.%s", section, key);
    list[settings->count++] = setting;
    return 1;
}

MildStatus settings_read(const char *text, const char *name, Settings *settings, MildError *error) {
    *settings = (Settings){0};
    int line = ini_parse_string(text, take, settings);
    if (line == 0) {
        return MILD_OK;
    }
    settings_free(settings);
    return mild_fail(error, MILD_ERROR_FORMAT,
                     "%s:%d: neither `key = value` nor `[section]`, or out of memory", name,
                     line > 0 ? line : 0);
}

void settings_free(Settings *settings) {
    for (int i = 0; i < settings->count; i++) {
        free(settings->list[i].key);
        free(settings->list[i].value);
    }
    free(settings->list);
    *settings = (Settings){0};
}
