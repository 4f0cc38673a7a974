/* Random steps for the tests of the batch engine. */
#ifndef TESTS_ENGINE_CASES_H
#define TESTS_ENGINE_CASES_H

#include <math.h>
#include <string.h>

#include <mujoco/mujoco.h>

#include "engine_text.h"

#include "base/random.h"
#include "draws.h"
#include "robot/sim.h"

/* Float takes these numbers as they are, so that its error is that of its arithmetic. */
static inline void round_case(EngineCase *in) {
    kit_round((double *)in, offsetof(EngineCase, variation) / sizeof(double));
    kit_round(&in->height, 1);
    kit_round(in->slope, 2);
    kit_round(in->map_origin, 2);
}

static inline void spread(Random *random, double *x, int count, double size) {
    for (int i = 0; i < count; i++) {
        x[i] = random_uniform(random, -size, size);
    }
}

static inline RobotVariation random_variation(const Robot *robot, Random *random) {
    RobotVariation variation = robot_variation_nominal();
    variation.base_mass_add = random_uniform(random, -0.15, 0.3) * robot->total_mass / 2;
    spread(random, variation.com_offset, 3, 0.05);
    for (int i = 0; i <= robot->def.joints; i++) {
        variation.link_mass_scale[i] = random_uniform(random, 0.7, 1.3);
    }
    variation.armature_scale = random_uniform(random, 0.7, 1.3);
    variation.rigid_friction = random_uniform(random, 0.2, 1.2);
    if (variation.armature_scale < 1) {
        variation.rigid_time = 0.02 + (1 - variation.armature_scale);
    }
    return variation;
}

/* Any pose, in violent motion; in every third case some joints are beyond a limit. */
static inline EngineCase random_case(const Robot *robot, uint32_t draw) {
    EngineCase in = {.variation = {.rigid = 0}};
    Random random = random_at(41, draw, 0);
    double norm = 0;
    in.variation = random_variation(robot, &random);
    spread(&random, in.qpos, 3, 3);
    for (int k = 3; k < 7; k++) {
        in.qpos[k] = random_normal(&random);
        norm += in.qpos[k] * in.qpos[k];
    }
    for (int k = 3; k < 7; k++) {
        in.qpos[k] /= sqrt(norm);
    }
    for (int j = 0; j < robot->def.joints; j++) {
        double low = robot->low[j], high = robot->high[j];
        double margin = 0.03 * (high - low);
        in.qpos[7 + j] = random_uniform(&random, low + margin, high - margin);
        if (draw % 3 == 0 && random_unit(&random) < 0.25) {
            double beyond = random_uniform(&random, 1e-4, 0.1);
            in.qpos[7 + j] = random_unit(&random) < 0.5 ? low - beyond : high + beyond;
        }
        in.torque[j] = random_uniform(&random, -1, 1) * robot->effort[j];
    }
    spread(&random, in.qvel, 6, 4);
    spread(&random, in.qvel + 6, robot->def.joints, 8);
    spread(&random, in.qacc, robot->nv, 500);
    spread(&random, in.push, 3, 150);
    spread(&random, in.push + 3, 3, 30);
    for (int f = 0; f < robot->def.feet; f++) {
        spread(&random, in.wrench[f], 3, 500);
        spread(&random, in.wrench[f] + 3, 3, 40);
    }
    round_case(&in);
    return in;
}

/* [m] Height of rigid ground at a point, and gradient [-]. */
static inline double case_height(const EngineCase *in, double x, double y, double slope[2]) {
    MildTerrain terrain = {.map = in->map, .map_x = in->map_origin[0], .map_y = in->map_origin[1]};
    memcpy(slope, in->slope, sizeof in->slope);
    if (in->map) {
        mild_terrain_slope_at(&terrain, x, y, slope);
        return in->height + mild_terrain_height_at(&terrain, x, y);
    }
    return in->height + slope[0] * x + slope[1] * y;
}

/* [m] By how much the robot of the case may sink before a corner touches the ground. */
static inline double clearance(RobotSim *sim, const EngineCase *in) {
    const mjModel *m = sim->model;
    RobotState state = {.qpos = {0}};
    double least = 1e9;
    memcpy(state.qpos, in->qpos, sizeof state.qpos);
    robot_sim_load(sim, &state, &in->variation);
    for (int g = 0; g < m->ngeom; g++) {
        const double *c = sim->data->geom_xpos + 3 * g;
        double slope[2];
        double height = case_height(in, c[0], c[1], slope);
        double steep = sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
        if (g != sim->robot->floor_geom) {
            least = fmin(least, c[2] - height - steep * m->geom_size[3 * g]);
        }
    }
    return least;
}

/* Near the default pose, the lowest corner of the feet up to 4 mm in the ground, or above it. Half
 * of the cases move as a stand does, half as a walk, some with joints beyond their limits. map: or
 * NULL for planes. */
static inline EngineCase rigid_case(RobotSim *sim, const MildMap *map, uint32_t draw) {
    const Robot *robot = sim->robot;
    EngineCase in = {.qpos = {0}, .map = map};
    Random random = random_at(43, draw, 0);
    double motion = draw % 2 ? 1 : 0.05;
    in.variation = random_variation(robot, &random);
    in.variation.rigid = 1;
    spread(&random, in.qpos, 2, 3);
    in.qpos[3] = 1;
    spread(&random, in.qpos + 4, 2, 0.02 + 0.1 * motion);
    in.qpos[6] = random_uniform(&random, -1, 1);
    mju_normalize4(in.qpos + 3);
    for (int j = 0; j < robot->def.joints; j++) {
        double off = random_uniform(&random, -0.05, 0.05) * (1 + 5 * motion);
        in.qpos[7 + j] =
            fmin(fmax(robot->def.pose[j] + off, robot->low[j] + 0.03), robot->high[j] - 0.03);
        if (draw % 5 == 0 && random_unit(&random) < 0.15) {
            in.qpos[7 + j] = robot->high[j] + random_uniform(&random, 1e-4, 0.02);
        }
        in.torque[j] = random_uniform(&random, -0.5, 0.5) * robot->effort[j];
    }
    spread(&random, in.qvel, 3, 1.5 * motion);
    spread(&random, in.qvel + 3, 3, 2 * motion);
    spread(&random, in.qvel + 6, robot->def.joints, 4 * motion);
    spread(&random, in.push, 3, 50);
    in.height = random_uniform(&random, -0.2, 0.2);
    if (map) {
        spread(&random, in.map_origin, 2, 3);
    } else if (draw % 4 >= 2) {
        spread(&random, in.slope, 2, draw % 8 == 7 ? 1 : 0.2);
    }
    in.qpos[2] -= clearance(sim, &in) + random_uniform(&random, -0.001, 0.004);
    round_case(&in);
    return in;
}

#endif
