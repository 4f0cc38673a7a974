/* Domain randomisation: changes the model of one workspace from the nominal robot to a varied
 * one. */
#include <string.h>

#include "robot/sim.h"

/* Sets mass and inertia of one body. The shape of the mass distribution does not change, so the
 * inertia scales with the mass. */
static void scale_body(mjModel *m, const mjModel *nominal, int body, double mass) {
    double scale = mass / nominal->body_mass[body];
    m->body_mass[body] = mass;
    for (int k = 0; k < 3; k++) {
        m->body_inertia[3 * body + k] = scale * nominal->body_inertia[3 * body + k];
    }
}

static void sum_subtrees(mjModel *m) {
    memcpy(m->body_subtreemass, m->body_mass, sizeof(double) * (size_t)m->nbody);
    for (int b = (int)m->nbody - 1; b > 0; b--) {
        m->body_subtreemass[m->body_parentid[b]] += m->body_subtreemass[b];
    }
}

/* The engine's reference constants (body_invweight0, dof_M0, stat) keep their nominal values. They
 * only affect how joint limits and rigid contacts are regularised. */
void variation_apply(RobotSim *sim, const RobotVariation *variation) {
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): a difference costs time only
    if (memcmp(variation, &sim->variation, sizeof *variation) == 0) {
        return;
    }
    mjModel *m = sim->model;
    const mjModel *nominal = sim->robot->model;
    int base = sim->robot->base_body;
    sim->variation = *variation;
    scale_body(m, nominal, base,
               nominal->body_mass[base] * variation->link_mass_scale[0] + variation->base_mass_add);
    if (m->body_sameframe[base] == mjSAMEFRAME_BODY) {
        m->body_sameframe[base] = mjSAMEFRAME_BODYROT; /* else the engine would not look at ipos */
    }
    for (int k = 0; k < 3; k++) {
        m->body_ipos[3 * base + k] = nominal->body_ipos[3 * base + k] + variation->com_offset[k];
    }
    for (int i = 0; i < sim->robot->def.joints; i++) {
        int dof = sim->robot->dof[i], body = m->dof_bodyid[dof];
        scale_body(m, nominal, body, nominal->body_mass[body] * variation->link_mass_scale[1 + i]);
        m->dof_armature[dof] = variation->armature_scale * nominal->dof_armature[dof];
    }
    sum_subtrees(m);
    for (int p = 0; p < m->npair; p++) {
        m->pair_friction[5 * p] = variation->rigid_friction;
        m->pair_friction[5 * p + 1] = variation->rigid_friction;
        const int own = variation->rigid_time > 0;
        double *solref = m->pair_solref + mjNREF * p;
        solref[0] = own ? variation->rigid_time : nominal->pair_solref[mjNREF * p];
        solref[1] = own ? 1 : nominal->pair_solref[mjNREF * p + 1];
    }
}
