/* mild train: from a config to a run folder. */
#include <dirent.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "app/build.h"
#include "app/cli.h"
#include "app/commands.h"
#include "app/log.h"
#include "app/paths.h"
#include "app/progress.h"
#include "app/train.h"
#include "base/clock.h"

enum { COLUMNS_FIXED = 25, COLUMNS = COLUMNS_FIXED + TASK_REWARD_COUNT };

typedef struct {
    const char *config, *out;
    int resume;
    ExperimentDef def;
    Trainer *trainer;
    Log *log;
    char column_text[COLUMNS][48];
    const char *column[COLUMNS];
    char note[1024];
} Run;

static const char *const fixed_columns[COLUMNS_FIXED] = {
    "episode/reward",      "episode/length_s",  "episode/speed_error", "episode/falls",
    "episode/ended",       "episode/diverged",  "loss/surrogate",      "loss/value",
    "loss/entropy",        "loss/kl",           "loss/clip_share",     "loss/mirror",
    "loss/reconstruction", "loss/vae_kl",       "loss/base_velocity",  "loss/feet_velocity",
    "loss/feet_height",    "ppo/learning_rate", "ppo/gradient",        "ppo/action_std",
    "ppo/explained",       "ppo/skipped",       "rate/steps_per_s",    "rate/steps",
    "episode/assist"};

