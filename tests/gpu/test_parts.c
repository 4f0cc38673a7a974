/* Learners on the GPUs of several processes, each with its part of a rollout, against one learner
 * on the CPU with all of it. Started by mpirun (app/test_ranks.sh, scripts/gpus.sh); in one process
 * the part is the whole. On a device with MILD_CUDA and MILD_NCCL, else on the stand-in. */
#include "gpu_check.h"

#include "device/ranks/ranks.h"

static Ranks *ranks;

/* A shard for each process at least. */
static PpoDef def_of(void) {
    PpoDef def = ppo_def_default();
    const int count = ranks_count(ranks);
    def.shards = count > def.shards ? count : def.shards;
    return def;
}

TEST(updates_are_those_of_the_whole) {
    PpoDef def = def_of();
    PolicyDef policy = small_def();
    double worst = 0.0;
    def.average = 0.9;
    for (int fault = 0; fault < FAULTS; fault++) {
        const int rows = fault == NOTHING ? 30 : 0;
        worse(&worst, compare_update(RESIDENT, &policy, &def, 37, rows, fault, ranks));
    }
    worse(&worst, compare_update(MIXED, &policy, &def, 37, 0, INVALID, ranks));
    def.optimizer = PPO_OPTIMIZER_MUON;
    worse(&worst, compare_update(RESIDENT, &policy, &def, 37, 0, INVALID, ranks));
    def.optimizer = PPO_OPTIMIZER_ADAM;
    def.steps = 10; /* minibatches in which some processes have no sample */
    def.minibatches = 16;
    worse(&worst, compare_update(RESIDENT, &policy, &def, def.shards + 1, 0, NOTHING, ranks));
#ifndef EMULATED
    policy = policy_def_default();
    def = def_of();
    worse(&worst, compare_update(RESIDENT, &policy, &def, 256, 0, NOTHING, ranks));
    def.minibatches = 2;
    worse(&worst, compare_update(RESIDENT, &policy, &def, 520, 0, INVALID, ranks));
#endif
    if (ranks_number(ranks) == 0) {
        print_message("%d processes: way of the parameters in an update, against one learner on "
                      "the CPU: %.1e (relative)\n",
                      ranks_count(ranks), worst);
    }
    assert_true(worst < 1e-3);
}

int main(void) {
    MildError error = {0};
    char device[512];
    if (!gpu_device(device, sizeof device)) {
        printf("skipped: %s\n", device);
        return 77;
    }
    /* as the trainer does, but for networks of any size */
    if (ranks_open(&ranks, &error) || ranks_open_device(ranks, (size_t)16 << 20, &error)) {
        fprintf(stderr, "%s\n", error.text);
        return 2;
    }
    const int failed = run_cases(NULL, NULL);
    if (failed) { /* the others may wait for this one */
        ranks_abort(&(MildError){.text = "a test of the learner in parts failed"});
    }
    ranks_close(ranks);
    return failed;
}
