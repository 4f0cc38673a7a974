#include "bench/replay.h"

#include <math.h>
#include <mujoco/mujoco.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "robot/float/float_ground.h"

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
