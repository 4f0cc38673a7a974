#include "train/trainer.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/paths.h"
#include "gpu/learner.h"

enum { TRAIN_MATERIALS = 3 }; /* drawn for the pattern of a terrain, as for stripes */

struct Trainer {
    ExperimentDef def;
    MildMap *map; /* NULL: level ground */
    Robot *robot;
    Pool *pool;
    Policy *policy;
    Ppo *ppo;
    Vec *vec;
};

void train_destroy(Trainer *trainer) {
    if (!trainer) {
        return;
    }
    vec_destroy(trainer->vec);
    mild_map_destroy(trainer->map);
    ppo_destroy(trainer->ppo);
    policy_destroy(trainer->policy);
    pool_destroy(trainer->pool);
    robot_destroy(trainer->robot);
    free(trainer);
}

static VecView view_of(const PpoBatch *batch, int t, const ExperimentDef *def) {
    size_t row = (size_t)t * (size_t)batch->envs;
    return (VecView){
        .history = batch->history + row * (size_t)(def->policy.frames * def->policy.observation),
        .critic = batch->critic + row * (size_t)def->policy.critic_input,
        .estimate = batch->target + row * (size_t)def->policy.estimates,
        .frame = batch->frame + row * (size_t)def->policy.observation,
    };
}

static int build(Trainer *trainer, MildError *error) {
    const ExperimentDef *def = &trainer->def;
    MildError cause = {0};
    trainer->robot = robot_open(def->train.robot, &cause);
    if (!trainer->robot) {
        mild_fail(error, cause.status, "train.robot: %s", cause.text);
        return 0;
    }
    experiment_fit_robot(&trainer->def, trainer->robot);
    const TaskMirror sides = task_mirror(trainer->robot);
    const PpoMirror mirror = {sides.observation_index, sides.observation_sign, sides.action_index,
                              sides.action_sign};
    robot_set_model(trainer->robot, (MildModel)def->task.randomize.model);
    trainer->pool = pool_create(def->train.threads);
    if (!trainer->pool) {
        mild_fail(error, MILD_ERROR_MEMORY, "cannot start %d threads", def->train.threads);
        return 0;
    }
    trainer->policy = policy_create(&def->policy, def->train.seed, error);
    if (!trainer->policy) {
        return 0;
    }
    trainer->ppo = ppo_create(&def->ppo, trainer->policy, trainer->pool, &mirror, def->train.envs,
                              def->train.seed, error);
    if (!trainer->ppo) {
        return 0;
    }
    if (strcmp(def->train.device, "cuda") == 0 &&
        gpu_learner_attach(trainer->ppo, &(GpuLearnerDef){.resident = 0}, error)) {
        return 0;
    }
    if (terrain_make(&def->terrain, TRAIN_MATERIALS, &trainer->map, error) != MILD_OK) {
        return 0;
    }
    trainer->def.task.map = trainer->map;
    trainer->def.task.print_tiles = terrain_print_tiles(&def->terrain);
    trainer->vec = vec_create(&def->task, trainer->robot, trainer->pool, def->train.envs,
                              def->train.seed, error);
    return trainer->vec != NULL;
}

Trainer *train_create(const ExperimentDef *def, MildError *error) {
    Trainer *trainer = calloc(1, sizeof *trainer);
    if (!trainer) {
        mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
        return NULL;
    }
    trainer->def = *def;
    if (!build(trainer, error)) {
        train_destroy(trainer);
        return NULL;
    }
    VecView first = view_of(ppo_batch(trainer->ppo), 0, &trainer->def);
    vec_reset(trainer->vec, &first);
    return trainer;
}

MildStatus train_iterate(Trainer *trainer, TrainReport *report, MildError *error) {
    PpoBatch *batch = ppo_batch(trainer->ppo);
    size_t envs = (size_t)batch->envs, actions = (size_t)trainer->def.policy.actions;
    TrainTimes times = {0};
    double start = clock_seconds(), reward = 0;
    for (int t = 0; t < batch->steps; t++) {
        double before = clock_seconds();
        ppo_act(trainer->ppo, t);
        double between = clock_seconds();
        size_t row = (size_t)t * envs;
        VecView next = view_of(batch, t + 1, &trainer->def);
        vec_step(trainer->vec, batch->action + row * actions, batch->reward + row,
                 batch->done + row, batch->timeout + row, batch->valid + row, &next);
        times.inference += between - before;
        times.environments += clock_seconds() - between;
    }
    for (size_t i = 0; i < envs * (size_t)batch->steps; i++) {
        reward += (double)batch->reward[i];
    }
    times.rollout = clock_seconds() - start;
    ppo_update(trainer->ppo, &report->ppo);
    double wall = clock_seconds() - start;
    times.update = wall - times.rollout;
    vec_take_times(trainer->vec, &times.physics, &times.ground);
    report->times = times;
    report->episodes = vec_take_stats(trainer->vec);
    report->steps_per_s = (double)(envs * (size_t)batch->steps) / wall;
    report->reward_per_step = reward / (double)(envs * (size_t)batch->steps);
    return ppo_status(trainer->ppo, error);
}

int64_t train_iteration(const Trainer *trainer) {
    return ppo_iteration(trainer->ppo);
}

Policy *train_policy(Trainer *trainer) {
    return ppo_average(trainer->ppo);
}

size_t train_bytes(const Trainer *trainer) {
    return vec_bytes(trainer->vec) + ppo_bytes(trainer->ppo);
}

int train_threads(const Trainer *trainer) {
    return pool_threads(trainer->pool);
}

MildStatus train_save(Trainer *trainer, const char *path, const char *note, MildError *error) {
    size_t bytes;
    void *state = vec_state(trainer->vec, &bytes);
    return ppo_save(trainer->ppo, path, state, bytes, note, error);
}

MildStatus train_load(Trainer *trainer, const char *path, MildError *error) {
    size_t bytes;
    void *state = vec_state(trainer->vec, &bytes);
    return ppo_load(trainer->ppo, path, state, bytes, error);
}
