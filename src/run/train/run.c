#include "run/train/run.h"

#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/clock.h"
#include "base/file.h"
#include "run/train/log.h"

enum { COLUMNS_FIXED = 25, COLUMNS = COLUMNS_FIXED + TASK_REWARD_COUNT };

struct TrainRun {
    TrainRunDef def;
    TrainCallbacks callbacks;
    Trainer *trainer;
    Log *log;
    FileLock lock; /* on the folder, so that two processes do not mix two runs */
    char column_text[COLUMNS][48];
    const char *column[COLUMNS];
    double start;  /* [s] of the loop */
    int64_t first; /* iteration at its start */
};

static const char *const fixed_columns[COLUMNS_FIXED] = {
    "episode/reward",      "episode/length_s",  "episode/speed_error", "episode/falls",
    "episode/ended",       "episode/diverged",  "loss/surrogate",      "loss/value",
    "loss/entropy",        "loss/kl",           "loss/clip_share",     "loss/mirror",
    "loss/reconstruction", "loss/vae_kl",       "loss/base_velocity",  "loss/feet_velocity",
    "loss/feet_height",    "ppo/learning_rate", "ppo/gradient",        "ppo/action_std",
    "ppo/explained",       "ppo/skipped",       "rate/steps_per_s",    "rate/steps",
    "episode/assist"};

static void name_columns(TrainRun *run) {
    for (int i = 0; i < COLUMNS; i++) {
        if (i < COLUMNS_FIXED) {
            snprintf(run->column_text[i], sizeof run->column_text[i], "%s", fixed_columns[i]);
        } else {
            snprintf(run->column_text[i], sizeof run->column_text[i], "reward/%s",
                     task_reward_names[i - COLUMNS_FIXED]);
        }
        run->column[i] = run->column_text[i];
    }
}

static void fill_row(const TrainRun *run, const TrainReport *r, double row[COLUMNS]) {
    double per_iteration = (double)run->def.def->train.envs * run->def.def->ppo.steps;
    const double fixed[COLUMNS_FIXED] = {r->episodes.reward,
                                         r->episodes.length,
                                         r->episodes.speed_error,
                                         r->episodes.falls,
                                         r->episodes.episodes,
                                         r->episodes.diverged,
                                         r->ppo.surrogate,
                                         r->ppo.value_loss,
                                         r->ppo.entropy,
                                         r->ppo.kl,
                                         r->ppo.clip_share,
                                         r->ppo.mirror,
                                         r->ppo.vae_reconstruction,
                                         r->ppo.vae_kl,
                                         r->ppo.estimate_loss[0],
                                         r->ppo.estimate_loss[1],
                                         r->ppo.estimate_loss[2],
                                         r->ppo.learning_rate,
                                         r->ppo.gradient_norm,
                                         r->ppo.action_std,
                                         r->ppo.explained_variance,
                                         r->ppo.skipped,
                                         r->steps_per_s,
                                         per_iteration * (double)train_iteration(run->trainer),
                                         r->episodes.assist};
    memcpy(row, fixed, sizeof fixed);
    memcpy(row + COLUMNS_FIXED, r->episodes.terms, TASK_REWARD_COUNT * sizeof *row);
}

/* ---- several processes: rank 0 has the folder, and all agree on every step that can fail ---- */

static int leads(const TrainRun *run) {
    return ranks_number(run->def.ranks) == 0;
}

static MildStatus agree(const TrainRun *run, MildStatus status, MildError *error) {
    return ranks_agree(run->def.ranks, status, error);
}

/* ---- the run folder ---- */

static int64_t checkpoint_number(const char *name) {
    int64_t number;
    int end = 0;
    if (sscanf(name, "checkpoint_%9" SCNd64 ".safetensors%n", &number, &end) != 1 || end == 0 ||
        name[end]) {
        return -1;
    }
    return number;
}

static MildStatus checkpoint_path(const TrainRun *run, int64_t number, char path[PATH_SIZE],
                                  MildError *error) {
    char name[64];
    snprintf(name, sizeof name, "checkpoint_%09" PRId64 ".safetensors", number);
    return path_join(run->def.folder, name, path, error);
}

/* Newest checkpoint below `limit`, or -1. *count is the number of all checkpoints, or -1 when the
 * folder exists and cannot be read. */
static int64_t newest_checkpoint(const char *folder, int64_t limit, int64_t *oldest, int *count) {
    int64_t newest = -1;
    *oldest = -1;
    *count = 0;
    DIR *dir = opendir(folder);
    if (!dir && errno != ENOENT && errno != ENOTDIR) {
        *count = -1;
    }
    for (struct dirent *entry; dir && (entry = readdir(dir));) {
        int64_t number = checkpoint_number(entry->d_name);
        if (number < 0) {
            continue;
        }
        ++*count;
        newest = number < limit && number > newest ? number : newest;
        *oldest = *oldest < 0 || number < *oldest ? number : *oldest;
    }
    if (dir) {
        closedir(dir);
    }
    return newest;
}

