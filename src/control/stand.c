#include "control/stand.h"

#include <math.h>
#include <mujoco/mujoco.h>
#include <stdlib.h>
#include <string.h>

#include "control/controller.h"

/* Soft ground is a spring under the feet. Its stiffness against pitching is the sum over elements
 * of K x^2 [N m/rad], for both feet of SA01 level at rest: rubber 1250, foam60 660, sand_dense 390,
 * grass 320, foam45 230, sand_loose 110, foam28 90, foam25 80. Gravity topples the robot with m g h
 * = 205. The joints are in series with the ground and with each other, so the potential of the
 * whole (sole tilt, ankle, knee, hip) has a minimum only above 460. Besides, in the default pose
 * the centre of mass is 40 mm behind the middle of the soles, so the heels sink first. Released in
 * that pose with fixed joints, the robot falls backwards on every soft ground within 1 to 2 s, on
 * rubber and foam60 because it overshoots. The balanced stand therefore
 *
 *   - puts the centre of mass over the middle of the soles, so that the feet sink evenly,
 *   - feeds the weight forward, so that the joints carry it without a position error,
 *   - controls the legs relative to the world instead of the tilting soles: the error of an ankle
 *     is the tilt of the shank, not of the joint, and the leg lengths follow the plane through the
 *     soles. The stiffness of the ground then drops out of the balance, and 2 x 200 N m/rad at the
 *     ankles hold 205 on any ground that carries the ankle torque,
 *   - damps the sway, which Kd = 1 N m s/rad at the ankles barely does.
 *
 * A robot without ankles has feet in front of and behind its centre of mass. It does not lean, and
 * its leg lengths respond to pitch as they do to roll. */
#define SWAY_RATE 0.15    /* [s] slope correction per angular speed of the base about the feet */
#define OFFSET_MAX 0.3    /* [rad] */
#define LIFT_LEAST 0.01   /* [m/rad] a leg with a smaller lift cannot adjust its length */
#define SPREAD_LEAST 1e-4 /* [m^2] with a smaller spread the feet define no slope */

struct Stand {
    const Robot *robot;
    int ankles;                      /* bool: every foot has an ankle */
    double lean;                     /* [rad] of the base, forward */
    double base[3];                  /* [m] base above the ground midway below the feet */
    double lift[ROBOT_FEET_MAX];     /* [m/rad] rise of a foot per unit of leg bend */
    double torque[ROBOT_JOINTS_MAX]; /* [N m] that holds the pose at rest */
};

static double clamp(double value, double bound) {
    return fmax(-bound, fmin(bound, value));
}

/* ---- torques ---- */

/* Positions of the feet relative to their mean, in the heading frame [m]. */
typedef struct {
    double x[ROBOT_FEET_MAX], y[ROBOT_FEET_MAX], z[ROBOT_FEET_MAX];
} FeetPlane;

static void feet_plane(const Robot *robot, const RobotSim *sim, const double ahead[2],
                       FeetPlane *plane) {
    double mean[3] = {0};
    int feet = robot_feet(robot);
    for (int f = 0; f < feet; f++) {
        for (int k = 0; k < 3; k++) {
            mean[k] += robot_sim_foot(sim, f)->position[k] / feet;
        }
    }
    for (int f = 0; f < feet; f++) {
        const double *p = robot_sim_foot(sim, f)->position;
        double dx = p[0] - mean[0], dy = p[1] - mean[1];
        plane->x[f] = ahead[0] * dx + ahead[1] * dy;
        plane->y[f] = ahead[0] * dy - ahead[1] * dx;
        plane->z[f] = p[2] - mean[2];
    }
}

/* [rad] Slope of the feet along one direction, minus the correction for the base's speed
 * [rad/s]. */
static double slope_along(const double *along, const double *z, int feet, double speed) {
    double rise = 0.0, spread = 0.0;
    for (int f = 0; f < feet; f++) {
        // NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult): feet_plane filled them
        rise += along[f] * z[f];
        spread += along[f] * along[f];
    }
    return spread < SPREAD_LEAST ? 0.0 : clamp(atan(rise / spread) - SWAY_RATE * speed, OFFSET_MAX);
}

