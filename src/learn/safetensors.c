#include "learn/safetensors.h"

#include <cjson/cJSON.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "base/file.h"

#define HEADER_MAX (1u << 20)
#define TENSORS_MAX 1024
#define PREFIX 8 /* bytes of the header's length */
#define CRC_KEY "\"crc32\":\""
#define CRC_DIGITS 8
#define DAMAGED "the file is damaged or cut short; use an older checkpoint or copy it again"

struct Safetensors {
    unsigned char *bytes;
    size_t size, data; /* data: where the data begins */
    cJSON *header;
    float *wide; /* numbers of the tensors that are F16 in the file */
    int count;
    Safetensor tensor[];
};

static const char *const type_names[] = {"F32", "F64", "I64", "U8", "F16"};
static const size_t type_sizes[] = {4, 8, 8, 1, 2};

/* ---- checksum: CRC-32 of IEEE 802.3 ---- */

static uint64_t header_length(const unsigned char *bytes) {
    uint64_t length = 0;
    for (int i = PREFIX - 1; i >= 0; i--) {
        length = length << 8 | bytes[i];
    }
    return length;
}

/* Position of the checksum's digits, or 0. Inside a JSON text the quotes of CRC_KEY would be
 * escaped, so the first match is the key itself. */
static size_t crc_position(const unsigned char *bytes, size_t size) {
    const size_t key = sizeof CRC_KEY - 1;
    size_t end = size < PREFIX ? 0 : PREFIX + (size_t)header_length(bytes);
    for (size_t i = PREFIX; i + key + CRC_DIGITS < end; i++) {
        if (bytes[i] == '"' && memcmp(bytes + i, CRC_KEY, key) == 0) {
            return bytes[i + key + CRC_DIGITS] == '"' ? i + key : 0;
        }
    }
    return 0;
}

static void crc_text(const unsigned char *bytes, size_t size, size_t at,
                     char text[CRC_DIGITS + 1]) {
    unsigned long crc = crc32_z(0, bytes, at);
    crc = crc32_z(crc, (const unsigned char *)"00000000", CRC_DIGITS);
    crc = crc32_z(crc, bytes + at + CRC_DIGITS, size - at - CRC_DIGITS);
    snprintf(text, CRC_DIGITS + 1, "%08lx", crc);
}

int safetensors_seal(unsigned char *bytes, size_t size) {
    if (size < PREFIX || header_length(bytes) > size - PREFIX) {
        return 0;
    }
    size_t at = crc_position(bytes, size);
    char text[CRC_DIGITS + 1];
    if (at == 0) {
        return 0;
    }
    crc_text(bytes, size, at, text);
    memcpy(bytes + at, text, CRC_DIGITS);
    return 1;
}

/* ---- writing ---- */

static size_t tensor_bytes(const Safetensor *tensor) {
    size_t bytes = type_sizes[tensor->type];
    for (int i = 0; i < tensor->rank; i++) {
        bytes *= (size_t)tensor->shape[i];
    }
    return bytes;
}

static int add_tensor(cJSON *header, const Safetensor *tensor, size_t begin) {
    cJSON *entry = cJSON_AddObjectToObject(header, tensor->name);
    cJSON *shape = entry && cJSON_AddStringToObject(entry, "dtype", type_names[tensor->type])
                       ? cJSON_AddArrayToObject(entry, "shape")
                       : NULL;
    for (int i = 0; shape && i < tensor->rank; i++) {
        if (!cJSON_AddItemToArray(shape, cJSON_CreateNumber((double)tensor->shape[i]))) {
            return 0;
        }
    }
    cJSON *offsets = shape ? cJSON_AddArrayToObject(entry, "data_offsets") : NULL;
    return offsets && cJSON_AddItemToArray(offsets, cJSON_CreateNumber((double)begin)) &&
           cJSON_AddItemToArray(offsets,
                                cJSON_CreateNumber((double)(begin + tensor_bytes(tensor))));
}

