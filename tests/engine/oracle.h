/* What MuJoCo says of a step: the reference of the batch engine's tests. */
#ifndef TESTS_ENGINE_ORACLE_H
#define TESTS_ENGINE_ORACLE_H

#include <math.h>
#include <string.h>

#include <mujoco/mujoco.h>

#include "engine_text.h"
#include "robot/legs.h"
#include "robot/sim.h"

enum { ROWS_MAX = 6 * ROBOT_FEET_MAX };

/* Beside the result what its errors are measured in. */
typedef struct {
    double mass[ROBOT_NV_MAX * ROBOT_NV_MAX];    /* N, dense */
    double inverse[ROBOT_NV_MAX * ROBOT_NV_MAX]; /* of it */
    double jacobian[ROWS_MAX][ROBOT_NV_MAX];
    double force[ROBOT_NV_MAX];
    double smooth[ROBOT_NV_MAX];
    double position[ROBOT_FEET_MAX][3];
    double rotation[ROBOT_FEET_MAX][9];
    double velocity[ROWS_MAX];
    double free_velocity[ROWS_MAX];
    double inverse_inertia[ROWS_MAX * ROWS_MAX];
    double wrenched[ROBOT_NV_MAX];
    double acceleration[ROBOT_NV_MAX];
    double wrench[ROBOT_FEET_MAX][6]; /* of rigid ground */
    double qpos[ROBOT_NQ_MAX];
    double qvel[ROBOT_NV_MAX];
    double body_clearance;
    double knee_distance;
    double foot_distance;
    double leg_distance;
    double sole_height[ROBOT_FEET_MAX];
    double sole_center[ROBOT_FEET_MAX][3];
    double sole_velocity[ROBOT_FEET_MAX][3];
    double next_velocity[ROWS_MAX];
    double next_position[ROBOT_FEET_MAX][3];
    int rows; /* joints beyond a limit, or edges of contacts */
    int legs; /* pairs that push */
    int held; /* limits that are taken to push */
    double held_inertia[ROBOT_NV_MAX], held_force[ROBOT_NV_MAX]; /* theirs: N - M and f' - f */
} Oracle;

