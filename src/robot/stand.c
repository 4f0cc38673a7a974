#include "robot/stand.h"

#include <math.h>
#include <string.h>

#include "robot/description.h"

/* Soft ground is a spring under the feet. Its stiffness against pitching is the sum over elements
 * of K x^2 [N m/rad], for both feet level at rest: rubber 1250, foam60 660, sand_dense 390, grass
 * 320, foam45 230, sand_loose 110, foam28 90, foam25 80. Gravity topples with m g h = 205; the
 * joints are in series with the ground and with each other, and the potential of the whole (sole
 * tilt, ankle, knee, hip) has a minimum only above 460. Besides, the default pose has its centre of
 * mass 40 mm behind the middle of the soles, so the heels sink first: released there with joints
 * held still the robot falls backwards on every soft ground in 1 to 2 s, on rubber and foam60 by
 * overshoot. The balanced stand therefore
 * - puts the centre of mass over the middle of the soles, so that the feet sink level,
 * - feeds the weight forward, so that the joints need no error to carry it,
 * - servoes the legs in the world instead of on the tilting soles: an ankle's error is the shank's
 * tilt, not the joint's, and the legs' lengths follow the line through the soles. The ground's
 * stiffness then drops out of the balance: 2 x 200 N m/rad at the ankles hold 205 on any ground
 * that carries the ankles' torque,
 * - damps the sway, which Kd = 1 N m s/rad at the ankles hardly does. */
#define SWAY_RATE                                                                                  \
    0.15 /* [s] ankle pitch and slope of the legs per angular speed of the base about the feet */
#define OFFSET_MAX 0.3 /* [rad] */

static const double stand_kp[ROBOT_LEG] = {240, 240, 240, 240, 200, 200}; /* [N m/rad] */
static const double stand_kd[ROBOT_LEG] = {6, 6, 6, 6, 1, 1};             /* [N m s/rad] */

static double clamp(double value, double bound) {
    return fmax(-bound, fmin(bound, value));
}

/* Joint offsets that level the base on tilted soles; offset: [ROBOT_JOINTS]. */
static void answer_tilt(const Robot *robot, const RobotSim *sim, double *offset) {
    const double *turn = robot_sim_base_rotation(sim), *speed = robot_sim_qvel(sim);
    double length = hypot(turn[0], turn[3]),
           ahead[2] = {turn[0] / length, turn[3] / length}; /* heading */
    double forward = (ahead[0] * speed[0] + ahead[1] * speed[1]) /
                     robot->stand_height; /* [rad/s] about the feet */
    double left = (ahead[0] * speed[1] - ahead[1] * speed[0]) / robot->stand_height;
    const double *l = robot_sim_foot(sim, ROBOT_FOOT_LEFT)->position,
                 *r = robot_sim_foot(sim, ROBOT_FOOT_RIGHT)->position;
    double apart = ahead[0] * (l[1] - r[1]) - ahead[1] * (l[0] - r[0]);
    double slope = clamp(atan2(l[2] - r[2], fabs(apart)) - SWAY_RATE * left, OFFSET_MAX);
    /* bending the knee by 2 d, hip and ankle by d each, shortens a leg by (L1 + L2) sin(q_knee / 2)
     * d */
    double bend = 0.5 * fabs(apart) / (0.67 * sin(0.5 * robot->pose[3])) * slope;
    for (int f = 0; f < ROBOT_FEET; f++) {
        const double *sole = robot_sim_foot(sim, f)->rotation;
        double pitch = atan2(-sole[6], hypot(sole[7], sole[8]));
        double *leg = offset + ROBOT_LEG * f, shorter = f == ROBOT_FOOT_LEFT ? bend : -bend;
        leg[2] -= shorter;
        leg[3] += 2.0 * shorter;
        leg[4] += clamp(pitch + SWAY_RATE * forward, OFFSET_MAX) - shorter;
    }
}

