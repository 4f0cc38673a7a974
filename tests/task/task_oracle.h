/* The robot's motion from the engine's own functions on data of their own: nothing of src/robot is
 * called but for reading qpos and qvel. */
#ifndef TASK_ORACLE_H
#define TASK_ORACLE_H

#include <mujoco/mujoco.h>

#include "sa01.h"
#include "task_kit.h"

/* Middle of a sole's bounds in the foot frame (docs of the robot: 5.5 mm outward, 55 mm below the
 * ankle). */
static const double oracle_sole[SA01_FEET][3] = {{0.06, 0.0055, -0.055}, {0.06, -0.0055, -0.055}};
static const char *const oracle_feet[SA01_FEET] = {"leg_l6_link", "leg_r6_link"};
static const char *const oracle_knees[SA01_FEET] = {"leg_l4_link", "leg_r4_link"};

typedef struct {
    double omega[3];                     /* [rad/s] base, base frame */
    double velocity[3];                  /* [m/s] base, base frame */
    double world[3];                     /* [m/s] base, world */
    double heading[3];                   /* [m/s, m/s, m/s] base: forward, left, up */
    double gravity[3];                   /* [-] base frame */
    double orientation[4];               /* [-] of the base, w x y z */
    double sole[SA01_FEET][3];           /* [m] centre, world */
    double sole_velocity[SA01_FEET][3];  /* [m/s] world */
    double sole_lowest[SA01_FEET];       /* [m] above z = 0 */
    double foot_distance, knee_distance; /* [m] left less right, to the left of the heading */
} Oracle;

static inline int oracle_body(const mjModel *m, const char *name) {
    int id = mj_name2id(m, mjOBJ_BODY, name);
    assert_true(id > 0);
    return id;
}

/* World vector into the base frame. */
static inline void oracle_to_base(const Oracle *o, const double v[3], double out[3]) {
    double inverse[4];
    mju_negQuat(inverse, o->orientation);
    mju_rotVecQuat(out, v, inverse);
}

static inline void oracle_foot(Oracle *o, const mjModel *m, const mjData *d, int f) {
    int body = oracle_body(m, oracle_feet[f]);
    double arm[3], jacobian[3 * SA01_NV];
    mju_mulMatVec3(arm, d->xmat + 9 * body, oracle_sole[f]);
    mju_add3(o->sole[f], d->xpos + 3 * body, arm);
    mj_jac(m, d, jacobian, NULL, o->sole[f], body);
    mju_mulMatVec(o->sole_velocity[f], jacobian, d->qvel, 3, SA01_NV);
    o->sole_lowest[f] = 1e9;
    for (int i = 0; i < 2 * SA01_OUTLINE_ROWS; i++) {
        const double *row = sa01_outline[i / 2];
        const double side = f == SA01_LEFT ? 1 : -1;
        const double local[3] = {row[0], side * row[1 + i % 2], -0.055};
        mju_mulMatVec3(arm, d->xmat + 9 * body, local);
        o->sole_lowest[f] = fmin(o->sole_lowest[f], d->xpos[3 * body + 2] + arm[2]);
    }
}

static inline Oracle oracle_of(RobotSim *sim) {
    Oracle o = {0};
    const mjModel *m = robot_sim_model(sim);
    mjData *d = mj_makeData(m);
    memcpy(d->qpos, robot_sim_qpos(sim), sizeof(double) * SA01_NQ);
    memcpy(d->qvel, robot_sim_qvel(sim), sizeof(double) * SA01_NV);
    mj_fwdPosition(m, d);
    mj_fwdVelocity(m, d);
    int base = oracle_body(m, "base_link");
    double six[6], ahead[3], left[3], between[3];
    const double x[3] = {1, 0, 0}, z[3] = {0, 0, 1}, down[3] = {0, 0, -1};
    memcpy(o.orientation, d->qpos + 3, sizeof o.orientation);
    mj_objectVelocity(m, d, mjOBJ_XBODY, base, six, 1);
    memcpy(o.omega, six, sizeof o.omega);
    memcpy(o.velocity, six + 3, sizeof o.velocity);
    mj_objectVelocity(m, d, mjOBJ_XBODY, base, six, 0);
    memcpy(o.world, six + 3, sizeof o.world);
    mju_rotVecQuat(ahead, x, o.orientation);
    ahead[2] = 0;
    mju_normalize3(ahead);
    mju_cross(left, z, ahead);
    o.heading[0] = mju_dot3(o.world, ahead);
    o.heading[1] = mju_dot3(o.world, left);
    o.heading[2] = o.world[2];
    oracle_to_base(&o, down, o.gravity);
    for (int f = 0; f < SA01_FEET; f++) {
        oracle_foot(&o, m, d, f);
    }
    mju_sub3(between, o.sole[0], o.sole[1]);
    o.foot_distance = mju_dot3(between, left);
    mju_sub3(between, d->xpos + 3 * oracle_body(m, oracle_knees[0]),
             d->xpos + 3 * oracle_body(m, oracle_knees[1]));
    o.knee_distance = mju_dot3(between, left);
    mj_deleteData(d);
    return o;
}

/* What a foot feels, as if a step had reported it. */
static inline RobotFoot *oracle_set_force(RobotSim *sim, int foot, double x, double y, double z) {
    RobotFoot *feet = (RobotFoot *)(uintptr_t)robot_sim_foot(sim, foot);
    feet->force[0] = x;
    feet->force[1] = y;
    feet->force[2] = z;
    return feet;
}

/* In the air, turned, bent and moving, above ground at z = 0.05. */
static inline Oracle rig_place(Rig *rig, uint32_t draw) {
    RobotState state = kit_moving_state(1.2, draw);
    task_env_set_state(rig->env, &state);
    task_env_rest(rig->env)->terrain.height = 0.05;
    kit_load(rig->sim, &state, rig->env);
    robot_sim_sole_clearance(rig->sim, task_env_terrain(rig->env));
    return oracle_of(rig->sim);
}

/* ---- the environment of a case ---- */

static Rig rig;

static inline int open_quiet(void **state) {
    (void)state;
    rig_open_quiet(&rig, 0.5);
    return 0;
}

static inline int close_rig(void **state) {
    (void)state;
    rig_close(&rig);
    return 0;
}

#endif
