#include "train/trainer.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/paths.h"
#include "gpu/learner.h"

enum { TRAIN_MATERIALS = 3 }; /* drawn for the pattern of a terrain, as for stripes */

struct Trainer {
    ExperimentDef def;
    Ranks *ranks; /* NULL: alone */
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
    const int threads = def->train.threads ? def->train.threads : ranks_threads(trainer->ranks);
    trainer->pool = pool_create(threads);
    if (!trainer->pool) {
        mild_fail(error, MILD_ERROR_MEMORY, "cannot start %d threads", threads);
        return 0;
    }
    trainer->policy = policy_create(&def->policy, def->train.seed, error);
    if (!trainer->policy) {
        return 0;
    }
    trainer->ppo = ppo_create_part(&def->ppo, trainer->policy, trainer->pool, &mirror,
                                   def->train.envs, def->train.seed, trainer->ranks, error);
    if (!trainer->ppo) {
        return 0;
    }
    if (strcmp(def->train.device, "cuda") == 0) {
        if (ranks_count(trainer->ranks) > 1) {
            mild_fail(error, MILD_ERROR_ARGUMENT,
                      "train.device = cuda trains in one process; start one, or take cpu");
            return 0;
        }
        if (gpu_learner_attach(trainer->ppo, error) != MILD_OK) {
            return 0;
        }
    }
    if (terrain_make(&def->terrain, TRAIN_MATERIALS, &trainer->map, error) != MILD_OK) {
        return 0;
    }
    trainer->def.task.map = trainer->map;
    trainer->def.task.print_tiles = terrain_print_tiles(&def->terrain);
    trainer->vec = vec_create(&def->task, trainer->robot, trainer->pool,
                              ppo_batch(trainer->ppo)->envs, def->train.seed, error);
    if (trainer->vec) {
        vec_number_from(trainer->vec, ppo_first_env(trainer->ppo));
    }
    return trainer->vec != NULL;
}

Trainer *train_create(const ExperimentDef *def, MildError *error) {
    return train_create_part(def, NULL, error);
}

Trainer *train_create_part(const ExperimentDef *def, Ranks *ranks, MildError *error) {
    MildError cause = {0};
    Trainer *trainer = calloc(1, sizeof *trainer);
    if (!trainer) {
        mild_fail(&cause, MILD_ERROR_MEMORY, "out of memory");
    } else {
        trainer->def = *def;
        trainer->ranks = ranks;
    }
    const int built = trainer && build(trainer, &cause);
    if (ranks_agree(ranks, built ? MILD_OK : cause.status, &cause) != MILD_OK || !trainer) {
        mild_fail(error, cause.status, "%s", cause.text);
        train_destroy(trainer);
        return NULL;
    }
    VecView first = view_of(ppo_batch(trainer->ppo), 0, &trainer->def);
    vec_reset(trainer->vec, &first);
    return trainer;
}

/* ---- several processes ---- */

/* Sums over the environments of all. Their last bits depend on the number of processes. */
static void sum_over_ranks(Ranks *ranks, VecStats *sums, double *reward) {
    double numbers[9 + TASK_REWARD_COUNT] = {sums->episodes,    sums->falls,  sums->diverged,
                                             sums->steps,       sums->length, sums->reward,
                                             sums->speed_error, sums->assist, *reward};
    memcpy(numbers + 9, sums->terms, sizeof sums->terms);
    ranks_sum_double(ranks, numbers, 9 + TASK_REWARD_COUNT);
    *sums = (VecStats){.episodes = (int)numbers[0],
                       .falls = (int)numbers[1],
                       .diverged = (int)numbers[2],
                       .steps = numbers[3],
                       .length = numbers[4],
                       .reward = numbers[5],
                       .speed_error = numbers[6],
                       .assist = numbers[7]};
    *reward = numbers[8];
    memcpy(sums->terms, numbers + 9, sizeof sums->terms);
}

uint64_t train_hash(Trainer *trainer) {
    const uint32_t *words = (const uint32_t *)(const void *)policy_parameters(trainer->policy);
    uint64_t hash = 0xcbf29ce484222325u;
    for (int64_t i = 0; i < policy_parameter_count(trainer->policy); i++) {
        hash = (hash ^ words[i]) * 0x100000001b3u;
    }
    return hash;
}

/* Every process applies the same sums to the same parameters. Another kind of processor may round
 * them differently. */
static MildStatus check_same(Trainer *trainer, MildError *error) {
    if (ranks_count(trainer->ranks) == 1) {
        return MILD_OK;
    }
    const uint64_t mine = train_hash(trainer);
    uint64_t first = mine;
    ranks_broadcast(trainer->ranks, &first, sizeof first);
    return mine == first ? MILD_OK
                         : mild_fail(error, MILD_ERROR_ARGUMENT,
                                     "its parameters differ from those of process 1; start the "
                                     "same program on processors of the same kind");
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
    if (ranks_count(trainer->ranks) > 1 && ppo_status(trainer->ppo, error) != MILD_OK) {
        ranks_abort(error); /* the others may wait for this one's gradient */
    }
    double wall = clock_seconds() - start;
    times.update = wall - times.rollout;
    vec_take_times(trainer->vec, &times.physics, &times.ground);
    report->times = times;
    VecStats sums = vec_take_sums(trainer->vec);
    sum_over_ranks(trainer->ranks, &sums, &reward);
    const double samples = (double)trainer->def.train.envs * batch->steps;
    sums.assist /= trainer->def.train.envs;
    vec_stats_means(&sums);
    report->episodes = sums;
    report->steps_per_s = samples / wall;
    report->reward_per_step = reward / samples;
    MildStatus status = check_same(trainer, error);
    return status == MILD_OK ? ppo_status(trainer->ppo, error) : status;
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
