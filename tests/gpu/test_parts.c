/* Learners on the GPUs of several processes, each with its part of a rollout, against one learner
 * on the CPU with all of it. Started by mpirun (app/test_ranks.sh, scripts/gpus.sh); in one process
 * the part is the whole. On a device with MILD_CUDA and MILD_NCCL, else on the stand-in. */
#include "gpu_check.h"

#include "device/ranks/device.h"

static Ranks *ranks;

/* Numbers of the part's environments, [times][width] of each, from those of all. */
static void take_part(OrderPart part, int times, size_t width, const void *whole, void *own) {
    for (int t = 0; t < times; t++) {
        const size_t from = (size_t)t * (size_t)part.envs + (size_t)part.first,
                     to = (size_t)t * (size_t)part.width;
        memcpy((char *)own + to * width, (const char *)whole + from * width,
               (size_t)part.width * width);
    }
}

static void take_rollout(OrderPart part, const Network *n, const PpoBatch *whole, PpoBatch *own) {
    const size_t number = sizeof(float);
    const int steps = whole->steps, more = steps + 1;
    take_part(part, more, (size_t)n->history * number, whole->history, own->history);
    take_part(part, more, (size_t)n->def.critic_input * number, whole->critic, own->critic);
    take_part(part, more, (size_t)n->def.estimates * number, whole->target, own->target);
    take_part(part, more, (size_t)n->def.observation * number, whole->frame, own->frame);
    take_part(part, steps, (size_t)n->def.actions * number, whole->action, own->action);
    take_part(part, steps, (size_t)n->def.actions * number, whole->mean, own->mean);
    take_part(part, steps, number, whole->log_prob, own->log_prob);
    take_part(part, steps, number, whole->reward, own->reward);
    take_part(part, steps, 1, whole->done, own->done);
    take_part(part, steps, 1, whole->timeout, own->timeout);
    take_part(part, steps, 1, whole->valid, own->valid);
}

/* Largest |a - b| over [steps][width] of the part, where a has all environments. */
static double part_gap(OrderPart part, int steps, int width, const float *a, const float *b) {
    double gap = 0.0;
    for (int t = 0; t < steps; t++) {
        for (int i = 0; i < part.width * width; i++) {
            const double whole = a[((int64_t)t * part.envs + part.first) * width + i],
                         own = b[(int64_t)t * part.width * width + i];
            worse(&gap, fabs(whole - own));
        }
    }
    return gap;
}

/* Actions of both; then those of the whole count, with ratios outside their clip range. */
static void act(Learner *whole, Learner *own, OrderPart part) {
    PpoBatch *a = &whole->batch, *b = &own->batch;
    const int actions = policy_def(whole->policy)->actions;
    for (int t = 0; t < a->steps; t++) {
        ppo_act(whole->ppo, t);
        ppo_act(own->ppo, t);
    }
    learner_read(own);
    assert_true(part_gap(part, a->steps, actions, a->mean, b->mean) < 1e-4);
    assert_true(part_gap(part, a->steps, actions, a->action, b->action) < 1e-4);
    assert_true(part_gap(part, a->steps, 1, a->log_prob, b->log_prob) < 1e-3);
    Random random = random_at(8, 8, 9);
    for (int64_t i = 0; i < (int64_t)a->steps * a->envs; i++) {
        a->log_prob[i] += (float)(0.2 * random_normal(&random));
    }
}

/* The samples of this process's last minibatch are those of its shards, in their order. */
static void check_order(Learner *whole, Learner *own, OrderPart part) {
    const PpoDef *def = &whole->ppo->def;
    const int samples = def->steps * part.width;
    int cut[PPO_SHARDS_MAX + 1], own_cut[PPO_SHARDS_MAX + 1];
    int *order = malloc((size_t)samples * sizeof *order);
    assert_non_null(order);
    order_cuts(part.all, def->steps, part.envs, def->minibatches - 1, def->minibatches, cut);
    const int count = order_own_cuts(part, cut, own_cut), begin = cut[part.shard];
    cudaMemcpyAsync(order, own->gpu->order, (size_t)count * sizeof *order, cudaMemcpyDeviceToHost,
                    own->gpu->queue.stream);
    assert_int_equal(cudaStreamSynchronize(own->gpu->queue.stream), cudaSuccess);
    for (int p = 0; p < count; p++) {
        const int t = order[p] / part.width, env = order[p] % part.width + part.first;
        assert_int_equal(t * part.envs + env, whole->ppo->order[begin + p]);
    }
    free(order);
}

