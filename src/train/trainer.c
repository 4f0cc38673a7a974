#include "train/trainer.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/paths.h"
#include "gpu/learner.h"
#include "train/envs.h"

enum { TRAIN_MATERIALS = 3 }; /* drawn for the pattern of a terrain, as for stripes */

struct Trainer {
    ExperimentDef def;
    MildMap *map; /* NULL: level ground */
    Robot *robot;
    Pool *pool;
    Policy *policy;
    Ppo *ppo;
    TrainEnvs *envs;
    void *stream; /* of the learner's device; NULL: none */
};

void train_destroy(Trainer *trainer) {
    if (!trainer) {
        return;
    }
    train_envs_destroy(trainer->envs);
    mild_map_destroy(trainer->map);
    ppo_destroy(trainer->ppo);
    policy_destroy(trainer->policy);
    pool_destroy(trainer->pool);
    robot_destroy(trainer->robot);
    free(trainer);
}

/* The batch engine has patches as stripes of the map. */
static int is_striped(const ExperimentDef *def) {
    return train_is_batch(&def->train) && def->task.randomize.patch_share > 0 &&
           def->terrain.map.patches == MILD_PATTERN_NONE;
}

static MildStatus make_map(Trainer *trainer, MildError *error) {
    const ExperimentDef *def = &trainer->def;
    return is_striped(def) ? terrain_make_striped(&def->terrain, TRAIN_MATERIALS,
                                                  def->task.randomize.patch_length, def->train.seed,
                                                  &trainer->map, error)
                           : terrain_make(&def->terrain, TRAIN_MATERIALS, &trainer->map, error);
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
    const GpuLearnerDef gpu = {.device = train_device(&def->train),
                               .resident = train_is_batch(&def->train)};
    if (gpu.device >= 0 && gpu_learner_attach(trainer->ppo, &gpu, error)) {
        return 0;
    }
    trainer->stream = gpu_learner_stream(trainer->ppo);
    if (make_map(trainer, error) != MILD_OK) {
        return 0;
    }
    trainer->def.task.map = trainer->map;
    trainer->def.task.print_tiles = terrain_print_tiles(&def->terrain);
    trainer->envs = train_envs_create(def, is_striped(def), trainer->robot, trainer->pool,
                                      def->train.envs, 0, error);
    return trainer->envs != NULL && train_envs_reset(trainer->envs, ppo_batch(trainer->ppo),
                                                     trainer->stream, error) == MILD_OK;
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
    return trainer;
}

/* One rollout. On a GPU actions and environments are only enqueued, and take their time
 * together. */
static MildStatus roll_out(Trainer *trainer, TrainTimes *times, MildError *error) {
    PpoBatch *batch = ppo_batch(trainer->ppo);
    MildStatus status = MILD_OK;
    for (int t = 0; t < batch->steps && status == MILD_OK; t++) {
        double before = clock_seconds();
        ppo_act(trainer->ppo, t);
        double between = clock_seconds();
        status = train_envs_step(trainer->envs, batch, t, trainer->stream, error);
        times->inference += between - before;
        times->environments += clock_seconds() - between;
    }
    double before = clock_seconds();
    status = status == MILD_OK ? train_envs_wait(trainer->envs, error) : status;
    times->environments += clock_seconds() - before;
    return status;
}

MildStatus train_iterate(Trainer *trainer, TrainReport *report, MildError *error) {
    const double samples = (double)trainer->def.train.envs * trainer->def.ppo.steps;
    TrainTimes times = {0};
    VecStats sums;
    double start = clock_seconds();
    MildStatus status = roll_out(trainer, &times, error);
    if (status != MILD_OK) {
        return status;
    }
    times.rollout = clock_seconds() - start;
    ppo_update(trainer->ppo, &report->ppo);
    double wall = clock_seconds() - start;
    times.update = wall - times.rollout;
    train_envs_take_times(trainer->envs, &times.physics, &times.ground);
    report->times = times;
    status = train_envs_take_sums(trainer->envs, &sums, trainer->stream, error);
    if (status != MILD_OK) {
        return status;
    }
    report->episodes = vec_stats_from(sums, trainer->def.train.envs);
    report->steps_per_s = samples / wall;
    report->reward_per_step = sums.paid / samples;
    return ppo_status(trainer->ppo, error);
}

int64_t train_iteration(const Trainer *trainer) {
    return ppo_iteration(trainer->ppo);
}

Policy *train_policy(Trainer *trainer) {
    return ppo_average(trainer->ppo);
}

size_t train_bytes(const Trainer *trainer) {
    return train_envs_bytes(trainer->envs) + ppo_bytes(trainer->ppo) +
           gpu_learner_bytes(trainer->ppo);
}

int train_threads(const Trainer *trainer) {
    return pool_threads(trainer->pool);
}

MildStatus train_save(Trainer *trainer, const char *path, const char *note, MildError *error) {
    size_t bytes;
    void *state = train_envs_state(trainer->envs, &bytes);
    if (state) {
        return ppo_save(trainer->ppo, path, state, bytes, note, error);
    }
    bytes = (size_t)trainer->def.train.envs * sizeof(TaskKept);
    TaskKept *kept = malloc(bytes);
    MildStatus status = kept ? train_envs_keep(trainer->envs, kept, error)
                             : mild_fail(error, MILD_ERROR_MEMORY, "no memory for a checkpoint");
    status =
        status == MILD_OK ? ppo_save_learner(trainer->ppo, path, kept, bytes, note, error) : status;
    free(kept);
    return status;
}

/* The learner alone: the environments begin new episodes. */
static MildStatus load_learner(Trainer *trainer, const char *path, MildError *error) {
    const size_t bytes = (size_t)trainer->def.train.envs * sizeof(TaskKept);
    TaskKept *kept = malloc(bytes);
    int found = 0;
    if (!kept) {
        return mild_fail(error, MILD_ERROR_MEMORY, "no memory for a checkpoint");
    }
    MildStatus status = ppo_load_learner(trainer->ppo, path, kept, bytes, &found, error);
    if (status == MILD_OK && found) {
        status = train_envs_restore(trainer->envs, kept, error);
    }
    free(kept);
    return status == MILD_OK
               ? train_envs_reset(trainer->envs, ppo_batch(trainer->ppo), trainer->stream, error)
               : status;
}

MildStatus train_load(Trainer *trainer, const char *path, MildError *error) {
    size_t bytes;
    void *state = train_envs_state(trainer->envs, &bytes);
    return state && ppo_file_is_whole(path) ? ppo_load(trainer->ppo, path, state, bytes, error)
                                            : load_learner(trainer, path, error);
}
