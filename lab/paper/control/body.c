#include "paper/control/body.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <mujoco/mujoco.h>

#define GRAVITY 9.81
#define LOAD_MOST 2.0 /* [-] of the weight on one foot */
#define DAMPED 1e-4   /* regularises the inverse of the tasks' Jacobian near stretched knees */

/* Rows of the tasks' Jacobian: centre of mass, base's rotation, then linear and angular velocity of
 * each foot. */
enum { NV = 18, TASKS = 18, TASK_MASS = 0, TASK_BASE = 3, TASK_FEET = 6 };

struct Body {
    const Robot *robot;
    BodyDef def;
    WrenchSolver *solver;
    double mass;                       /* [kg] */
    double support[WALK_FEET][3];      /* [m] support point, foot frame */
    double low[WALK_FEET][2];          /* [m] of the sole from the support point */
    double high[WALK_FEET][2];         /* [m] */
    double limit[ROBOT_JOINTS_MAX];    /* [N m] */
    int dof[WALK_FEET][WRENCH_MOTORS]; /* of the legs' joints in the engine */
    int joint[WALK_FEET][WRENCH_MOTORS];
    /* state */
    double m[NV][NV]; /* mass matrix */
    double h[NV];     /* bias force */
    double jacobian[TASKS][NV];
    double drift[TASKS];     /* rate of the Jacobian times the velocity */
    double rate[TASKS];      /* Jacobian times the velocity */
    double mass_center[3];   /* [m] */
    double dcm[3];           /* [m] */
    double base[3];          /* [m] */
    double base_rotation[9]; /* to world, row major */
    double foot_rotation[WALK_FEET][9];
    double foot_point[WALK_FEET][3]; /* [m] */
    /* result */
    WrenchProgram program;
    double wanted[WRENCH_SIZE];
    double share[WALK_FEET][WRENCH_SIZE];
};

BodyDef body_def_default(void) {
    BodyDef def = {
        .dcm_gain = 3,
        .turn_stiffness = 100,
        .turn_damping = 18,
        .still_turn_damping = 9,
        .swing_stiffness = 1500,
        .swing_damping = 100,
        .sole_stiffness = 30,
        .sole_damping = 1,
        .stance_damping = 250,
        .stance_turn_damping = 6,
        .pitch = 0,
        .friction = 0.5,
        .ahead = 0.03,
        .margin = {0.03, 0.01},
    };
    return def;
}

/* ---- constants of the robot ---- */

static int is_biped(const Robot *robot) {
    int legs[WALK_FEET] = {0};
    if (robot_feet(robot) != WALK_FEET || robot_joints(robot) != WALK_FEET * WRENCH_MOTORS) {
        return 0;
    }
    for (int i = 0; i < robot_joints(robot); i++) {
        const int f = robot_joint_foot(robot)[i];
        if (f < 0) {
            return 0;
        }
        legs[f]++;
    }
    return legs[0] == legs[1] && robot_ankle(robot, 0) >= 0 && robot_ankle(robot, 1) >= 0;
}

static void read_sole(Body *body, int f) {
    const MildSole *sole = robot_rasters(body->robot)[f];
    const double *at[2] = {mild_sole_x(sole), mild_sole_y(sole)};
    body->support[f][0] = body->def.ahead;
    body->support[f][1] = 0;
    body->support[f][2] = mild_sole_z(sole);
    for (int k = 0; k < 2; k++) {
        double low = 1e9, high = -1e9;
        for (int e = 0; e < mild_sole_elements(sole); e++) {
            low = fmin(low, at[k][e]);
            high = fmax(high, at[k][e]);
        }
        body->low[f][k] = low + body->def.margin[k] - body->support[f][k];
        body->high[f][k] = high - body->def.margin[k] - body->support[f][k];
    }
}

Body *body_create(const Robot *robot, const BodyDef *def, const double *limit, MildError *error) {
    if (!is_biped(robot)) {
        mild_fail(error, MILD_ERROR_ARGUMENT,
                  "controller passivity: robot %s is no biped with six joints a leg; give another "
                  "--controller",
                  robot_name(robot));
        return NULL;
    }
    Body *body = calloc(1, sizeof *body);
    WrenchSolver *solver = wrench_solver_create();
    if (!body || !solver) {
        free(body);
        wrench_solver_destroy(solver);
        mild_fail(error, MILD_ERROR_MEMORY, "controller passivity: out of memory");
        return NULL;
    }
    body->robot = robot;
    body->def = *def;
    body->solver = solver;
    int count[WALK_FEET] = {0};
    for (int i = 0; i < robot_joints(robot); i++) {
        const int f = robot_joint_foot(robot)[i];
        body->limit[i] = limit[i];
        body->joint[f][count[f]] = i;
        body->dof[f][count[f]++] = robot_joint_dof(robot)[i];
    }
    for (int f = 0; f < WALK_FEET; f++) {
        read_sole(body, f);
    }
    return body;
}