/* Writes policy.safetensors and removes the oldest checkpoints. */
static MildStatus save_policy(TrainRun *run, MildError *error) {
    char path[PATH_SIZE];
    MildStatus status = path_join(run->def.folder, "policy.safetensors", path, error);
    status = status == MILD_OK ? file_check_own(path, error) : status;
    if (status == MILD_OK) {
        status = policy_save(train_policy(run->trainer), path, run->def.note, error);
    }
    int64_t oldest;
    int count;
    newest_checkpoint(run->def.folder, INT64_MAX, &oldest, &count);
    for (; status == MILD_OK && count > run->def.def->train.keep_checkpoints; count--) {
        if (checkpoint_path(run, oldest, path, error) != MILD_OK || remove(path) != 0) {
            break;
        }
        newest_checkpoint(run->def.folder, INT64_MAX, &oldest, &(int){0});
    }
    return status;
}

static MildStatus save_checkpoint(TrainRun *run, MildError *error) {
    char path[PATH_SIZE] = "";
    MildStatus status =
        leads(run) ? checkpoint_path(run, train_iteration(run->trainer), path, error) : MILD_OK;
    status = agree(run, status, error);
    if (status == MILD_OK) {
        status = train_save(run->trainer, path, run->def.note, error);
    }
    if (status == MILD_OK && leads(run)) {
        status = save_policy(run, error);
    }
    return agree(run, status, error);
}

/* Writes a text to a file of the folder. */
static MildStatus write_text(const TrainRun *run, const char *name, const char *text,
                             MildError *error) {
    char path[PATH_SIZE];
    MildStatus status = path_join(run->def.folder, name, path, error);
    status = status == MILD_OK ? file_check_own(path, error) : status;
    return status == MILD_OK ? file_write(path, text, strlen(text), error) : status;
}

static MildStatus write_config(const TrainRun *run, MildError *error) {
    char version[1200];
    snprintf(version, sizeof version, "%s\n%s\n", run->def.version, run->def.note);
    MildStatus status = write_text(run, "config.ini", run->def.config, error);
    return status == MILD_OK ? write_text(run, "version.txt", version, error) : status;
}

/* Newest checkpoint below `limit`, or -1. */
static int64_t checkpoint_below(const TrainRun *run, int64_t limit) {
    int64_t oldest, number = -1;
    if (leads(run)) {
        number = newest_checkpoint(run->def.folder, limit, &oldest, &(int){0});
    }
    ranks_broadcast(run->def.ranks, &number, sizeof number);
    return number;
}

/* Loads the newest checkpoint that is not damaged (by a power loss or a broken disk). A checkpoint
 * of another config is an error, because the earlier ones have that config too, and so is a lack of
 * memory. */
static MildStatus resume(TrainRun *run, MildError *error) {
    int64_t number = checkpoint_below(run, INT64_MAX);
    for (;;) {
        char path[PATH_SIZE] = "";
        MildStatus status = leads(run) ? checkpoint_path(run, number, path, error) : MILD_OK;
        status = agree(run, status, error);
        if (status == MILD_OK) {
            status = train_load(run->trainer, path, error);
        }
        if (status == MILD_OK && leads(run) && run->callbacks.resumed) {
            run->callbacks.resumed(run->callbacks.self, path);
        }
        if (status == MILD_OK || status == MILD_ERROR_ARGUMENT || status == MILD_ERROR_MEMORY) {
            return status;
        }
        number = checkpoint_below(run, number);
        if (number < 0) {
            return status;
        }
        if (leads(run) && run->callbacks.passed_over) {
            run->callbacks.passed_over(run->callbacks.self, error->text);
        }
    }
}

/* Removes temporary files of runs that were killed while saving. */
static void remove_leftovers(const char *folder) {
    static const char *const ours[] = {"checkpoint_", "policy.safetensors.", "config.ini.",
                                       "version.txt."}; /* file_is_temporary knows the rest */
    DIR *dir = opendir(folder);
    for (struct dirent *entry; dir && (entry = readdir(dir));) {
        char path[PATH_SIZE];
        for (size_t i = 0; i < sizeof ours / sizeof *ours; i++) {
            if (strncmp(entry->d_name, ours[i], strlen(ours[i])) == 0 &&
                file_is_temporary(entry->d_name) &&
                path_join(folder, entry->d_name, path, NULL) == MILD_OK) {
                remove(path);
            }
        }
    }
    if (dir) {
        closedir(dir);
    }
}