/* Joint offsets that level the base on tilted and unequal ground; offset: [robot_joints]. */
static void answer_tilt(const Stand *stand, const RobotSim *sim, double *offset) {
    const Robot *robot = stand->robot;
    const double *turn = robot_sim_base_rotation(sim), *speed = robot_sim_qvel(sim);
    const double *swing = robot_swing(robot);
    const int *joint_foot = robot_joint_foot(robot);
    const int feet = robot_feet(robot), joints = robot_joints(robot);
    double length = sqrt(turn[0] * turn[0] + turn[3] * turn[3]);
    double height = robot_stand_height(robot);
    double ahead[2] = {turn[0] / length, turn[3] / length};                /* heading */
    double forward = (ahead[0] * speed[0] + ahead[1] * speed[1]) / height; /* [rad/s] */
    double left = (ahead[0] * speed[1] - ahead[1] * speed[0]) / height;    /* [rad/s] */
    FeetPlane plane;
    feet_plane(robot, sim, ahead, &plane);
    double roll = slope_along(plane.y, plane.z, feet, left);
    double pitch = stand->ankles ? 0.0 : slope_along(plane.x, plane.z, feet, forward);
    for (int f = 0; f < feet; f++) {
        double rise = plane.y[f] * roll + plane.x[f] * pitch;
        double bend = stand->lift[f] > LIFT_LEAST ? rise / stand->lift[f] : 0.0;
        for (int i = 0; i < joints; i++) {
            offset[i] += joint_foot[i] == f ? bend * swing[i] : 0.0;
        }
        if (stand->ankles) {
            const double *sole = robot_sim_foot(sim, f)->rotation;
            double tilt = asin(clamp(-sole[6], 1.0)); /* the row is a unit vector */
            offset[robot_ankle(robot, f)] += clamp(tilt + SWAY_RATE * forward, OFFSET_MAX);
        }
    }
}

static void pd(const Robot *robot, const double *q, const double *qd, const double *offset,
               const double *forward, double *torque) {
    const double *pose = robot_default_pose(robot), *effort = robot_effort(robot);
    const double *kp = robot_stand_kp(robot), *kd = robot_stand_kd(robot);
    const int joints = robot_joints(robot);
    for (int i = 0; i < joints; i++) {
        double wanted = kp[i] * (pose[i] + offset[i] - q[i]) - kd[i] * qd[i];
        torque[i] = clamp(wanted + forward[i], effort[i]);
    }
}

/* The ankles undo the lean of the base. */
static void lean_ankles(const Stand *stand, double *q) {
    for (int f = 0; f < robot_feet(stand->robot) && stand->ankles; f++) {
        q[robot_ankle(stand->robot, f)] -= stand->lean;
    }
}

void stand_pd(const Stand *stand, int balance, const double *q, const double *qd, double *torque) {
    static const double none[ROBOT_JOINTS_MAX];
    double offset[ROBOT_JOINTS_MAX] = {0};
    if (balance) {
        lean_ankles(stand, offset);
    }
    pd(stand->robot, q, qd, offset, balance ? stand->torque : none, torque);
}

void stand_torque(const Stand *stand, const RobotSim *sim, int balance, double *torque) {
    const double *q = robot_sim_qpos(sim) + 7, *qd = robot_sim_qvel(sim) + 6;
    if (!balance) {
        stand_pd(stand, 0, q, qd, torque);
        return;
    }
    double offset[ROBOT_JOINTS_MAX] = {0};
    lean_ankles(stand, offset);
    answer_tilt(stand, sim, offset);
    pd(stand->robot, q, qd, offset, stand->torque, torque);
}

void stand_target(const Stand *stand, const RobotSim *sim, double *target) {
    const double *pose = robot_default_pose(stand->robot), *kp = robot_stand_kp(stand->robot);
    double offset[ROBOT_JOINTS_MAX] = {0};
    lean_ankles(stand, offset);
    answer_tilt(stand, sim, offset);
    for (int i = 0; i < robot_joints(stand->robot); i++) {
        target[i] = pose[i] + offset[i] + (kp[i] > 0.0 ? stand->torque[i] / kp[i] : 0.0);
    }
}

