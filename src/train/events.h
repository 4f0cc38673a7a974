/* TensorBoard event files, scalars only: the few fields of event.proto and summary.proto encoded by
 * hand, framed as TFRecord (length, masked CRC32C of the length, data, masked CRC32C of the data).
 */
#ifndef TRAIN_EVENTS_H
#define TRAIN_EVENTS_H

#include <stdint.h>
#include <stdio.h>

enum { EVENTS_TAG_MAX = 100 };

/* First record of every file. */
int events_write_version(FILE *file, double wall_time);

/* Marks the start of a session at `step`. Readers ignore what earlier files of the folder contain
 * from that step on. */
int events_write_start(FILE *file, double wall_time, int64_t step);

/* One event with a scalar per tag (tags are cut at EVENTS_TAG_MAX characters). Each returns 0 when
 * all was written. */
int events_write_scalars(FILE *file, double wall_time, int64_t step, const char *const *tags,
                         const double *values, int count);

uint32_t events_crc32c(const void *data, size_t size);

#endif
