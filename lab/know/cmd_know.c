/* mild know: judges what a robot knows of its ground from its own sensors; writes walks to learn
 * from. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app/build.h"
#include "app/cli.h"
#include "app/context.h"
#include "app/report.h"
#include "base/file.h"
#include "base/text.h"
#include "identify/belief/file.h"
#include "know/know.h"
#include "lab/lists.h"
#include "run/config/experiment_keys.h"

#define CLOCK_LEAST 0.2 /* [s] as of task.gait_period */

typedef struct {
    Context context;
    const char *walks, *weights, *prior, *ground, *json;
    CliNumbers speed, slick, care, clock;
    int grounds, threads, true_ground;
    StudyDef study;
    TaskDef drawn; /* the randomised robots' */
    MildMaterial preset;
} Know;

/* ---- walks to learn from ---- */

/* Numbers of a step: the frame; the same without noise; true velocities and heights; mean depth of
 * each foot; material under each foot, -1 in the air. */
enum { TRUTH = 11, FEET = 2, ROW = 2 * BELIEF_FRAME + TRUTH + 2 * FEET, NPY_HEAD = 128 };

typedef struct {
    FILE *file;
    int steps;
    int failed; /* bool: the disk is full */
} Log;

static void log_step(void *context, const WalkStep *step) {
    Log *log = context;
    float row[ROW];
    const float *feet = step->critic + BELIEF_FRAME + TRUTH;
    memcpy(row, step->frame, BELIEF_FRAME * sizeof *row);
    memcpy(row + BELIEF_FRAME, step->critic, (BELIEF_FRAME + TRUTH) * sizeof *row);
    for (int f = 0; f < FEET; f++) {
        row[ROW - 2 * FEET + f] = feet[6 * f + 5];
        row[ROW - FEET + f] = (float)step->material[f];
    }
    const long at = NPY_HEAD + ((long)step->walk * log->steps + step->step) * (long)sizeof row;
    log->failed |=
        fseek(log->file, at, SEEK_SET) != 0 || fwrite(row, sizeof row, 1, log->file) != 1;
}

/* Of NumPy's format 1.0. */
static void log_head(const Log *log, int walks) {
    static const char magic[10] = "\x93NUMPY\x01\x00v"; /* 118 characters follow */
    char head[NPY_HEAD], shape[NPY_HEAD];
    const int length = snprintf(shape, sizeof shape,
                                "{'descr': '<f4', 'fortran_order': False, 'shape': (%d, %d, %d), }",
                                walks, log->steps, ROW);
    memset(head, ' ', sizeof head);
    memcpy(head, magic, sizeof magic);
    memcpy(head + sizeof magic, shape, (size_t)length);
    head[NPY_HEAD - 1] = '\n';
    fwrite(head, NPY_HEAD, 1, log->file);
}

static void log_truths(const StudyWalk *walk, int count, FILE *csv) {
    fprintf(csv, "walk,grounds,drawn,noise,lasted,commands,vx");
    for (int g = 0; g < 2; g++) {
        fprintf(csv, ",sinkage%d,k_pen%d,sigma_cone%d,mu%d,slip_length%d,preset%d", g, g, g, g, g,
                g);
    }
    fprintf(csv, "\n");
    for (int i = 0; i < count; i++) {
        const StudyWalk *w = &walk[i];
        fprintf(csv, "%d,%d,%d,%g,%d,%d,%g", i, w->grounds, w->drawn, w->noise, w->lasted,
                w->walk.commands, w->walk.command[0][0]);
        for (int g = 0; g < 2; g++) {
            const PriorGround *p = &w->ground[g];
            fprintf(csv, ",%.6g,%.6g,%.6g,%.6g,%.6g,%d", p->sinkage, p->k_pen, p->sigma_cone, p->mu,
                    p->slip_length, p->preset);
        }
        fprintf(csv, "\n");
    }
}

static MildStatus log_close(FILE *file, const char *path, int failed, MildError *error) {
    return fclose(file) == 0 && !failed
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_FORMAT, "%s: cannot write all of it", path);
}