/* The header as text (from malloc), or NULL when out of memory. */
static char *make_header(const Safetensor *tensors, int tensor_count, const SafetensorsText *texts,
                         int text_count) {
    cJSON *header = cJSON_CreateObject();
    cJSON *metadata = header ? cJSON_AddObjectToObject(header, "__metadata__") : NULL;
    int ok = metadata && cJSON_AddStringToObject(metadata, "crc32", "00000000");
    for (int i = 0; ok && i < text_count; i++) {
        ok = cJSON_AddStringToObject(metadata, texts[i].key, texts[i].value) != NULL;
    }
    size_t begin = 0;
    for (int i = 0; ok && i < tensor_count; i++) {
        ok = add_tensor(header, &tensors[i], begin);
        begin += tensor_bytes(&tensors[i]);
    }
    char *text = ok ? cJSON_PrintUnformatted(header) : NULL;
    cJSON_Delete(header);
    return text;
}

/* The whole file in memory (from malloc), or NULL when out of memory. Spaces after the header align
 * the data to 8. */
static unsigned char *assemble(const char *header, const Safetensor *tensors, int tensor_count,
                               size_t *size) {
    size_t length = strlen(header), padded = (length + 7) / 8 * 8, at = PREFIX + padded;
    *size = at;
    for (int i = 0; i < tensor_count; i++) {
        *size += tensor_bytes(&tensors[i]);
    }
    unsigned char *bytes = malloc(*size);
    if (!bytes) {
        return NULL;
    }
    for (int i = 0; i < PREFIX; i++) {
        bytes[i] = (unsigned char)(padded >> (8 * i));
    }
    memcpy(bytes + PREFIX, header, length); // NOLINT(bugprone-not-null-terminated-result)
    memset(bytes + PREFIX + length, ' ', padded - length);
    for (int i = 0; i < tensor_count; i++) {
        memcpy(bytes + at, tensors[i].data, tensor_bytes(&tensors[i]));
        at += tensor_bytes(&tensors[i]);
    }
    safetensors_seal(bytes, *size);
    return bytes;
}

MildStatus safetensors_write(const char *path, const Safetensor *tensors, int tensor_count,
                             const SafetensorsText *texts, int text_count, MildError *error) {
    char *header = make_header(tensors, tensor_count, texts, text_count);
    size_t size = 0;
    unsigned char *bytes = header ? assemble(header, tensors, tensor_count, &size) : NULL;
    MildStatus status =
        bytes ? file_write(path, bytes, size, error)
              : mild_fail(error, MILD_ERROR_MEMORY, "%s: no memory to write it", path);
    cJSON_free(header);
    free(bytes);
    return status;
}

/* ---- reading ---- */

static MildStatus damaged(const char *path, const char *what, MildError *error) {
    return mild_fail(error, MILD_ERROR_FORMAT, "%s: %s; " DAMAGED, path, what);
}

/* A whole number in 0 .. 2^53, exact in JSON's doubles. */
static int whole(const cJSON *item, uint64_t *value) {
    if (!cJSON_IsNumber(item) || !(item->valuedouble >= 0.0) || item->valuedouble > 0x1p53) {
        return 0;
    }
    *value = (uint64_t)item->valuedouble;
    return (double)*value == item->valuedouble;
}

static int parse_type(const cJSON *item, SafetensorsType *type) {
    for (int i = 0; cJSON_IsString(item) && i < (int)(sizeof type_names / sizeof *type_names);
         i++) {
        if (strcmp(item->valuestring, type_names[i]) == 0) {
            *type = (SafetensorsType)i;
            return 1;
        }
    }
    return 0;
}

/* One entry; its size must be that of its shape and lie within the data. Returns what is wrong, or
 * NULL. */