static inline double oracle_dot(const double *a, const double *b, int count) {
    double sum = 0;
    for (int i = 0; i < count; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* Limits that push at the acceleration of the step before. */
static inline void oracle_hold(RobotSim *sim, const EngineCase *in, Oracle *o) {
    const mjModel *m = sim->model;
    mjData *d = sim->data;
    double before[ROBOT_NV_MAX];
    robot_engine_rates(sim->robot, in->qacc, before);
    memset(o->held_inertia, 0, sizeof o->held_inertia);
    memset(o->held_force, 0, sizeof o->held_force);
    o->held = 0;
    d->ncon = 0;
    mj_makeConstraint(m, d);
    mj_referenceConstraint(m, d);
    for (int row = 0; row < d->nefc && !in->variation.rigid; row++) {
        double dense[ROBOT_NV_MAX] = {0}; /* the row's Jacobian: one number */
        for (int k = 0; k < (mj_isSparse(m) ? d->efc_J_rownnz[row] : m->nv); k++) {
            const int sparse = mj_isSparse(m);
            const int at = sparse ? d->efc_J_rowadr[row] + k : row * (int)m->nv + k;
            dense[sparse ? d->efc_J_colind[at] : k] = d->efc_J[at];
        }
        if (oracle_dot(dense, before, (int)m->nv) - d->efc_aref[row] < 0) {
            for (int i = 0; i < m->nv; i++) {
                o->held_inertia[i] += d->efc_D[row] * dense[i] * dense[i];
                o->held_force[i] += d->efc_D[row] * dense[i] * d->efc_aref[row];
            }
            o->held++;
        }
    }
}

/* [m] World point that the twist of a foot refers to: where a flat foot's body is, or the lowest
 * point of a ball. */
static inline void oracle_reference(const RobotSim *sim, int f, double point[3]) {
    const RobotFootDef *foot = &sim->robot->def.foot[f];
    const RobotLimb *limb = &sim->robot->limb[f];
    mju_copy3(point, sim->data->xpos + 3 * limb->body);
    if (limb->round) {
        double center[3];
        mju_mulMatVec3(center, sim->data->xmat + 9 * limb->body, foot->center);
        mju_addTo3(point, center);
        point[2] -= foot->radius;
    }
}

/* N = M with dt damping on the diagonal and the held limits, N^-1, and J of the feet. */
static inline void oracle_matrices(RobotSim *sim, Oracle *o) {
    const mjModel *m = sim->model;
    mjData *d = sim->data;
    const int nv = (int)m->nv;
    mj_makeM(m, d);
    for (int i = 0; i < nv; i++) {
        d->M[m->M_rowadr[i] + m->M_rownnz[i] - 1] +=
            sim->dt * m->dof_damping[i] + o->held_inertia[i];
    }
    mj_factorM(m, d);
    mju_sym2dense(o->mass, d->M, nv, m->M_rownnz, m->M_rowadr, m->M_colind);
    memset(o->inverse, 0, sizeof o->inverse);
    for (int i = 0; i < nv; i++) {
        o->inverse[i * nv + i] = 1;
    }
    mj_solveM(m, d, o->inverse, o->inverse, nv);
    memset(o->jacobian, 0, sizeof o->jacobian);
    for (int f = 0; f < sim->robot->def.feet; f++) {
        const RobotLimb *limb = &sim->robot->limb[f];
        static const double level[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
        double turn[3 * ROBOT_NV_MAX];
        double move[3 * ROBOT_NV_MAX];
        oracle_reference(sim, f, o->position[f]);
        memcpy(o->rotation[f], limb->round ? level : d->xmat + 9 * limb->body, sizeof level);
        mj_jac(m, d, move, turn, o->position[f], limb->body);
        for (int k = 0; k < 3; k++) {
            memcpy(o->jacobian[6 * f + k], move + k * nv, (size_t)nv * sizeof(double));
            if (!limb->round) {
                memcpy(o->jacobian[6 * f + 3 + k], turn + k * nv, (size_t)nv * sizeof(double));
            }
        }
    }
}

static inline void oracle_forces(RobotSim *sim, const EngineCase *in, Oracle *o) {
    const mjModel *m = sim->model;
    mjData *d = sim->data;
    const int nv = (int)m->nv;
    const int base = sim->robot->base_body;
    mj_comVel(m, d);
    mj_rne(m, d, 0, d->qfrc_bias);
    for (int i = 0; i < nv; i++) {
        o->force[i] = -d->qfrc_bias[i] - m->dof_damping[i] * d->qvel[i];
    }
    for (int j = 0; j < sim->robot->def.joints; j++) {
        o->force[sim->robot->dof[j]] += in->torque[j];
    }
    mj_applyFT(m, d, in->push, in->push + 3, d->xipos + 3 * base, base, o->force);
    for (int i = 0; i < nv; i++) {
        o->force[i] += o->held_force[i];
    }
    mj_solveM(m, d, o->smooth, o->force, 1);
}

static inline LegCapsule oracle_capsule(const RobotSim *sim, int c) {
    const RobotCapsule *from = &sim->robot->capsule[c];
    LegCapsule capsule = {.radius = from->radius};
    mju_mulMatVec3(capsule.half, sim->data->xmat + 9 * from->body, from->half);
    mju_mulMatVec3(capsule.center, sim->data->xmat + 9 * from->body, from->center);
    mju_addTo3(capsule.center, sim->data->xpos + 3 * from->body);
    return capsule;
}

/* Legs that meet, pair by pair: an impulse on the points of both bodies at which they touch. */
static inline void oracle_legs(RobotSim *sim, Oracle *o) {
    const mjModel *m = sim->model;
    mjData *d = sim->data;
    const double *R = d->xmat + 9 * sim->robot->base_body, left[3] = {R[1], R[4], R[7]};
    for (int n = 0; n < sim->robot->leg_pairs; n++) {
        const int *pair = sim->robot->leg_pair[n];
        const LegCapsule a = oracle_capsule(sim, pair[0]), b = oracle_capsule(sim, pair[1]);
        LegGap gap;
        double row[ROBOT_NV_MAX] = {0}, gain[ROBOT_NV_MAX], away[3], none[3] = {0};
        legs_gap(&a, &b, left, &gap);
        if (gap.gap >= 0.01) {
            continue;
        }
        mju_scl3(away, gap.normal, -1);
        mj_applyFT(m, d, gap.normal, none, gap.point, sim->robot->capsule[pair[1]].body, row);
        mj_applyFT(m, d, away, none, gap.point, sim->robot->capsule[pair[0]].body, row);
        mj_solveM(m, d, gain, row, 1);
        const double allowed = gap.gap > 0 ? -gap.gap / sim->dt : -gap.gap / 2 / sim->dt;
        const double lacking = allowed - oracle_dot(row, d->qvel, (int)m->nv);
        if (lacking > 0) {
            const double force = lacking / sim->dt /
                                 (oracle_dot(row, gain, (int)m->nv) + 1 / sim->robot->total_mass);
            mju_addToScl(o->force, row, force, (int)m->nv);
            mju_addToScl(o->smooth, gain, force, (int)m->nv);
            o->legs++;
        }
    }
}

static inline void oracle_feet(RobotSim *sim, Oracle *o) {
    const int nv = (int)sim->model->nv;
    const int rows = 6 * sim->robot->def.feet;
    double rate[ROBOT_NV_MAX];
    for (int i = 0; i < nv; i++) {
        rate[i] = sim->data->qvel[i] + sim->dt * o->smooth[i];
    }
    for (int r = 0; r < rows; r++) {
        double solved[ROBOT_NV_MAX];
        mj_solveM(sim->model, sim->data, solved, o->jacobian[r], 1);
        o->velocity[r] = oracle_dot(o->jacobian[r], sim->data->qvel, nv);
        o->free_velocity[r] = oracle_dot(o->jacobian[r], rate, nv);
        for (int c = 0; c < rows; c++) {
            o->inverse_inertia[r * rows + c] = oracle_dot(o->jacobian[c], solved, nv);
        }
    }
}

/* The map of a case, or level ground. */
static inline MildTerrain oracle_terrain(const EngineCase *in) {
    const MildMaterial any = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&any);
    terrain.height = in->height;
    terrain.map = in->map;
    terrain.map_x = in->map_origin[0];
    terrain.map_y = in->map_origin[1];
    return terrain;
}

/* Contacts with a plane of the height and slope of the case, or with its map. */
static inline void oracle_collide(RobotSim *sim, const EngineCase *in) {
    if (in->map) {
        const MildTerrain terrain = oracle_terrain(in);
        rigid_collide(sim, &terrain);
        return;
    }
    const double length = sqrt(1 + in->slope[0] * in->slope[0] + in->slope[1] * in->slope[1]);
    const double normal[3] = {-in->slope[0] / length, -in->slope[1] / length, 1 / length};
    const int floor = sim->robot->floor_geom;
    double quaternion[4];
    mju_quatZ2Vec(quaternion, normal);
    mju_quat2Mat(sim->data->geom_xmat + 9 * floor, quaternion);
    sim->data->geom_xpos[3 * floor] = sim->data->geom_xpos[3 * floor + 1] = 0;
    sim->data->geom_xpos[3 * floor + 2] = in->height;
    mj_collision(sim->model, sim->data);
}

/* The wrench of contacts on each foot at its reference point. */
static inline void oracle_wrench(RobotSim *sim, Oracle *o) {
    const mjData *d = sim->data;
    memset(o->wrench, 0, sizeof o->wrench);
    for (int c = 0; c < d->ncon; c++) {
        const mjContact *contact = &d->contact[c];
        const int floor_first = contact->geom[0] == sim->robot->floor_geom;
        const int body = sim->model->geom_bodyid[contact->geom[floor_first]];
        int foot = 0;
        while (sim->robot->limb[foot].body != body) {
            foot++;
        }
        double local[6], force[3], arm[3], torque[3];
        mj_contactForce(sim->model, d, c, local);
        mju_mulMatTVec3(force, contact->frame, local);
        mju_sub3(arm, contact->pos, o->position[foot]);
        mju_cross(torque, arm, force);
        for (int k = 0; k < 3; k++) {
            o->wrench[foot][k] += floor_first ? force[k] : -force[k];
            o->wrench[foot][3 + k] += floor_first ? torque[k] : -torque[k];
        }
    }
}

/* Limits and contacts, solved as far as MuJoCo can, then the step. */
static inline void oracle_finish(RobotSim *sim, Oracle *o) {
    mjModel *m = sim->model;
    mjData *d = sim->data;
    const int nv = (int)m->nv;
    mj_mulM(m, d, d->qfrc_smooth, o->wrenched);
    for (int i = 0; i < nv; i++) { /* M and f again */
        d->M[m->M_rowadr[i] + m->M_rownnz[i] - 1] -= o->held_inertia[i];
        d->qfrc_smooth[i] -= o->held_force[i];
    }
    mj_factorM(m, d);
    mj_solveM(m, d, d->qacc_smooth, d->qfrc_smooth, 1);
    memcpy(d->qacc_warmstart, d->qacc_smooth, (size_t)nv * sizeof(double));
    m->opt.tolerance = 1e-15;
    m->opt.ls_tolerance = 1e-12;
    m->opt.iterations = 100;
    mj_makeConstraint(m, d);
    mj_projectConstraint(m, d);
    mj_referenceConstraint(m, d);
    mj_fwdConstraint(m, d);
    o->rows = d->nefc;
    memcpy(o->acceleration, d->qacc, (size_t)nv * sizeof(double));
    oracle_wrench(sim, o);
    for (int i = 0; i < nv; i++) {
        d->qvel[i] += sim->dt * d->qacc[i];
    }
    for (int r = 0; r < 6 * sim->robot->def.feet; r++) {
        o->next_velocity[r] = oracle_dot(o->jacobian[r], d->qvel, nv);
    }
    mj_integratePos(m, d->qpos, d->qvel, sim->dt);
    mj_kinematics(m, d);
    for (int f = 0; f < sim->robot->def.feet; f++) {
        oracle_reference(sim, f, o->next_position[f]);
    }
    memcpy(o->qpos, d->qpos, 7 * sizeof(double));
    memcpy(o->qvel, d->qvel, 6 * sizeof(double));
    for (int j = 0; j < sim->robot->def.joints; j++) {
        o->qpos[7 + j] = d->qpos[sim->robot->dof[j] + 1];
        o->qvel[6 + j] = d->qvel[sim->robot->dof[j]];
    }
}

/* What RobotSim gives a task of the pose. */
static inline void oracle_measure(RobotSim *sim, const EngineCase *in, Oracle *o) {
    const MildTerrain terrain = oracle_terrain(in);
    o->body_clearance = robot_sim_body_clearance(sim, &terrain);
    o->knee_distance = robot_sim_knee_distance(sim);
    o->foot_distance = robot_sim_foot_distance(sim);
    o->leg_distance = robot_sim_leg_distance(sim);
    robot_sim_sole_clearance(sim, &terrain);
    for (int f = 0; f < sim->robot->def.feet; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        o->sole_height[f] = foot->sole_height;
        memcpy(o->sole_center[f], foot->sole_center, sizeof foot->sole_center);
        memcpy(o->sole_velocity[f], foot->sole_center_velocity, sizeof foot->sole_center_velocity);
    }
}

static inline void oracle_step(RobotSim *sim, const EngineCase *in, Oracle *o) {
    const int nv = (int)sim->model->nv;
    RobotState state = {.qpos = {0}};
    memcpy(state.qpos, in->qpos, sizeof state.qpos);
    memcpy(state.qvel, in->qvel, sizeof state.qvel);
    robot_sim_load(sim, &state, &in->variation);
    oracle_measure(sim, in, o);
    oracle_hold(sim, in, o);
    oracle_matrices(sim, o);
    oracle_forces(sim, in, o);
    o->legs = 0;
    oracle_legs(sim, o);
    oracle_feet(sim, o);
    memcpy(o->wrenched, o->smooth, sizeof o->smooth);
    sim->data->ncon = 0;
    if (in->variation.rigid) {
        oracle_collide(sim, in);
    } else {
        double force[ROBOT_NV_MAX];
        memcpy(force, o->force, sizeof force);
        for (int r = 0; r < 6 * sim->robot->def.feet; r++) {
            mju_addToScl(force, o->jacobian[r], in->wrench[r / 6][r % 6], nv);
        }
        mj_solveM(sim->model, sim->data, o->wrenched, force, 1);
    }
    oracle_finish(sim, o);
}

#endif
