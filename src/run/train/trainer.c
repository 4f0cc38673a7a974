#include "run/train/trainer.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/paths.h"
#include "device/ranks/ranks.h"
#include "env/task/policy_keys.h"
#include "learn/cuda/learner.h"
#include "run/train/experiment.h"

struct Trainer {
    ExperimentDef def;
    Ranks *ranks; /* NULL: alone */
    Robot *robot;
    Pool *pool;
    Policy *policy;
    Ppo *ppo;
    TrainEnvs envs;
    MildStream stream; /* of the learner's device; NULL: none */
};

void train_destroy(Trainer *trainer) {
    if (!trainer) {
        return;
    }
    train_envs_close(&trainer->envs);
    ppo_destroy(trainer->ppo);
    policy_destroy(trainer->policy);
    pool_destroy(trainer->pool);
    robot_destroy(trainer->robot);
    free(trainer);
}

/* Bool: the points of the ground that `other` sees, if it does, are those of `own`, whose scan has
 * as many. */
static int sees_the_same(const TaskDef *own, const PolicyDef *other) {
    TaskDef theirs = *own;
    return other->scan == 0 || (task_policy_keys_read(&theirs, other->task, NULL) == MILD_OK &&
                                theirs.scan == own->scan && theirs.scan_pitch == own->scan_pitch &&
                                theirs.scan_ahead[0] == own->scan_ahead[0]);
}

/* The networks of a policy file take the place of the random ones. */
static MildStatus start_policy(Trainer *trainer, MildError *error) {
    const char *path = trainer->def.train.start;
    MildError cause = {0};
    if (!path[0]) {
        return MILD_OK;
    }
    Policy *start = policy_load(path, NULL, 0, &cause);
    if (!start) {
        return mild_fail(error, cause.status, "train.start: %s", cause.text);
    }
    const PolicyDef *own = policy_def(trainer->policy), *other = policy_def(start);
    MildStatus status = MILD_OK;
    if (strcmp(own->robot, other->robot) != 0 || !policy_take_networks(trainer->policy, start)) {
        status = mild_fail(error, MILD_ERROR_FORMAT,
                           "train.start: %s has other networks or another robot than this config "
                           "asks for; see sections [policy], [ppo] and train.robot",
                           path);
    }
    if (status == MILD_OK && !sees_the_same(&trainer->def.task, other)) {
        status = mild_fail(error, MILD_ERROR_FORMAT,
                           "train.start: %s sees other points of the ground than task.scan, "
                           "scan_ahead and scan_pitch say",
                           path);
    }
    policy_destroy(start);
    return status;
}

/* Robot, threads, networks and learner, on the CPU. Returns 0 on failure. */
static int make_learner(Trainer *trainer, MildError *error) {
    const ExperimentDef *def = &trainer->def;
    MildError cause = {0};
    trainer->robot = robot_open(def->train.robot, &cause);
    if (!trainer->robot) {
        mild_fail(error, cause.status, "train.robot: %s", cause.text);
        return 0;
    }
    experiment_fit_robot(&trainer->def, trainer->robot);
    robot_set_model(trainer->robot, task_model_soles(def->task.randomize.model));
    robot_set_shells(trainer->robot, def->task.shells_stand);
    if (task_set_robot(&def->task, trainer->robot, error) != MILD_OK) {
        return 0;
    }
    const TaskMirror sides = task_mirror(&def->task, trainer->robot);
    const PpoMirror mirror = {sides.observation_index, sides.observation_sign, sides.action_index,
                              sides.action_sign};
    const int lopsided = robot_mirror_shift(trainer->robot) < 0;
    const int threads = def->train.threads ? def->train.threads : ranks_threads(trainer->ranks);
    trainer->pool = pool_create(threads);
    if (!trainer->pool) {
        mild_fail(error, MILD_ERROR_MEMORY, "cannot start %d threads", threads);
        return 0;
    }
    trainer->policy = policy_create(&def->policy, def->train.seed, error);
    if (!trainer->policy || start_policy(trainer, error) != MILD_OK) {
        return 0;
    }
    trainer->ppo =
        ppo_create_part(&def->ppo, trainer->policy, trainer->pool, lopsided ? NULL : &mirror,
                        def->train.envs, def->train.seed, trainer->ranks, error);
    return trainer->ppo != NULL;
}

