/* What the engine's own contact did to the feet, in the terms of the soft ground. */
#include <math.h>
#include <string.h>

#include "robot/sim.h"

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Adds contact c to the foot it belongs to. The contact frame's first axis points from geom 0 to geom 1. */
static void add_contact(RobotSim *sim, int c) {
    const mjData *d = sim->data;
    const mjContact *contact = d->contact + c;
    int floor_first = contact->geom[0] == sim->robot->floor_geom;
    int body = sim->model->geom_bodyid[contact->geom[floor_first]];
    int foot = body == sim->robot->foot_body[ROBOT_FOOT_RIGHT];
    MildFootResult *result = &sim->contact.foot[foot];
    double local[6], force[3], torque[3], arm[3];
    mj_contactForce(sim->model, d, c, local);
    if (local[0] <= 0.0) {
        return;
    }
    for (int k = 0; k < 3; k++) {
        double sum = 0.0;
        for (int r = 0; r < 3; r++) {
            sum += contact->frame[3 * r + k] * local[r];
        }
        force[k] = floor_first ? sum : -sum;
        arm[k] = contact->pos[k] - sim->input.position[foot][k];
    }
    cross(arm, force, torque);
    for (int k = 0; k < 3; k++) {
        result->force[k] += force[k];
        result->torque[k] += torque[k];
        result->pressure_center[k] += contact->pos[k] * force[2]; /* the floor is level: normal = vertical */
    }
    result->depth_max = fmax(result->depth_max, -contact->dist);
    result->depth_mean += -contact->dist;
    result->contacts++;
}

/* Central axis F x tau / |F|^2 and the point of zero moment on the sole plane (docs/model.md section 9). */
static void finish_foot(RobotSim *sim, int foot) {
    MildFootResult *result = &sim->contact.foot[foot];
    const double *force = result->force, *torque = result->torque, *turn = sim->input.rotation[foot];
    double square = force[0] * force[0] + force[1] * force[1] + force[2] * force[2];
    if (result->contacts == 0 || square <= 0.0 || force[2] <= 0.0) {
        return;
    }
    cross(force, torque, result->zmp_axis);
    for (int k = 0; k < 3; k++) {
        result->zmp_axis[k] /= square;
        result->pressure_center[k] /= force[2];
    }
    const double *center = sim->robot->sole_center[foot];
    double sole = turn[6] * center[0] + turn[7] * center[1] + turn[8] * center[2];
    result->zmp_sole[0] = (sole * force[0] - torque[1]) / force[2];
    result->zmp_sole[1] = (torque[0] + sole * force[1]) / force[2];
    result->depth_mean /= result->contacts;
}

void rigid_contact_result(RobotSim *sim) {
    memset(&sim->contact, 0, sizeof sim->contact);
    for (int c = 0; c < sim->data->ncon; c++) {
        add_contact(sim, c);
    }
    for (int f = 0; f < ROBOT_FEET; f++) {
        finish_foot(sim, f);
        foot_map_twist(sim, f, sim->data->qvel, sim->data->qacc, sim->contact.velocity + 6 * f);
    }
    sim->contact.iterations = sim->data->solver_niter[0];
    sim->contact.converged = 1;
}