RobotState stand_state(const Stand *stand, int balance, double sinkage) {
    const Robot *robot = stand->robot;
    RobotState state = {.qpos = {0, 0, robot_stand_height(robot) - sinkage, 1, 0, 0, 0}};
    memcpy(state.qpos + 7, robot_default_pose(robot),
           (size_t)robot_joints(robot) * sizeof *state.qpos);
    if (balance) {
        memcpy(state.qpos, stand->base, sizeof stand->base);
        state.qpos[2] -= sinkage;
        state.qpos[3] = cos(0.5 * stand->lean);
        state.qpos[5] = sin(0.5 * stand->lean);
        lean_ankles(stand, state.qpos + 7);
    }
    return state;
}

/* ---- the pose ---- */

static void load_pose(const Stand *stand, RobotSim *sim) {
    RobotState state = stand_state(stand, 1, 0.0);
    RobotVariation nominal = robot_variation_nominal();
    robot_sim_load(sim, &state, &nominal);
}

/* Finds the lean at which the centre of mass is over the middle of the soles, by fixed-point
 * iteration. */
static void find_lean(Stand *stand, RobotSim *sim) {
    const mjData *d = robot_sim_data(sim);
    int feet = robot_feet(stand->robot);
    for (int i = 0; i < 20; i++) {
        load_pose(stand, sim);
        double sole = 0.0, lowest = 1e9, foot[3] = {0};
        for (int f = 0; f < feet; f++) {
            for (int k = 0; k < 3; k++) {
                foot[k] += robot_sim_foot(sim, f)->position[k] / feet;
            }
            sole += robot_sim_foot(sim, f)->sole_center[0] / feet;
            lowest = fmin(lowest, robot_sim_foot(sim, f)->sole_height);
        }
        const double *com = d->subtree_com + 3; /* of the base, the first body behind the world */
        stand->lean += stand->ankles ? (sole - com[0]) / (com[2] - foot[2]) : 0.0;
        stand->base[0] = d->qpos[0] - foot[0];
        stand->base[2] = d->qpos[2] - lowest;
    }
}

/* Loads [N] of the feet that carry the weight without a moment about the centre of mass. Of all
 * such loads, F = a + b x + c y has the smallest sum of squares. */
static void share_weight(const Stand *stand, const RobotSim *sim, double load[ROBOT_FEET_MAX]) {
    const mjData *d = robot_sim_data((RobotSim *)sim);
    const double *com = d->subtree_com + 3;
    int feet = robot_feet(stand->robot);
    double m[3][4] = {{0, 0, 0, feet * robot_foot_load(stand->robot)}};
    for (int f = 0; f < feet; f++) {
        const double *p = robot_sim_foot(sim, f)->sole_center;
        const double row[3] = {1.0, p[0] - com[0], p[1] - com[1]};
        for (int r = 0; r < 3; r++) {
            for (int c = 0; c < 3; c++) {
                m[r][c] += row[r] * row[c];
            }
        }
    }
    m[1][1] += SPREAD_LEAST; /* feet in a row get equal shares */
    m[2][2] += SPREAD_LEAST;
    for (int p = 0; p < 3; p++) { /* Gauss; positive definite */
        for (int r = 0; r < 3; r++) {
            double factor = r == p ? 0.0 : m[r][p] / m[p][p];
            for (int c = p; c < 4; c++) {
                m[r][c] -= factor * m[p][c];
            }
        }
    }
    for (int f = 0; f < feet; f++) {
        const double *p = robot_sim_foot(sim, f)->sole_center;
        load[f] = m[0][3] / m[0][0] + m[1][3] / m[1][1] * (p[0] - com[0]) +
                  m[2][3] / m[2][2] * (p[1] - com[1]);
    }
}

/* Joint torques at rest: the bias force b of gravity minus the load of each sole, applied at its
 * middle. */
