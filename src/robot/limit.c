/* Joint limits that push while the ground does. MuJoCo's row of a limit that is exceeded on the
 * side s (1: lower, -1: upper) pushes joint i with the force s max(0, r - s a_i)/R, where a is the
 * acceleration after the step and r the row's reference. While it pushes that is linear in a, so
 *
 *     M a = f + J^T W + sum of s e_i (r - s a_i)/R   <=>   N a = f' + J^T W,
 *     N = M + sum of e_i e_i^T/R,   f' = f + sum of s r e_i/R,
 *
 * and the ground that is solved with N and f' in the place of M and f agrees with the limits that
 * are solved after it. Which limits push is not known before. They are taken to be those that push
 * at the last step's acceleration, which is exact while a limit bears a load. If that proves wrong,
 * the ground's forces of this step are those for feet held otherwise. */
#include <string.h>

#include "robot/sim.h"

static int any_joint_beyond_limit(const RobotSim *sim) {
    const double *q = sim->qpos + 7;
    int beyond = 0;
    for (int i = 0; i < sim->robot->def.joints; i++) {
        beyond |= q[i] <= sim->robot->low[i] || q[i] >= sim->robot->high[i];
    }
    return beyond;
}

/* M_ii in the sparse matrix. */
static double *inertia_of(const mjModel *m, mjData *d, int dof) {
    return d->M + m->M_rowadr[dof] + m->M_rownnz[dof] - 1;
}

int limits_make(RobotSim *sim) {
    sim->data->nefc = 0;
    if (sim->data->ncon == 0 && !any_joint_beyond_limit(sim)) {
        return 0;
    }
    mj_makeConstraint(sim->model, sim->data);
    mj_referenceConstraint(sim->model, sim->data);
    return 1;
}

int limits_hold(RobotSim *sim) {
    const mjModel *m = sim->model;
    mjData *d = sim->data;
    int held = 0;
    for (int row = 0; row < d->nefc; row++) {
        const int joint = d->efc_id[row], dof = m->jnt_dofadr[joint];
        const double range = m->jnt_range[2 * joint] + m->jnt_range[2 * joint + 1];
        const double side = 2 * d->qpos[m->jnt_qposadr[joint]] < range ? 1 : -1;
        const double weight = d->efc_D[row], reference = d->efc_aref[row];
        if (side * d->qacc_warmstart[dof] < reference) {
            sim->without[held++] = (Unheld){dof, *inertia_of(m, d, dof), d->qfrc_smooth[dof]};
            *inertia_of(m, d, dof) += weight;
            d->qfrc_smooth[dof] += side * weight * reference;
        }
    }
    return held;
}

void limits_release(RobotSim *sim, int held) {
    for (int k = 0; k < held; k++) {
        const Unheld *without = &sim->without[k];
        *inertia_of(sim->model, sim->data, without->dof) = without->inertia;
        sim->data->qfrc_smooth[without->dof] = without->force;
    }
}