static const char *parse_tensor(const Safetensors *file, const cJSON *entry, Safetensor *tensor) {
    const cJSON *shape = cJSON_GetObjectItemCaseSensitive(entry, "shape");
    const cJSON *offsets = cJSON_GetObjectItemCaseSensitive(entry, "data_offsets");
    uint64_t begin, end, room = file->size - file->data;
    *tensor = (Safetensor){.name = entry->string};
    if (!cJSON_IsObject(entry) ||
        !parse_type(cJSON_GetObjectItemCaseSensitive(entry, "dtype"), &tensor->type)) {
        return "a tensor has a type that is none of F32, F64, I64, U8, F16";
    }
    if (!cJSON_IsArray(shape) || cJSON_GetArraySize(shape) > SAFETENSORS_RANK_MAX) {
        return "a tensor has no usable shape";
    }
    if (!cJSON_IsArray(offsets) || cJSON_GetArraySize(offsets) != 2 ||
        !whole(offsets->child, &begin) || !whole(offsets->child->next, &end) || begin > end ||
        end > room) {
        return "a tensor lies outside the data";
    }
    uint64_t bytes = type_sizes[tensor->type];
    for (const cJSON *item = shape->child; item; item = item->next) {
        uint64_t width;
        if (!whole(item, &width) || width == 0 || width > room || bytes > room / width) {
            return "a tensor's shape does not fit its data";
        }
        bytes *= width;
        tensor->shape[tensor->rank++] = (int64_t)width;
    }
    if (bytes != end - begin) {
        return "a tensor's shape does not fit its data";
    }
    tensor->data = file->bytes + file->data + begin;
    tensor->bytes = (size_t)bytes;
    return NULL;
}

static int by_position(const void *a, const void *b) {
    const unsigned char *x = ((const Safetensor *)a)->data, *y = ((const Safetensor *)b)->data;
    return (x > y) - (x < y);
}

/* Sorted by position, each tensor begins where the one before ends, and the last ends the file;
 * names are unique. */
static const char *check_tiling(Safetensors *file) {
    qsort(file->tensor, (size_t)file->count, sizeof *file->tensor, by_position);
    const unsigned char *at = file->bytes + file->data;
    for (int i = 0; i < file->count; i++) {
        if (file->tensor[i].data != at) {
            return "tensors overlap or leave a gap";
        }
        at += file->tensor[i].bytes;
        for (int j = 0; j < i; j++) {
            if (strcmp(file->tensor[i].name, file->tensor[j].name) == 0) {
                return "two tensors have the same name";
            }
        }
    }
    return at == file->bytes + file->size ? NULL : "the data is longer or shorter than the tensors";
}

static const char *parse_header(Safetensors *file) {
    const cJSON *metadata = cJSON_GetObjectItemCaseSensitive(file->header, "__metadata__");
    for (const cJSON *text = metadata ? metadata->child : NULL; text; text = text->next) {
        if (!cJSON_IsString(text)) {
            return "a text in its metadata is no text";
        }
    }
    for (const cJSON *entry = file->header->child; entry; entry = entry->next) {
        if (entry == metadata) {
            continue;
        }
        const char *wrong = parse_tensor(file, entry, &file->tensor[file->count++]);
        if (wrong) {
            return wrong;
        }
    }
    return check_tiling(file);
}

/* The number of IEEE 754 binary16 with these bits: (-1)^sign (1 + fraction/1024) 2^(exponent - 15);
 * where the exponent is 0, (-1)^sign fraction/1024 2^-14. */
static float half_number(unsigned bits) {
    const int exponent = (int)(bits >> 10 & 31u), fraction = (int)(bits & 1023u);
    float size;
    if (exponent == 31) {
        size = fraction ? NAN : INFINITY;
    } else {
        size = exponent ? ldexpf((float)(1024 + fraction), exponent - 25)
                        : ldexpf((float)fraction, -24);
    }
    return bits & 0x8000u ? -size : size;
}

/* Makes every F16 tensor one of F32, exactly. Returns 0 when out of memory. */
static int widen(Safetensors *file) {
    size_t count = 0;
    for (int i = 0; i < file->count; i++) {
        count += file->tensor[i].type == SAFETENSORS_F16 ? file->tensor[i].bytes / 2 : 0;
    }
    float *at = file->wide = count ? malloc(count * sizeof *at) : NULL;
    for (int i = 0; i < file->count && at; i++) {
        Safetensor *tensor = &file->tensor[i];
        if (tensor->type == SAFETENSORS_F16) {
            const unsigned char *half = tensor->data;
            const size_t numbers = tensor->bytes / 2;
            tensor->type = SAFETENSORS_F32;
            tensor->data = at;
            tensor->bytes = numbers * sizeof *at;
            for (size_t k = 0; k < numbers; k++) {
                *at++ = half_number(half[2 * k] | (unsigned)half[2 * k + 1] << 8);
            }
        }
    }
    return count == 0 || file->wide;
}

