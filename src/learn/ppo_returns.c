#include "learn/ppo_returns.h"

#include <math.h>

static int sample_usable(const PpoBatch *b, int64_t i) {
    return b->valid[i] && isfinite(b->value[i]) && isfinite(b->reward[i]);
}

/* Backward over time for one environment:
 *   delta_t = r_t + gamma V(s_t+1) (1 - done) - V(s_t),  A_t = delta_t + gamma lambda (1 - done)
 * A_t+1, where an end by time has r_t += gamma V(s_t), as if the episode went on. An unusable
 * sample cuts like an end. */
static void environment_returns(const PpoDef *def, PpoBatch *b, int env) {
    double advantage = 0.0, next_value = b->value[(int64_t)b->steps * b->envs + env];
    next_value = isfinite(next_value) ? next_value : 0.0;
    for (int t = b->steps - 1; t >= 0; t--) {
        int64_t i = (int64_t)t * b->envs + env;
        if (!sample_usable(b, i)) {
            b->advantage[i] = b->returns[i] = 0.0f;
            advantage = 0.0;
            next_value = isfinite(b->value[i]) ? b->value[i] : 0.0;
            continue;
        }
        double value = b->value[i], live = b->done[i] ? 0.0 : 1.0;
        double reward = b->reward[i] + (b->done[i] && b->timeout[i] ? def->gamma * value : 0.0);
        double delta = reward + live * def->gamma * next_value - value;
        advantage = delta + live * def->gamma * def->lambda * advantage;
        b->advantage[i] = (float)advantage;
        b->returns[i] = (float)(advantage + value);
        next_value = value;
    }
}

typedef struct {
    double mean, std;
} Moments;

static Moments moments_of(const Ppo *ppo, const float *x) {
    double sum = 0.0, squares = 0.0, n = ppo->samples > 0 ? (double)ppo->samples : 1.0;
    for (int k = 0; k < ppo->samples; k++) {
        sum += x[ppo->order[k]];
    }
    for (int k = 0; k < ppo->samples; k++) {
        double gap = x[ppo->order[k]] - sum / n;
        squares += gap * gap;
    }
    return (Moments){sum / n, sqrt(squares / n)};
}

static void returns_piece(void *context, int piece, int thread) {
    (void)thread;
    Ppo *ppo = context;
    const int end = ppo_piece_begin(ppo->batch.envs, piece + 1);
    for (int env = ppo_piece_begin(ppo->batch.envs, piece); env < end; env++) {
        environment_returns(&ppo->def, &ppo->batch, env);
    }
}

void ppo_returns(Ppo *ppo, PpoReport *report) {
    PpoBatch *b = &ppo->batch;
    pool_run(ppo->pool, PPO_PIECES, returns_piece, ppo);
    ppo->samples = 0;
    for (int i = 0; i < b->steps * b->envs; i++) {
        if (sample_usable(b, i)) {
            ppo->order[ppo->samples++] = i;
        }
    }
    Moments advantage = moments_of(ppo, b->advantage), returns = moments_of(ppo, b->returns);
    report->value_mean = moments_of(ppo, b->value).mean;
    report->advantage_std = advantage.std;
    /* returns - value is the advantage before it is normalised */
    report->explained_variance =
        returns.std > 0.0 ? 1.0 - pow(advantage.std / returns.std, 2) : 0.0;
    for (int k = 0; k < ppo->samples; k++) {
        float *a = &b->advantage[ppo->order[k]];
        *a = (float)((*a - advantage.mean) / (advantage.std + 1e-8));
    }
}