static MildStatus log_walks(const Know *k, StudyWalk *walk, MildError *error) {
    Log log = {.steps = (int)(k->study.seconds / TASK_PERIOD + 0.5)};
    char truths[PATH_SIZE];
    MildStatus status = path_beside(k->walks, ".csv", truths, error);
    if (status != MILD_OK) {
        return status;
    }
    log.file = fopen(k->walks, "wb");
    FILE *csv = fopen(truths, "w");
    if (!log.file || !csv) {
        status =
            mild_fail(error, MILD_ERROR_ARGUMENT, "%s: cannot write it and %s", k->walks, truths);
    }
    if (status == MILD_OK) {
        log_head(&log, k->grounds);
        const StudyWatcher watcher = {log_step, NULL, &log};
        status = study_run(&k->study, walk, k->grounds, &watcher, error);
    }
    if (status == MILD_OK) {
        log_truths(walk, k->grounds, csv);
    }
    if (log.file) {
        MildStatus closed = log_close(log.file, k->walks, log.failed, error);
        status = status == MILD_OK ? closed : status;
    }
    if (csv) {
        MildStatus closed = log_close(csv, truths, 0, error);
        status = status == MILD_OK ? closed : status;
    }
    return status;
}

/* ---- the judge ---- */

static void print_cells(const JudgeResult *result) {
    char text[TEXT_CELL];
    printf("%-12s %10s %6s %6s %9s %9s\n", "parameter", "footsteps", "walks", "R2", "covered",
           "interval");
    for (int p = 0; p < BELIEF_PARAMETERS; p++) {
        for (int d = 0; d < JUDGE_DEPTHS; d++) {
            const JudgeCell *cell = &result->cell[d][p];
            char after[16] = "end";
            if (d < JUDGE_LAST) {
                snprintf(after, sizeof after, "%d", judge_footsteps[d]);
            }
            printf("%-12s %10s %6d %6s %7.1f %% x %7.3g\n", belief_names[p].name, after,
                   cell->walks, text_cell("%.2f", cell->r2, text), 100 * cell->coverage,
                   cell->factor);
        }
    }
    printf("covered: walks whose true value is in the interval of %.0f %%; interval: its upper end "
           "over its lower, median\n",
           100 * JUDGE_SHARE);
}

static void print_changes(const JudgeResult *result) {
    static const char *const names[JUDGE_BORDERS] = {"all", "twice the sinkage",
                                                     "four times the sinkage"};
    char text[TEXT_CELL];
    printf("false alarms: %d in %.1f min of walking, %.2f in 10 min\n", result->false_alarms,
           result->minutes, 10 * result->false_alarms / fmax(result->minutes, 1e-9));
    for (int b = 0; b < JUDGE_BORDERS && result->border[0].borders; b++) {
        const JudgeBorders *border = &result->border[b];
        printf("borders, %s: %d crossed, %d flagged within two footsteps, %d within four; mean "
               "delay %s\n",
               names[b], border->borders, border->in_two, border->in_four,
               text_cell("%.1f", border->delay, text));
    }
    printf("%d walks fell, %d with an alarm in the second before; a step takes %.2f us\n",
           result->fell, result->before_falls, 1e6 * result->step);
}

/* Of the walks that did not fall. */
static void print_walks(const JudgeWalk *each, int count) {
    double error = 0, cost = 0;
    int stood = 0;
    for (int i = 0; i < count; i++) {
        if (!each[i].fell) {
            error += fabs(each[i].speed - each[i].asked);
            cost += each[i].cost;
            stood++;
        }
    }
    if (stood) {
        printf("the other %d: speed off by %.3f m/s, cost of transport %.3f, means\n", stood,
               error / stood, cost / stood);
    }
}

static cJSON *walks_json(const JudgeWalk *each, int count) {
    cJSON *rows = cJSON_CreateArray();
    for (int i = 0; i < count; i++) {
        cJSON *row = cJSON_CreateObject();
        const PriorGround *ground = &each[i].ground;
        cJSON_AddNumberToObject(row, "sinkage", ground->sinkage);
        cJSON_AddNumberToObject(row, "mu", ground->mu);
        cJSON_AddNumberToObject(row, "slip_length", ground->slip_length);
        cJSON_AddBoolToObject(row, "fell", each[i].fell);
        cJSON_AddNumberToObject(row, "asked", each[i].asked);
        cJSON_AddNumberToObject(row, "speed", each[i].speed);
        cJSON_AddNumberToObject(row, "cost", each[i].cost);
        cJSON_AddNumberToObject(row, "seconds", each[i].seconds);
        cJSON_AddItemToArray(rows, row);
    }
    return rows;
}