/* All processes have the same bits. */
static void check_same(Learner *own) {
    const size_t bytes = (size_t)policy_parameter_count(own->policy) * sizeof(float);
    const float *mine = policy_parameters(own->policy);
    float *first = malloc(bytes);
    uint64_t hash = ppo_hash(own->ppo);
    assert_non_null(first);
    memcpy(first, mine, bytes);
    ranks_broadcast(ranks, first, bytes);
    ranks_broadcast(ranks, &hash, sizeof hash);
    assert_memory_equal(first, mine, bytes);
    assert_true(hash == ppo_hash(own->ppo));
    free(first);
}

static void fill(Learner *whole, Learner *own, OrderPart part, int round, int fault) {
    const Network *n = &whole->policy->network;
    learner_fill_rollout(whole, 3 + (uint64_t)round);
    take_rollout(part, n, &whole->batch, &own->batch);
    learner_write(own);
    act(whole, own, part);
    spoil(&whole->batch, n, fault);
    take_rollout(part, n, &whole->batch, &own->batch);
    learner_write(own);
}

/* Updates from the same rollout: decisions, advantages, order, and how far the parameters move. */
static double compare_update(int where, const PolicyDef *policy, const PpoDef *def, int envs,
                             int rows, int fault) {
    Learner whole, own;
    learner_open(&whole, ON_CPU, policy, def, envs, 0);
    learner_open_part(&own, where, policy, def, envs, rows, ranks);
    const OrderPart part = own.ppo->part;
    const Network *n = &whole.policy->network;
    const size_t bytes = (size_t)n->count * sizeof(float);
    float *before = malloc(bytes), *steps[2] = {malloc(bytes), malloc(bytes)};
    double moved = 0.0;
    uint64_t hash = 0;
    assert_true(before && steps[0] && steps[1]);
    for (int round = 0; round < 3; round++) { /* from the second on a graph's */
        Learner *const both[] = {&whole, &own};
        PpoReport report[2];
        memcpy(own.policy->parameters, whole.policy->parameters, bytes);
        for (int k = 0; k < 2; k++) {
            learner_fill_parameters(both[k], 3);
        }
        memcpy(before, whole.policy->parameters, bytes);
        fill(&whole, &own, part, round, fault);
        for (int k = 0; k < 2; k++) {
            report[k] = learner_update(both[k]);
            learner_pull(both[k]);
            learner_read(both[k]);
            for (int64_t i = 0; i < n->count; i++) {
                steps[k][i] = both[k]->policy->parameters[i] - before[i];
            }
        }
        compare_reports(&report[1], &report[0], 1e-4);
        assert_int_equal(report[0].skipped > 0, fault >= NOT_FINITE);
        const PpoBatch *a = &whole.batch, *b = &own.batch;
        assert_true(where == MIXED ||
                    part_gap(part, def->steps, 1, a->advantage, b->advantage) < 1e-4);
        assert_true(where == MIXED || part_gap(part, def->steps, 1, a->returns, b->returns) < 1e-4);
        check_order(&whole, &own, part);
        check_same(&own);
        assert_int_equal(own.ppo->adam_steps, whole.ppo->adam_steps);
        assert_true(ranks_count(ranks) == 1 || fault == STARVED || ppo_hash(own.ppo) != hash);
        hash = ppo_hash(own.ppo);
        if (fault == STARVED) {
            assert_memory_equal(steps[1], steps[0], bytes);
        } else {
            worse(&moved, distance(steps[1], steps[0], n->count));
        }
    }
    free(before);
    free(steps[0]);
    free(steps[1]);
    learner_close(&whole);
    learner_close(&own);
    return moved;
}

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
        worse(&worst, compare_update(RESIDENT, &policy, &def, 37, rows, fault));
    }
    worse(&worst, compare_update(MIXED, &policy, &def, 37, 0, INVALID));
    def.optimizer = PPO_OPTIMIZER_MUON;
    worse(&worst, compare_update(RESIDENT, &policy, &def, 37, 0, INVALID));
    def.optimizer = PPO_OPTIMIZER_ADAM;
    def.steps = 10; /* minibatches in which some processes have no sample */
    def.minibatches = 16;
    worse(&worst, compare_update(RESIDENT, &policy, &def, def.shards + 1, 0, NOTHING));
#ifndef EMULATED
    policy = policy_def_default();
    def = def_of();
    worse(&worst, compare_update(RESIDENT, &policy, &def, 256, 0, NOTHING));
    def.minibatches = 2;
    worse(&worst, compare_update(RESIDENT, &policy, &def, 520, 0, INVALID));
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