/* Each of several processes takes the GPU with its number on its machine. No process may be missing
 * here, because all wait for each other. */
static MildStatus join_devices(Trainer *trainer, MildError *error) {
    TrainDef *def = &trainer->def.train;
    const int count = ranks_count(trainer->ranks), device = train_device(def);
    if (count == 1 || device < 0) {
        return MILD_OK;
    }
    if (device > 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "train.device = %s in %d processes: each takes a GPU of its own; write "
                         "cuda",
                         def->device, count);
    }
    snprintf(def->device, sizeof def->device, "cuda:%d", ranks_local(trainer->ranks));
    return ranks_open_device(trainer->ranks, gpu_learner_sum_bytes(trainer->ppo), error);
}

static MildStatus move_learner(Trainer *trainer, MildError *error) {
    const TrainDef *def = &trainer->def.train;
    const GpuLearnerDef gpu = {.device = train_device(def), .resident = train_is_batch(def)};
    MildError cause = {0};
    if (gpu.device < 0 || gpu_learner_attach(trainer->ppo, &gpu, &cause) == MILD_OK) {
        return MILD_OK;
    }
    return mild_fail(error, cause.status, "train.device = %s: %s", def->device, cause.text);
}

/* The rows of the batch at time t. */
static EnvsView view_at(const Trainer *trainer, int t) {
    const PolicyDef *policy = &trainer->def.policy;
    const PpoBatch *batch = ppo_batch(trainer->ppo);
    const size_t row = (size_t)t * (size_t)batch->envs;
    return (EnvsView){
        .history = batch->history + row * (size_t)policy_history(policy),
        .critic = batch->critic + row * (size_t)policy->critic_input,
        .estimate = batch->target + row * (size_t)policy->estimates,
        .frame = batch->frame + row * (size_t)policy->observation,
    };
}

static MildStatus reset_envs(Trainer *trainer, MildError *error) {
    const EnvsView first = view_at(trainer, 0);
    return envs_reset(trainer->envs.envs, &first, trainer->stream, error);
}

static MildStatus make_envs(Trainer *trainer, MildError *error) {
    trainer->stream = gpu_learner_stream(trainer->ppo);
    MildStatus status =
        train_envs_open(&trainer->envs, &trainer->def, trainer->robot, trainer->pool,
                        ppo_batch(trainer->ppo)->envs, ppo_first_env(trainer->ppo), error);
    return status == MILD_OK ? reset_envs(trainer, error) : status;
}

static MildStatus build(Trainer *trainer, MildError *error) {
    MildStatus status = make_learner(trainer, error) ? MILD_OK : error->status;
    status = ranks_agree(trainer->ranks, status, error);
    status = status == MILD_OK ? join_devices(trainer, error) : status;
    status = status == MILD_OK ? move_learner(trainer, error) : status;
    return status == MILD_OK ? make_envs(trainer, error) : status;
}

Trainer *train_create(const ExperimentDef *def, MildError *error) {
    return train_create_part(def, NULL, error);
}

Trainer *train_create_part(const ExperimentDef *def, Ranks *ranks, MildError *error) {
    MildError cause = {0};
    Trainer *trainer = calloc(1, sizeof *trainer);
    MildStatus status = trainer ? MILD_OK : mild_fail(&cause, MILD_ERROR_MEMORY, "out of memory");
    status = ranks_agree(ranks, status, &cause);
    if (status == MILD_OK && trainer) {
        trainer->def = *def;
        trainer->ranks = ranks;
        status = ranks_agree(ranks, build(trainer, &cause), &cause);
    }
    if (status != MILD_OK) {
        mild_fail(error, cause.status, "%s", cause.text);
        train_destroy(trainer);
        return NULL;
    }
    return trainer;
}