static cJSON *result_json(const Know *k, const JudgeResult *result) {
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "version", build_version());
    cJSON_AddStringToObject(root, "policy", k->context.policy);
    cJSON_AddNumberToObject(root, "grounds", k->grounds);
    cJSON_AddNumberToObject(root, "share", JUDGE_SHARE);
    cJSON *rows = cJSON_AddArrayToObject(root, "rows");
    for (int p = 0; p < BELIEF_PARAMETERS; p++) {
        for (int d = 0; d < JUDGE_DEPTHS; d++) {
            const JudgeCell *cell = &result->cell[d][p];
            cJSON *row = cJSON_CreateObject();
            cJSON_AddStringToObject(row, "parameter", belief_names[p].name);
            cJSON_AddNumberToObject(row, "footsteps", judge_footsteps[d]);
            cJSON_AddNumberToObject(row, "walks", cell->walks);
            cJSON_AddNumberToObject(row, "r2", cell->r2);
            cJSON_AddNumberToObject(row, "coverage", cell->coverage);
            cJSON_AddNumberToObject(row, "factor", cell->factor);
            cJSON_AddItemToArray(rows, row);
        }
    }
    cJSON *borders = cJSON_AddArrayToObject(root, "borders");
    for (int b = 0; b < JUDGE_BORDERS; b++) {
        const JudgeBorders *border = &result->border[b];
        cJSON *row = cJSON_CreateObject();
        cJSON_AddNumberToObject(row, "borders", border->borders);
        cJSON_AddNumberToObject(row, "in_two", border->in_two);
        cJSON_AddNumberToObject(row, "in_four", border->in_four);
        cJSON_AddNumberToObject(row, "delay", border->delay);
        cJSON_AddItemToArray(borders, row);
    }
    cJSON_AddNumberToObject(root, "false_alarms", result->false_alarms);
    cJSON_AddNumberToObject(root, "before_falls", result->before_falls);
    cJSON_AddNumberToObject(root, "minutes", result->minutes);
    cJSON_AddNumberToObject(root, "fell", result->fell);
    cJSON_AddNumberToObject(root, "step_s", result->step);
    return root;
}

static MildStatus judge(const Know *k, MildError *error) {
    char shipped[PATH_SIZE];
    JudgeResult result;
    BeliefNet *net =
        belief_read(k->weights ? k->weights : path_data(BELIEF_SHIPPED, shipped), error);
    if (!net) {
        return error->status;
    }
    const JudgeCare care = {.mu = k->care.value[0],
                            .speed = k->care.value[1],
                            .slip = k->clock.value[0],
                            .slow = k->clock.value[1],
                            .fast = k->clock.value[2],
                            .true_ground = k->true_ground};
    JudgeWalk *each = calloc((size_t)k->grounds, sizeof *each);
    MildStatus status = each ? judge_run(&k->study, net, &care, k->grounds, &result, each, error)
                             : mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    free(net);
    if (status == MILD_OK && (!k->json || strcmp(k->json, "-") != 0)) {
        print_cells(&result);
        print_changes(&result);
        print_walks(each, k->grounds);
    }
    if (status == MILD_OK && k->json) {
        cJSON *root = result_json(k, &result);
        cJSON_AddItemToObject(root, "walks", walks_json(each, k->grounds));
        status = report_save(root, k->json, error);
    }
    free(each);
    return status;
}

/* ---- the command ---- */

static const char *const priors[PRIORS] = {"wide", "paper", "presets"};

