/* Memory runs out at the n-th allocation, for every n, while files are written and read: an error
 * each time, nothing lost, nothing leaked; and acting and learning allocate nothing of their own.
 * The allocator of this executable counts and fails. What is created: train/test_allocation. */
#include "check.h"

#include <errno.h>
#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "learn/ppo.h"

#if defined(__SANITIZE_ADDRESS__)
#define COUNTS 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define COUNTS 0
#endif
#endif
#ifndef COUNTS
#define COUNTS 1
#endif

#define PATH "build_test_allocation.safetensors"

static atomic_long fail_at = -1; /* allocations until the one that fails; negative: none */
static atomic_long live;         /* blocks allocated and not freed */

#if COUNTS
/* glibc's own allocator, below the functions that this file replaces */
extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *block, size_t size);
extern void *__libc_memalign(size_t alignment, size_t size);
extern void __libc_free(void *block);

static int fails(void) {
    return atomic_load(&fail_at) >= 0 && atomic_fetch_sub(&fail_at, 1) == 0;
}

static void *count(void *block) {
    atomic_fetch_add(&live, block != NULL);
    return block;
}

void *malloc(size_t size) {
    return fails() ? NULL : count(__libc_malloc(size));
}

void *calloc(size_t items, size_t size) {
    return fails() ? NULL : count(__libc_calloc(items, size));
}

void *aligned_alloc(size_t alignment, size_t size) {
    return fails() ? NULL : count(__libc_memalign(alignment, size));
}

int posix_memalign(void **block, size_t alignment, size_t size) {
    *block = aligned_alloc(alignment, size);
    return *block ? 0 : ENOMEM;
}

void *realloc(void *block, size_t size) {
    if (fails()) {
        return NULL;
    }
    atomic_fetch_add(&live, block == NULL);
    return __libc_realloc(block, size);
}

void free(void *block) {
    atomic_fetch_sub(&live, block != NULL);
    __libc_free(block);
}
#endif

/* Runs `attempt` with the 1st, 2nd, ... allocation failing until one run meets no failure. */
static int fail_each(int (*attempt)(void)) {
    for (int n = 0; n < 10000; n++) {
        long before = atomic_load(&live);
        atomic_store(&fail_at, n);
        int ok = attempt();
        int met = atomic_load(&fail_at) < 0;
        atomic_store(&fail_at, -1);
        assert_int_equal(atomic_load(&live), before);
        if (!met) {
            assert_true(ok);
            return n;
        }
        assert_false(ok);
    }
    fail();
    return 0;
}

static Ppo *shared_ppo;

static int attempt_save(void) {
    MildError error = {0};
    return ppo_save(shared_ppo, PATH, "state", 5, "note", &error) == MILD_OK;
}

static int attempt_load_policy(void) {
    MildError error = {0};
    Policy *policy = policy_load(PATH, NULL, 0, &error);
    policy_destroy(policy);
    return policy != NULL;
}

static int attempt_load(void) {
    MildError error = {0};
    char state[5];
    return ppo_load(shared_ppo, PATH, state, sizeof state, &error) == MILD_OK;
}

TEST(test_every_allocation_may_fail) {
    if (!COUNTS) {
        skip();
    }
    MildError error = {0};
    const PolicyDef policy_def = small_def();
    const PpoDef def = ppo_def_default();
    Policy *policy = policy_create(&policy_def, 1, &error);
    Pool *pool = pool_create(1);
    shared_ppo = ppo_create(&def, policy, pool, NULL, 4, 1, &error);
    assert_non_null(shared_ppo);
    const int save = fail_each(attempt_save);
    assert_true(attempt_save());
    const int load_policy = fail_each(attempt_load_policy), load = fail_each(attempt_load);
    print_message("allocations: save %d, load policy %d, resume %d\n", save, load_policy, load);
    ppo_destroy(shared_ppo);
    policy_destroy(policy);
    pool_destroy(pool);
    unlink(PATH);
}

/* oneDNN's packing buffers are its own; whatever it takes it gives back, and a product that finds
 * no memory only costs its minibatch. */
static void check_survival(int optimizer) {
    MildError error = {0};
    PolicyDef def = policy_def_default();
    Policy *policy = policy_create(&def, 1, &error);
    Pool *pool = pool_create(1);
    PpoDef ppo_def = ppo_def_default();
    ppo_def.epochs = 1;
    ppo_def.optimizer = optimizer;
    Ppo *ppo = ppo_create(&ppo_def, policy, pool, NULL, 4, 1, &error);
    assert_non_null(ppo);
    PpoReport report;
    for (int n = -1; n < 3; n++) { /* first once with memory: oneDNN generates its kernels */
        for (int t = 0; t < ppo_def.steps; t++) {
            ppo_act(ppo, t);
        }
        long before = atomic_load(&live);
        atomic_store(&fail_at, n < 0 ? -1 : 40 * n + 1);
        ppo_update(ppo, &report);
        atomic_store(&fail_at, -1);
        assert_true(n < 0 || atomic_load(&live) == before);
        for (int64_t i = 0; i < policy_parameter_count(policy); i++) {
            assert_true(isfinite(policy_parameters(policy)[i]));
        }
    }
    ppo_destroy(ppo);
    policy_destroy(policy);
    pool_destroy(pool);
}

TEST(test_learning_survives_without_memory) {
    if (!COUNTS) {
        skip();
    }
    check_survival(PPO_OPTIMIZER_ADAM);
    check_survival(PPO_OPTIMIZER_MUON);
}

TEST_MAIN(NULL, NULL)