/* What a run writes beside checkpoints and the TensorBoard file. */
static const char *const run_names[] = {"policy.safetensors", "log.csv", "config.ini",
                                        "version.txt"};
enum { RUN_NAMES = sizeof run_names / sizeof *run_names };

/* A new run overwrites nothing, whoever made it. A resumed one writes into its own files only, not
 * into what a link or a pipe leads to. */
static MildStatus check_names(const char *folder, int resume, MildError *error) {
    MildStatus status = MILD_OK;
    for (int i = 0; i < RUN_NAMES && status == MILD_OK; i++) {
        char path[PATH_SIZE];
        struct stat info;
        status = path_join(folder, run_names[i], path, error);
        if (status == MILD_OK && resume) {
            status = strcmp(run_names[i], "log.csv") == 0 ? log_check(path, error)
                                                          : file_check_own(path, error);
        } else if (status == MILD_OK && lstat(path, &info) == 0) {
            status = mild_fail(error, MILD_ERROR_ARGUMENT,
                               "%.200s exists and would be overwritten, and without a checkpoint "
                               "--resume cannot go on from it: choose another --out, or move it "
                               "away",
                               path);
        }
    }
    return status;
}

/* A checkpoint's name may be written again: after a damaged one, or when nothing is left to do. */
static MildStatus check_checkpoints(const char *folder, MildError *error) {
    MildStatus status = MILD_OK;
    DIR *dir = opendir(folder);
    for (struct dirent *entry; status == MILD_OK && dir && (entry = readdir(dir));) {
        char path[PATH_SIZE];
        if (checkpoint_number(entry->d_name) >= 0) {
            status = path_join(folder, entry->d_name, path, error);
            status = status == MILD_OK ? file_check_own(path, error) : status;
        }
    }
    if (dir) {
        closedir(dir);
    }
    return status;
}

static MildStatus check_folder(const char *folder, int resume, MildError *error) {
    int64_t oldest;
    int count;
    newest_checkpoint(folder, INT64_MAX, &oldest, &count);
    if (count < 0) {
        return mild_fail(error, errno == ENOMEM ? MILD_ERROR_MEMORY : MILD_ERROR_IO,
                         "%s: cannot read the folder: %s", folder, strerror(errno));
    }
    if (!resume && count > 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%s holds %d checkpoints: add --resume to go on, or choose another --out",
                         folder, count);
    }
    if (resume && count == 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%s: no checkpoint to resume from; start anew, without --resume, in "
                         "another --out",
                         folder);
    }
    MildStatus status = resume ? check_checkpoints(folder, error) : MILD_OK;
    return status == MILD_OK ? check_names(folder, resume, error) : status;
}

MildStatus train_run_check_folder(const char *folder, int resume, MildError *error) {
    char lock[PATH_SIZE];
    const long holder =
        path_join(folder, "lock", lock, NULL) == MILD_OK ? file_lock_holder(lock) : 0;
    if (holder) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%.200s: in use by process %ld, which trains in this folder; choose "
                         "another --out",
                         folder, holder);
    }
    return check_folder(folder, resume, error);
}

MildStatus train_run_claim(const char *folder, int resume, MildError *error) {
    MildStatus status = MILD_OK;
    for (int i = 0; i < RUN_NAMES && status == MILD_OK; i++) {
        char path[PATH_SIZE];
        if (resume &&
            (strcmp(run_names[i], "config.ini") == 0 || strcmp(run_names[i], "version.txt") == 0)) {
            continue; /* read, and written again with what has changed */
        }
        status = path_join(folder, run_names[i], path, error);
        status = status == MILD_OK ? file_claim(path, "--out", error) : status;
    }
    return status;
}

/* Locks the folder for this run. Checks it again, because another run may have started there
 * since. */
static MildStatus take_folder(TrainRun *run, MildError *error) {
    const char *folder = run->def.folder;
    char path[PATH_SIZE];
    MildError cause = {0};
    MildStatus status = path_make_folder(folder, error);
    if (status == MILD_OK) {
        status = path_join(folder, "lock", path, error);
    }
    if (status != MILD_OK) {
        return status;
    }
    status = file_lock(&run->lock, path, &cause);
    if (status == MILD_ERROR_FORMAT) {
        return mild_fail(error, status, "%.300s, or choose another --out", cause.text);
    }
    if (status == MILD_ERROR_ARGUMENT) {
        return mild_fail(error, status, "%.250s, which trains in this folder; choose another --out",
                         cause.text);
    }
    if (status != MILD_OK) {
        return mild_fail(error, status, "%s", cause.text);
    }
    remove_leftovers(folder);
    return check_folder(folder, run->def.resume, error);
}

