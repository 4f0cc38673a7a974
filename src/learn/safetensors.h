/* Safetensors files: 8 bytes of header length (little endian), a JSON header {name: {dtype,
 * shape, data_offsets}} with texts under __metadata__, then the data. The text "crc32" of our
 * files is a CRC-32 of the whole file, computed with its own eight digits as zeros. It detects a
 * flipped bit anywhere. */
#ifndef MILD_SAFETENSORS_H
#define MILD_SAFETENSORS_H

#include <stddef.h>
#include <stdint.h>

#include "mild/error.h"

#define SAFETENSORS_RANK_MAX 4

/* F16, half precision, is for files alone: a reader finds such a tensor as F32. */
typedef enum {
    SAFETENSORS_F32,
    SAFETENSORS_F64,
    SAFETENSORS_I64,
    SAFETENSORS_U8,
    SAFETENSORS_F16
} SafetensorsType;

typedef struct {
    const char *name;
    SafetensorsType type;
    int rank;
    int64_t shape[SAFETENSORS_RANK_MAX];
    const void *data; /* from a file: not aligned, copy it */
    size_t bytes;     /* filled by the reader; the writer computes it from the shape */
} Safetensor;

typedef struct {
    const char *key, *value;
} SafetensorsText;

/* Writes the file completely or not at all (file_write). After a failure the old file is
 * unchanged. */
MildStatus safetensors_write(const char *path, const Safetensor *tensors, int tensor_count,
                             const SafetensorsText *texts, int text_count, MildError *error);

typedef struct Safetensors Safetensors;
/* Read and check everything: sizes, offsets (the tensors tile the data), types, checksum. */
Safetensors *safetensors_read(const char *path, MildError *error);
/* The same from memory. Takes ownership of `bytes` (from malloc), also on failure. `path` names
 * it in messages. */
Safetensors *safetensors_parse(unsigned char *bytes, size_t size, const char *path,
                               MildError *error);
void safetensors_destroy(Safetensors *file);

int safetensors_count(const Safetensors *file);
const Safetensor *safetensors_at(const Safetensors *file, int index);
const Safetensor *safetensors_find(const Safetensors *file, const char *name); /* or NULL */
const char *safetensors_text(const Safetensors *file, const char *key);        /* or NULL */

/* Writes the correct checksum into a complete file. Returns 0 when its header has no place for
 * one. */
int safetensors_seal(unsigned char *bytes, size_t size);

#endif
