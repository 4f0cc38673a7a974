#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app/build.h"
#include "app/cli.h"
#include "app/package.h"
#include "app/report.h"
#include "app/robots.h"
#include "base/text.h"
#include "bench/bench.h"
#include "lab/lists.h"
#include "run/config/experiment_keys.h"

/* memory comes first, because it reports the peak of the whole process so far. */
static const struct {
    const char *name;
    MildStatus (*run)(const ExperimentDef *def, BenchReport *report, MildError *error);
    const char *help;
} benches[] = {
    {"memory", bench_memory, "memory that training needs"},
    {"step", bench_step,
     "one physics step of the robot on soft ground and with the engine's own contact, in the same "
     "pose and in turns; ratio_to_rigid is newton over engine_rigid"},
    {"ground", bench_ground, "the contact solver alone"},
    {"elements", bench_elements, "the contact solver with 20 to 2000 elements"},
    {"walk", bench_walk, "the same as step, along a walk of the shipped policy"},
    {"batch", bench_batch,
     "the contact solver in batches, on train.device, along that walk, on grounds of "
     "randomize.model"},
    {"robots", bench_robots, "the environments alone on train.device, in the batch engine"},
    {"update", bench_update,
     "the learner alone: actions of a rollout and update, on train.device, from random numbers"},
    {"train", bench_train, "policy steps per second in training, and how the time is spent"},
};
enum { BENCHES = sizeof benches / sizeof *benches, WORDS };

/* No bench, but a script that runs them and the peers; it has the rest of the line. */
static const CliWord record = {
    "record", "first word: benches and peers in turns, as JSON and a page, and their history "
              "(lab/bench/README.md; mild bench record --help)"};

/* ---- the report ---- */

void bench_add(BenchReport *report, const char *bench, const char *name, double value,
               const char *unit) {
    if (report->count == report->room) {
        const int room = 2 * report->room + 8;
        BenchRow *more = realloc(report->rows, (size_t)room * sizeof *more);
        if (!more) {
            report->is_short = 1;
            return;
        }
        report->rows = more;
        report->room = room;
    }
    BenchRow *row = &report->rows[report->count++];
    *row = (BenchRow){.bench = bench, .unit = unit, .value = value};
    snprintf(row->name, sizeof row->name, "%s", name);
}

void bench_report_free(BenchReport *report) {
    free(report->rows);
    *report = (BenchReport){0};
}

static MildStatus save_json(const BenchReport *report, const char *path, MildError *error) {
    char machine[256];
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "machine", build_machine(machine, sizeof machine));
    cJSON_AddStringToObject(root, "version", build_version());
    cJSON *rows = cJSON_AddArrayToObject(root, "rows");
    for (int i = 0; i < report->count; i++) {
        const BenchRow *row = &report->rows[i];
        cJSON *object = cJSON_CreateObject();
        cJSON_AddStringToObject(object, "bench", row->bench);
        cJSON_AddStringToObject(object, "case", row->name);
        cJSON_AddNumberToObject(object, "value", row->value);
        cJSON_AddStringToObject(object, "unit", row->unit);
        cJSON_AddItemToArray(rows, object);
    }
    return report_save(root, path, error);
}

static void print_rows(const BenchReport *report, int first, FILE *file) {
    for (int i = first; i < report->count; i++) {
        const BenchRow *row = &report->rows[i];
        char bytes[32];
        if (strcmp(row->unit, "B") == 0) {
            fprintf(file, "%-8s %-28s %14s\n", row->bench, row->name,
                    text_bytes(row->value, bytes, sizeof bytes));
        } else {
            fprintf(file, "%-8s %-28s %14.4g %s\n", row->bench, row->name, row->value,
                    strcmp(row->unit, "-") ? row->unit : "");
        }
    }
    fflush(file);
}

