#include "app/run_files.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/file.h"

enum { TEXT_MAX = 1 << 20 }; /* bytes of config.ini, version.txt, eval.json */

/* Reads a text of the folder. *text is NULL when there is no such file. */
static MildStatus read_text(const char *folder, const char *name, char path[PATH_SIZE], char **text,
                            MildError *error) {
    size_t size;
    MildStatus status = path_join(folder, name, path, error);
    if (status != MILD_OK || (access(path, F_OK) != 0 && errno == ENOENT)) {
        return status;
    }
    status = file_check_own(path, error);
    if (status != MILD_OK) {
        return status;
    }
    *text = file_read(path, TEXT_MAX, &size, error);
    return *text ? MILD_OK : error->status;
}

static MildStatus read_config(RunFiles *run, MildError *error) {
    char path[PATH_SIZE];
    MildStatus status = read_text(run->folder, "config.ini", path, &run->config, error);
    return status == MILD_OK && run->config
               ? settings_read(run->config, path, &run->settings, error)
               : status;
}

static MildStatus read_eval(RunFiles *run, MildError *error) {
    char path[PATH_SIZE], *text = NULL;
    MildStatus status = read_text(run->folder, "eval.json", path, &text, error);
    if (status != MILD_OK || !text) {
        return status;
    }
    run->eval = cJSON_Parse(text);
    free(text);
    const cJSON *row = cJSON_GetArrayItem(cJSON_GetObjectItem(run->eval, "rows"), 0);
    if (cJSON_IsString(cJSON_GetObjectItem(row, "ground"))) {
        return MILD_OK;
    }
    return mild_fail(
        error, MILD_ERROR_FORMAT,
        "%s: not what mild eval --json writes, or out of memory; write it again or remove "
        "it",
        path);
}

static int is_video(const struct dirent *entry) {
    const size_t length = strlen(entry->d_name);
    return length > 4 && strcmp(entry->d_name + length - 4, ".mp4") == 0;
}

static void find_videos(RunFiles *run) {
    struct dirent **list = NULL;
    const int count = scandir(run->folder, &list, is_video, alphasort);
    for (int i = 0; i < count; i++) {
        if (run->videos < RUN_VIDEOS_MAX) {
            snprintf(run->video[run->videos++], sizeof run->video[0], "%s", list[i]->d_name);
        }
        free(list[i]);
    }
    free(list);
}

static MildStatus read_log(RunFiles *run, MildError *error) {
    char path[PATH_SIZE];
    MildStatus status = path_join(run->folder, "log.csv", path, error);
    if (status == MILD_OK && access(path, F_OK) != 0) {
        return mild_fail(error, MILD_ERROR_IO,
                         "%.300s: cannot read: %s; name a run folder of mild train", path,
                         strerror(errno));
    }
    if (status == MILD_OK) {
        status = file_check_own(path, error);
    }
    return status == MILD_OK ? history_read(path, &run->history, error) : status;
}

MildStatus run_files_read(const char *folder, RunFiles *run, MildError *error) {
    char path[PATH_SIZE];
    *run = (RunFiles){.folder = folder};
    MildStatus status = read_log(run, error);
    if (status == MILD_OK) {
        status = read_config(run, error);
    }
    if (status == MILD_OK) {
        status = read_text(folder, "version.txt", path, &run->version, error);
    }
    if (status == MILD_OK) {
        status = read_eval(run, error);
    }
    if (status != MILD_OK) {
        run_files_free(run);
        return status;
    }
    find_videos(run);
    return MILD_OK;
}

void run_files_free(RunFiles *run) {
    history_free(&run->history);
    settings_free(&run->settings);
    free(run->config);
    free(run->version);
    cJSON_Delete(run->eval);
    *run = (RunFiles){0};
}

int run_files_alike(const RunFiles *a, const RunFiles *b) {
    if (!a->config || !b->config || a->settings.count != b->settings.count) {
        return 0;
    }
    for (int i = 0; i < a->settings.count; i++) {
        const Setting *mine = &a->settings.list[i];
        const char *other = settings_find(&b->settings, mine->key);
        if (!other || (strcmp(mine->value, other) != 0 && strcmp(mine->key, "train.seed") != 0)) {
            return 0;
        }
    }
    return 1;
}
