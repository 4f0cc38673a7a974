#include "bench/record.h"

#include <stdlib.h>
#include <string.h>

#include "base/paths.h"
#include "env/envs.h"
#include "env/task/policy_keys.h"
#include "learn/policy.h"
#include "run/eval/eval.h"

static const double walk_speed = 0.6,
                    walk_settle = 1.0; /* [m/s] commanded, [s] before the record begins */

Robot *bench_robot(const ExperimentDef *def, MildError *error) {
    Robot *robot = robot_open(def->train.robot, error);
    if (robot && task_set_robot(&def->task, robot, error) != MILD_OK) {
        robot_destroy(robot);
        return NULL;
    }
    return robot;
}

MildStatus bench_open(BenchContext *c, const ExperimentDef *def, MildError *error) {
    *c = (BenchContext){.def = *def, .robot = bench_robot(def, error)};
    if (!c->robot) {
        return error->status;
    }
    c->def.task.randomize.patch_share = 0;
    experiment_fit_robot(&c->def, c->robot);
    robot_set_model(c->robot, task_model_soles(c->def.task.randomize.model));
    robot_set_shells(c->robot, c->def.task.shells_stand);
    c->pool = pool_create(def->train.threads);
    return c->pool ? MILD_OK : mild_fail(error, MILD_ERROR_MEMORY, "cannot start threads");
}

void bench_close(BenchContext *c) {
    pool_destroy(c->pool);
    robot_destroy(c->robot);
}

/* A robot that walks. */
typedef struct {
    TaskDef def;
    const Robot *robot;
    Pool *pool;
    Controller controller;
    EnvsTrial trial;
    Envs *envs;         /* one */
    TaskEnv *env;       /* of envs */
    EnvsSample *sample; /* [physics steps] of the last policy step */
} BenchWalk;

/* period: the state before the step, and its torques; NULL: not recorded. */
static MildStatus walk_step(const BenchWalk *walk, ReplayPeriod *period, int *upright,
                            MildError *error) {
    float action[ROBOT_JOINTS_MAX], reward;
    uint8_t done = 0, timeout, valid;
    const EnvsStep step = {
        .action = action, .reward = &reward, .done = &done, .timeout = &timeout, .valid = &valid};
    if (period) {
        MildGround *ground = task_env_ground(walk->env);
        period->state = task_env_state(walk->env);
        memcpy(period->ground, ground, mild_ground_size(ground));
    }
    walk->controller.act(walk->controller.self, 1, &walk->env, action);
    const MildStatus status = envs_step(walk->envs, &step, NULL, error);
    for (int k = 0; period && k < envs_physics_steps(walk->envs); k++) {
        memcpy(period->torque[k], walk->sample[k].torque, sizeof period->torque[k]);
    }
    eval_command(walk->env, walk_speed, 0);
    *upright = !done;
    return status;
}

MildStatus bench_walker(const Robot *robot, Pool *pool, int envs, TaskDef *task,
                        Controller *controller, MildError *error) {
    char path[PATH_SIZE];
    const char *file = robot_policy(robot_name(robot), path);
    Policy *policy = policy_load(file, NULL, 0, error);
    MildStatus status =
        policy ? task_policy_keys_read(task, policy_def(policy)->task, error) : error->status;
    policy_destroy(policy);
    return status == MILD_OK ? controller_learned(file, robot, pool, envs, controller, error)
                             : status;
}

static MildStatus walk_open(BenchWalk *walk, const Scene *scene, MildError *error) {
    walk->pool = pool_create(1);
    if (!walk->pool) {
        return mild_fail(error, MILD_ERROR_MEMORY, "bench: out of memory");
    }
    MildStatus status =
        bench_walker(walk->robot, walk->pool, 1, &walk->def, &walk->controller, error);
    if (status != MILD_OK) {
        return status;
    }
    walk->trial = (EnvsTrial){.rigid = scene->rigid};
    const EnvsDef of = {.task = &walk->def,
                        .robot = walk->robot,
                        .pool = walk->pool,
                        .count = 1,
                        .seed = 1,
                        .trial = &walk->trial,
                        .terrain = &scene->terrain,
                        .terrains = 1};
    walk->envs = envs_create(&of, error);
    if (!walk->envs) {
        return error->status;
    }
    walk->env = envs_env(walk->envs, 0);
    walk->sample = calloc((size_t)envs_physics_steps(walk->envs), sizeof *walk->sample);
    return walk->sample ? MILD_OK : mild_fail(error, MILD_ERROR_MEMORY, "bench: out of memory");
}

static void walk_close(BenchWalk *walk) {
    controller_destroy(&walk->controller);
    envs_destroy(walk->envs);
    free(walk->sample);
    pool_destroy(walk->pool);
}

static MildStatus walk_record(BenchWalk *walk, const Scene *scene, Replay *replay,
                              MildError *error) {
    const int settle = (int)(walk_settle / TASK_PERIOD);
    int upright = 1;
    eval_command(walk->env, walk_speed, 0);
    envs_set_samples(walk->envs, walk->sample);
    MildStatus status = envs_reset(walk->envs, &(EnvsView){0}, NULL, error);
    replay->variation = task_env_variation(walk->env);
    replay->terrain = *task_env_terrain(walk->env);
    for (int i = -settle; status == MILD_OK && upright && i < replay->periods; i++) {
        status = walk_step(walk, i < 0 ? NULL : &replay->period[i], &upright, error);
    }
    return upright ? status
                   : mild_fail(error, MILD_ERROR_RANGE, "bench: the shipped policy fell on %s",
                               scene->name);
}

Replay *bench_record_walk(const ExperimentDef *def, const Robot *robot, const char *ground,
                          int model, int periods, MildError *error) {
    BenchWalk walk = {.def = def->task, .robot = robot};
    Scene scene;
    task_def_make_nominal(&walk.def);
    walk.def.episode = walk_settle + (periods + 1) * TASK_PERIOD;
    int steps = (int)(TASK_PERIOD / walk.def.physics_dt + 0.5);
    Replay *replay = replay_create(robot, periods, steps, walk.def.physics_dt, error);
    if (!replay) {
        return NULL;
    }
    MildStatus status = task_def_check_robot(&walk.def, robot, error);
    if (status == MILD_OK) {
        status = scene_make(&scene, ground, 1.0, error);
    }
    if (status == MILD_OK && model != TASK_MODEL_OWN) {
        const MildMaterial own = scene.terrain.materials[0];
        status =
            robot_match_model(robot, (MildModel)model, &own, &scene.terrain.materials[0], error);
    }
    if (status == MILD_OK) {
        status = walk_open(&walk, &scene, error);
    }
    if (status == MILD_OK) {
        status = walk_record(&walk, &scene, replay, error);
    }
    walk_close(&walk);
    if (status == MILD_OK) {
        return replay;
    }
    replay_destroy(replay);
    return NULL;
}
