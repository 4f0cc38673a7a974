/* The engine's own contact under the feet's corners and under shells that stand: collision with
 * uneven ground, and results in the same terms as those of the soft ground. */
#include <math.h>
#include <string.h>

#include "robot/sim.h"

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* ---- spheres ---- */

/* Contact frame. Rows: the unit normal, then the tangents that the engine would choose. */
static void tangent_frame(const double slope[2], double frame[9]) {
    double scale = 1.0 / sqrt(1.0 + slope[0] * slope[0] + slope[1] * slope[1]);
    const double normal[3] = {-slope[0] * scale, -slope[1] * scale, scale};
    int axis = fabs(normal[1]) < 0.5 ? 1 : 2;
    for (int k = 0; k < 3; k++) {
        frame[k] = normal[k];
        frame[3 + k] = (k == axis) - normal[axis] * normal[k];
    }
    mju_normalize3(frame + 3);
    cross(frame, frame + 3, frame + 6);
}

/* Plane-sphere contact as the engine computes it, with the tangent plane under the centre of the
 * sphere. It is exact on a slope. Elsewhere the error is the curvature of the ground times
 * radius^2/2. */
static int collide_sphere(RobotSim *sim, const MildTerrain *terrain, int pair, int geom,
                          const double center[3], double radius) {
    const mjModel *m = sim->model;
    int floor = sim->robot->floor_geom;
    double slope[2];
    mjContact contact = {.includemargin = m->pair_margin[pair] - m->pair_gap[pair],
                         .dim = m->pair_dim[pair],
                         .geom1 = floor,
                         .geom2 = geom,
                         .geom = {floor, geom},
                         .flex = {-1, -1},
                         .elem = {-1, -1},
                         .vert = {-1, -1},
                         .efc_address = -1};
    mild_terrain_slope_at(terrain, center[0], center[1], slope);
    tangent_frame(slope, contact.frame);
    contact.dist =
        (center[2] - mild_terrain_height_at(terrain, center[0], center[1])) * contact.frame[2] -
        radius;
    if (!(contact.dist < m->pair_margin[pair])) {
        return 0;
    }
    for (int k = 0; k < 3; k++) {
        contact.pos[k] = center[k] - (0.5 * contact.dist + radius) * contact.frame[k];
    }
    contact.exclude = contact.dist >= contact.includemargin;
    memcpy(contact.friction, m->pair_friction + 5 * pair, sizeof contact.friction);
    memcpy(contact.solref, m->pair_solref + mjNREF * pair, sizeof contact.solref);
    memcpy(contact.solreffriction, m->pair_solreffriction + mjNREF * pair,
           sizeof contact.solreffriction);
    memcpy(contact.solimp, m->pair_solimp + mjNIMP * pair, sizeof contact.solimp);
    mj_addContact(m, sim->data, &contact);
    return 1;
}

/* ---- feet and shells ---- */

static void collide_corner(RobotSim *sim, const MildTerrain *terrain, int pair) {
    const mjModel *m = sim->model;
    int first = m->pair_geom1[pair] != sim->robot->floor_geom;
    int corner = first ? m->pair_geom1[pair] : m->pair_geom2[pair];
    collide_sphere(sim, terrain, pair, corner, sim->data->geom_xpos + 3 * corner,
                   m->geom_size[3 * corner]);
}

/* The points of a shell, of which `most` at most may touch, with the numbers of a pair. Returns how
 * many touch. */
static int collide_shell(RobotSim *sim, const MildTerrain *terrain, const RobotShell *shell,
                         int pair, int most) {
    const double *p = sim->data->xpos + 3 * shell->body, *turn = sim->data->xmat + 9 * shell->body;
    int points = 0;
    for (int c = 0; c < ROBOT_SHELL_CORNERS && points < most; c++) {
        double local[3], center[3];
        if (robot_shell_corner(shell, c, local)) {
            mju_mulMatVec3(center, turn, local);
            mju_addTo3(center, p);
            points += collide_sphere(sim, terrain, pair, shell->floor_geom, center, shell->radius);
        }
    }
    return points;
}

/* Shells that stand, with the contacts of the feet's corners: all pairs have the same numbers.
 * Their bodies get rows, for robot_sim_shell_load. */
static void collide_shells(RobotSim *sim, const MildTerrain *terrain) {
    const Robot *robot = sim->robot;
    int pair = 0, points = 0, touching[ROBOT_BODIES_MAX] = {0};
    while (sim->model->pair_margin[pair] < 0) { /* that of a shell: add_shells */
        pair++;
    }
    for (int s = 0; s < robot->shells; s++) {
        const RobotShell *shell = &robot->shell[s];
        if (shell->limb >= robot->def.feet && robot_sim_shell_may_touch(sim, shell, terrain)) {
            const int now = collide_shell(sim, terrain, shell, pair, ROBOT_FLOOR_POINTS - points);
            points += now;
            touching[shell->limb] |= now > 0;
        }
    }
    for (int b = robot->def.feet; b < sim->input.feet; b++) {
        if (touching[b]) {
            sim->row[sim->rows++] = b;
        }
    }
}

