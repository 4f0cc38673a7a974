/* mild train: from a config to a run folder. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app/build.h"
#include "app/cli.h"
#include "app/commands.h"
#include "app/progress.h"
#include "app/robots.h"
#include "base/file.h"
#include "base/paths.h"
#include "base/text.h"
#include "device/ranks/ranks.h"
#include "run/config/experiment_keys.h"
#include "run/train/run.h"

enum { VERSION_MAX = 1 << 16 }; /* bytes of version.txt */

typedef struct {
    Ranks *ranks; /* NULL: alone */
    const char *config, *out, *robot;
    int resume;
    ExperimentDef def;
    char *config_text;
    char note[1024];
} Command;

/* The command, truncated if necessary. config.ini in the run folder has every key. */
static void write_command(const Command *run, const CliArgs *args, char *note, int size) {
    const char *folder = run->resume ? run->out : "configs",
               *name = run->resume ? "config" : "default";
    int used = run->config
                   ? snprintf(note, (size_t)size, "mild train --config %s", run->config)
                   : snprintf(note, (size_t)size, "mild train --config %s/%s.ini", folder, name);
    if (run->robot && used < size) {
        used += snprintf(note + used, (size_t)(size - used), " --robot %s", run->robot);
    }
    for (int i = 0; i < args->override_count && used < size; i++) {
        used += snprintf(note + used, (size_t)(size - used), " --%s", args->overrides[i]);
    }
    if (used < size) {
        snprintf(note + used, (size_t)(size - used), ", seed %" PRIu64 ", version %s",
                 run->def.train.seed, build_version());
    }
}

/* Notes the command that made the policy, and before it those that the run was begun and resumed
 * with: the second line of its version.txt. */
static void write_note(Command *run, const CliArgs *args) {
    char path[PATH_SIZE], command[sizeof run->note / 2];
    MildError unused = {0};
    size_t size;
    char *text = run->resume && path_join(run->out, "version.txt", path, NULL) == MILD_OK
                     ? file_read(path, VERSION_MAX, &size, &unused)
                     : NULL;
    const char *before = text ? strchr(text, '\n') : NULL;
    if (before) {
        const int length = (int)strcspn(++before, "\n");
        write_command(run, args, command, (int)sizeof command);
        const int again = strstr(before, command) != NULL;
        snprintf(run->note, sizeof run->note, "%.*s%s%s", length, before,
                 again ? "" : "; resumed: ", again ? "" : command);
    } else {
        write_command(run, args, run->note, (int)sizeof run->note);
    }
    free(text);
}

/* A resumed run keeps the config that it began with, unless --config or overrides change it. */
static MildStatus read_config(Command *run, const CliArgs *args, MildError *error) {
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
    MildStatus status =
        experiment_read(&run->def, config, args->overrides, args->override_count, error);
    return status == MILD_OK && run->robot ? robots_set(&run->def, run->robot, error) : status;
}

static MildStatus make_config_text(Command *run, MildError *error) {
    ConfigSection sections[EXPERIMENT_SECTIONS];
    experiment_sections(&run->def, sections);
    run->config_text = config_text(sections, EXPERIMENT_SECTIONS, 0);
    return run->config_text ? MILD_OK : mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
}

/* ---- what the progress line shows ---- */

typedef struct {
    Progress bar;
    double steps_per_s, reward, length, falls; /* smoothed, except falls; NaN: no episode yet */
    int64_t iteration;                         /* of the whole run */
    int64_t bad;                               /* diverged environments and skipped minibatches */
} Display;

/* A running mean; NaN before its first number. */
static double smoothed(double before, double now) {
    return isnan(before) ? now : 0.9 * before + 0.1 * now;
}

static void display_take(void *self, int64_t iteration, const TrainReport *r, double share) {
    Display *display = self;
    display->iteration = iteration;
    display->steps_per_s = smoothed(display->steps_per_s, r->steps_per_s);
    display->reward = smoothed(display->reward, r->reward_per_step / TASK_PERIOD);
    if (r->episodes.episodes) {
        display->length = smoothed(display->length, r->episodes.length);
        display->falls = (double)r->episodes.falls / r->episodes.episodes;
    }
    char length[TEXT_CELL], falls[TEXT_CELL];
    display->bad += r->episodes.diverged + r->ppo.skipped;
    progress_show(&display->bar, share,
                  "iteration %" PRId64
                  "  %.0f steps/s  reward %.2f/s  episode %s s  falls %s %%  diverged %" PRId64,
                  iteration, display->steps_per_s, display->reward,
                  text_cell("%.1f", display->length, length),
                  text_cell("%.0f", 100 * display->falls, falls), display->bad);
}

static void print_resumed(void *self, const char *checkpoint) {
    (void)self;
    printf("resumed %s\n", checkpoint);
}

static void print_passed_over(void *self, const char *why) {
    (void)self;
    fprintf(stderr, "mild train: %s; trying the checkpoint before\n", why);
}

static int stop(void *self) {
    (void)self;
    return interrupt_requested();
}

/* ---- the command ---- */