static void pd(const Robot *robot, const double *q, const double *qd, const double *offset,
               const double *forward, double *torque) {
    for (int i = 0; i < ROBOT_JOINTS; i++) {
        double wanted = stand_kp[i % ROBOT_LEG] * (robot->pose[i] + offset[i] - q[i]) -
                        stand_kd[i % ROBOT_LEG] * qd[i];
        torque[i] = clamp(wanted + forward[i], robot->effort[i]);
    }
}

void robot_stand_pd(const Robot *robot, int balance, const double *q, const double *qd,
                    double *torque) {
    static const double none[ROBOT_JOINTS];
    double offset[ROBOT_JOINTS] = {0};
    offset[4] = offset[10] = balance ? -robot->lean : 0.0;
    pd(robot, q, qd, offset, balance ? robot->lean_torque : none, torque);
}

void robot_stand_torque(const Robot *robot, const RobotSim *sim, int balance, double *torque) {
    const double *q = robot_sim_qpos(sim) + 7, *qd = robot_sim_qvel(sim) + 6;
    if (!balance) {
        robot_stand_pd(robot, 0, q, qd, torque);
        return;
    }
    double offset[ROBOT_JOINTS] = {0};
    offset[4] = offset[10] = -robot->lean;
    answer_tilt(robot, sim, offset);
    pd(robot, q, qd, offset, robot->lean_torque, torque);
}

RobotState robot_stand_state(const Robot *robot, int balance, double sinkage) {
    RobotState state = {.qpos = {0, 0, robot->stand_height - sinkage, 1, 0, 0, 0}};
    memcpy(state.qpos + 7, robot->pose, sizeof robot->pose);
    if (balance) {
        memcpy(state.qpos, robot->lean_base, sizeof robot->lean_base);
        state.qpos[2] -= sinkage;
        state.qpos[3] = cos(0.5 * robot->lean);
        state.qpos[5] = sin(0.5 * robot->lean);
        for (int f = 0; f < ROBOT_FEET; f++) {
            state.qpos[7 + ROBOT_LEG * f + 4] -= robot->lean;
        }
    }
    return state;
}

/* Joint torques at rest: gravity's b less what the soles carry, half the weight at the middle of
 * each. */
static void hold_torque(Robot *robot, mjData *d) {
    const mjModel *m = robot->model;
    mj_fwdVelocity(m, d); /* b at rest */
    memcpy(robot->lean_torque, d->qfrc_bias + 6, sizeof robot->lean_torque);
    for (int f = 0; f < ROBOT_FEET; f++) {
        const double *ankle = d->xpos + 3 * robot->foot_body[f];
        double load = -0.5 * robot->total_mass * m->opt.gravity[2];
        for (int k = 0; k < ROBOT_LEG; k++) {
            int joint = 1 + ROBOT_LEG * f + k;
            const double *axis = d->xaxis + 3 * joint, *anchor = d->xanchor + 3 * joint;
            double x = ankle[0] + robot->sole_center[f][0] - anchor[0],
                   y = ankle[1] + robot->sole_center[f][1] - anchor[1];
            robot->lean_torque[joint - 1] -= (axis[0] * y - axis[1] * x) * load;
        }
    }
}

int stand_prepare(Robot *robot) {
    mjData *d = mj_makeData(robot->model);
    if (!d) {
        return 1;
    }
    for (int i = 0; i < 20; i++) { /* lean until the centre of mass is over the soles' centre:
                                      converges like a fixed point */
        RobotState state = robot_stand_state(robot, 1, 0.0);
        memcpy(d->qpos, state.qpos, sizeof state.qpos);
        mj_fwdPosition(robot->model, d);
        const double *ankle = d->xpos + 3 * robot->foot_body[0],
                     *com = d->subtree_com + 3 * robot->base_body;
        robot->lean += (ankle[0] + robot->sole_center[0][0] - com[0]) / (com[2] - ankle[2]);
        robot->lean_base[0] = d->qpos[0] - ankle[0];
        robot->lean_base[2] = d->qpos[2] - ankle[2] - robot->sole_z;
    }
    hold_torque(robot, d);
    mj_deleteData(d);
    return 0;
}
