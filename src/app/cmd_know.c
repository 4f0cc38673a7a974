/* mild know: walks on grounds drawn at random, for what a robot knows of its ground. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app/cli.h"
#include "app/commands.h"
#include "app/context.h"
#include "run/config/experiment_keys.h"
#include "run/know/study.h"

enum { TRUTHS = 60, FEET = 2, ROW = 47 + TRUTHS + FEET };

typedef struct {
    Context context;
    const char *walks, *prior;
    int grounds, threads;
    StudyDef study;
    TaskDef drawn;
    StudyWalk *walk;
    FILE *file;
    int steps;
} Know;

static void write_step(void *context, const WalkStep *step) {
    const Know *k = context;
    float row[ROW];
    memcpy(row, step->frame, 47 * sizeof *row);
    memcpy(row + 47, step->critic, 58 * sizeof *row);
    row[47 + 58] = step->critic[58 + 5];
    row[47 + 59] = step->critic[58 + 11];
    for (int f = 0; f < FEET; f++) {
        row[47 + TRUTHS + f] = (float)step->material[f];
    }
    const long at = 128 + ((long)step->walk * k->steps + step->step) * (long)sizeof row;
    fseek(k->file, at, SEEK_SET);
    fwrite(row, sizeof row, 1, k->file);
}

static void write_head(Know *k) {
    char head[128];
    memset(head, ' ', sizeof head);
    memcpy(head, "\x93NUMPY\x01\x00", 8);
    head[8] = 118, head[9] = 0;
    const int n = snprintf(head + 10, 118,
                           "{'descr': '<f4', 'fortran_order': False, 'shape': (%d, %d, %d), }",
                           k->grounds, k->steps, ROW);
    head[10 + n] = ' ';
    head[127] = '\n';
    fwrite(head, sizeof head, 1, k->file);
}

static void write_truths(const Know *k) {
    char path[500];
    snprintf(path, sizeof path, "%s.csv", k->walks);
    FILE *csv = fopen(path, "w");
    fprintf(csv, "walk,grounds,drawn,noise,lasted,commands,vx");
    for (int g = 0; g < 2; g++) {
        fprintf(csv, ",sinkage%d,k_pen%d,sigma_cone%d,mu%d,slip_length%d,preset%d", g, g, g, g, g,
                g);
    }
    fprintf(csv, "\n");
    for (int i = 0; i < k->grounds; i++) {
        const StudyWalk *w = &k->walk[i];
        fprintf(csv, "%d,%d,%d,%g,%d,%d,%g", i, w->grounds, w->drawn, w->noise, w->lasted,
                w->walk.commands, w->walk.command[0][0]);
        for (int g = 0; g < 2; g++) {
            const PriorGround *p = &w->ground[g];
            fprintf(csv, ",%.6g,%.6g,%.6g,%.6g,%.6g,%d", p->sinkage, p->k_pen, p->sigma_cone,
                    p->mu, p->slip_length, p->preset);
        }
        fprintf(csv, "\n");
    }
    fclose(csv);
}

static MildStatus run_know(Know *k, const CliArgs *args, MildError *error) {
    Context *c = &k->context;
    c->pool = pool_create(k->threads);
    MildStatus status = context_open(c, args, error);
    if (status == MILD_OK) {
        status = context_move(c, STUDY_BATCH, error);
    }
    if (status == MILD_OK) {
        char robot[TRAIN_ROBOT_SIZE];
        status = experiment_task(&k->drawn, 1, robot, c->config, c->policy, error);
    }
    k->walk = calloc((size_t)k->grounds, sizeof *k->walk);
    if (status == MILD_OK) {
        StudyDef *s = &k->study;
        s->nominal = &c->task;
        s->drawn = &k->drawn;
        s->robot = c->robot;
        s->pool = c->pool;
        s->controller = &c->mover;
        s->prior = k->prior && strcmp(k->prior, "paper") == 0 ? PRIOR_PAPER : PRIOR_WIDE;
        k->steps = (int)(s->seconds / TASK_PERIOD + 0.5);
        k->file = fopen(k->walks, "wb");
        write_head(k);
        status = study_run(s, k->walk, k->grounds, write_step, k, error);
        fclose(k->file);
        write_truths(k);
    }
    context_close(c);
    return status;
}

int cmd_know(int argc, char **argv) {
    Know *k = calloc(1, sizeof *k);
    CliArgs *args = calloc(1, sizeof *args);
    k->context = context_default();
    k->context.controller = "learned";
    k->grounds = 600;
    k->study.seconds = 12;
    k->study.seed = 1;
    const CliOption options[] = {
        context_policy(&k->context, "policy"),
        {"walks", CLI_OUTPUT, &k->walks, 0, 0, "FILE.npy", "write the walks"},
        {"grounds", CLI_INT, &k->grounds, 1, 100000, "N", "walks"},
        {"threads", CLI_INT, &k->threads, 0, 64, "N", "threads"},
        {"prior", CLI_TEXT, &k->prior, 0, 0, "NAME", "wide or paper"},
        {"seconds", CLI_NUMBER, &k->study.seconds, 1, 600, "T", "[s] of each walk"},
        {"changes", CLI_NUMBER, &k->study.change_share, 0, 1, "P", "share with a border"},
        {"robots", CLI_NUMBER, &k->study.robots, 0, 1, "P", "share with randomised robots"},
        {"quiet", CLI_NUMBER, &k->study.quiet, 0, 1, "P", "share with less noise"},
        {"slow", CLI_NUMBER, &k->study.speed[0], -2, 2, "V", "[m/s]"},
        {"fast", CLI_NUMBER, &k->study.speed[1], -2, 2, "V", "[m/s]"},
        {"seed", CLI_UINT64, &k->study.seed, 0, 0, "S", "seed"},
    };
    const CliCommand command = {.name = "know",
                                .usage = "[options]",
                                .summary = "Walks.",
                                .options = options,
                                .option_count = sizeof options / sizeof *options};
    CliOutcome outcome = cli_parse(&command, argc, argv, args);
    if (outcome != CLI_RUN) {
        return outcome == CLI_DONE ? 0 : CLI_EXIT_BAD_INPUT;
    }
    MildError error = {0};
    int code = run_know(k, args, &error) == MILD_OK ? 0 : cli_fail("know", &error);
    free(k->walk);
    free(k);
    free(args);
    return code;
}