/* A log of other columns ends a resumed run before anything is written; a new one begins with its
 * config, because a log alone is in the way of the next. */
static MildStatus open_log(TrainRun *run, MildError *error) {
    const int resume = run->def.resume;
    MildStatus status = resume ? MILD_OK : write_config(run, error);
    if (status != MILD_OK) {
        return status;
    }
    name_columns(run);
    run->log = log_open(run->def.folder, run->column, COLUMNS,
                        resume ? train_iteration(run->trainer) : -1, error);
    status = run->log ? MILD_OK : error->status;
    if (status == MILD_OK && resume) {
        status = write_config(run, error);
    }
    return status == MILD_OK ? log_config(run->log, run->def.config, error) : status;
}

/* A resumed run has its networks from its checkpoint. */
static Trainer *make_trainer(const TrainRun *run, MildError *error) {
    ExperimentDef def = *run->def.def;
    if (run->def.resume) {
        def.train.start[0] = 0;
    }
    return train_create_part(&def, run->def.ranks, error);
}

static MildStatus build(TrainRun *run, MildError *error) {
    MildStatus status = MILD_OK;
    if (leads(run)) {
        status = train_run_check_folder(run->def.folder, run->def.resume, error);
    }
    if (agree(run, status, error) != MILD_OK) {
        return error->status;
    }
    run->trainer = make_trainer(run, error);
    if (!run->trainer) {
        return error->status;
    }
    status = agree(run, leads(run) ? take_folder(run, error) : MILD_OK, error);
    if (status == MILD_OK && run->def.resume) {
        status = resume(run, error);
    }
    if (status == MILD_OK && leads(run)) {
        status = open_log(run, error);
    }
    return agree(run, status, error);
}

TrainRun *train_run_open(const TrainRunDef *def, const TrainCallbacks *callbacks,
                         MildError *error) {
    TrainRun *run = calloc(1, sizeof *run);
    MildStatus status = run ? MILD_OK : mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    if (ranks_agree(def->ranks, status, error) != MILD_OK || !run) {
        free(run);
        return NULL;
    }
    run->lock.file = -1;
    run->def = *def;
    run->callbacks = *callbacks;
    if (build(run, error) != MILD_OK) {
        train_run_close(run);
        return NULL;
    }
    return run;
}

void train_run_close(TrainRun *run) {
    if (!run) {
        return;
    }
    log_close(run->log);
    file_unlock(&run->lock);
    train_destroy(run->trainer);
    free(run);
}

int64_t train_run_iteration(const TrainRun *run) {
    return train_iteration(run->trainer);
}

/* ---- the loop ---- */

/* Share of the run that is done, 0 .. 1; negative when the run has no end. */
static double share_done(const TrainRun *run) {
    const TrainDef *def = &run->def.def->train;
    double done = (double)(train_iteration(run->trainer) - run->first);
    double by_time = def->minutes > 0 ? (clock_seconds() - run->start) / (60 * def->minutes) : -1;
    double by_count = -1;
    if (def->iterations > 0) {
        by_count = def->iterations > run->first ? done / (double)(def->iterations - run->first) : 1;
    }
    return by_time > by_count ? by_time : by_count;
}

static int goes_on(const TrainRun *run) {
    const int stop = run->callbacks.stop && run->callbacks.stop(run->callbacks.self);
    return !ranks_any(run->def.ranks, stop || share_done(run) >= 1);
}

static MildStatus log_iteration(TrainRun *run, const TrainReport *report, MildError *error) {
    double row[COLUMNS];
    const int64_t iteration = train_iteration(run->trainer);
    fill_row(run, report, row);
    MildStatus status = log_row(run->log, iteration, row, error);
    if (run->callbacks.iterated) {
        run->callbacks.iterated(run->callbacks.self, iteration, report, share_done(run));
    }
    return status;
}

static MildStatus iterate(TrainRun *run, MildError *error) {
    TrainReport report;
    MildStatus status = train_iterate(run->trainer, &report, error);
    if (status == MILD_OK && leads(run)) {
        status = log_iteration(run, &report, error);
    }
    status = agree(run, status, error);
    if (status == MILD_OK &&
        train_iteration(run->trainer) % run->def.def->train.checkpoint_every == 0) {
        status = save_checkpoint(run, error);
    }
    return status;
}

MildStatus train_run_loop(TrainRun *run, MildError *error) {
    run->start = clock_seconds();
    run->first = train_iteration(run->trainer);
    MildStatus status = MILD_OK;
    while (status == MILD_OK && goes_on(run)) {
        status = iterate(run, error);
    }
    return status == MILD_OK ? save_checkpoint(run, error) : status;
}