/* Everything that can be said before the JSON is looked at. */
static MildStatus check_frame(const unsigned char *bytes, size_t size, const char *path,
                              MildError *error) {
    if (size < PREFIX + 2 || header_length(bytes) > HEADER_MAX || bytes[PREFIX] != '{') {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: no safetensors file (%zu bytes); give a policy or checkpoint of mild",
                         path, size);
    }
    if (header_length(bytes) > size - PREFIX) {
        return damaged(path, "its header goes on past the end", error);
    }
    size_t at = crc_position(bytes, size);
    char text[CRC_DIGITS + 1];
    if (at == 0) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: has no checksum, so mild did not write it or it is damaged", path);
    }
    crc_text(bytes, size, at, text);
    return memcmp(text, bytes + at, CRC_DIGITS)
               ? damaged(path, "its checksum does not match", error)
               : MILD_OK;
}

Safetensors *safetensors_parse(unsigned char *bytes, size_t size, const char *path,
                               MildError *error) {
    if (check_frame(bytes, size, path, error)) {
        free(bytes);
        return NULL;
    }
    size_t length = (size_t)header_length(bytes);
    const char *end = NULL;
    errno = 0;
    cJSON *header = cJSON_ParseWithLengthOpts((const char *)bytes + PREFIX, length, &end, 0);
    int no_memory = !header && errno == ENOMEM;
    int count = cJSON_IsObject(header) ? cJSON_GetArraySize(header) : -1;
    int readable = count >= 0 && count <= TENSORS_MAX;
    Safetensors *file =
        readable ? calloc(1, sizeof *file + (size_t)count * sizeof(Safetensor)) : NULL;
    if (!file) {
        if (readable || no_memory) {
            mild_fail(error, MILD_ERROR_MEMORY, "%s: no memory to read it", path);
        } else {
            damaged(path, "its header cannot be read", error);
        }
        cJSON_Delete(header);
        free(bytes);
        return NULL;
    }
    *file = (Safetensors){.bytes = bytes, .size = size, .data = PREFIX + length, .header = header};
    const char *wrong = parse_header(file);
    for (; end < (const char *)bytes + file->data && !wrong; end++) {
        wrong = *end == ' ' ? NULL : "its header has an end too many";
    }
    if (wrong) {
        damaged(path, wrong, error);
    } else if (!widen(file)) {
        wrong = "no memory";
        mild_fail(error, MILD_ERROR_MEMORY, "%s: no memory to read it", path);
    }
    if (wrong) {
        safetensors_destroy(file);
        return NULL;
    }
    return file;
}

Safetensors *safetensors_read(const char *path, MildError *error) {
    size_t size;
    char *bytes = file_read(path, SIZE_MAX - 1, &size, error);
    return bytes ? safetensors_parse((unsigned char *)bytes, size, path, error) : NULL;
}

void safetensors_destroy(Safetensors *file) {
    if (file) {
        cJSON_Delete(file->header);
        free(file->wide);
        free(file->bytes);
        free(file);
    }
}

int safetensors_count(const Safetensors *file) {
    return file->count;
}

const Safetensor *safetensors_at(const Safetensors *file, int index) {
    return &file->tensor[index];
}

const Safetensor *safetensors_find(const Safetensors *file, const char *name) {
    for (int i = 0; i < file->count; i++) {
        if (strcmp(file->tensor[i].name, name) == 0) {
            return &file->tensor[i];
        }
    }
    return NULL;
}

const char *safetensors_text(const Safetensors *file, const char *key) {
    const cJSON *metadata = cJSON_GetObjectItemCaseSensitive(file->header, "__metadata__");
    return cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(metadata, key));
}
