/* What every test of the learner includes. */
#ifndef MILD_TEST_LEARN_CHECK_H
#define MILD_TEST_LEARN_CHECK_H

#include "base/random.h"
#include "kit.h"
#include "learn/policy.h"

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

static inline void fill_normal(float *x, int64_t count, double scale, Random *random) {
    for (int64_t i = 0; i < count; i++) {
        x[i] = (float)(scale * random_normal(random));
    }
}

#endif
