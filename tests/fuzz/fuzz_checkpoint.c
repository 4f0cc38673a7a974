/* Any bytes as a checkpoint to resume a tiny training from, with the checksum put right. Refused
 * with a message and nothing changed, or loaded whole and finite. */
#include "fuzz.h"
#include "learn/ppo.h"
#include "learn/ppo_private.h"

enum { EXTRA = 4, ENVS = 1 };

static Ppo *ppo;

static void make_ppo(void) {
    PolicyDef def = policy_def_default();
    def.observation = def.frames = def.critic_input = def.actions = def.estimates = def.latent = 1;
    def.feet_velocity_offset = 0;
    def.feet_velocity_count = 1;
    def.encoder_hidden[0] = def.decoder_hidden[0] = def.actor_hidden[0] = def.critic_hidden[0] = 1;
    for (int l = 1; l < POLICY_LAYERS_MAX; l++) {
        def.encoder_hidden[l] = def.decoder_hidden[l] = def.actor_hidden[l] = def.critic_hidden[l] =
            0;
    }
    def.modulation_hidden = 1;
    PpoDef learner = ppo_def_default();
    learner.average = 0.5;
    Policy *policy = policy_create(&def, 1, NULL);
    Pool *pool = pool_create(1);
    fuzz_check(policy && pool);
    ppo = ppo_create(&learner, policy, pool, NULL, ENVS, 1, NULL);
    fuzz_check(ppo != NULL);
}

static void check_finite(const float *values, int64_t count) {
    for (int64_t i = 0; i < count; i++) {
        fuzz_check(isfinite(values[i]));
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (!ppo) {
        make_ppo();
    }
    unsigned char *bytes = malloc(size + 1);
    fuzz_check(bytes != NULL);
    memcpy(bytes, data, size);
    safetensors_seal(bytes, size);
    char extra[EXTRA];
    const Policy *policy = ppo->policy;
    const float before = policy_parameters(ppo->policy)[0];
    MildError error = {0};
    Safetensors *file = safetensors_parse(bytes, size, "fuzz", &error);
    if (file && ppo_load_file(ppo, file, "fuzz", extra, sizeof extra, &error) == MILD_OK) {
        check_finite(policy->parameters, policy->network.count);
        check_finite(policy_parameters(ppo->average), policy->network.count);
        check_finite(ppo->first, policy->network.count);
        check_finite(ppo->second, policy->network.count);
    } else {
        fuzz_check(error.status != MILD_OK && error.text[0]);
        fuzz_check(memcmp(&before, policy->parameters, sizeof before) == 0);
    }
    safetensors_destroy(file);
    return 0;
}