/* ---- several processes ---- */

/* Sums over the environments of all. Their last bits depend on the number of processes. */
static void sum_over_ranks(Ranks *ranks, EnvsStats *sums) {
    double numbers[9 + TASK_REWARD_COUNT] = {sums->episodes,    sums->falls,  sums->diverged,
                                             sums->steps,       sums->length, sums->reward,
                                             sums->speed_error, sums->assist, sums->paid};
    memcpy(numbers + 9, sums->terms, TASK_REWARD_COUNT * sizeof *numbers);
    ranks_sum_double(ranks, numbers, 9 + TASK_REWARD_COUNT);
    *sums = (EnvsStats){.episodes = (int)numbers[0],
                        .falls = (int)numbers[1],
                        .diverged = (int)numbers[2],
                        .steps = numbers[3],
                        .length = numbers[4],
                        .reward = numbers[5],
                        .speed_error = numbers[6],
                        .assist = numbers[7],
                        .paid = numbers[8]};
    memcpy(sums->terms, numbers + 9, TASK_REWARD_COUNT * sizeof *numbers);
}

/* Every process applies the same sums to the same parameters. Another kind of processor or GPU may
 * round them differently. */
static MildStatus check_same(Trainer *trainer, MildError *error) {
    if (ranks_count(trainer->ranks) == 1) {
        return MILD_OK;
    }
    const uint64_t mine = ppo_hash(trainer->ppo);
    uint64_t first = mine;
    ranks_broadcast(trainer->ranks, &first, sizeof first);
    return mine == first ? MILD_OK
                         : mild_fail(error, MILD_ERROR_ARGUMENT,
                                     "its parameters differ from those of process 1; start the "
                                     "same program on processors of the same kind");
}

/* A policy step from time t, with the batch's actions. */
static MildStatus step_envs(Trainer *trainer, int t, MildError *error) {
    const PpoBatch *batch = ppo_batch(trainer->ppo);
    const size_t row = (size_t)t * (size_t)batch->envs;
    const EnvsStep step = {.action = batch->action + row * (size_t)trainer->def.policy.actions,
                           .reward = batch->reward + row,
                           .done = batch->done + row,
                           .timeout = batch->timeout + row,
                           .valid = batch->valid + row,
                           .next = view_at(trainer, t + 1)};
    return envs_step(trainer->envs.envs, &step, trainer->stream, error);
}

/* One rollout. On a GPU actions and environments are only enqueued, and take their time
 * together. */
static MildStatus roll_out(Trainer *trainer, TrainTimes *times, MildError *error) {
    const int steps = ppo_batch(trainer->ppo)->steps;
    MildStatus status = MILD_OK;
    for (int t = 0; t < steps && status == MILD_OK; t++) {
        double before = clock_seconds();
        ppo_act(trainer->ppo, t);
        double between = clock_seconds();
        status = step_envs(trainer, t, error);
        times->inference += between - before;
        times->environments += clock_seconds() - between;
    }
    double before = clock_seconds();
    status = status == MILD_OK ? envs_wait(trainer->envs.envs, error) : status;
    times->environments += clock_seconds() - before;
    return status;
}