static MildStatus choose_ground(Know *k, MildError *error) {
    StudyDef *s = &k->study;
    MildStatus status = MILD_OK;
    MildModel model = MILD_MODEL_MILD;
    if (k->prior) {
        int prior = 0;
        while (prior < PRIORS && strcmp(k->prior, priors[prior]) != 0) {
            prior++;
        }
        if (prior == PRIORS) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "--prior: '%.40s' is neither wide nor paper nor presets", k->prior);
        }
        s->prior = (Prior)prior;
    }
    if (k->ground) {
        status = grounds_find(k->ground, &k->preset, &s->rigid, error);
        s->preset = s->rigid ? NULL : &k->preset;
    }
    if (status == MILD_OK && k->context.model && !mild_model_find(k->context.model, &model)) {
        status =
            mild_fail(error, MILD_ERROR_ARGUMENT, "--model: unknown model '%.40s'; nearest is '%s'",
                      k->context.model,
                      text_nearest(k->context.model, (const char **)mild_model_names, MILD_MODELS));
    }
    s->rigid |= model == MILD_MODEL_RIGID;
    s->model = s->rigid ? MILD_MODEL_MILD : model;
    return status;
}

static MildStatus check_pairs(const Know *k, MildError *error) {
    if (k->slick.count && (k->slick.count != 2 || k->slick.value[1] < k->slick.value[0])) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--slick: lowest and highest friction, as 0.2,0.3");
    }
    if (k->care.count && k->care.count != 2) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "--care: friction and speed, as 0.3,0.4");
    }
    if (k->clock.count && (k->clock.count != 3 || k->clock.value[1] < CLOCK_LEAST ||
                           k->clock.value[2] < CLOCK_LEAST)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--clock: slip length and two periods of at least %g s, as 0.02,1,0.6",
                         CLOCK_LEAST);
    }
    return MILD_OK;
}

static MildStatus open_study(Know *k, const CliArgs *args, MildError *error) {
    Context *c = &k->context;
    StudyDef *s = &k->study;
    char robot[TRAIN_ROBOT_SIZE];
    c->pool = pool_create(k->threads);
    MildStatus status = c->pool ? context_open(c, args, error)
                                : mild_fail(error, MILD_ERROR_MEMORY, "cannot start threads");
    if (status == MILD_OK && !belief_has(robot_name(c->robot))) {
        status = mild_fail(error, MILD_ERROR_ARGUMENT,
                           "robot %s: only sa01 has learned to know its ground (docs/identify.md)",
                           robot_name(c->robot));
    }
    status = status == MILD_OK ? context_move(c, STUDY_BATCH, error) : status;
    if (status == MILD_OK) {
        status = experiment_task(&k->drawn, 1, robot, c->config, c->policy, error);
    }
    status = status == MILD_OK ? choose_ground(k, error) : status;
    if (k->speed.count == 1) {
        k->speed.value[1] = k->speed.value[0];
    }
    s->nominal = &c->task;
    s->drawn = &k->drawn;
    s->robot = c->robot;
    s->pool = c->pool;
    s->controller = &c->mover;
    memcpy(s->speed, k->speed.value, sizeof s->speed);
    memcpy(s->slick, k->slick.value, sizeof s->slick);
    return status == MILD_OK ? check_pairs(k, error) : status;
}

static MildStatus run_know(Know *k, const CliArgs *args, MildError *error) {
    MildStatus status = open_study(k, args, error);
    if (status == MILD_OK && k->walks) {
        StudyWalk *walk = calloc((size_t)k->grounds, sizeof *walk);
        status =
            walk ? log_walks(k, walk, error)
                 : mild_fail(error, MILD_ERROR_MEMORY, "out of memory for %d walks", k->grounds);
        free(walk);
    } else if (status == MILD_OK) {
        status = judge(k, error);
    }
    context_close(&k->context);
    return status;
}

