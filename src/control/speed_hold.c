#include "control/speed_hold.h"

#include <math.h>
#include <mujoco/mujoco.h>
#include <string.h>

#include "env/task/gait.h"

#define RATIO_MAX 0.2   /* [-] */
#define ERROR_MAX 0.5   /* [-] of the speed of one cycle */
#define SPEED_MIN 0.1   /* [m/s] of a command whose ratio can be learned */
#define CHANGE_MAX 0.01 /* [m/s] of the command that begins anew */
#define TURNING_MAX 0.4 /* [rad/s] of a command in a cycle that r can learn from */
#define SETTLING 2      /* cycles after that */
#define DOUBT 4         /* cycles after which the mean weighs as much as what was before */
#define FLYING 0.08     /* [-] Froude number above which both feet may be in the air */
#define GRAVITY 9.81    /* [m/s^2] */
#define LEVELLING 0.05  /* [-] share of a frame's gravity in what is down */

/* ---- the legs ---- */

static void take_hinge(const mjModel *m, const Robot *robot, int hinge, SpeedHoldLink *link) {
    const int *dof = robot_joint_dof(robot);
    link->joint = -1;
    for (int i = 0; i < robot_joints(robot); i++) {
        if (dof[i] == m->jnt_dofadr[hinge]) {
            link->joint = i;
        }
    }
    link->zero = m->qpos0[m->jnt_qposadr[hinge]];
    memcpy(link->axis, m->jnt_axis + 3 * (size_t)hinge, sizeof link->axis);
    memcpy(link->anchor, m->jnt_pos + 3 * (size_t)hinge, sizeof link->anchor);
}

/* A link for each hinge of a body, the last one first, and one for a body without. Only the first
 * hinge's carries the body to its place. */
static int take_body(const mjModel *m, const Robot *robot, int body, SpeedHoldLink *link) {
    const int hinges = m->body_jntnum[body], count = hinges > 0 ? hinges : 1;
    for (int i = 0; i < count; i++) {
        link[i] = (SpeedHoldLink){.joint = -1, .turn = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
        if (hinges > 0) {
            take_hinge(m, robot, m->body_jntadr[body] + hinges - 1 - i, &link[i]);
        }
    }
    memcpy(link[count - 1].place, m->body_pos + 3 * (size_t)body, sizeof link->place);
    mju_quat2Mat(link[count - 1].turn, m->body_quat + 4 * (size_t)body);
    return count;
}

static MildStatus take_leg(const mjModel *m, const Robot *robot, int foot, SpeedHoldLegs *legs,
                           MildError *error) {
    SpeedHoldLink *link = legs->link[foot];
    int links = 0;
    for (int body = robot_foot_body(robot, foot); m->body_parentid[body] != 0;
         body = m->body_parentid[body]) {
        const int hinges = m->body_jntnum[body];
        if (links + (hinges > 0 ? hinges : 1) > SPEED_HOLD_LINKS_MAX) {
            return mild_fail(error, MILD_ERROR_RANGE,
                             "robot %s: more than %d bodies between the base and %s; "
                             "--task.speed_hold=0",
                             robot_name(robot), SPEED_HOLD_LINKS_MAX, robot_foot_name(robot, foot));
        }
        links += take_body(m, robot, body, link + links);
    }
    legs->links[foot] = links;
    return MILD_OK;
}

MildStatus speed_hold_legs(const Robot *robot, double gain, SpeedHoldLegs *legs, MildError *error) {
    memset(legs, 0, sizeof *legs);
    if (gain == 0 || robot_points(robot)) {
        return MILD_OK;
    }
    RobotSim *sim = robot_sim_create(robot, 0.005, error);
    if (!sim) {
        return MILD_ERROR_MEMORY;
    }
    const RobotVariation nominal = robot_variation_nominal();
    RobotState state = {.qpos = {0, 0, robot_stand_height(robot), 1}};
    const mjModel *m = robot_sim_model(sim);
    MildStatus status = MILD_OK;
    legs->gain = gain;
    legs->flying = sqrt(FLYING * GRAVITY * robot_stand_height(robot));
    legs->joints = robot_joints(robot);
    legs->feet = robot_feet(robot);
    memcpy(legs->pose, robot_default_pose(robot), (size_t)legs->joints * sizeof *legs->pose);
    memcpy(legs->gait_offset, robot_table(robot)->gait_offset, sizeof legs->gait_offset);
    memcpy(state.qpos + 7, legs->pose, (size_t)legs->joints * sizeof *legs->pose);
    robot_sim_load(sim, &state, &nominal);
    for (int f = 0; f < legs->feet && status == MILD_OK; f++) {
        const mjData *d = robot_sim_data(sim);
        const size_t body = (size_t)robot_foot_body(robot, f);
        double from[3];
        mju_sub3(from, robot_sim_foot(sim, f)->sole_center, d->xpos + 3 * body);
        mju_mulMatTVec3(legs->sole_center[f], d->xmat + 9 * body, from);
        status = take_leg(m, robot, f, legs, error);
    }
    robot_sim_destroy(sim);
    return status;
}

/* v about a unit axis (Rodrigues). */
static void turn_about(const double axis[3], double angle, double v[3]) {
    const double s = sin(angle), c = cos(angle);
    const double along = (1 - c) * (axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2]);
    const double x = c * v[0] + s * (axis[1] * v[2] - axis[2] * v[1]) + along * axis[0];
    const double y = c * v[1] + s * (axis[2] * v[0] - axis[0] * v[2]) + along * axis[1];
    const double z = c * v[2] + s * (axis[0] * v[1] - axis[1] * v[0]) + along * axis[2];
    v[0] = x;
    v[1] = y;
    v[2] = z;
}

