/* What every test of the learner includes. */
#ifndef MILD_TEST_LEARN_CHECK_H
#define MILD_TEST_LEARN_CHECK_H

#include "base/random.h"
#include "kit.h"
#include "learn/mlp.h"
#include "learn/policy.h"
#include "learn/ppo.h"

/* A network small enough for differences and large enough to hold every feature. */
static inline PolicyDef small_def(void) {
    PolicyDef def = policy_def_default();
    def.observation = 5;
    def.frames = 3;
    def.critic_input = 7;
    def.actions = 2;
    def.estimates = 6;
    def.feet_velocity_offset = 1;
    def.feet_velocity_count = 3;
    def.latent = 4;
    def.encoder_hidden[0] = 12, def.encoder_hidden[1] = 8;
    def.decoder_hidden[0] = 6, def.decoder_hidden[1] = 9;
    def.modulation_hidden = 5;
    def.actor_hidden[0] = 16, def.actor_hidden[1] = 10, def.actor_hidden[2] = 8;
    def.critic_hidden[0] = 11, def.critic_hidden[1] = 7, def.critic_hidden[2] = 6;
    return def;
}

/* Left and right of its five numbers of a frame, three of a scan and two actions. */
static inline PpoMirror small_mirror(void) {
    static const int observation[] = {0, 2, 1, 4, 3, 7, 6, 5}, action[] = {1, 0};
    static const float observation_sign[] = {-1, 1, 1, -1, -1, 1, -1, 1}, action_sign[] = {-1, -1};
    return (PpoMirror){observation, observation_sign, action, action_sign};
}

/* A network forward in double, straight from its formula: ELU between layers. */
static inline void mlp_double(const Mlp *mlp, const double *p, const double *x, double *y) {
    double in[64], out[64];
    memcpy(in, x, (size_t)mlp->layer[0].in * sizeof *x);
    for (int l = 0; l < mlp->layers; l++) {
        const MlpLayer *layer = &mlp->layer[l];
        for (int i = 0; i < layer->out; i++) {
            out[i] = p[layer->bias + i];
            for (int j = 0; j < layer->in; j++) {
                out[i] += p[layer->weight + i * layer->in + j] * in[j];
            }
            if (l < mlp->layers - 1 && out[i] < 0.0) {
                out[i] = expm1(out[i]);
            }
        }
        memcpy(in, out, (size_t)layer->out * sizeof *out);
    }
    memcpy(y, in, (size_t)mlp->layer[mlp->layers - 1].out * sizeof *y);
}

static inline void fill_normal(float *x, int64_t count, double scale, Random *random) {
    for (int64_t i = 0; i < count; i++) {
        x[i] = (float)(scale * random_normal(random));
    }
}

#endif
