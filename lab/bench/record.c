#include "bench/record.h"

#include <math.h>
#include <mujoco/mujoco.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/paths.h"
#include "env/envs.h"
#include "env/task/policy_keys.h"
#include "learn/policy.h"
#include "robot/float/float_ground.h"
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

enum { TIGHT, LOOSE, ENGINE, CASES };

typedef struct {
    const Replay *replay;
    const Robot *robot;
    RobotSim *soft, *rigid;
    mjData *engine;
    MildGround *ground;
    RobotGround *single;    /* steps `ground` in float; NULL: not asked for */
    ReplayStop stop[CASES]; /* of ours */
    double iterations[CASES], unconverged[CASES];
    int bad;
} Player;

void replay_destroy(Replay *replay) {
    if (!replay) {
        return;
    }
    for (int p = 0; replay->period && p < replay->periods; p++) {
        free(replay->period[p].ground);
    }
    free(replay->period);
    free(replay);
}

static MildGround *new_ground(const Robot *robot) {
    void *block = aligned_alloc(64, mild_ground_bytes(robot_soles(robot), robot_feet(robot)));
    return block ? mild_ground_init(block, robot_soles(robot), robot_feet(robot)) : NULL;
}

Replay *replay_create(const Robot *robot, int periods, int steps, double dt, MildError *error) {
    Replay *replay = calloc(1, sizeof *replay);
    if (replay) {
        *replay = (Replay){.periods = periods, .steps = steps, .dt = dt};
        replay->period = calloc((size_t)periods, sizeof *replay->period);
    }
    int good = replay && replay->period;
    for (int p = 0; good && p < periods; p++) {
        good = (replay->period[p].ground = new_ground(robot)) != NULL;
    }
    if (good) {
        return replay;
    }
    replay_destroy(replay);
    mild_fail(error, MILD_ERROR_MEMORY, "replay: out of memory for %d periods", periods);
    return NULL;
}

/* Seconds of one period on our ground. */
static double play_soft(Player *player, const ReplayPeriod *period, int which) {
    RobotSim *sim = player->soft;
    const Replay *replay = player->replay;
    memcpy(player->ground, period->ground, mild_ground_size(period->ground));
    robot_sim_set_solver(sim, MILD_SOLVER_NEWTON, player->stop[which].tolerance,
                         player->stop[which].iterations);
    robot_sim_set_ground(sim, player->stop[which].in_float ? player->single : NULL);
    robot_sim_load(sim, &period->state, &replay->variation);
    double start = clock_seconds();
    for (int s = 0; s < replay->steps; s++) {
        player->bad |=
            robot_sim_step(sim, period->torque[s], NULL, &replay->terrain, player->ground);
        player->iterations[which] += robot_sim_contact(sim)->iterations;
        player->unconverged[which] += !robot_sim_contact(sim)->converged;
    }
    return clock_seconds() - start;
}

/* [m] Height of the rigid floor: that of the higher sole which sank into soft ground, otherwise 0.
 * At this height the floor carries the soles without throwing one out. */
static double sunk_floor(Player *player, const ReplayPeriod *period) {
    double floor = -INFINITY;
    robot_sim_load(player->soft, &period->state, &player->replay->variation);
    for (int f = 0; f < robot_feet(player->robot); f++) {
        double height = robot_sim_foot(player->soft, f)->sole_height;
        if (height < 0.0) {
            floor = fmax(floor, height);
        }
    }
    return floor > -INFINITY && !player->replay->variation.rigid ? floor : 0.0;
}

/* Seconds of one period with the engine's own contact. */
static double play_engine(Player *player, const ReplayPeriod *period) {
    const Replay *replay = player->replay;
    mjModel *m = robot_sim_model(player->rigid);
    mjData *d = player->engine;
    m->geom_pos[3 * mj_name2id(m, mjOBJ_GEOM, "floor") + 2] = sunk_floor(player, period);
    const int *dof = robot_joint_dof(player->robot);
    int joints = robot_joints(player->robot);
    robot_engine_qpos(player->robot, period->state.qpos, d->qpos);
    robot_engine_rates(player->robot, period->state.qvel, d->qvel);
    robot_engine_rates(player->robot, period->state.qacc, d->qacc_warmstart);
    double start = clock_seconds();
    for (int s = 0; s < replay->steps; s++) {
        for (int i = 0; i < joints; i++) {
            d->qfrc_applied[dof[i]] = period->torque[s][i];
        }
        mj_step(m, d);
    }
    return clock_seconds() - start;
}

/* The least time of each case in every period, summed over the periods. */
static void play_all(Player *player, int repeats, double sums[CASES]) {
    for (int p = 0; p < player->replay->periods; p++) {
        const ReplayPeriod *period = &player->replay->period[p];
        double least[CASES] = {INFINITY, INFINITY, INFINITY};
        for (int r = 0; r < repeats; r++) {
            least[TIGHT] = fmin(least[TIGHT], play_soft(player, period, TIGHT));
            least[ENGINE] = fmin(least[ENGINE], play_engine(player, period));
            least[LOOSE] = fmin(least[LOOSE], play_soft(player, period, LOOSE));
        }
        for (int c = 0; c < CASES; c++) {
            sums[c] += least[c];
        }
    }
}

MildStatus replay_time(const Replay *replay, const Robot *robot, ReplayStop loose, int repeats,
                       ReplayTimes *times, MildError *error) {
    Player player = {.replay = replay, .robot = robot, .stop[LOOSE] = loose};
    MildStatus status = MILD_OK;
    double sums[CASES] = {0}, steps = (double)replay->periods * replay->steps;
    RobotVariation rigid = replay->variation;
    rigid.rigid = 1;
    player.soft = robot_sim_create(robot, replay->dt, error);
    player.rigid = robot_sim_create(robot, replay->dt, error);
    player.ground = new_ground(robot);
    player.single = loose.in_float ? float_ground_create(robot, error) : NULL;
    if (player.rigid) {
        robot_sim_load(player.rigid, &replay->period[0].state, &rigid);
        player.engine = mj_makeData(robot_sim_model(player.rigid));
    }
    if (!player.soft || !player.engine || !player.ground || (loose.in_float && !player.single)) {
        status = mild_fail(error, MILD_ERROR_MEMORY, "replay: out of memory");
    } else {
        play_all(&player, repeats, sums);
        if (player.bad) {
            status = mild_fail(error, MILD_ERROR_RANGE, "replay: the recorded walk diverged");
        }
    }
    *times = (ReplayTimes){.tight = 1e6 * sums[TIGHT] / steps,
                           .loose = 1e6 * sums[LOOSE] / steps,
                           .engine = 1e6 * sums[ENGINE] / steps,
                           .tight_iterations = player.iterations[TIGHT] / steps / repeats,
                           .loose_iterations = player.iterations[LOOSE] / steps / repeats,
                           .loose_unconverged = player.unconverged[LOOSE] / steps / repeats};
    mj_deleteData(player.engine);
    robot_sim_destroy(player.soft);
    robot_sim_destroy(player.rigid);
    float_ground_destroy(player.single);
    free(player.ground);
    return status;
}