void rigid_collide(RobotSim *sim, const MildTerrain *terrain) {
    if (!terrain->map || mild_map_is_level(terrain->map)) {
        sim->data->geom_xpos[3 * sim->robot->floor_geom + 2] = terrain->height;
        mj_collision(sim->model, sim->data);
    } else {
        sim->data->ncon = 0;
        for (int pair = 0; pair < sim->model->npair; pair++) {
            collide_corner(sim, terrain, pair);
        }
    }
    sim->shell_contact = sim->data->ncon;
    sim->rows = sim->robot->def.feet;
    if (sim->input.feet > sim->rows && sim->variation.shells_stand) {
        collide_shells(sim, terrain);
    }
}

/* ---- results ---- */

/* Number of the foot or body with shells that contact c is of. A foot's body may have shells, whose
 * contacts follow those of all feet. */
static int limb_of(const RobotSim *sim, int c) {
    const mjContact *contact = sim->data->contact + c;
    int floor_first = contact->geom[0] == sim->robot->floor_geom;
    int body = sim->model->geom_bodyid[contact->geom[floor_first]];
    int limb = c < sim->shell_contact ? 0 : sim->robot->def.feet;
    while (sim->robot->limb[limb].body != body) {
        limb++;
    }
    return limb;
}

/* Adds contact c to its foot, and the vertical part of its normal force to the load of that foot;
 * or its force alone to its body with shells. The first axis of the contact frame points from geom
 * 0 to geom 1. */
static void add_contact(RobotSim *sim, int c, double load[ROBOT_FEET_MAX]) {
    const mjData *d = sim->data;
    const mjContact *contact = d->contact + c;
    int floor_first = contact->geom[0] == sim->robot->floor_geom;
    int limb = limb_of(sim, c);
    MildFootResult *result = &sim->contact.foot[limb];
    double local[6], force[3], torque[3], arm[3];
    mj_contactForce(sim->model, d, c, local);
    if (local[0] <= 0.0) {
        return;
    }
    double normal = fabs(contact->frame[2]) * local[0];
    for (int k = 0; k < 3; k++) {
        double sum = 0.0;
        for (int r = 0; r < 3; r++) {
            sum += contact->frame[3 * r + k] * local[r];
        }
        force[k] = floor_first ? sum : -sum;
    }
    if (limb >= sim->robot->def.feet) {
        mju_addTo3(result->force, force);
        return;
    }
    mju_sub3(arm, contact->pos, sim->input.position[limb]);
    cross(arm, force, torque);
    for (int k = 0; k < 3; k++) {
        result->force[k] += force[k];
        result->torque[k] += torque[k];
        result->pressure_center[k] += contact->pos[k] * normal;
    }
    load[limb] += normal;
    result->depth_max = fmax(result->depth_max, -contact->dist);
    result->depth_mean += -contact->dist;
    result->contacts++;
}

/* Central axis F x tau / |F|^2 and the point of zero moment on the sole plane (docs/model.md
 * section 9). */
static void finish_foot(RobotSim *sim, int foot, double load) {
    MildFootResult *result = &sim->contact.foot[foot];
    const double *force = result->force, *torque = result->torque,
                 *turn = sim->input.rotation[foot];
    double square = force[0] * force[0] + force[1] * force[1] + force[2] * force[2];
    if (result->contacts == 0 || square <= 0.0) {
        return;
    }
    result->depth_mean /= result->contacts;
    cross(force, torque, result->zmp_axis);
    for (int k = 0; k < 3; k++) {
        result->zmp_axis[k] /= square;
        result->pressure_center[k] /= load;
    }
    if (force[2] <= 0.0) {
        return;
    }
    const double *center = sim->robot->limb[foot].sole_center;
    double sole = turn[6] * center[0] + turn[7] * center[1] + turn[8] * center[2];
    result->zmp_sole[0] = (sole * force[0] - torque[1]) / force[2];
    result->zmp_sole[1] = (torque[0] + sole * force[1]) / force[2];
}

void rigid_contact_result(RobotSim *sim) {
    double load[ROBOT_FEET_MAX] = {0};
    memset(&sim->contact, 0, sizeof sim->contact);
    for (int c = 0; c < sim->data->ncon; c++) {
        add_contact(sim, c, load);
    }
    for (int f = 0; f < sim->robot->def.feet; f++) {
        finish_foot(sim, f, load[f]);
        foot_map_twist(sim, f, sim->data->qvel, sim->data->qacc, sim->contact.velocity + 6 * f);
    }
    sim->contact.iterations = sim->data->solver_niter[0];
    sim->contact.converged = 1;
}