MildStatus train_iterate(Trainer *trainer, TrainReport *report, MildError *error) {
    const double samples = (double)trainer->def.train.envs * trainer->def.ppo.steps;
    TrainTimes times = {0};
    EnvsStats sums;
    double start = clock_seconds();
    MildStatus status = ranks_agree(trainer->ranks, roll_out(trainer, &times, error), error);
    if (status != MILD_OK) {
        return status;
    }
    times.rollout = clock_seconds() - start;
    ppo_update(trainer->ppo, &report->ppo);
    if (ranks_count(trainer->ranks) > 1 && ppo_status(trainer->ppo, error) != MILD_OK) {
        ranks_abort(error); /* the others may wait for this one's gradient */
    }
    double wall = clock_seconds() - start;
    times.update = wall - times.rollout;
    envs_times(trainer->envs.envs, &times.physics, &times.ground);
    report->times = times;
    status = ranks_agree(trainer->ranks,
                         envs_sums(trainer->envs.envs, &sums, trainer->stream, error), error);
    if (status != MILD_OK) {
        return status;
    }
    sum_over_ranks(trainer->ranks, &sums);
    report->episodes = envs_means(sums, trainer->def.train.envs);
    report->steps_per_s = samples / wall;
    report->reward_per_step = sums.paid / samples;
    status = check_same(trainer, error);
    return status == MILD_OK ? ppo_status(trainer->ppo, error) : status;
}

int64_t train_iteration(const Trainer *trainer) {
    return ppo_iteration(trainer->ppo);
}

Policy *train_policy(Trainer *trainer) {
    return ppo_average(trainer->ppo);
}

size_t train_bytes(const Trainer *trainer) {
    return envs_bytes(trainer->envs.envs) + ppo_bytes(trainer->ppo) +
           gpu_learner_bytes(trainer->ppo);
}

int train_threads(const Trainer *trainer) {
    return pool_threads(trainer->pool);
}

MildStatus train_save(Trainer *trainer, const char *path, const char *note, MildError *error) {
    size_t bytes;
    char *state = envs_state(trainer->envs.envs, &bytes);
    if (state) {
        return ppo_save(trainer->ppo, path, state, bytes, note, error);
    }
    bytes = (size_t)ppo_batch(trainer->ppo)->envs * sizeof(TaskProgress);
    TaskProgress *progress = malloc(bytes);
    MildStatus status = progress
                            ? envs_save_progress(trainer->envs.envs, progress, error)
                            : mild_fail(error, MILD_ERROR_MEMORY, "no memory for a checkpoint");
    status = ranks_agree(trainer->ranks, status, error);
    status = status == MILD_OK ? ppo_save_learner(trainer->ppo, path, progress, bytes, note, error)
                               : status;
    free(progress);
    return status;
}

/* The learner alone: the environments begin new episodes. */
static MildStatus load_learner(Trainer *trainer, const char *path, MildError *error) {
    const size_t bytes = (size_t)ppo_batch(trainer->ppo)->envs * sizeof(TaskProgress);
    TaskProgress *progress = malloc(bytes);
    int found = 0;
    MildStatus status =
        progress ? MILD_OK : mild_fail(error, MILD_ERROR_MEMORY, "no memory for a checkpoint");
    status = ranks_agree(trainer->ranks, status, error);
    if (status == MILD_OK) {
        status = ppo_load_learner(trainer->ppo, path, progress, bytes, &found, error);
    }
    if (status == MILD_OK && found) {
        status = envs_load_progress(trainer->envs.envs, progress, error);
    }
    free(progress);
    if (status == MILD_OK) {
        status = reset_envs(trainer, error);
    }
    return ranks_agree(trainer->ranks, status, error);
}

MildStatus train_load(Trainer *trainer, const char *path, MildError *error) {
    size_t bytes;
    char *state = envs_state(trainer->envs.envs, &bytes);
    int whole = 0;
    MildStatus status = state && ranks_number(trainer->ranks) == 0
                            ? ppo_file_is_whole(path, &whole, error)
                            : MILD_OK;
    status = ranks_agree(trainer->ranks, status, error);
    if (status != MILD_OK) {
        return status;
    }
    return ranks_any(trainer->ranks, whole) ? ppo_load(trainer->ppo, path, state, bytes, error)
                                            : load_learner(trainer, path, error);
}
