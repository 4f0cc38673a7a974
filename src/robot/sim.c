/* One physics step of a robot whose feet stand on our ground. Between steps, everything that
 * depends on the pose (kinematics, Jacobians and twists of the feet) is up to date. So a step
 * starts with the dynamics and ends with the next pose. */
#include "robot/sim.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "ground/terrain/grid.h"

#define QVEL_MAX 1e3 /* [m/s, rad/s] a larger velocity means divergence */

static double split(RobotSim *sim, double *phase, double since) {
    if (!sim->phases) {
        return 0.0;
    }
    double now = clock_seconds();
    *phase += now - since;
    return now;
}

RobotSim *robot_sim_create(const Robot *robot, double dt, MildError *error) {
    if (!(dt >= 0.0001 && dt <= 0.01)) {
        mild_fail(error, MILD_ERROR_RANGE, "robot: time step %g s is outside 0.0001 .. 0.01", dt);
        return NULL;
    }
    RobotSim *sim = calloc(1, sizeof *sim);
    mjModel *model = sim ? mj_copyModel(NULL, robot->model) : NULL;
    mjData *data = model ? mj_makeData(model) : NULL;
    if (!data) {
        mj_deleteModel(model);
        free(sim);
        mild_fail(error, MILD_ERROR_MEMORY, "robot: out of memory");
        return NULL;
    }
    sim->robot = robot;
    sim->model = model;
    sim->data = data;
    sim->dt = dt;
    sim->scratch = mild_scratch_create(robot_soles(robot), robot_bodies(robot), error);
    if (!sim->scratch) {
        robot_sim_destroy(sim);
        return NULL;
    }
    model->opt.timestep = dt;
    sim->input.feet = robot_bodies(robot);
    sim->rows = robot->def.feet;
    for (int f = 0; f < sim->rows; f++) {
        sim->row[f] = f;
    }
    sim->input.dt = dt;
    sim->input.inverse_inertia = sim->inverse_inertia;
    RobotState stand = {.qpos = {0, 0, robot->stand_height, 1, 0, 0, 0}};
    memcpy(stand.qpos + 7, robot->def.pose, sizeof robot->def.pose);
    RobotVariation nominal = robot_variation_nominal();
    robot_sim_load(sim, &stand, &nominal);
    return sim;
}

void robot_sim_destroy(RobotSim *sim) {
    if (!sim) {
        return;
    }
    mild_scratch_destroy(sim->scratch);
    mj_deleteData(sim->data);
    mj_deleteModel(sim->model);
    free(sim);
}

void robot_sim_set_solver(RobotSim *sim, MildSolver solver, double tolerance, int iterations) {
    sim->input.solver = solver;
    sim->input.tolerance = tolerance;
    sim->input.max_iterations = iterations;
}

double robot_sim_dt(const RobotSim *sim) {
    return sim->dt;
}

/* Lowest point of a flat sole's outline above z = 0 [m]. */
static double lowest_sole_point(const RobotFootDef *def, const double position[3],
                                const double turn[9]) {
    double least = 1e9;
    for (int i = 0; i < def->outline_points; i++) {
        double z = turn[6] * def->outline[2 * i] + turn[7] * def->outline[2 * i + 1];
        least = z < least ? z : least;
    }
    return position[2] + turn[8] * def->z + least;
}

/* [m] Smallest height of an outline point above the ground under it. */
static double lowest_above_map(const RobotFootDef *def, const double position[3],
                               const double turn[9], const MildTerrain *terrain) {
    double least = 1e9, c = def->z;
    for (int i = 0; i < def->outline_points; i++) {
        double a = def->outline[2 * i], b = def->outline[2 * i + 1];
        double x = position[0] + turn[0] * a + turn[1] * b + turn[2] * c,
               y = position[1] + turn[3] * a + turn[4] * b + turn[5] * c;
        double z = position[2] + turn[6] * a + turn[7] * b + turn[8] * c;
        least = fmin(least, z - mild_terrain_height_at(terrain, x, y));
    }
    return least;
}

