/* The legs of a robot as capsules of its MJCF, and what they do to each other in MuJoCo's step. */
#include <math.h>
#include <string.h>

#include "robot/legs.h"
#include "robot/sim.h"

/* ---- from the file ---- */

/* The capsule of a geom: of a box the one along its longest side that is as wide as its second
 * longest and ends where the box does. */
static int take_shape(const mjModel *m, int geom, RobotCapsule *capsule) {
    const double *size = m->geom_size + 3 * geom;
    double turn[9], half = 0;
    int axis = 2;
    capsule->radius = size[0];
    if (m->geom_type[geom] == mjGEOM_CAPSULE) {
        half = size[1];
    } else if (m->geom_type[geom] == mjGEOM_BOX) {
        for (int k = 0; k < 3; k++) {
            axis = size[k] > size[axis] ? k : axis;
        }
        capsule->radius = fmax(size[(axis + 1) % 3], size[(axis + 2) % 3]);
        half = size[axis] - capsule->radius;
    } else if (m->geom_type[geom] != mjGEOM_SPHERE) {
        return 0;
    }
    mju_quat2Mat(turn, m->geom_quat + 4 * geom);
    memcpy(capsule->center, m->geom_pos + 3 * geom, sizeof capsule->center);
    for (int k = 0; k < 3; k++) {
        capsule->half[k] = half * turn[3 * k + axis];
    }
    return 1;
}

/* The only foot that a body's last hinge moves, or -1. */
static int foot_of(const Robot *robot, int body) {
    const mjModel *m = robot->model;
    const int dof = m->body_dofadr[m->body_weldid[body]];
    int foot = -1, feet = 0;
    for (int f = 0; f < robot->def.feet; f++) {
        for (int k = 6; k < robot->limb[f].dofs; k++) {
            if (robot->limb[f].dof[k] == dof) {
                foot = f;
                feet++;
            }
        }
    }
    return feet == 1 ? foot : -1;
}

static MildStatus read_capsule(Robot *robot, const char *name, RobotCapsule *capsule,
                               MildError *error) {
    const mjModel *m = robot->visual;
    const int geom = robot_find(robot, m, mjOBJ_GEOM, "geom", name, "[robot] legs", error);
    capsule->body = geom < 0 ? -1 : robot_geom_body(robot, geom, error);
    if (capsule->body < 0) {
        return MILD_ERROR_FORMAT;
    }
    capsule->foot = foot_of(robot, capsule->body);
    if (capsule->foot < 0) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: geom '%s' of [robot] legs is not between the base and one foot alone",
                         robot->path, name);
    }
    return take_shape(m, geom, capsule)
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_FORMAT,
                           "%s: geom '%s' of [robot] legs must be a box, a sphere or a capsule",
                           robot->path, name);
}

MildStatus robot_read_legs(Robot *robot, MildError *error) {
    robot->capsules = robot->def.legs;
    for (int c = 0; c < robot->capsules; c++) {
        RobotCapsule *capsule = &robot->capsule[c];
        if (read_capsule(robot, robot->def.leg[c], capsule, error) != MILD_OK) {
            return error->status;
        }
        for (int b = 0; b < c; b++) {
            if (robot->capsule[b].foot == capsule->foot) {
                continue;
            }
            if (robot->leg_pairs == ROBOT_LEG_PAIRS_MAX) {
                return mild_fail(error, MILD_ERROR_RANGE,
                                 "%s: robot.ini: [robot] legs: more than %d pairs of geoms of "
                                 "different legs; name fewer",
                                 robot->path, ROBOT_LEG_PAIRS_MAX);
            }
            robot->leg_pair[robot->leg_pairs][0] = b;
            robot->leg_pair[robot->leg_pairs++][1] = c;
        }
    }
    return MILD_OK;
}

/* ---- in a step ---- */

static LegCapsule capsule_of(const RobotSim *sim, int c) {
    const RobotCapsule *from = &sim->robot->capsule[c];
    const double *turn = sim->data->xmat + 9 * from->body;
    LegCapsule capsule = {.radius = from->radius};
    mju_mulMatVec3(capsule.center, turn, from->center);
    mju_addTo3(capsule.center, sim->data->xpos + 3 * from->body);
    mju_mulMatVec3(capsule.half, turn, from->half);
    return capsule;
}

static void all_capsules(const RobotSim *sim, LegCapsule *capsule) {
    for (int c = 0; c < sim->robot->capsules; c++) {
        capsule[c] = capsule_of(sim, c);
    }
}

static LegGap gap_of(const RobotSim *sim, const LegCapsule *capsule, int pair) {
    const int *of = sim->robot->leg_pair[pair];
    const double *turn = robot_sim_base_rotation(sim);
    const double across[3] = {turn[1], turn[4], turn[7]};
    LegGap gap = {.gap = LEGS_APART};
    legs_gap(&capsule[of[0]], &capsule[of[1]], across, &gap);
    return gap;
}

double robot_sim_leg_distance(const RobotSim *sim) {
    LegCapsule capsule[ROBOT_CAPSULES_MAX];
    double least = LEGS_APART;
    all_capsules(sim, capsule);
    for (int pair = 0; pair < sim->robot->leg_pairs; pair++) {
        least = fmin(least, gap_of(sim, capsule, pair).gap);
    }
    return least;
}

/* row: [nv] rate of the gap per degree of freedom. */
static void gap_row(const RobotSim *sim, int pair, const LegGap *gap, double *row) {
    const int nv = sim->robot->nv;
    double jacobian[2][3 * ROBOT_NV_MAX];
    for (int n = 0; n < 2; n++) {
        const int body = sim->robot->capsule[sim->robot->leg_pair[pair][n]].body;
        mj_jac(sim->model, sim->data, jacobian[n], NULL, gap->point, body);
    }
    for (int i = 0; i < nv; i++) {
        row[i] = 0;
        for (int k = 0; k < 3; k++) {
            row[i] += gap->normal[k] * (jacobian[1][k * nv + i] - jacobian[0][k * nv + i]);
        }
    }
}

static void push_pair(RobotSim *sim, int pair, const LegGap *gap, int held) {
    const int nv = sim->robot->nv;
    mjData *d = sim->data;
    double row[ROBOT_NV_MAX], gain[ROBOT_NV_MAX];
    gap_row(sim, pair, gap, row);
    mj_solveM(sim->model, d, gain, row, 1);
    const double force = legs_force(sim->dt, gap->gap, mju_dot(row, d->qvel, nv),
                                    mju_dot(row, gain, nv) + 1 / sim->robot->total_mass);
    if (force == 0) {
        return;
    }
    mju_addToScl(d->qfrc_smooth, row, force, nv);
    mju_addToScl(d->qacc_smooth, gain, force, nv);
    for (int k = 0; k < held; k++) {
        sim->without[k].force += row[sim->without[k].dof] * force;
    }
}

void legs_push(RobotSim *sim, int held) {
    LegCapsule capsule[ROBOT_CAPSULES_MAX];
    all_capsules(sim, capsule);
    for (int pair = 0; pair < sim->robot->leg_pairs; pair++) {
        const int *of = sim->robot->leg_pair[pair];
        if (legs_near(&capsule[of[0]], &capsule[of[1]])) {
            const LegGap gap = gap_of(sim, capsule, pair);
            if (gap.gap < LEGS_NEAR) {
                push_pair(sim, pair, &gap, held);
            }
        }
    }
}