void body_destroy(Body *body) {
    if (body) {
        wrench_solver_destroy(body->solver);
        free(body);
    }
}

/* ---- state ---- */

static void cross(const double a[3], const double b[3], double c[3]) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static void turn(const double rotation[9], const double local[3], double world[3]) {
    for (int k = 0; k < 3; k++) {
        world[k] = rotation[3 * k] * local[0] + rotation[3 * k + 1] * local[1] +
                   rotation[3 * k + 2] * local[2];
    }
}

/* Mass matrix and bias force of the engine at its pose and velocity. */
static void measure_dynamics(Body *body, const mjModel *m, mjData *d) {
    mj_makeM(m, d);
    mj_comVel(m, d);
    mj_rne(m, d, 0, d->qfrc_bias);
    mj_fullM(m, d, body->m[0]);
    memcpy(body->h, d->qfrc_bias, sizeof body->h);
    body->mass = body->m[0][0];
}

/* The first three rows of M are the momentum's; those of h are its rate at rest of the joints'
 * accelerations, and the weight. */
static void measure_mass_center(Body *body, const mjData *d, double b) {
    for (int k = 0; k < 3; k++) {
        const double weight = k == 2 ? GRAVITY : 0;
        for (int i = 0; i < NV; i++) {
            body->jacobian[TASK_MASS + k][i] = body->m[k][i] / body->mass;
        }
        body->drift[TASK_MASS + k] = body->h[k] / body->mass - weight;
        body->mass_center[k] = d->subtree_com[3 + k]; /* of the base, the first body */
        body->dcm[k] = body->mass_center[k];
        for (int i = 0; i < NV; i++) {
            body->dcm[k] += b * body->jacobian[TASK_MASS + k][i] * d->qvel[i];
        }
    }
}

/* The engine's angular velocity of the base is in the base's axes. */
static void measure_base(Body *body, const RobotSim *sim) {
    memcpy(body->base, robot_sim_qpos(sim), sizeof body->base);
    memcpy(body->base_rotation, robot_sim_base_rotation(sim), sizeof body->base_rotation);
    for (int k = 0; k < 3; k++) {
        memcpy(&body->jacobian[TASK_BASE + k][3], body->base_rotation + 3 * k, 3 * sizeof(double));
    }
}

static void measure_foot(Body *body, const mjModel *m, const mjData *d, const RobotSim *sim,
                         int f) {
    const int row = TASK_FEET + 6 * f, id = robot_foot_body(body->robot, f);
    const RobotFoot *foot = robot_sim_foot(sim, f);
    double dot[6][NV], arm[3];
    turn(foot->rotation, body->support[f], arm);
    for (int k = 0; k < 3; k++) {
        body->foot_point[f][k] = foot->position[k] + arm[k];
    }
    memcpy(body->foot_rotation[f], foot->rotation, sizeof body->foot_rotation[f]);
    mj_jac(m, d, body->jacobian[row], body->jacobian[row + 3], body->foot_point[f], id);
    mj_jacDot(m, d, dot[0], dot[3], body->foot_point[f], id);
    for (int k = 0; k < 6; k++) {
        body->drift[row + k] = 0;
        for (int i = 0; i < NV; i++) {
            body->drift[row + k] += dot[k][i] * d->qvel[i];
        }
    }
}

void body_measure(Body *body, RobotSim *sim, double b, WalkState *state) {
    const mjModel *m = robot_sim_model(sim);
    mjData *d = robot_sim_data(sim);
    measure_dynamics(body, m, d);
    measure_mass_center(body, d, b);
    measure_base(body, sim);
    for (int f = 0; f < WALK_FEET; f++) {
        measure_foot(body, m, d, sim, f);
        memcpy(state->support[f], body->foot_point[f], sizeof state->support[f]);
        state->yaw[f] = atan2(body->foot_rotation[f][3], body->foot_rotation[f][0]);
    }
    for (int t = 0; t < TASKS; t++) {
        body->rate[t] = 0;
        for (int i = 0; i < NV; i++) {
            body->rate[t] += body->jacobian[t][i] * d->qvel[i];
        }
    }
    memcpy(state->dcm, body->dcm, sizeof state->dcm);
    state->base_yaw = atan2(body->base_rotation[3], body->base_rotation[0]);
}

/* ---- impedances ---- */