static double sole_height(const Robot *robot, int f, const RobotFoot *foot,
                          const MildTerrain *terrain) {
    const RobotFootDef *def = &robot->def.foot[f];
    if (robot->limb[f].round) {
        const double *p = foot->position;
        return p[2] - (terrain ? mild_terrain_height_at(terrain, p[0], p[1]) : 0.0);
    }
    if (terrain && terrain->map) {
        return lowest_above_map(def, foot->position, foot->rotation, terrain);
    }
    return lowest_sole_point(def, foot->position, foot->rotation) -
           (terrain ? terrain->height : 0.0);
}

/* Pose, twist and sole of a foot from the current kinematics. terrain: NULL for z = 0. */
static void observe_foot(RobotSim *sim, int f, const MildTerrain *terrain) {
    static const double level[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const mjData *d = sim->data;
    const RobotLimb *limb = &sim->robot->limb[f];
    RobotFoot *foot = &sim->feet[f];
    foot_map_reference(sim, f, foot->position);
    memcpy(foot->rotation, limb->round ? level : d->xmat + 9 * limb->body, sizeof foot->rotation);
    foot_map_twist(sim, f, d->qvel, NULL, foot->velocity);
    const double *c = limb->sole_center, *turn = foot->rotation, *w = foot->velocity + 3;
    double arm[3];
    for (int k = 0; k < 3; k++) {
        arm[k] = turn[3 * k] * c[0] + turn[3 * k + 1] * c[1] + turn[3 * k + 2] * c[2];
        foot->sole_center[k] = foot->position[k] + arm[k];
    }
    foot->sole_center_velocity[0] = foot->velocity[0] + w[1] * arm[2] - w[2] * arm[1];
    foot->sole_center_velocity[1] = foot->velocity[1] + w[2] * arm[0] - w[0] * arm[2];
    foot->sole_center_velocity[2] = foot->velocity[2] + w[0] * arm[1] - w[1] * arm[0];
    foot->sole_height = sole_height(sim->robot, f, foot, terrain);
}

/* Velocities or accelerations from the engine's order to the robot's. */
static void gather_rates(const Robot *robot, const double *from, double *to) {
    memcpy(to, from, 6 * sizeof *to);
    for (int i = 0; i < robot->def.joints; i++) {
        to[6 + i] = from[robot->dof[i]];
    }
}

/* The engine's state in the robot's order. */
static void gather_state(const Robot *robot, const mjData *d, double *qpos, double *qvel) {
    memcpy(qpos, d->qpos, 7 * sizeof *qpos);
    for (int i = 0; i < robot->def.joints; i++) {
        qpos[7 + i] = d->qpos[robot->dof[i] + 1];
    }
    gather_rates(robot, d->qvel, qvel);
}

/* Updates everything that depends only on qpos and qvel. */
static void update_pose(RobotSim *sim, const MildTerrain *terrain) {
    mj_kinematics(sim->model, sim->data);
    mj_comPos(sim->model, sim->data);
    gather_state(sim->robot, sim->data, sim->qpos, sim->qvel);
    foot_map_jacobian(sim);
    for (int f = 0; f < sim->robot->def.feet; f++) {
        observe_foot(sim, f, terrain);
    }
}

void robot_sim_load(RobotSim *sim, const RobotState *state, const RobotVariation *variation) {
    const Robot *robot = sim->robot;
    mjData *d = sim->data;
    variation_apply(sim, variation);
    robot_engine_qpos(robot, state->qpos, d->qpos);
    robot_engine_rates(robot, state->qvel, d->qvel);
    robot_engine_rates(robot, state->qacc, d->qacc_warmstart);
    d->time = 0.0;
    memset(sim->feet, 0, sizeof sim->feet);
    memset(&sim->contact, 0, sizeof sim->contact);
    update_pose(sim, NULL);
}

double robot_sim_sole_clearance(RobotSim *sim, const MildTerrain *terrain) {
    double least = 1e9;
    for (int f = 0; f < sim->robot->def.feet; f++) {
        sim->feet[f].sole_height = sole_height(sim->robot, f, &sim->feet[f], terrain);
        least = fmin(least, sim->feet[f].sole_height);
    }
    return least;
}

void robot_sim_store(const RobotSim *sim, RobotState *state) {
    memset(state, 0, sizeof *state);
    gather_state(sim->robot, sim->data, state->qpos, state->qvel);
    gather_rates(sim->robot, sim->data->qacc_warmstart, state->qacc);
}

/* Generalised force of a push (force, torque, world) at the base's centre of mass. */
static void add_push(RobotSim *sim, const double *push) {
    mjData *d = sim->data;
    int base = sim->robot->base_body;
    const double *turn = d->xmat + 9 * base;
    double arm[3], moment[3];
    for (int k = 0; k < 3; k++) {
        arm[k] = d->xipos[3 * base + k] - d->xpos[3 * base + k];
    }
    moment[0] = push[3] + arm[1] * push[2] - arm[2] * push[1];
    moment[1] = push[4] + arm[2] * push[0] - arm[0] * push[2];
    moment[2] = push[5] + arm[0] * push[1] - arm[1] * push[0];
    for (int k = 0; k < 3; k++) {
        d->qfrc_smooth[k] += push[k];
        d->qfrc_smooth[3 + k] +=
            turn[k] * moment[0] + turn[3 + k] * moment[1] + turn[6 + k] * moment[2];
    }
}

/* M, the bias b and the forces without ground and constraints, f = tau - b. */
static void smooth_dynamics(RobotSim *sim, const double *torque, const double *push) {
    mjModel *m = sim->model;
    mjData *d = sim->data;
    mj_makeM(m, d);
    mj_comVel(m, d);
    mj_rne(m, d, 0, d->qfrc_bias);
    for (int i = 0; i < 6; i++) {
        d->qfrc_smooth[i] = 0.0 - d->qfrc_bias[i];
    }
    for (int i = 0; i < sim->robot->def.joints; i++) {
        int dof = sim->robot->dof[i];
        d->qfrc_smooth[dof] = torque[i] - d->qfrc_bias[dof];
    }
    if (push) {
        add_push(sim, push);
    }
}

/* The factor of M, or of N with limits that are held, and qacc_smooth = M^-1 f. */
static void smooth_acceleration(RobotSim *sim) {
    mj_factorM(sim->model, sim->data);
    mj_solveM(sim->model, sim->data, sim->data->qacc_smooth, sim->data->qfrc_smooth, 1);
}

/* Fixes the pose of the feet before the step, because forces refer to the pose in which they were
 * computed. */
static void feet_pose(RobotSim *sim) {
    MildContactInput *input = &sim->input;
    for (int f = 0; f < sim->robot->def.feet; f++) {
        memcpy(input->position[f], sim->feet[f].position, sizeof input->position[f]);
        memcpy(input->rotation[f], sim->feet[f].rotation, sizeof input->rotation[f]);
        memcpy(input->velocity[f], sim->feet[f].velocity, sizeof input->velocity[f]);
    }
}

/* Pose and twist of the bodies with shells. */
static void update_shells(RobotSim *sim) {
    MildContactInput *input = &sim->input;
    const mjModel *m = sim->model;
    const mjData *d = sim->data;
    for (int b = sim->robot->def.feet; b < input->feet; b++) {
        const int body = sim->robot->limb[b].body;
        const double *com = d->subtree_com + 3 * m->body_rootid[body], *spin = d->cvel + 6 * body;
        double arm[3];
        memcpy(input->position[b], d->xpos + 3 * body, sizeof input->position[b]);
        memcpy(input->rotation[b], d->xmat + 9 * body, sizeof input->rotation[b]);
        mju_sub3(arm, input->position[b], com);
        mju_cross(input->velocity[b], spin, arm);
        mju_addTo3(input->velocity[b], spin + 3);
        memcpy(input->velocity[b] + 3, spin, 3 * sizeof(double));
        memcpy(input->free_velocity + 6 * b, input->velocity[b], sizeof input->velocity[b]);
    }
}

/* The feet and those shells that stand and may touch the ground get rows of A. Gravity adds to a
 * velocity less than mild_ground_near allows for. */
static void choose_rows(RobotSim *sim, const MildTerrain *terrain) {
    const int feet = sim->robot->def.feet;
    if (sim->input.feet == feet) {
        return;
    }
    update_shells(sim);
    sim->rows = feet;
    sim->input.rows = (1u << feet) - 1;
    const uint32_t near =
        sim->variation.shells_stand ? mild_ground_near(terrain, &sim->input, sim->scratch) : 0;
    for (int b = feet; b < sim->input.feet; b++) {
        if (near >> b & 1) {
            sim->input.rows |= 1u << b;
            sim->row[sim->rows++] = b;
            foot_map_shell(sim, b);
        }
    }
}

/* Inverse inertia and free motion of the rows: A = J M^-1 J^T and V_free = J (qvel + dt a). */
static void project_feet(RobotSim *sim) {
    foot_map_inverse_inertia(sim);
    for (int i = 0; i < sim->rows; i++) {
        const int b = sim->row[i];
        foot_map_twist(sim, b, sim->data->qvel, sim->data->qacc_smooth,
                       sim->input.free_velocity + 6 * b);
    }
}

/* qacc_smooth with the wrenches of soft ground, and without the limits that were held. */
static void accelerate(RobotSim *sim, int held) {
    mjData *d = sim->data;
    double wrench[ROBOT_BODIES_MAX][6], force[ROBOT_NV_MAX], acceleration[ROBOT_NV_MAX];
    for (int i = 0; i < sim->rows; i++) {
        const MildFootResult *body = &sim->contact.foot[sim->row[i]];
        memcpy(wrench[i], body->force, 3 * sizeof(double));
        memcpy(wrench[i] + 3, body->torque, 3 * sizeof(double));
    }
    limits_release(sim, held);
    foot_map_wrench(sim, wrench, force, acceleration);
    for (int i = 0; i < sim->robot->nv; i++) {
        d->qfrc_smooth[i] += force[i];
        d->qacc_smooth[i] += acceleration[i];
    }
    if (held) {
        smooth_acceleration(sim);
    }
}

/* Solves the rows of limits_make. Without any the smooth acceleration is final. */
static void constrain(RobotSim *sim, int rows) {
    mjData *d = sim->data;
    if (rows) {
        mj_projectConstraint(sim->model, d);
        mj_fwdConstraint(sim->model, d);
    } else {
        memcpy(d->qacc, d->qacc_smooth, (size_t)sim->robot->nv * sizeof(double));
    }
}

/* Semi-implicit Euler, as the engine does by default: first the velocity, then the pose with the
 * new velocity. */
static int integrate(RobotSim *sim) {
    mjData *d = sim->data;
    int bad = 0;
    for (int i = 0; i < sim->robot->nv; i++) {
        d->qvel[i] += sim->dt * d->qacc[i];
        bad |= !(fabs(d->qvel[i]) < QVEL_MAX); /* NaN included */
    }
    if (bad) {
        return 1;
    }
    memcpy(d->qacc_warmstart, d->qacc, (size_t)sim->robot->nv * sizeof(double));
    mj_integratePos(sim->model, d->qpos, d->qvel, sim->dt);
    d->time += sim->dt;
    return 0;
}

static void report_forces(RobotSim *sim) {
    for (int f = 0; f < sim->robot->def.feet; f++) {
        RobotFoot *foot = &sim->feet[f];
        foot->result = sim->contact.foot[f];
        memcpy(foot->force, foot->result.force, sizeof foot->force);
        if (!sim->robot->limb[f].round) {
            memcpy(foot->torque, foot->result.torque, sizeof foot->torque);
        }
    }
}

/* The ground's wrenches. Returns 1 when another ground has failed. */
static int stand(RobotSim *sim, const MildTerrain *terrain, MildGround *ground) {
    if (sim->other) {
        memset(&sim->contact, 0, sizeof sim->contact);
        return sim->other->solve(sim->other->self, terrain, ground, &sim->input, &sim->contact);
    }
    mild_ground_solve(ground, terrain, &sim->input, sim->scratch, &sim->contact);
    mild_ground_advance(ground, terrain, &sim->input, sim->scratch, &sim->contact);
    return 0;
}

void robot_sim_set_ground(RobotSim *sim, const RobotGround *ground) {
    sim->other = ground;
}

/* The step of docs/task.md section 2, with six rows per foot. mild/ground.h shows the same step for
 * any engine. */
int robot_sim_step(RobotSim *sim, const double *torque, const double *push,
                   const MildTerrain *terrain, MildGround *ground) {
    RobotPhases none = {0}, *phases = sim->phases ? sim->phases : &none;
    double t = sim->phases ? clock_seconds() : 0.0;
    int rigid = sim->variation.rigid, bad = 0;

    smooth_dynamics(sim, torque, push);
    feet_pose(sim);
    sim->data->ncon = 0;
    if (rigid) {
        smooth_acceleration(sim);
        legs_push(sim, 0);
        t = split(sim, &phases->smooth, t);
        rigid_collide(sim, terrain);
        t = split(sim, &phases->ground, t);
        constrain(sim, limits_make(sim));
        rigid_contact_result(sim);
    } else {
        const int rows = limits_make(sim), held = limits_hold(sim);
        smooth_acceleration(sim);
        legs_push(sim, held);
        t = split(sim, &phases->smooth, t);
        choose_rows(sim, terrain);
        project_feet(sim);
        t = split(sim, &phases->map, t);
        bad = stand(sim, terrain, ground);
        t = split(sim, &phases->ground, t);
        accelerate(sim, held);
        constrain(sim, rows);
    }
    bad = bad || integrate(sim);
    if (!bad) {
        update_pose(sim, terrain);
        report_forces(sim);
    }
    split(sim, &phases->finish, t);
    phases->steps += sim->phases != NULL;
    return bad;
}

void robot_sim_time_phases(RobotSim *sim, RobotPhases *phases) {
    sim->phases = phases;
}

const double *robot_sim_qpos(const RobotSim *sim) {
    return sim->qpos;
}

const double *robot_sim_qvel(const RobotSim *sim) {
    return sim->qvel;
}

const double *robot_sim_base_rotation(const RobotSim *sim) {
    return sim->data->xmat + 9 * sim->robot->base_body;
}

const double *robot_sim_mass_center(const RobotSim *sim) {
    return sim->data->subtree_com + 3 * sim->robot->base_body;
}

const RobotFoot *robot_sim_foot(const RobotSim *sim, int foot) {
    return &sim->feet[foot];
}

/* Lowest point of a shell above z = 0, and the point on the ground under its centre [m]. */
static double shell_lowest(const RobotSim *sim, const RobotShell *shell, double under[2]) {
    const double *p = sim->data->xpos + 3 * shell->body, *turn = sim->data->xmat + 9 * shell->body;
    const double *c = shell->center, *box = shell->rotation;
    double low = p[2] - shell->radius;
    under[0] = p[0];
    under[1] = p[1];
    for (int k = 0; k < 3; k++) {
        double up = turn[6] * box[k] + turn[7] * box[3 + k] + turn[8] * box[6 + k];
        low += turn[6 + k] * c[k] - fabs(up) * shell->half[k];
        under[0] += turn[k] * c[k];
        under[1] += turn[3 + k] * c[k];
    }
    return low;
}

int robot_sim_shell_may_touch(const RobotSim *sim, const RobotShell *shell,
                              const MildTerrain *terrain) {
    double under[2], low = shell_lowest(sim, shell, under);
    const double height = mild_terrain_height_at(terrain, under[0], under[1]);
    const double reach = shell->half[0] + shell->half[1] + shell->half[2] + shell->radius;
    return low < height + (terrain->map ? terrain->map->steepest * reach : 0);
}

/* on_base: bool, of these shells alone. */
static double least_clearance(const RobotSim *sim, const MildTerrain *terrain, int on_base) {
    double least = 1e9;
    for (int s = 0; s < sim->robot->shells; s++) {
        const RobotShell *shell = &sim->robot->shell[s];
        double under[2], low = shell_lowest(sim, shell, under);
        if (shell->on_base || !on_base) {
            least = fmin(least, low - mild_terrain_height_at(terrain, under[0], under[1]));
        }
    }
    return least;
}

double robot_sim_body_clearance(const RobotSim *sim, const MildTerrain *terrain) {
    return least_clearance(sim, terrain, 0);
}

double robot_sim_base_clearance(const RobotSim *sim, const MildTerrain *terrain) {
    return least_clearance(sim, terrain, 1);
}

/* [m] Component of b - a along the base's lateral axis (to the left), projected onto the horizontal
 * plane. Negative when the legs are crossed. */
static double lateral_distance(const RobotSim *sim, const double *a, const double *b) {
    const double *turn = robot_sim_base_rotation(sim);
    double x = turn[0], y = turn[3],
           length = sqrt(x * x + y * y); /* heading: the base's x axis, level */
    if (length < 1e-9) {
        return 0.0;
    }
    return (-y * (b[0] - a[0]) + x * (b[1] - a[1])) / length;
}

double robot_sim_knee_distance(const RobotSim *sim) {
    const Robot *robot = sim->robot;
    double least = 1e9;
    for (int p = 0; p < robot->pairs; p++) {
        int left = robot->limb[robot->pair[p][0]].knee_body;
        int right = robot->limb[robot->pair[p][1]].knee_body;
        least = fmin(
            least, lateral_distance(sim, sim->data->xpos + 3 * right, sim->data->xpos + 3 * left));
    }
    return least;
}

double robot_sim_foot_distance(const RobotSim *sim) {
    const Robot *robot = sim->robot;
    double least = 1e9;
    for (int p = 0; p < robot->pairs; p++) {
        const RobotFoot *left = &sim->feet[robot->pair[p][0]];
        const RobotFoot *right = &sim->feet[robot->pair[p][1]];
        least = fmin(least, lateral_distance(sim, right->sole_center, left->sole_center));
    }
    return least;
}

double robot_sim_shell_load(const RobotSim *sim) {
    double sum = 0;
    for (int i = sim->robot->def.feet; i < sim->rows; i++) {
        sum += sim->contact.foot[sim->row[i]].force[2];
    }
    return sum;
}

const MildScratch *robot_sim_scratch(const RobotSim *sim) {
    return sim->scratch;
}

void robot_sim_change_ground(RobotSim *sim, const MildTerrain *from, const MildTerrain *to,
                             MildGround *ground) {
    mild_ground_change(ground, from, to, sim->scratch);
}

const MildContactResult *robot_sim_contact(const RobotSim *sim) {
    return &sim->contact;
}

const MildContactInput *robot_sim_contact_input(const RobotSim *sim) {
    return &sim->input;
}

mjModel *robot_sim_model(RobotSim *sim) {
    return sim->model;
}

mjData *robot_sim_data(RobotSim *sim) {
    return sim->data;
}
