/* What a report takes from a run folder. */
#ifndef MILD_RUN_FILES_H
#define MILD_RUN_FILES_H

#include <cjson/cJSON.h>

#include "base/paths.h"
#include "run/train/history.h"
#include "run/train/settings.h"

enum { RUN_VIDEOS_MAX = 4 };

typedef struct {
    const char *folder; /* borrowed */
    History history;    /* log.csv */
    char *config;       /* text of config.ini; NULL: there is none */
    Settings settings;  /* its keys */
    char *version;      /* text of version.txt; NULL: there is none */
    cJSON *eval;        /* eval.json as `mild eval --json` writes it; NULL: there is none */
    int videos;
    char video[RUN_VIDEOS_MAX][256]; /* names of the first *.mp4 of the folder */
} RunFiles;

/* Only log.csv must be there. Links are refused: a report is for others, and must not publish what
 * a link in a folder from elsewhere leads to. There is nothing to free after a failure. */
MildStatus run_files_read(const char *folder, RunFiles *run, MildError *error);
void run_files_free(RunFiles *run);

/* Whether two runs have the same config but for train.seed. Runs without a config never do. */
int run_files_alike(const RunFiles *a, const RunFiles *b);

#endif