/* Checks all names before the first bench runs. */
static int check_names(const CliArgs *args) {
    const char *names[WORDS];
    for (int i = 0; i < BENCHES; i++) {
        names[i] = benches[i].name;
    }
    names[BENCHES] = record.name;
    for (int a = 0; a < args->positional_count; a++) {
        const char *nearest = text_nearest(args->positional[a], names, WORDS);
        if (strcmp(args->positional[a], record.name) == 0) {
            return cli_fail_text("bench", "record must be the first word: mild bench record OUT");
        }
        if (strcmp(nearest, args->positional[a]) != 0) {
            return cli_fail_text("bench", "unknown bench '%s'; nearest is '%s'",
                                 args->positional[a], nearest);
        }
    }
    return 0;
}

static int wanted(const CliArgs *args, const char *name) {
    for (int a = 0; a < args->positional_count; a++) {
        if (strcmp(args->positional[a], name) == 0) {
            return 1;
        }
    }
    return args->positional_count == 0;
}

/* They read an experiment, as `mild train` does, and not a Context: each opens its robot itself,
 * because it sets the model and the shells under it. */
static MildStatus run_benches(const CliArgs *args, const char *robot, FILE *file,
                              BenchReport *report, MildError *error) {
    ExperimentDef def = experiment_def_default();
    MildStatus status = experiment_read(&def, NULL, args->overrides, args->override_count, error);
    if (status == MILD_OK && robot) {
        status = robots_set(&def, robot, error);
    }
    char machine[256];
    if (status == MILD_OK) {
        fprintf(file, "%s, mild %s\n", build_machine(machine, sizeof machine), build_version());
        robots_warn_slow("bench", &def.train, def.train.robot);
    }
    fflush(file);
    for (int i = 0; i < BENCHES && status == MILD_OK; i++) {
        int first = report->count;
        if (!wanted(args, benches[i].name)) {
            continue;
        }
        status = benches[i].run(&def, report, error);
        if (status == MILD_OK && report->is_short) {
            status = mild_fail(error, MILD_ERROR_MEMORY, "bench %s: out of memory for its rows",
                               benches[i].name);
        }
        if (status == MILD_OK) {
            print_rows(report, first, file);
        }
    }
    return status;
}

int cmd_bench(int argc, char **argv) {
    if (argc > 1 && strcmp(argv[1], record.name) == 0) {
        return package_run(argv);
    }
    const char *json = NULL, *robot = NULL;
    const CliOption options[] = {
        {"json", CLI_OUTPUT, &json, 0, 0, "FILE",
         "write {machine, version, rows: [{bench, case, value, unit}]} to FILE; - for standard "
         "output"},
        {"robot", CLI_TEXT, &robot, 0, 0, "NAME|DIR",
         ROBOTS_HELP "; walk needs sa01, the shipped policy's (default sa01)"},
    };
    CliWord words[WORDS];
    for (int i = 0; i < BENCHES; i++) {
        words[i] = (CliWord){benches[i].name, benches[i].help};
    }
    words[BENCHES] = record;
    const CliCommand command = {
        .name = "bench",
        .usage = "[NAME ...] [--json FILE]",
        .summary = "Measures speed and memory on this machine. Without a name it runs every bench, "
                   "which takes a few minutes, but not record.",
        .words_title = "benches",
        .words = words,
        .word_count = WORDS,
        .options = options,
        .option_count = sizeof options / sizeof *options,
        .overrides = "any key of configs/default.ini, e.g. --train.envs=256 --train.threads=1 "
                     "--task.physics_dt=0.001",
        .examples = "  mild bench step\n  mild bench train memory --json bench.json\n"
                    "  mild bench record out/record\n",
        .positional_max = BENCHES,
    };
    CliArgs args;
    const int parsed = cli_parse(&command, argc, argv, &args);
    if (parsed != CLI_RUN) {
        return parsed;
    }
    int bad = check_names(&args);
    if (bad) {
        return bad;
    }
    BenchReport report = {0};
    MildError error = {0};
    FILE *table = json && strcmp(json, "-") == 0 ? stderr : stdout;
    MildStatus status = run_benches(&args, robot, table, &report, &error);
    if (status == MILD_OK && json) {
        status = save_json(&report, json, &error);
    }
    bench_report_free(&report);
    return status == MILD_OK ? 0 : cli_fail("bench", &error);
}