static MildStatus train(const Command *command, MildError *error) {
    Display display = {.steps_per_s = NAN, .reward = NAN, .length = NAN, .falls = NAN};
    const int leads = ranks_number(command->ranks) == 0;
    const TrainRunDef def = {.ranks = command->ranks,
                             .folder = command->out,
                             .resume = command->resume,
                             .def = &command->def,
                             .config = command->config_text,
                             .version = build_version(),
                             .note = command->note};
    const TrainCallbacks callbacks = {.self = &display,
                                      .resumed = print_resumed,
                                      .passed_over = print_passed_over,
                                      .stop = stop,
                                      .iterated = display_take};
    if (leads && ranks_count(command->ranks) > 1) {
        const int threads = command->def.train.threads;
        printf("%d processes, %d threads each\n", ranks_count(command->ranks),
               threads ? threads : ranks_threads(command->ranks));
    }
    TrainRun *run = train_run_open(&def, &callbacks, error);
    if (!run) {
        return error->status;
    }
    if (leads) {
        display.bar = progress_begin("training");
    }
    display.iteration = train_run_iteration(run);
    MildStatus status = train_run_loop(run, error);
    if (leads) {
        char rate[TEXT_CELL], reward[TEXT_CELL], length[TEXT_CELL];
        progress_end(&display.bar,
                     "iteration %" PRId64
                     "  %s steps/s  reward %s/s  episode %s s  diverged %" PRId64,
                     display.iteration, text_cell("%.0f", display.steps_per_s, rate),
                     text_cell("%.2f", display.reward, reward),
                     text_cell("%.1f", display.length, length), display.bad);
    }
    train_run_close(run);
    return status;
}

static MildStatus prepare(Command *run, const CliArgs *args, MildError *error) {
    MildStatus status = train_run_check_folder(run->out, run->resume, error);
    if (status == MILD_OK) {
        status = train_run_claim(run->out, run->resume, error);
    }
    if (status == MILD_OK) {
        status = read_config(run, args, error);
    }
    if (status == MILD_OK) {
        write_note(run, args);
        status = make_config_text(run, error);
    }
    if (status == MILD_OK) {
        robots_warn_slow("train", &run->def.train, run->def.train.robot);
    }
    return status;
}

/* ---- several processes: rank 0 reads the command line and the config, and speaks ---- */

/* The others need not see the files of rank 0. */
static MildStatus share_config(Command *run, MildError *error) {
    const int leads = ranks_number(run->ranks) == 0;
    size_t size = leads ? strlen(run->config_text) + 1 : 0;
    ranks_broadcast(run->ranks, &run->resume, sizeof run->resume);
    ranks_broadcast(run->ranks, &size, sizeof size);
    run->config_text = leads ? run->config_text : malloc(size);
    MildStatus status =
        run->config_text ? MILD_OK : mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    status = ranks_agree(run->ranks, status, error);
    if (status != MILD_OK) {
        return status;
    }
    ranks_broadcast(run->ranks, run->config_text, size);
    if (!leads) {
        run->def = experiment_def_default();
        status = experiment_read_text(&run->def, run->config_text, error);
    }
    return ranks_agree(run->ranks, status, error);
}

static MildStatus prepare_and_train(Command *run, const CliArgs *args, MildError *error) {
    MildStatus status = ranks_number(run->ranks) == 0 ? prepare(run, args, error) : MILD_OK;
    status = ranks_agree(run->ranks, status, error);
    if (status == MILD_OK) {
        status = share_config(run, error);
    }
    return status == MILD_OK ? train(run, error) : status;
}

/* Parses on rank 0. Returns whether all go on; otherwise *code is the exit code. */
static int parse(const CliCommand *command, int argc, char **argv, CliArgs *args, Command *run,
                 int *code) {
    int parsed = 0;
    if (ranks_number(run->ranks) == 0) {
        parsed = cli_parse(command, argc, argv, args);
        if (parsed == CLI_RUN && !run->out) {
            parsed = cli_fail_text("train", "--out FOLDER is missing");
        }
    }
    *code = parsed == CLI_RUN ? 0 : parsed;
    return ranks_any(run->ranks, parsed == CLI_RUN);
}

int cmd_train(int argc, char **argv) {
    Command *run = calloc(1, sizeof *run);
    CliArgs *args = calloc(1, sizeof *args);
    if (!run || !args) {
        free(run);
        free(args);
        return cli_fail_text("train", "out of memory");
    }
    const CliOption options[] = {
        {"config", CLI_INPUT, &run->config, 0, 0, "FILE.ini",
         "config file; it needs only the keys that differ from configs/default.ini"},
        {"out", CLI_TEXT, &run->out, 0, 0, "FOLDER",
         "run folder, for config, log, checkpoints and policy.safetensors; a new run overwrites no "
         "file of another"},
        {"robot", CLI_TEXT, &run->robot, 0, 0, "NAME|DIR",
         ROBOTS_HELP "; sets train.robot (default: the config's, or sa01)"},
        {"resume", CLI_FLAG, &run->resume, 0, 0, NULL,
         "continue from the newest checkpoint of the run folder, with its config.ini unless "
         "--config is given"},
    };
    const CliCommand command = {
        .name = "train",
        .usage = "--config FILE.ini --out FOLDER [--resume] [--section.key=value]",
        .summary = "Trains a walking policy from scratch by PPO. Ctrl-C saves the run and ends "
                   "it. --resume continues it as if it had never stopped, bit for bit. The run "
                   "folder gets the log as log.csv and as a TensorBoard file.",
        .options = options,
        .option_count = sizeof options / sizeof *options,
        .overrides = "any key of configs/default.ini, e.g. --train.minutes=5 --task.vx=0,0.8",
        .examples = "  mild train --config configs/quick.ini --out runs/quick --train.minutes=5\n"
                    "  mild train --robot go1 --out runs/go1\n",
    };
    MildError error = {0};
    int code = 0;
    interrupt_install();
    MildStatus status = ranks_open(&run->ranks, &error);
    if (status == MILD_OK && parse(&command, argc, argv, args, run, &code)) {
        status = prepare_and_train(run, args, &error);
    }
    if (status != MILD_OK) {
        code = ranks_number(run->ranks) == 0 ? cli_fail("train", &error) : CLI_EXIT_BAD_INPUT;
    }
    ranks_close(run->ranks);
    free(run->config_text);
    free(run);
    free(args);
    return code;
}
