/* A robot that stands on its own gains, on ground of one material or on rigid ground. */
#ifndef STAND_KIT_H
#define STAND_KIT_H

#include "robot_kit.h"

typedef struct {
    const MildMaterial *material; /* NULL: rigid ground */
    double dt, seconds;           /* [s] */
    double tail;                  /* [s] at the end, over which means are taken */
    int plain;                    /* bool: without balance */
    MildSolver solver;
    double push[6]; /* [N, N m] for 0.1 s after the first second */
    /* Bool: it has not fallen; NULL: it may lie. */
    int (*up)(const RobotSim *sim, const MildTerrain *terrain);
} KitStand;

typedef struct {
    int stands;
    double seconds; /* [s] until it fell, or all */
    double height;  /* [m] of the base at the end, above z = 0 */
    double load;    /* [-] of the weight, mean over the tail */
    double share;   /* [-] least load of a foot over an equal share of the weight, then too */
    double depth;   /* [m] mean over the feet, then too */
    double rest;    /* [m] mean over the feet of a sole's sinkage under the foot's load */
    double creep;   /* [m] change of the mean depth in the tail */
    double drift;   /* [m] of the soles' centres from where they first rested, horizontal */
    double moved;   /* [m] the base during the push */
    double tilt;    /* [rad] of the base at the end */
    double leaning; /* [rad] of the soles at the end, the largest */
    double speed;   /* [m/s, rad/s] of the base at the end, the largest component */
    double torque;  /* [N m] largest in the tail */
} Standing;

/* [m] Under the foot's share of the weight. */
static inline double kit_sinkage(const MildMaterial *material) {
    return material ? mild_sole_sinkage(robot_soles(robot)[0], material, robot_foot_load(robot))
                    : 0;
}

static inline double kit_tilt(const double *rotation) {
    return acos(fmin(1.0, rotation[8]));
}

/* [m] Mean over the feet. */
static inline double kit_depth(const RobotSim *sim) {
    double sum = 0;
    for (int f = 0; f < robot_feet(robot); f++) {
        sum += robot_sim_foot(sim, f)->result.depth_mean;
    }
    return sum / robot_feet(robot);
}

/* A step of the tail. loads: [feet] [N] */
static inline void kit_weigh(const RobotSim *sim, const KitStand *how, const double *torque,
                             Standing *result, double *loads) {
    const double steps = how->tail / how->dt;
    result->depth += kit_depth(sim) / steps;
    for (int f = 0; f < robot_feet(robot); f++) {
        loads[f] += robot_sim_foot(sim, f)->force[2] / steps;
    }
    for (int k = 0; k < robot_joints(robot); k++) {
        result->torque = fmax(result->torque, fabs(torque[k]));
    }
}

/* What is known at the end. start: [feet] of the soles' centres */
static inline void kit_stood(const RobotSim *sim, const KitStand *how, double (*start)[3],
                             const double *loads, Standing *result) {
    const int feet = robot_feet(robot);
    const double weight = 9.81 * robot_total_mass(robot);
    result->share = INFINITY;
    for (int f = 0; f < feet; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        result->load += loads[f] / weight;
        result->share = fmin(result->share, loads[f] / (weight / feet));
        result->rest +=
            how->material ? mild_sole_sinkage(robot_soles(robot)[f], how->material, loads[f]) / feet
                          : 0;
        result->drift = fmax(result->drift, hypot(foot->sole_center[0] - start[f][0],
                                                  foot->sole_center[1] - start[f][1]));
        result->leaning = fmax(result->leaning, kit_tilt(foot->rotation));
    }
    for (int k = 0; k < 6; k++) {
        result->speed = fmax(result->speed, fabs(robot_sim_qvel(sim)[k]));
    }
    result->tilt = kit_tilt(robot_sim_base_rotation(sim));
    result->height = robot_sim_qpos(sim)[2];
}

static inline Standing kit_stand(const KitStand *how) {
    RobotSim *sim = new_sim(how->dt);
    MildGround *ground = kit_ground(robot);
    const MildMaterial any = mild_material_default();
    const MildTerrain terrain = mild_terrain_uniform(how->material ? how->material : &any);
    RobotVariation variation = robot_variation_nominal();
    variation.rigid = how->material == NULL;
    const RobotState state = stand_state(stand, !how->plain, kit_sinkage(how->material));
    robot_sim_set_solver(sim, how->solver, 0, 0);
    robot_sim_load(sim, &state, &variation);
    Standing result = {.stands = 1};
    double start[ROBOT_FEET_MAX][3], loads[ROBOT_FEET_MAX] = {0}, late = 0, from[2] = {0};
    for (int f = 0; f < robot_feet(robot); f++) {
        memcpy(start[f], robot_sim_foot(sim, f)->sole_center, sizeof start[f]);
    }
    const int steps = (int)(how->seconds / how->dt + 0.5), second = (int)(1 / how->dt + 0.5);
    const int tail = (int)(how->tail / how->dt + 0.5);
    for (int i = 0; i < steps && result.stands; i++) {
        double torque[ROBOT_JOINTS_MAX];
        const double *at = robot_sim_qpos(sim);
        const int pushed = i >= second && i < second + second / 10;
        if (i == second) {
            memcpy(from, at, sizeof from);
        }
        result.moved = pushed ? hypot(at[0] - from[0], at[1] - from[1]) : result.moved;
        stand_torque(stand, sim, !how->plain, torque);
        const int bad = robot_sim_step(sim, torque, pushed ? how->push : NULL, &terrain, ground);
        result.stands = !bad && (!how->up || how->up(sim, &terrain));
        result.seconds = (i + 1) * how->dt;
        late = i == steps - tail ? kit_depth(sim) : late;
        if (i >= steps - tail) {
            kit_weigh(sim, how, torque, &result, loads);
        }
    }
    result.creep = kit_depth(sim) - late;
    kit_stood(sim, how, start, loads, &result);
    free(ground);
    robot_sim_destroy(sim);
    return result;
}

#endif