static int parse_and_run(Know *k, CliArgs *args, int argc, char **argv) {
    const CliOption options[] = {
        context_policy(&k->context, "policy that walks (default policies/mild.safetensors)"),
        context_config(&k->context),
        {"weights", CLI_INPUT, &k->weights, 0, 0, "FILE",
         "weights to judge (default policies/knows.safetensors)"},
        {"grounds", CLI_INT, &k->grounds, 1, 100000, "N",
         "walks, each on a ground of its own "
         "(default 600)"},
        {"seconds", CLI_NUMBER, &k->study.seconds, 1, 3600, "T",
         "[s] length of each walk (default 12)"},
        {"changes", CLI_NUMBER, &k->study.change_share, 0, 1, "P",
         "[-] share of the walks that cross a border onto another ground (default 0)"},
        {"prior", CLI_TEXT, &k->prior, 0, 0, "NAME",
         "what grounds are drawn from: wide; paper, that of lab/paper; or presets, as they are "
         "(default wide)"},
        {"ground", CLI_TEXT, &k->ground, 0, 0, "NAME", "one ground for all walks, or rigid"},
        {"model", CLI_TEXT, &k->context.model, 0, 0, "NAME",
         "another ground model, matched to the ground that was drawn for mild"},
        {"speed", CLI_NUMBERS, &k->speed, -1.3, 1.3, "LOW[,HIGH]",
         "[m/s] straight walks of speeds between these (default: any command, also changing "
         "ones)"},
        {"slick", CLI_NUMBERS, &k->slick, 0.05, 2, "LOW,HIGH",
         "[-] friction of each walk's ground, or of that behind its border (default: as drawn)"},
        {"grip", CLI_NUMBER, &k->study.grip, 0, 2, "T",
         "[-] greatest friction of a sliding sole by its virgin load, on grounds with a slip "
         "length (default 0: that of the ground)"},
        {"care", CLI_NUMBERS, &k->care, 0, 2, "MU,V",
         "[-, m/s] the robot walks no faster than V while it believes friction to be below MU "
         "(default: it does nothing)"},
        {"clock", CLI_NUMBERS, &k->clock, 0, 10, "SLIP,SLOW,FAST",
         "[m, s, s] while the robot believes the slip length to be below SLIP, its gait clock has "
         "the period SLOW below 0.75 m/s and FAST above (default: that of the policy)"},
        {"true-ground", CLI_FLAG, &k->true_ground, 0, 0, NULL,
         "--care and --clock go by the true numbers of the ground instead of what the robot "
         "believes"},
        {"robots", CLI_NUMBER, &k->study.robots, 0, 1, "P",
         "[-] share of the walks with robots drawn and pushed as in training (default 0.5)"},
        {"quiet", CLI_NUMBER, &k->study.quiet, 0, 1, "P",
         "[-] share of the walks with less noise than in training (default 0)"},
        {"walks", CLI_OUTPUT, &k->walks, 0, 0, "FILE.npy",
         "write the walks to FILE.npy and their grounds to FILE.csv, and judge nothing"},
        {"seed", CLI_UINT64, &k->study.seed, 0, 0, "S", "seed of everything drawn (default 99)"},
        {"threads", CLI_INT, &k->threads, 0, 1024, "N",
         "threads; 0: one for each core (default "
         "0)"},
        {"json", CLI_OUTPUT, &k->json, 0, 0, "FILE",
         "write the results to FILE; - for standard "
         "output"},
    };
    const CliCommand command = {
        .name = "know",
        .usage = "[--grounds N] [--changes P] [options]",
        .summary = "Lets a policy walk on grounds drawn at random, and judges what the robot then "
                   "knows of them from its own sensors: the share of the variance that the "
                   "posterior's mean explains (R2), how often its 90 % interval holds the true "
                   "value, changes of ground that are flagged, and false alarms.",
        .options = options,
        .option_count = sizeof options / sizeof *options,
        .examples = "  mild know\n"
                    "  mild know --changes 1 --robots 0\n"
                    "  mild know --grounds 96 --seconds 60 --speed 0.3,1\n"
                    "  mild know --grounds 6000 --changes 0.35 --quiet 0.2 --seed 1 --walks "
                    "walks.npy\n",
    };
    const int parsed = cli_parse(&command, argc, argv, args);
    if (parsed != CLI_RUN) {
        return parsed;
    }
    MildError error = {0};
    const int code = cli_refuse_dash("know", "walks", k->walks);
    if (code) {
        return code;
    }
    return run_know(k, args, &error) == MILD_OK ? 0 : cli_fail("know", &error);
}

int cmd_know(int argc, char **argv) {
    Know *k = calloc(1, sizeof *k);
    CliArgs *args = calloc(1, sizeof *args);
    int code = CLI_EXIT_BAD_INPUT;
    if (k && args) {
        k->context = context_default();
        k->context.controller = "learned";
        k->grounds = 600;
        k->study.seconds = 12;
        k->study.robots = 0.5;
        k->study.seed = 99;
        code = parse_and_run(k, args, argc, argv);
    } else {
        cli_fail_text("know", "out of memory");
    }
    free(k);
    free(args);
    return code;
}