static void name_columns(Run *run) {
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

static void fill_row(const Run *run, const TrainReport *r, double row[COLUMNS]) {
    double per_iteration = (double)run->def.train.envs * run->def.ppo.steps;
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
    memcpy(row + COLUMNS_FIXED, r->episodes.terms, sizeof r->episodes.terms);
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

static MildStatus checkpoint_path(const Run *run, int64_t number, char path[PATH_SIZE],
                                  MildError *error) {
    char name[64];
    snprintf(name, sizeof name, "checkpoint_%09" PRId64 ".safetensors", number);
    return path_join(run->out, name, path, error);
}

/* The newest checkpoint below `limit`, or -1; *count counts them all. */
static int64_t newest_checkpoint(const char *folder, int64_t limit, int64_t *oldest, int *count) {
    int64_t newest = -1;
    *oldest = -1;
    *count = 0;
    DIR *dir = opendir(folder);
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

static MildStatus save_checkpoint(Run *run, MildError *error) {
    char path[PATH_SIZE];
    MildStatus status = checkpoint_path(run, train_iteration(run->trainer), path, error);
    if (status == MILD_OK) {
        status = train_save(run->trainer, path, run->note, error);
    }
    if (status == MILD_OK) {
        status = path_join(run->out, "policy.safetensors", path, error);
    }
    if (status == MILD_OK) {
        status = policy_save(train_policy(run->trainer), path, run->note, error);
    }
    int64_t oldest;
    int count;
    newest_checkpoint(run->out, INT64_MAX, &oldest, &count);
    for (; status == MILD_OK && count > run->def.train.keep_checkpoints; count--) {
        if (checkpoint_path(run, oldest, path, error) != MILD_OK || remove(path) != 0) {
            break;
        }
        newest_checkpoint(run->out, INT64_MAX, &oldest, &(int){0});
    }
    return status;
}

static MildStatus write_config(const Run *run, MildError *error) {
    char path[PATH_SIZE];
    ConfigSection sections[EXPERIMENT_SECTIONS];
    ExperimentDef def = run->def;
    experiment_sections(&def, sections);
    char *text = config_text(sections, EXPERIMENT_SECTIONS, 0);
    if (!text) {
        return mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    }
    MildStatus status = path_join(run->out, "config.ini", path, error);
    if (status == MILD_OK) {
        status = path_write(path, text, strlen(text), error);
    }
    if (status == MILD_OK) {
        status = path_join(run->out, "version.txt", path, error);
    }
    char line[sizeof run->note + 64];
    snprintf(line, sizeof line, "%s\n%s\n", build_version(), run->note);
    if (status == MILD_OK) {
        status = path_write(path, line, strlen(line), error);
    }
    free(text);
    return status;
}

/* A checkpoint that does not load (killed machine, broken disk) is passed over for the one before
 * it; one of another config is not: those before it are no better. */
static MildStatus resume(Run *run, MildError *error) {
    int64_t oldest, number = newest_checkpoint(run->out, INT64_MAX, &oldest, &(int){0});
    for (;;) {
        char path[PATH_SIZE];
        MildStatus status = checkpoint_path(run, number, path, error);
        if (status == MILD_OK) {
            status = train_load(run->trainer, path, error);
        }
        if (status == MILD_OK) {
            printf("resumed %s\n", path);
        }
        if (status == MILD_OK || status == MILD_ERROR_ARGUMENT) {
            return status;
        }
        number = newest_checkpoint(run->out, number, &oldest, &(int){0});
        if (number < 0) {
            return status;
        }
        fprintf(stderr, "mild train: %s; trying the checkpoint before\n", error->text);
    }
}

/* ---- the loop ---- */

/* What the progress line shows. */
typedef struct {
    Progress bar;
    double start;                              /* [s] */
    int64_t first;                             /* iteration at the start */
    double steps_per_s, reward, length, falls; /* smoothed, but for falls */
    int64_t bad;                               /* diverged environments and skipped minibatches */
} Display;

static double share_done(const Run *run, const Display *display) {
    const TrainDef *def = &run->def.train;
    double done = (double)(train_iteration(run->trainer) - display->first);
    double by_time =
        def->minutes > 0 ? (clock_seconds() - display->start) / (60 * def->minutes) : -1;
    double by_count = def->iterations > 0 ? (def->iterations > display->first
                                                 ? done / (double)(def->iterations - display->first)
                                                 : 1)
                                          : -1;
    return by_time > by_count ? by_time : by_count;
}

static void display_take(Display *display, const Run *run, const TrainReport *r) {
    double keep = train_iteration(run->trainer) == display->first + 1 ? 0 : 0.9;
    display->steps_per_s = keep * display->steps_per_s + (1 - keep) * r->steps_per_s;
    display->reward = keep * display->reward + (1 - keep) * r->reward_per_step / TASK_PERIOD;
    if (r->episodes.episodes) {
        display->length = display->length > 0 ? 0.9 * display->length + 0.1 * r->episodes.length
                                              : r->episodes.length;
        display->falls = (double)r->episodes.falls / r->episodes.episodes;
    }
    display->bad += r->episodes.diverged + r->ppo.skipped;
    progress_show(&display->bar, share_done(run, display),
                  "iteration %" PRId64
                  "  %.0f steps/s  reward %.2f/s  episode %.1f s  falls %.0f %%  diverged %" PRId64,
                  train_iteration(run->trainer), display->steps_per_s, display->reward,
                  display->length, 100 * display->falls, display->bad);
}

static MildStatus train_loop(Run *run, MildError *error) {
    Display display = {.bar = progress_begin("training"),
                       .start = clock_seconds(),
                       .first = train_iteration(run->trainer)};
    MildStatus status = MILD_OK;
    while (status == MILD_OK && !interrupt_requested() && share_done(run, &display) < 1) {
        TrainReport report;
        double row[COLUMNS];
        status = train_iterate(run->trainer, &report, error);
        if (status != MILD_OK) {
            break;
        }
        fill_row(run, &report, row);
        int64_t iteration = train_iteration(run->trainer);
        status = log_row(run->log, iteration, row, error);
        display_take(&display, run, &report);
        if (status == MILD_OK && iteration % run->def.train.checkpoint_every == 0) {
            status = save_checkpoint(run, error);
        }
    }
    progress_end(&display.bar,
                 "iteration %" PRId64
                 "  %.0f steps/s  reward %.2f/s  episode %.1f s  diverged %" PRId64,
                 train_iteration(run->trainer), display.steps_per_s, display.reward, display.length,
                 display.bad);
    if (status == MILD_OK) {
        status = save_checkpoint(run, error);
    }
    return status;
}

/* A new run takes a folder without checkpoints, a resumed one a folder with some. */
static MildStatus check_folder(const Run *run, MildError *error) {
    int64_t oldest;
    int count;
    newest_checkpoint(run->out, INT64_MAX, &oldest, &count);
    if (!run->resume && count > 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%s holds %d checkpoints: add --resume to go on, or choose another --out",
                         run->out, count);
    }
    if (run->resume && count == 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%s: no checkpoint to resume from; drop --resume to start anew", run->out);
    }
    return MILD_OK;
}

/* What made the policy, as far as it fits; the run folder's config.ini has every key. */
static void write_note(Run *run, const CliArgs *args) {
    const char *folder = run->resume ? run->out : "configs",
               *name = run->resume ? "config" : "default";
    int size = (int)sizeof run->note;
    int used =
        run->config
            ? snprintf(run->note, sizeof run->note, "mild train --config %s", run->config)
            : snprintf(run->note, sizeof run->note, "mild train --config %s/%s.ini", folder, name);
    for (int i = 0; i < args->override_count && used < size; i++) {
        used += snprintf(run->note + used, (size_t)(size - used), " --%s", args->overrides[i]);
    }
    if (used < size) {
        snprintf(run->note + used, (size_t)(size - used), ", seed %" PRIu64 ", version %s",
                 run->def.train.seed, build_version());
    }
}

/* A resumed run keeps the config it began with; --config and overrides still change it. */
static MildStatus read_config(Run *run, const CliArgs *args, MildError *error) {
    char path[PATH_SIZE];
    const char *config = run->config;
    if (run->resume && !config) {
        MildStatus status = path_join(run->out, "config.ini", path, error);
        if (status != MILD_OK) {
            return status;
        }
        config = path;
    }
    run->def = experiment_def_default();
    return experiment_read(&run->def, config, args->overrides, args->override_count, error);
}

static MildStatus prepare(Run *run, const CliArgs *args, MildError *error) {
    MildStatus status = check_folder(run, error);
    if (status == MILD_OK) {
        status = read_config(run, args, error);
    }
    if (status != MILD_OK) {
        return status;
    }
    write_note(run, args);
    run->trainer = train_create(&run->def, error);
    if (!run->trainer) {
        return error->status;
    }
    status = path_make_folder(run->out, error);
    if (status == MILD_OK && run->resume) {
        status = resume(run, error);
    }
    if (status == MILD_OK) {
        status = write_config(run, error);
    }
    if (status != MILD_OK) {
        return status;
    }
    name_columns(run);
    run->log = log_open(run->out, run->column, COLUMNS,
                        run->resume ? train_iteration(run->trainer) : -1, error);
    return run->log ? MILD_OK : error->status;
}

int cmd_train(int argc, char **argv) {
    Run *run = calloc(1, sizeof *run);
    CliArgs *args = calloc(1, sizeof *args);
    if (!run || !args) {
        free(run);
        free(args);
        return cli_fail_text("train", "out of memory");
    }
    const CliOption options[] = {
        {"config", CLI_TEXT, &run->config, 0, 0, "FILE.ini",
         "what to change of configs/default.ini"},
        {"out", CLI_TEXT, &run->out, 0, 0, "FOLDER",
         "run folder: config, log, checkpoints, policy.safetensors"},
        {"resume", CLI_FLAG, &run->resume, 0, 0, NULL,
         "go on from the newest checkpoint in the run folder, with its config.ini unless --config "
         "is given"},
    };
    const CliCommand command = {
        .name = "train",
        .usage = "--config FILE.ini --out FOLDER [--resume] [--section.key=value]",
        .summary = "Trains a walking policy from scratch by PPO. Ctrl-C saves and ends; --resume "
                   "goes on as if the run\n"
                   "had never stopped, bit for bit. The log is log.csv and a TensorBoard file in "
                   "the run folder.",
        .options = options,
        .option_count = sizeof options / sizeof *options,
        .overrides = "any key of configs/default.ini, e.g. --train.minutes=5 --task.vx=0,0.8",
        .examples = "  mild train --config configs/quick.ini --out runs/quick --train.minutes=5\n",
    };
    MildError error = {0};
    int code = 0;
    CliOutcome outcome = cli_parse(&command, argc, argv, args);
    if (outcome != CLI_RUN) {
        code = outcome == CLI_DONE ? 0 : CLI_EXIT_BAD_INPUT;
    } else if (!run->out) {
        code = cli_fail_text("train", "--out FOLDER is missing");
    } else {
        interrupt_install();
        MildStatus status = prepare(run, args, &error);
        if (status == MILD_OK) {
            status = train_loop(run, &error);
        }
        code = status == MILD_OK ? 0 : cli_fail("train", &error);
    }
    log_close(run->log);
    train_destroy(run->trainer);
    free(run);
    free(args);
    return code;
}