/* Rotation by yaw about z after pitch about y. */
static void upright(double yaw, double pitch, double rotation[9]) {
    const double c = cos(yaw), s = sin(yaw), cp = cos(pitch), sp = sin(pitch);
    const double r[9] = {c * cp, -s, c * sp, s * cp, c, s * sp, -sp, 0, cp};
    memcpy(rotation, r, sizeof r);
}

/* [rad] Rotation vector, world axes, from `now` to `wanted`, for angles well below pi:
 * half of the sum of now_k x wanted_k over the axes k. */
static void rotation_error(const double now[9], const double wanted[9], double error[3]) {
    memset(error, 0, 3 * sizeof *error);
    for (int k = 0; k < 3; k++) {
        const double a[3] = {now[k], now[3 + k], now[6 + k]};
        const double b[3] = {wanted[k], wanted[3 + k], wanted[6 + k]};
        double c[3];
        cross(a, b, c);
        for (int j = 0; j < 3; j++) {
            error[j] += 0.5 * c[j];
        }
    }
}

/* Forces of the impedances in the tasks' coordinates, and the accelerations of the plan. */
typedef struct {
    double force[TASKS];
    double acceleration[TASKS];
} Wish;

/* a = (x - p) / b^2 along the plan, and -m (1 + k b) / b^2 times the DCM's error: the impedance
 * K = m k / b, D = m (1 + k b) / b about the plan's centre of mass, which drops out. */
static void wish_mass_center(const Body *body, const WalkTarget *target, double b, Wish *wish) {
    for (int k = 0; k < 3; k++) {
        const double error = body->dcm[k] - target->dcm[k];
        wish->acceleration[TASK_MASS + k] =
            (body->mass_center[k] - target->point[k] - (1 + body->def.dcm_gain * b) * error) /
            (b * b);
    }
}

static void wish_base(const Body *body, const WalkTarget *target, Wish *wish) {
    const double rate[3] = {0, 0, target->base_yaw_rate};
    const double damping = target->still ? body->def.still_turn_damping : body->def.turn_damping;
    double wanted[9], error[3];
    upright(target->base_yaw, body->def.pitch, wanted);
    rotation_error(body->base_rotation, wanted, error);
    for (int k = 0; k < 3; k++) {
        wish->force[TASK_BASE + k] =
            body->def.turn_stiffness * error[k] + damping * (rate[k] - body->rate[TASK_BASE + k]);
    }
}

static void wish_swing(const Body *body, const WalkTarget *target, Wish *wish) {
    const BodyDef *def = &body->def;
    const int f = target->swing, row = TASK_FEET + 6 * f;
    double wanted[9], error[3];
    upright(target->yaw, 0, wanted);
    rotation_error(body->foot_rotation[f], wanted, error);
    for (int k = 0; k < 3; k++) {
        const double behind = target->position[k] - body->foot_point[f][k];
        const double slower = target->velocity[k] - body->rate[row + k];
        wish->acceleration[row + k] = target->acceleration[k];
        wish->force[row + k] = def->swing_stiffness * behind + def->swing_damping * slower;
        wish->force[row + 3 + k] = target->level * def->sole_stiffness * error[k] -
                                   def->sole_damping * body->rate[row + 3 + k];
    }
}

/* Joints' and base's accelerations a with J a = acceleration - drift, by damped least squares. */
static void solve_acceleration(const Body *body, const Wish *wish, double *acceleration) {
    double normal[NV][NV], right[NV];
    for (int i = 0; i < NV; i++) {
        right[i] = 0;
        for (int t = 0; t < TASKS; t++) {
            right[i] += body->jacobian[t][i] * (wish->acceleration[t] - body->drift[t]);
        }
        for (int j = 0; j < NV; j++) {
            normal[i][j] = i == j ? DAMPED : 0;
            for (int t = 0; t < TASKS; t++) {
                normal[i][j] += body->jacobian[t][i] * body->jacobian[t][j];
            }
        }
    }
    mju_cholFactor(normal[0], NV, 0);
    mju_cholSolve(acceleration, normal[0], right, NV);
}

/* u = M a + h + J^T force */
static void generalised_force(const Body *body, const Wish *wish, double u[NV]) {
    double acceleration[NV];
    solve_acceleration(body, wish, acceleration);
    for (int i = 0; i < NV; i++) {
        u[i] = body->h[i];
        for (int j = 0; j < NV; j++) {
            u[i] += body->m[i][j] * acceleration[j];
        }
        for (int t = 0; t < TASKS; t++) {
            u[i] += body->jacobian[t][i] * wish->force[t];
        }
    }
}

/* ---- from forces to torques ---- */