static void to_parent(const SpeedHoldLink *link, const double *q, double v[3]) {
    double at[3];
    for (int i = 0; i < 3; i++) {
        v[i] -= link->anchor[i];
    }
    if (link->joint >= 0) {
        turn_about(link->axis, q[link->joint] - link->zero, v);
    }
    for (int i = 0; i < 3; i++) {
        at[i] = v[i] + link->anchor[i];
    }
    for (int i = 0; i < 3; i++) {
        const double *row = link->turn + 3 * i;
        v[i] = link->place[i] + row[0] * at[0] + row[1] * at[1] + row[2] * at[2];
    }
}

void speed_hold_feet(const SpeedHoldLegs *legs, const double *q, double (*foot)[3]) {
    for (int f = 0; f < legs->feet; f++) {
        memcpy(foot[f], legs->sole_center[f], sizeof foot[f]);
        for (int i = 0; i < legs->links[f]; i++) {
            to_parent(&legs->link[f][i], q, foot[f]);
        }
    }
}

/* ---- a frame ---- */

/* Into the heading frame: z against gravity, x where the base looks. */
static void to_heading(const double g[3], const double v[3], double out[2]) {
    const double length = fmax(sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]), 1e-6);
    const double z[3] = {-g[0] / length, -g[1] / length, -g[2] / length};
    const double level = fmax(sqrt(1 - z[0] * z[0]), 1e-6);
    const double x[3] = {(1 - z[0] * z[0]) / level, -z[0] * z[1] / level, -z[0] * z[2] / level};
    const double y[3] = {z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2],
                         z[0] * x[1] - z[1] * x[0]};
    out[0] = x[0] * v[0] + x[1] * v[1] + x[2] * v[2];
    out[1] = y[0] * v[0] + y[1] * v[1] + y[2] * v[2];
}

/* Bits of the feet that the clock wants in stance; 0: the robot stands. */
static unsigned stance_of(const SpeedHoldLegs *legs, const float *clock) {
    unsigned stance = 0;
    if (clock[0] == 0 && clock[1] == 0) {
        return 0;
    }
    /* a little later, for a passing that rounding puts before its frame */
    const double phase = atan2((double)clock[0], (double)clock[1]) / TASK_TWO_PI + 1e-4;
    for (int f = 0; f < legs->feet; f++) {
        const double since = phase - legs->gait_offset[f];
        stance |= (since - floor(since) < 0.5 ? 1u : 0u) << f;
    }
    return stance;
}