static void hold_torque(Stand *stand, RobotSim *sim, double *jacobian) {
    const Robot *robot = stand->robot;
    const mjModel *m = robot_sim_model(sim);
    mjData *d = robot_sim_data(sim);
    double load[ROBOT_FEET_MAX];
    share_weight(stand, sim, load);
    mj_fwdPosition(m, d);
    mj_fwdVelocity(m, d); /* b at rest */
    for (int i = 0; i < robot_joints(robot); i++) {
        stand->torque[i] = d->qfrc_bias[robot_joint_dof(robot)[i]];
    }
    for (int f = 0; f < robot_feet(robot); f++) {
        mj_jac(m, d, jacobian, NULL, robot_sim_foot(sim, f)->sole_center,
               robot_foot_body(robot, f));
        const double *up = jacobian + 2 * m->nv;
        for (int i = 0; i < robot_joints(robot); i++) {
            double rise = up[robot_joint_dof(robot)[i]];
            stand->torque[i] -= rise * load[f];
            stand->lift[f] += robot_joint_foot(robot)[i] == f ? rise * robot_swing(robot)[i] : 0.0;
        }
    }
}

Stand *stand_create(const Robot *robot, MildError *error) {
    Stand *stand = calloc(1, sizeof *stand);
    RobotSim *sim = stand ? robot_sim_create(robot, 0.001, error) : NULL;
    double jacobian[3 * ROBOT_NV_MAX];
    if (!sim) {
        free(stand);
        mild_fail(error, MILD_ERROR_MEMORY, "stand: out of memory");
        return NULL;
    }
    stand->robot = robot;
    stand->base[2] = robot_stand_height(robot);
    stand->ankles = 1;
    for (int f = 0; f < robot_feet(robot); f++) {
        stand->ankles = stand->ankles && robot_ankle(robot, f) >= 0;
    }
    find_lean(stand, sim);
    load_pose(stand, sim);
    hold_torque(stand, sim, jacobian);
    robot_sim_destroy(sim);
    return stand;
}

void stand_destroy(Stand *stand) {
    free(stand);
}

/* The balanced stand as a controller, which ignores the command. The balance is computed once per
 * policy step from the true state. Between policy steps the joints' own PD holds it. */

typedef struct {
    const Robot *robot;
    Stand *stand;
    RobotSim *sim;       /* to compute the feet of a state */
    double action_scale; /* [rad] per unit of action */
} Standing;

/* Gains are part of a motor command, so the environments get the gains of the stand. */
static void standing_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    Standing *standing = self;
    const int width = robot_actions(standing->robot);
    const size_t bytes = (size_t)robot_joints(standing->robot) * sizeof(double);
    const double *pose = robot_default_pose(standing->robot);
    for (int e = 0; e < rows; e++) {
        double target[ROBOT_JOINTS_MAX] = {0};
        memcpy(task_env_rest(envs[e])->gains.kp, robot_stand_kp(standing->robot), bytes);
        memcpy(task_env_rest(envs[e])->gains.kd, robot_stand_kd(standing->robot), bytes);
        task_env_load(envs[e], standing->sim);
        stand_target(standing->stand, standing->sim, target);
        for (int i = 0; i < width; i++) {
            actions[e * width + i] = (float)((target[i] - pose[i]) / standing->action_scale);
        }
    }
}

static void standing_destroy(void *self) {
    Standing *standing = self;
    robot_sim_destroy(standing->sim);
    stand_destroy(standing->stand);
    free(standing);
}

MildStatus controller_make_stand(const ControllerDef *def, Controller *controller,
                                 MildError *error) {
    Standing *standing = calloc(1, sizeof *standing);
    if (!standing) {
        return mild_fail(error, MILD_ERROR_MEMORY, "stand: out of memory");
    }
    standing->robot = def->robot;
    standing->action_scale = task_action_scale(def->task, robot_table(def->robot));
    standing->stand = stand_create(def->robot, error);
    standing->sim = robot_sim_create(def->robot, def->task->physics_dt, error);
    if (!standing->stand || !standing->sim) {
        standing_destroy(standing);
        return mild_fail(error, MILD_ERROR_MEMORY, "stand: out of memory");
    }
    *controller = (Controller){
        .self = standing, .name = "stand", .act = standing_act, .destroy = standing_destroy};
    return MILD_OK;
}
