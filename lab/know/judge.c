#include "know/know.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

const int judge_footsteps[JUDGE_DEPTHS] = {1, 4, 16, 0};

/* A posterior as it was, of one parameter. */
typedef struct {
    double log_mean, low, high; /* [log SI], [SI], [SI] */
} Said;

typedef struct {
    Belief belief;
    Said said[JUDGE_DEPTHS][BELIEF_PARAMETERS];
    int known[JUDGE_DEPTHS]; /* bool */
    int began;               /* policy step at which this footstep began */
    int touched;             /* step of the first contact with the second ground; 0: none yet */
    int crossed;             /* footsteps on the second ground */
    int flagged;             /* the same, when the alarm came; 0: it has not */
    int false_alarms;
    int latest;   /* policy step of the latest of them */
    int steps;    /* policy steps that are measured */
    double begin; /* [m] where it was before them */
    double end;   /* [m] where it is */
    double work;  /* [J] in them */
} Judged;

#define GRAVITY 9.81 /* [m/s^2] */
#define SETTLES 2.0  /* [s] of a walk that are not measured */

typedef struct {
    const BeliefNet *net;
    const JudgeCare *care;
    const StudyWalk *walk;
    Judged *judged;
    JudgeResult *result;
    double spent; /* [s] in belief_step */
    long steps;   /* of it */
    long calm;    /* of it before a border */
} Judge;

static void keep(const Judge *j, Judged *judged, int depth) {
    judged->known[depth] = 1;
    for (int i = 0; i < BELIEF_PARAMETERS; i++) {
        const BeliefParameter p = (BeliefParameter)i;
        judged->said[depth][i] =
            (Said){belief_log_mean(&judged->belief, j->net, p),
                   belief_quantile(&judged->belief, j->net, p, 0.5 - 0.5 * JUDGE_SHARE),
                   belief_quantile(&judged->belief, j->net, p, 0.5 + 0.5 * JUDGE_SHARE)};
    }
}

static void keep_depths(const Judge *j, Judged *judged) {
    for (int d = 0; d < JUDGE_LAST; d++) {
        if (judged->belief.alarms == 0 && judged->belief.footsteps == judge_footsteps[d]) {
            keep(j, judged, d);
        }
    }
}

/* A footstep counts as one on the second ground if at least half of it came after the contact. */
static void count_footstep(Judged *judged, int step, int event) {
    if (judged->touched && 2 * (step - judged->touched) >= step - judged->began) {
        judged->crossed++;
    }
    judged->began = step;
    if (event & BELIEF_ALARM) {
        if (!judged->touched) {
            judged->false_alarms++;
            judged->latest = step;
        } else if (!judged->flagged) {
            judged->flagged = judged->crossed > 0 ? judged->crossed : 1;
        }
    }
}

static void measure(Judged *judged, const WalkStep *step) {
    if (step->step * TASK_PERIOD < SETTLES) {
        judged->begin = step->forward;
        return;
    }
    judged->end = step->forward;
    judged->work += step->work;
    judged->steps++;
}

static void judge_step(void *context, const WalkStep *step) {
    Judge *j = context;
    Judged *judged = &j->judged[step->walk];
    measure(judged, step);
    const double start = clock_seconds();
    const int event = belief_step(&judged->belief, j->net, step->frame);
    j->spent += clock_seconds() - start;
    j->steps++;
    for (int f = 0; f < ROBOT_FEET_MAX && f < 2; f++) {
        if (step->material[f] == 1 && !judged->touched) {
            judged->touched = step->step;
        }
    }
    j->calm += !judged->touched;
    if (event & BELIEF_FOOTSTEP) {
        count_footstep(judged, step->step, event);
        if (!judged->touched) {
            keep_depths(j, judged);
        }
    }
}

static double truth_of(const PriorGround *ground, int parameter) {
    const double values[BELIEF_PARAMETERS] = {ground->sinkage, ground->k_pen, ground->sigma_cone,
                                              ground->mu, ground->slip_length};
    return values[parameter];
}

/* Whether a parameter is thought to be below a value, or is. */
static int is_below(const Judge *j, int walk, BeliefParameter p, double value) {
    const Judged *judged = &j->judged[walk];
    if (j->care->true_ground) {
        return truth_of(&j->walk[walk].ground[judged->touched > 0], (int)p) < value;
    }
    return judged->belief.footsteps > 0 && belief_quantile(&judged->belief, j->net, p, 0.5) < value;
}

static WalkCare take_care(void *context, int walk) {
    const Judge *j = context;
    const JudgeCare *care = j->care;
    const int fast = fabs(j->walk[walk].walk.command[0][0]) >= JUDGE_FAST;
    WalkCare takes = {.speed = INFINITY};
    if (care->mu > 0 && is_below(j, walk, BELIEF_mu, care->mu)) {
        takes.speed = care->speed;
    }
    if (care->slip > 0 && is_below(j, walk, BELIEF_slip_length, care->slip)) {
        takes.period = fast ? care->fast : care->slow;
    }
    return takes;
}

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* factor: [count] to sort in. */
static JudgeCell judge_cell(const Judge *j, int count, int depth, int parameter, double *factor) {
    double sum = 0, squares = 0, error = 0;
    int walks = 0, inside = 0;
    for (int i = 0; i < count; i++) {
        const Said *said = &j->judged[i].said[depth][parameter];
        if (!j->judged[i].known[depth]) {
            continue;
        }
        const double value = truth_of(&j->walk[i].ground[0], parameter), log_value = log(value);
        sum += log_value;
        squares += log_value * log_value;
        error += (log_value - said->log_mean) * (log_value - said->log_mean);
        inside += value >= said->low && value <= said->high;
        factor[walks++] = said->high / said->low;
    }
    const double variance = walks > 1 ? squares / walks - sum / walks * sum / walks : 0;
    qsort(factor, (size_t)walks, sizeof *factor, compare);
    return (JudgeCell){.walks = walks,
                       .r2 = variance > 1e-12 ? 1 - error / walks / variance : NAN,
                       .coverage = walks ? (double)inside / walks : NAN,
                       .factor = walks ? factor[walks / 2] : NAN};
}