/* The base's rows of u as a wrench about the centre of mass. */
static void wanted_wrench(Body *body, const double u[NV]) {
    double arm[3], moment[3], about_base[3];
    for (int k = 0; k < 3; k++) {
        arm[k] = body->base[k] - body->mass_center[k];
    }
    turn(body->base_rotation, u + 3, about_base);
    cross(arm, u, moment);
    for (int k = 0; k < 3; k++) {
        body->wanted[k] = u[k];
        body->wanted[3 + k] = about_base[k] + moment[k];
    }
}

/* A foot that stands is damped against its leg, in the joints' rows alone: the base's rows would
 * ask the ground for the same wrench, and the foot would get none of it. */
static void damp_stance(const Body *body, int f, double u[NV]) {
    const int row = TASK_FEET + 6 * f;
    const BodyDef *def = &body->def;
    for (int i = 0; i < WRENCH_MOTORS; i++) {
        const int dof = body->dof[f][i];
        for (int k = 0; k < 6; k++) {
            const double damping = k < 3 ? def->stance_damping : def->stance_turn_damping;
            u[dof] -= damping * body->jacobian[row + k][dof] * body->rate[row + k];
        }
    }
}

static void describe_foot(const Body *body, int f, const WalkTarget *target, const double u[NV],
                          WrenchFoot *foot) {
    for (int k = 0; k < 3; k++) {
        foot->point[k] = body->foot_point[f][k] - body->mass_center[k];
    }
    memcpy(foot->rotation, body->foot_rotation[f], sizeof foot->rotation);
    memcpy(foot->low, body->low[f], sizeof foot->low);
    memcpy(foot->high, body->high[f], sizeof foot->high);
    foot->load[0] = 0;
    foot->load[1] = LOAD_MOST * body->mass * GRAVITY * target->share[f];
    foot->friction = body->def.friction;
    for (int i = 0; i < WRENCH_MOTORS; i++) {
        const int dof = body->dof[f][i];
        foot->motor_rest[i] = u[dof];
        foot->motor_limit[i] = body->limit[body->joint[f][i]];
        for (int k = 0; k < WRENCH_SIZE; k++) {
            foot->motor_map[i][k] = body->jacobian[TASK_FEET + 6 * f + k][dof];
        }
    }
}

/* The feet that stand, in order, and which they are. Returns their number. */
static int describe_feet(const Body *body, const WalkTarget *target, double u[NV],
                         WrenchFoot foot[WALK_FEET], int which[WALK_FEET]) {
    int feet = 0;
    for (int f = 0; f < WALK_FEET; f++) {
        if (target->stands[f]) {
            damp_stance(body, f, u);
            describe_foot(body, f, target, u, &foot[feet]);
            which[feet++] = f;
        }
    }
    return feet;
}

/* tau = u - sum of J_f^T F_f */
static void motor_torques(const Body *body, const double u[NV], double *torque) {
    for (int i = 0; i < robot_joints(body->robot); i++) {
        torque[i] = u[robot_joint_dof(body->robot)[i]];
    }
    for (int f = 0; f < WALK_FEET; f++) {
        for (int i = 0; i < WRENCH_MOTORS; i++) {
            for (int k = 0; k < WRENCH_SIZE; k++) {
                const double lever = body->jacobian[TASK_FEET + 6 * f + k][body->dof[f][i]];
                torque[body->joint[f][i]] -= lever * body->share[f][k];
            }
        }
    }
}

int body_torque(Body *body, const WalkTarget *target, double b, double *torque) {
    Wish wish = {0};
    WrenchFoot foot[WALK_FEET];
    int which[WALK_FEET];
    double u[NV], x[WRENCH_NUMBERS] = {0};
    wish_mass_center(body, target, b, &wish);
    wish_base(body, target, &wish);
    if (target->swing >= 0) {
        wish_swing(body, target, &wish);
    }
    generalised_force(body, &wish, u);
    wanted_wrench(body, u);
    const int feet = describe_feet(body, target, u, foot, which);
    wrench_program(foot, feet, body->wanted, &body->program);
    const int failed = wrench_solve(body->solver, &body->program, x);
    memset(body->share, 0, sizeof body->share);
    for (int n = 0; n < feet; n++) {
        memcpy(body->share[which[n]], x + WRENCH_SIZE * n, sizeof body->share[0]);
    }
    motor_torques(body, u, torque);
    return failed;
}

void body_wrenches(const Body *body, double wanted[WRENCH_SIZE],
                   double share[WALK_FEET][WRENCH_SIZE]) {
    memcpy(wanted, body->wanted, sizeof body->wanted);
    memcpy(share, body->share, sizeof body->share);
}
