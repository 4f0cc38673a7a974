/* TensorBoard event files: scalars, a text, hyperparameters. The few fields of event.proto,
 * summary.proto and the hparams plugin are encoded by hand, framed as TFRecord (length, masked
 * CRC32C of the length, data, masked CRC32C of the data). */
#ifndef TRAIN_EVENTS_H
#define TRAIN_EVENTS_H

#include <stdint.h>
#include <stdio.h>

#include "mild/error.h"

/* The keys and values of a config.ini as texts, whatever version wrote it. */
typedef struct {
    char *key; /* "section.key" */
    char *value;
} Setting;

typedef struct {
    Setting *list; /* [count] in the order of the text */
    int count;
} Settings;

/* Fails when memory runs out or a line is neither a section nor a key, with "NAME:LINE: reason";
 * there is then nothing to free. */
MildStatus settings_read(const char *text, const char *name, Settings *settings, MildError *error);
void settings_free(Settings *settings);

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

/* One event with a text in Markdown, for TensorBoard's page "Text". */
int events_write_text(FILE *file, double wall_time, const char *tag, const char *text);

/* The hyperparameters of the run, for TensorBoard's page "HParams". Values that are numbers, true
 * or false are written as such, others as texts. */
int events_write_settings(FILE *file, double wall_time, const Settings *settings);

uint32_t events_crc32c(const void *data, size_t size);

#endif
