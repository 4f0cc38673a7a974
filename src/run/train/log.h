/* The log of a run folder: a row of named numbers for each iteration, in log.csv and in a
 * TensorBoard event file. */
#ifndef TRAIN_LOG_H
#define TRAIN_LOG_H

#include <stdint.h>
#include <stdio.h>

#include "mild/error.h"

typedef struct Log Log;

/* Fails when there is something at the path of log.csv that must not be written in place: a link,
 * also a hard one, as in the folder of another run that was copied by hard links. */
MildStatus log_check(const char *path, MildError *error);

/* columns: [count] names such as "reward/gait"; TensorBoard groups them by the part before the
 * slash. They are not copied and must outlive the log. The first column of the CSV is
 * "iteration". resume_after < 0: a new log. Otherwise the log is continued with the same
 * columns. Rows after that iteration come from a run that was killed after its last checkpoint.
 * They are dropped from log.csv, and TensorBoard drops its own, too. */
Log *log_open(const char *folder, const char *const *columns, int count, int64_t resume_after,
              MildError *error);

/* Writes the text of config.ini into the TensorBoard file, as a text and as hyperparameters. Call
 * it once, after log_open. */
MildStatus log_config(Log *log, const char *config, MildError *error);

/* values: [count]. Both files are complete up to here when the call returns. */
MildStatus log_row(Log *log, int64_t iteration, const double *values, MildError *error);

void log_close(Log *log);

/* ---- events.c: TensorBoard event files ----
 *
 * Scalars, a text, hyperparameters. The few fields of event.proto, summary.proto and the hparams
 * plugin are encoded by hand, framed as TFRecord (length, masked CRC32C of the length, data, masked
 * CRC32C of the data). */

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