/* A vector g that is at rest in the world turns in the base with -w x g. rate: [rad/s] of the base.
 */
static void take_down(SpeedHold *hold, const float *rate, const float *gravity) {
    const double share = hold->frames > 0 ? LEVELLING : 1;
    double w[3], turn[3];
    for (int i = 0; i < 3; i++) {
        w[i] = (hold->rate[i] + (double)rate[i]) / 2; /* between the two frames */
        hold->rate[i] = (double)rate[i];
    }
    mju_cross(turn, hold->down, w);
    for (int i = 0; i < 3; i++) {
        const double down = hold->down[i] + TASK_PERIOD * turn[i];
        hold->down[i] = down + share * ((double)gravity[i] - down);
    }
}

static void take_frame(SpeedHold *hold, const SpeedHoldLegs *legs, const float *frame,
                       unsigned stance) {
    double q[ROBOT_JOINTS_MAX], foot[ROBOT_FEET_MAX][3];
    const float *angle = frame + 9;
    take_down(hold, frame, frame + 6);
    const int older = SPEED_HOLD_FRAMES - 1;
    memmove(hold->foot + 1, hold->foot, (size_t)older * sizeof *hold->foot);
    memmove(hold->stance + 1, hold->stance, (size_t)older * sizeof *hold->stance);
    for (int i = 0; i < legs->joints; i++) {
        q[i] = legs->pose[i] + (double)angle[i];
    }
    speed_hold_feet(legs, q, foot);
    for (int f = 0; f < legs->feet; f++) {
        to_heading(hold->down, foot[f], hold->foot[0][f]);
    }
    hold->stance[0] = stance;
    hold->frames += hold->frames < SPEED_HOLD_FRAMES;
}

/* ---- steps and cycles ---- */

/* [m] Mean place of some feet in three frames around that of an age. */
static void mean_place(const SpeedHold *hold, int feet, unsigned which, int age, double place[2]) {
    int count = 0;
    place[0] = place[1] = 0;
    for (int f = 0; f < feet; f++) {
        for (int k = age - 1; k <= age + 1 && (which >> f & 1); k++) {
            place[0] += hold->foot[k][f][0];
            place[1] += hold->foot[k][f][1];
            count++;
        }
    }
    place[0] /= count > 0 ? count : 1;
    place[1] /= count > 0 ? count : 1;
}

/* The stance passed to other feet in the frame of age SPEED_HOLD_LATE. */
static void take_step(SpeedHold *hold, const SpeedHoldLegs *legs) {
    const unsigned now = hold->stance[SPEED_HOLD_LATE], before = hold->stance[SPEED_HOLD_LATE + 1];
    const int flies = hypot(hold->wanted[0], hold->wanted[1]) > legs->flying;
    const int early = flies ? SPEED_HOLD_BEFORE : 0, late = flies ? SPEED_HOLD_AFTER : 0;
    for (int i = 0; i < SPEED_HOLD_SHIFTS; i++) {
        const int age = SPEED_HOLD_LATE + SPEED_HOLD_EARLY - 1 - i;
        double from[2], to[2];
        mean_place(hold, legs->feet, before, age + early, from);
        mean_place(hold, legs->feet, now, age - late, to);
        hold->way[i][0] += to[0] - from[0];
        hold->way[i][1] += to[1] - from[1];
    }
    hold->duration -= early + late;
}

/* The shift of the largest mean, of three. */
static int best_shift(const double *along) {
    int best = SPEED_HOLD_EARLY - 1; /* c = 0 */
    double most = -INFINITY;
    for (int i = 1; i < SPEED_HOLD_SHIFTS - 1; i++) {
        const double mean = along[i - 1] + along[i] + along[i + 1];
        if (mean > most) {
            most = mean;
            best = i;
        }
    }
    return best;
}

/* [-] v at the top of the means' parabola, over that at the shift: means of three frames lie below
 * the top of f = top - a (c - c0)^2 by 2 a/3 + a (shift - c0)^2. */
