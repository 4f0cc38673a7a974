#include "learn/ppo_private.h"

#include <math.h>

#include "learn/ppo_batch.h"
#include "learn/ppo_step.h"

static void returns_piece(void *context, int piece, int thread) {
    (void)thread;
    Ppo *ppo = context;
    const int end = ppo_piece_begin(ppo->batch.envs, piece + 1);
    for (int env = ppo_piece_begin(ppo->batch.envs, piece); env < end; env++) {
        returns_environment(ppo->def.gamma, ppo->def.lambda, &ppo->batch, env);
    }
}

/* Each sample's next usable one, cyclic within the stratum. */
static void substitute_stratum(void *context, int index, int thread) {
    (void)thread;
    Ppo *ppo = context;
    const PpoBatch *b = &ppo->batch;
    const OrderStratum stratum = order_part_stratum(b->steps, ppo->part, index);
    int next = -1;
    for (int k = 2 * stratum.count - 1; k >= 0; k--) {
        const int i = order_sample(stratum, b->envs, k % stratum.count);
        next = returns_usable(b, i) ? i : next;
        ppo->substitute[i] = next < 0 ? i : next;
    }
}

/* ---- moments over the usable samples ---- */

enum { ADVANTAGE, RETURNS, VALUE, NUMBERS };

typedef struct {
    Ppo *ppo;
    double about[NUMBERS]; /* gaps are the distances from these */
    struct {
        double count[PPO_SHARDS_MAX];
        double gaps[NUMBERS][PPO_SHARDS_MAX];
        double squares[NUMBERS][PPO_SHARDS_MAX]; /* of the gaps */
    } sums;                                      /* of each stratum */
    double mean[NUMBERS], std[NUMBERS];
} MomentsJob;

static void add_stratum(void *context, int index, int thread) {
    (void)thread;
    MomentsJob *job = context;
    const PpoBatch *b = &job->ppo->batch;
    const float *const numbers[NUMBERS] = {b->advantage, b->returns, b->value};
    const OrderStratum stratum = order_part_stratum(b->steps, job->ppo->part, index);
    double count = 0.0, gaps[NUMBERS] = {0.0}, squares[NUMBERS] = {0.0};
    for (int k = 0; k < stratum.count; k++) {
        const int i = order_sample(stratum, b->envs, k);
        if (returns_usable(b, i)) {
            count += 1.0;
            for (int n = 0; n < NUMBERS; n++) {
                const double gap = numbers[n][i] - job->about[n];
                gaps[n] += gap;
                squares[n] += gap * gap;
            }
        }
    }
    job->sums.count[index] = count;
    for (int n = 0; n < NUMBERS; n++) {
        job->sums.gaps[n][index] = gaps[n];
        job->sums.squares[n][index] = squares[n];
    }
}

static double total(const double x[PPO_SHARDS_MAX]) {
    double sum = 0.0;
    for (int s = 0; s < PPO_SHARDS_MAX; s++) {
        sum += x[s];
    }
    return sum;
}

/* A stratum is empty but in the one process that has it, so the sum over the ranks is exact. */
static void add_strata(MomentsJob *job) {
    pool_run(job->ppo->pool, job->ppo->part.all, add_stratum, job);
    ranks_sum_double(job->ppo->ranks, (double *)(void *)&job->sums,
                     sizeof job->sums / sizeof(double));
}

/* The means first, then the squares of the distances from them. */
static void find_moments(MomentsJob *job) {
    add_strata(job);
    const double count = fmax(total(job->sums.count), 1.0);
    for (int n = 0; n < NUMBERS; n++) {
        job->about[n] = job->mean[n] = total(job->sums.gaps[n]) / count;
    }
    add_strata(job);
    for (int n = 0; n < NUMBERS; n++) {
        job->std[n] = sqrt(total(job->sums.squares[n]) / count);
    }
}

static void normalise_piece(void *context, int piece, int thread) {
    (void)thread;
    const MomentsJob *job = context;
    const PpoBatch *b = &job->ppo->batch;
    const int samples = b->steps * b->envs, end = ppo_piece_begin(samples, piece + 1);
    for (int i = ppo_piece_begin(samples, piece); i < end; i++) {
        if (returns_usable(b, i)) {
            float *a = &b->advantage[i];
            *a = (float)((*a - job->mean[ADVANTAGE]) / (job->std[ADVANTAGE] + 1e-8));
        }
    }
}

void ppo_returns(Ppo *ppo, PpoReport *report) {
    pool_run(ppo->pool, PPO_PIECES, returns_piece, ppo);
    pool_run(ppo->pool, ppo->part.all, substitute_stratum, ppo);
    MomentsJob job = {.ppo = ppo};
    find_moments(&job);
    ppo->starved = 0;
    for (int s = 0; s < ppo->part.all; s++) {
        const OrderStratum stratum =
            order_stratum(ppo->part.all, ppo->batch.steps, ppo->part.envs, s);
        ppo->starved |= stratum.count > 0 && job.sums.count[s] == 0.0;
    }
    pool_run(ppo->pool, PPO_PIECES, normalise_piece, &job);
    step_report_returns(report, job.mean[VALUE], job.std[ADVANTAGE], job.std[RETURNS]);
}