static void count_border(JudgeBorders *border, const Judged *judged) {
    border->borders++;
    border->in_two += judged->flagged > 0 && judged->flagged <= 2;
    border->in_four += judged->flagged > 0 && judged->flagged <= 4;
    border->delay += judged->flagged;
}

/* Borders after which the robot made at least four footsteps. */
static void judge_borders(const Judge *j, int count) {
    JudgeBorders *border = j->result->border;
    int flagged[JUDGE_BORDERS] = {0};
    for (int i = 0; i < count; i++) {
        const Judged *judged = &j->judged[i];
        const PriorGround *ground = j->walk[i].ground;
        if (j->walk[i].grounds < 2 || !judged->touched || judged->crossed < 4) {
            continue;
        }
        const double differ = fabs(log(ground[1].sinkage / ground[0].sinkage));
        const double least[JUDGE_BORDERS] = {0, log(2), log(4)};
        for (int b = 0; b < JUDGE_BORDERS; b++) {
            if (differ >= least[b]) {
                count_border(&border[b], judged);
                flagged[b] += judged->flagged > 0;
            }
        }
    }
    for (int b = 0; b < JUDGE_BORDERS; b++) {
        border[b].delay = flagged[b] ? border[b].delay / flagged[b] : NAN;
    }
}

static JudgeWalk judge_walk(const Judge *j, int i, double weight) {
    const Judged *judged = &j->judged[i];
    const StudyWalk *walk = &j->walk[i];
    const double seconds = judged->steps * TASK_PERIOD, way = judged->end - judged->begin;
    const int measured = judged->steps > 0;
    JudgeWalk found = {.ground = walk->ground[0],
                       .asked = walk->walk.command[0][0],
                       .speed = measured ? way / seconds : NAN,
                       .cost = measured ? judged->work / (weight * fabs(way)) : NAN,
                       .seconds = seconds};
    found.fell = walk->lasted * TASK_PERIOD < walk->seconds - 0.5 * TASK_PERIOD;
    return found;
}

static void judge_all(Judge *j, int count, double *factor) {
    for (int i = 0; i < count; i++) {
        Judged *judged = &j->judged[i];
        const StudyWalk *walk = &j->walk[i];
        const int fell = walk->lasted * TASK_PERIOD < walk->seconds - 0.5 * TASK_PERIOD;
        const int falling =
            fell && judged->false_alarms && (walk->lasted - judged->latest) * TASK_PERIOD <= 1;
        j->result->fell += fell;
        j->result->before_falls += falling;
        j->result->false_alarms += judged->false_alarms - falling;
        if (!judged->touched && judged->belief.footsteps > 0) {
            keep(j, judged, JUDGE_LAST);
        }
    }
    for (int d = 0; d < JUDGE_DEPTHS; d++) {
        for (int p = 0; p < BELIEF_PARAMETERS; p++) {
            j->result->cell[d][p] = judge_cell(j, count, d, p, factor);
        }
    }
    judge_borders(j, count);
    j->result->minutes = (double)j->calm * TASK_PERIOD / 60;
    j->result->step = j->steps ? j->spent / (double)j->steps : 0;
}

MildStatus judge_run(const StudyDef *study, const BeliefNet *net, const JudgeCare *care, int count,
                     JudgeResult *result, JudgeWalk *each, MildError *error) {
    StudyWalk *walk = calloc((size_t)count, sizeof *walk);
    Judged *judged = calloc((size_t)count, sizeof *judged);
    double *factor = calloc((size_t)count, sizeof *factor);
    MildStatus status = walk && judged && factor ? MILD_OK
                                                 : mild_fail(error, MILD_ERROR_MEMORY,
                                                             "out of memory for %d walks", count);
    memset(result, 0, sizeof *result);
    if (status == MILD_OK) {
        Judge j = {.net = net, .care = care, .walk = walk, .judged = judged, .result = result};
        for (int i = 0; i < count; i++) {
            belief_reset(&judged[i].belief);
        }
        const int cares = care->mu > 0 || care->slip > 0;
        const StudyWatcher watcher = {judge_step, cares ? take_care : NULL, &j};
        status = study_run(study, walk, count, &watcher, error);
        if (status == MILD_OK) {
            judge_all(&j, count, factor);
            const double weight = GRAVITY * robot_total_mass(study->robot);
            for (int i = 0; i < count; i++) {
                each[i] = judge_walk(&j, i, weight);
            }
        }
    }
    free(walk);
    free(judged);
    free(factor);
    return status;
}