static double top_over_shift(const double *along, int shift) {
    const double *at = along + shift;
    const double a = -0.5 * (at[-1] - 2 * at[0] + at[1]), slope = 0.5 * (at[1] - at[-1]);
    return a > 0 && at[0] > 0
               ? 1 + fmin((2 * a / 3 + fmin(slope * slope / (4 * a), a)) / at[0], 0.1)
               : 1;
}

static void learn(SpeedHold *hold, double gain) {
    const double *wanted = hold->wanted, time = hold->duration * TASK_PERIOD;
    const double wanted_speed = hypot(wanted[0], wanted[1]);
    hold->shift = hold->cycles > 0 ? best_shift(hold->along) : SPEED_HOLD_EARLY - 1;
    const double n = ++hold->cycles, share = fmax(gain, 1 / n),
                 weight = n * n / (n * n + DOUBT * DOUBT);
    for (int i = 0; i < SPEED_HOLD_SHIFTS; i++) {
        const double v[2] = {hold->way[i][0] / time, hold->way[i][1] / time};
        const double along = (v[0] * wanted[0] + v[1] * wanted[1]) / fmax(wanted_speed, 1e-6);
        hold->along[i] += share * (along - hold->along[i]);
        if (i == hold->shift) {
            hold->speed[0] = v[0];
            hold->speed[1] = v[1];
        }
    }
    const double top = top_over_shift(hold->along, hold->shift);
    for (int i = 0; i < 2; i++) {
        hold->speed[i] *= top;
        if (fabs(wanted[i]) >= SPEED_MIN) {
            const double command = wanted[i] * (1 + hold->ratio[i]);
            const double factor =
                fmax(fmin(hold->speed[i] / command, 1 + ERROR_MAX), 1 - ERROR_MAX);
            hold->mean[i] += share * (factor - hold->mean[i]);
            const double known = 1 + hold->before[i],
                         now = known + weight * (hold->mean[i] - known);
            hold->ratio[i] = fmax(fmin(1 / now - 1, RATIO_MAX), -RATIO_MAX);
        }
    }
}

static void pass_cycle(SpeedHold *hold, double gain) {
    if (hold->begun && hold->settling == 0 && !hold->turning && hold->duration > 0) {
        learn(hold, gain);
    }
    hold->settling -= hold->settling > 0;
    hold->begun = 1;
    hold->turning = hold->duration = 0;
    memset(hold->way, 0, sizeof hold->way);
}

/* What was learned is where it goes on from. */
static void begin_anew(SpeedHold *hold, const double command[2]) {
    hold->settling = SETTLING;
    hold->cycles = 0;
    for (int i = 0; i < 2; i++) {
        hold->wanted[i] = command[i];
        hold->before[i] = 1 / (1 + hold->ratio[i]) - 1;
    }
}

void speed_hold(SpeedHold *hold, const SpeedHoldLegs *legs, const float *frame, double command[3]) {
    const unsigned stance = legs->gain > 0 ? stance_of(legs, frame + 9 + 3 * legs->joints) : 0;
    if (!stance) {
        *hold = (SpeedHold){.settling = SETTLING, .wanted = {command[0], command[1]}};
        return;
    }
    if (fabs(command[0] - hold->wanted[0]) > CHANGE_MAX ||
        fabs(command[1] - hold->wanted[1]) > CHANGE_MAX) {
        begin_anew(hold, command);
    }
    take_frame(hold, legs, frame, stance);
    hold->duration++;
    hold->turning |= fabs(command[2]) > TURNING_MAX;
    if (hold->frames == SPEED_HOLD_FRAMES &&
        hold->stance[SPEED_HOLD_LATE] != hold->stance[SPEED_HOLD_LATE + 1]) {
        take_step(hold, legs);
        if (hold->stance[SPEED_HOLD_LATE] & ~hold->stance[SPEED_HOLD_LATE + 1] & 1) {
            pass_cycle(hold, legs->gain);
        }
    }
    command[0] *= 1 + hold->ratio[0];
    command[1] *= 1 + hold->ratio[1];
}
