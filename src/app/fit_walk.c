#include "app/fit_work.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app/report.h"
#include "base/paths.h"
#include "identify/belief/file.h"

/* The ground that the posterior is of, from the last alarm on. */
static void print_table(const Belief *belief, const BeliefNet *net) {
    printf("%-12s %10s %10s %10s  %s\n", "parameter", "median", "low 90 %", "high 90 %", "unit");
    for (int i = 0; i < BELIEF_PARAMETERS; i++) {
        const BeliefName *name = &belief_names[i];
        const BeliefParameter p = (BeliefParameter)i;
        printf("%-12s %10.3g %10.3g %10.3g  %s\n", name->name,
               name->scale * belief_quantile(belief, net, p, 0.5),
               name->scale * belief_quantile(belief, net, p, 0.05),
               name->scale * belief_quantile(belief, net, p, 0.95), name->unit);
    }
    printf("from %d footsteps on this ground; the prior and what the parameters are: "
           "docs/identify.md\n",
           belief->footsteps);
}

static cJSON *parameters_json(const Belief *belief, const BeliefNet *net) {
    cJSON *o = cJSON_CreateObject();
    for (int i = 0; i < BELIEF_PARAMETERS; i++) {
        const BeliefParameter p = (BeliefParameter)i;
        cJSON *one = cJSON_AddObjectToObject(o, belief_names[i].name);
        cJSON_AddNumberToObject(one, "median", belief_quantile(belief, net, p, 0.5));
        cJSON_AddNumberToObject(one, "low", belief_quantile(belief, net, p, 0.05));
        cJSON_AddNumberToObject(one, "high", belief_quantile(belief, net, p, 0.95));
    }
    return o;
}

/* A footstep: its end, the posterior in standard deviations of the prior, the odds. */
static cJSON *footstep_json(const Belief *belief, double time, int event) {
    cJSON *o = cJSON_CreateObject();
    cJSON_AddNumberToObject(o, "time_s", time);
    cJSON_AddBoolToObject(o, "alarm", (event & BELIEF_ALARM) != 0);
    if (isfinite(belief->log_odds)) {
        cJSON_AddNumberToObject(o, "log_odds", (double)belief->log_odds);
    }
    cJSON_AddItemToObject(o, "center", cJSON_CreateFloatArray(belief->center, BELIEF_PARAMETERS));
    cJSON_AddItemToObject(o, "spread", cJSON_CreateFloatArray(belief->spread, BELIEF_PARAMETERS));
    return o;
}

static cJSON *walk_log(const BeliefLog *log, const BeliefNet *net, Belief *belief, int quiet) {
    cJSON *footsteps = cJSON_CreateArray();
    belief_reset(belief);
    for (int i = 0; i < log->count; i++) {
        const int event = belief_step(belief, net, log->frame[i]);
        if (event & BELIEF_ALARM && !quiet) {
            printf("%.2f s: other ground\n", i * BELIEF_PERIOD);
        }
        if (event & BELIEF_FOOTSTEP) {
            cJSON_AddItemToArray(footsteps, footstep_json(belief, i * BELIEF_PERIOD, event));
        }
    }
    return footsteps;
}

static MildStatus report(const BeliefLog *log, const BeliefNet *net, const char *path,
                         const char *json, MildError *error) {
    Belief belief;
    const int quiet = json && strcmp(json, "-") == 0;
    cJSON *footsteps = walk_log(log, net, &belief, quiet);
    if (belief.footsteps == 0) {
        cJSON_Delete(footsteps);
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: no footstep in %d rows that counts; a log of walking needs about 2 s "
                         "before the first, and a clock in its last two columns",
                         path, log->count);
    }
    if (!quiet) {
        print_table(&belief, net);
    }
    if (!json) {
        cJSON_Delete(footsteps);
        return MILD_OK;
    }
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "log", path);
    cJSON_AddNumberToObject(root, "footsteps_on_this_ground", belief.footsteps);
    cJSON_AddNumberToObject(root, "alarms", belief.alarms);
    cJSON_AddItemToObject(root, "parameters", parameters_json(&belief, net));
    cJSON_AddItemToObject(root, "footsteps", footsteps);
    return report_save(root, json, error);
}

MildStatus fit_walk(const char *path, int trial, const char *json, MildError *error) {
    BeliefLog log;
    char shipped[PATH_SIZE];
    BeliefNet *net = belief_read(path_data(BELIEF_SHIPPED, shipped), error);
    if (!net) {
        return error->status;
    }
    MildStatus status = belief_log_read(path, trial, &log, error);
    if (status == MILD_OK) {
        status = report(&log, net, path, json, error);
        free(log.frame);
    }
    free(net);
    return status;
}
