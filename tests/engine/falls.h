/* Robots that fall, in the engine and by MuJoCo: what the tests of shells share. */
#ifndef FALLS_H
#define FALLS_H

#include "base/random.h"
#include "robot/engine/read.h"
#include "robot/engine/step.h"
#include "robot/sim.h"
#include "robots.h"

enum { ROBOTS = 3, FALL_STEPS = 300 };
static const char *const names[ROBOTS] = {"sa01", "go1", "g1"};
static const double dt = 0.0025;

static inline double worse(double a, double b) {
    return !(a > b) && a == a ? b : a; /* NaN where one is */
}

/* In the air, with any attitude and any joints. */
static inline RobotState random_state(const Robot *robot, Random *random) {
    RobotState state = {.qpos = {random_uniform(random, -1, 1), 0, 0.5}};
    for (int k = 3; k < 7; k++) {
        state.qpos[k] = random_normal(random);
    }
    mju_normalize4(state.qpos + 3);
    for (int j = 0; j < robot->def.joints; j++) {
        state.qpos[7 + j] = random_uniform(random, robot->low[j], robot->high[j]);
    }
    for (int d = 0; d < robot->nv; d++) {
        state.qvel[d] = random_uniform(random, -1, 1);
    }
    return state;
}

static inline void random_torque(const Robot *robot, Random *random, double *torque) {
    for (int j = 0; j < robot->def.joints; j++) {
        torque[j] = 0.1 * robot->effort[j] * random_uniform(random, -1, 1);
    }
}

static inline EngineModel *read_model(const Robot *robot) {
    MildError error = {0};
    EngineModel *model = calloc(1, sizeof *model);
    assert_non_null(model);
    expect_good(engine_model_read(robot, dt, &model->tree, (double *)(void *)&model->number,
                                  &error) == MILD_OK,
                &error);
    return model;
}

#endif
