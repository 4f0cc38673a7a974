#include "run/bench/record.h"

#include <stdlib.h>
#include <string.h>

#include "base/paths.h"
#include "env/task/policy_keys.h"
#include "learn/policy.h"
#include "run/eval/eval.h"

static const double walk_speed = 0.6,
                    walk_settle = 1.0; /* [m/s] commanded, [s] before the record begins */

Robot *bench_robot(const ExperimentDef *def, MildError *error) {
    Robot *robot = robot_open(def->train.robot, error);
    if (robot && task_set_elements(&def->task, robot, error) != MILD_OK) {
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
    robot_set_model(c->robot, (MildModel)c->def.task.randomize.model);
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
    RobotSim *sim;
    TaskEnv *env;
    ReplayPeriod *period; /* where the torques go; NULL: nowhere */
    int step;             /* of the period */
} Walk;

static void record_torque(void *context, const TaskEnv *env, const RobotSim *sim,
                          const double *torque) {
    Walk *walk = context;
    (void)env;
    (void)sim;
    if (walk->period) {
        memcpy(walk->period->torque[walk->step++], torque, sizeof walk->period->torque[0]);
    }
}

static int walk_step(Walk *walk, ReplayPeriod *period) {
    float action[ROBOT_JOINTS_MAX];
    TaskView none = {0};
    TaskCallback callback = {record_torque, walk, NULL};
    if (period) {
        MildGround *ground = task_env_ground(walk->env);
        period->state = task_env_state(walk->env);
        memcpy(period->ground, ground, mild_ground_size(ground));
    }
    walk->period = period;
    walk->step = 0;
    walk->controller.act(walk->controller.self, 1, &walk->env, action);
    TaskStep step =
        task_env_step(walk->env, &walk->def, walk->robot, walk->sim, action, 0, &none, &callback);
    eval_command(walk->env, walk_speed, 0);
    return !step.done;
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

static MildStatus walk_open(Walk *walk, MildError *error) {
    walk->pool = pool_create(1);
    walk->sim = robot_sim_create(walk->robot, walk->def.physics_dt, error);
    walk->env = aligned_alloc(64, task_env_bytes(&walk->def, walk->robot));
    if (!walk->pool || !walk->sim || !walk->env) {
        return mild_fail(error, MILD_ERROR_MEMORY, "bench: out of memory");
    }
    return bench_walker(walk->robot, walk->pool, 1, &walk->def, &walk->controller, error);
}

static void walk_close(Walk *walk) {
    controller_destroy(&walk->controller);
    robot_sim_destroy(walk->sim);
    free(walk->env);
    pool_destroy(walk->pool);
}

static MildStatus walk_record(Walk *walk, const Scene *scene, Replay *replay, MildError *error) {
    const uint64_t seed = 1;
    TaskView none = {0};
    task_env_init(walk->env, &walk->def, walk->robot, seed, 0);
    eval_command(walk->env, walk_speed, 0);
    // NOLINTNEXTLINE(clang-analyzer-core.CallAndMessage): error->status is no success
    task_env_reset_on(walk->env, &walk->def, walk->robot, walk->sim, &scene->terrain, scene->rigid,
                      &none);
    replay->variation = task_env_variation(walk->env);
    replay->terrain = *task_env_terrain(walk->env);
    int settle = (int)(walk_settle / TASK_PERIOD), upright = 1;
    for (int i = -settle; i < replay->periods && upright; i++) {
        upright = walk_step(walk, i < 0 ? NULL : &replay->period[i]);
    }
    return upright ? MILD_OK
                   : mild_fail(error, MILD_ERROR_RANGE, "bench: the shipped policy fell on %s",
                               scene->name);
}

Replay *bench_record_walk(const ExperimentDef *def, const Robot *robot, const char *ground,
                          MildModel model, int periods, MildError *error) {
    Walk walk = {.def = def->task, .robot = robot};
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
    if (status == MILD_OK && model != MILD_MODEL_MILD) {
        const MildMaterial mild = scene.terrain.materials[0];
        status = robot_match_model(robot, model, &mild, &scene.terrain.materials[0], error);
    }
    if (status == MILD_OK) {
        status = walk_open(&walk, error);
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
