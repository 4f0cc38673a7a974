/* A step on soft ground inside MuJoCo's. At the stage where actuator forces are computed all forces
 * but those of the constraints and of the ground are known. The ground needs the twists of the feet
 * after the step as a function of its wrench W:
 *
 *     V = V_free + h A W,    A = J N^-1 J^T    (N: metric.h)
 *
 * Constraints (joint limits, friction losses, contacts of other bodies) respond to the ground's
 * force, and the ground to theirs. Those of rows.h are solved with the ground, and MuJoCo's solver
 * then starts at the solution. What is left, cones of friction of other contacts, is solved with
 * the ground in turn until the twists agree, with an A that holds the constraints' response while
 * the same ones stay active. Two sets of active constraints may follow each other for ever: A of
 * the one makes the other active. The A without constraints ends that. No set of them responds by
 * more, so the ground never counts with too little. */
#include "plugin/soft.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ground/law/width.h"
#include "ground/step/scratch.h"
#include "plugin/plugin.h"

#define JOINT_ROUNDS 30  /* solves of the ground with the constraints in its response */
#define JOINT_TRIES 12   /* of them in the same zones */
#define NEWTON_TRIES 4   /* the first of them by mix_newton */
#define JOINT_CLOSE 1e-9 /* [m/s, rad/s] difference of the twists at which they end */
#define ROUNDS_MAX 30    /* solves of ground and constraints in one step */
#define ROUNDS_ACTIVE 12 /* of them with the response of the active constraints */
#define STANDS 0.5       /* [-] least cosine of a sole's tilt */
#define AGREEMENT 1e-6   /* [m/s, rad/s] difference of the twists at which they agree */

/* ---- making one ---- */

/* First body of the tree that a body belongs to. */
static int root_of(const mjModel *m, int body) {
    while (m->body_parentid[body] > 0) {
        body = m->body_parentid[body];
    }
    return body;
}

/* [N] Weight of everything that moves with the first foot, divided by the number of feet without
 * bodies, if there are any. The compiler asks before it has summed the masses. */
static double foot_load(const mjModel *m, const Foot *feet, int count) {
    const int root = root_of(m, feet[0].body);
    double mass = 0;
    while (count > 1 && feet[count - 1].shell) {
        count--;
    }
    for (int b = 1; b < m->nbody; b++) {
        mass += root_of(m, b) == root ? m->body_mass[b] : 0;
    }
    return mass * fabs(m->opt.gravity[2]) / count;
}

double soft_load(const Soft *soft, const mjModel *m) {
    return foot_load(m, soft->foot, soft->feet);
}

/* The height of a map that is not level, or has a pattern, is added to `height`. */
static MildStatus lay_map(Soft *soft, MildError *error) {
    MildMapDef *map = &soft->def.map;
    if (map->kind == MILD_MAP_FLAT && map->patches == MILD_PATTERN_NONE) {
        return MILD_OK;
    }
    map->patch_count = soft->terrain.material_count;
    soft->map = mild_map_create(map, error);
    return soft->map ? mild_terrain_set_map(&soft->terrain, soft->map, error) : MILD_ERROR_ARGUMENT;
}

MildStatus soft_meet(const Soft *soft, const MildMaterial *material, MildError *error) {
    MildStatus status = MILD_OK;
    for (int f = 0; f < soft->feet && status == MILD_OK; f++) {
        status = width_check(material, mild_sole_width(soft->soles[f]), error);
    }
    return status;
}

/* Without `ground` the numbers of ground.* are a material of its own. */
static void choose_colours(Soft *soft, const mjModel *m, int instance) {
    const char *text = plugin_text(m, instance, "ground") ? soft->def.ground : "";
    char word[64];
    for (int i = 0; i < soft->terrain.material_count; i++) {
        visual_colour(plugin_word(&text, word, sizeof word) ? word : NULL,
                      &soft->terrain.materials[i], soft->colour[i]);
    }
}

static size_t ground_bytes(const Soft *soft) {
    return mild_ground_bytes_imprints(soft->soles, soft->feet, soft->def.prints);
}

static int alloc_arrays(Soft *soft, const mjModel *m) {
    const size_t nv = (size_t)m->nv, rows = 6 * (size_t)soft->feet;
    soft->jacobian = calloc(rows * nv + 1, sizeof *soft->jacobian);
    soft->response = calloc(rows * nv + 1, sizeof *soft->response);
    soft->forces = calloc(rows * nv + 1, sizeof *soft->forces);
    soft->passive = calloc(nv + 1, sizeof *soft->passive);
    soft->acceleration = calloc(nv + 1, sizeof *soft->acceleration);
    return soft->jacobian && soft->response && soft->forces && soft->passive &&
           soft->acceleration && metric_alloc(&soft->metric, m) && rows_alloc(&soft->rows, m);
}

/* What the size of the state follows from. compiling: bool, as for feet_create. */
static MildStatus make_feet(Soft *soft, const mjModel *m, int instance, int compiling,
                            MildError *error) {
    MildModel first = MILD_MODEL_MILD;
    MildStatus status = plugin_def_read(m, instance, &soft->def, error);
    if (status == MILD_OK) {
        status = plugin_def_model(m, instance, &soft->def, &soft->model, &first, error);
    }
    if (status == MILD_OK) {
        status = feet_create(m, &soft->def, first, compiling, soft->foot, &soft->feet, error);
    }
    for (int f = 0; f < soft->feet && status == MILD_OK; f++) {
        soft->soles[f] = soft->foot[f].sole;
    }
    return status;
}

static MildStatus make(Soft *soft, const mjModel *m, int instance, MildError *error) {
    MildStatus status = make_feet(soft, m, instance, 0, error);
    if (status == MILD_OK &&
        (size_t)m->plugin_statenum[instance] * sizeof(mjtNum) < ground_bytes(soft)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "the model was compiled with other feet, bodies, soles or prints; compile "
                         "it again");
    }
    if (status == MILD_OK) {
        status = plugin_def_materials(m, instance, &soft->def,
                                      soft->foot[0].shell ? NULL : soft->foot[0].raster,
                                      soft_load(soft, m), &soft->terrain, error);
    }
    for (int i = 0; i < soft->terrain.material_count && status == MILD_OK; i++) {
        status = soft_meet(soft, &soft->terrain.materials[i], error);
    }
    if (status == MILD_OK) {
        status = lay_map(soft, error);
    }
    if (status != MILD_OK) {
        return status;
    }
    soft->scratch = mild_scratch_create(soft->soles, soft->feet, error);
    if (!soft->scratch || !alloc_arrays(soft, m)) {
        return mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    }
    choose_colours(soft, m, instance);
    soft->layout = ground_layout(soft->soles, soft->feet, soft->def.prints);
    soft->fresh = 1;
    return MILD_OK;
}

Soft *soft_create(const mjModel *m, int instance, MildError *error) {
    Soft *soft = calloc(1, sizeof *soft);
    if (!soft) {
        mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
        return NULL;
    }
    if (make(soft, m, instance, error) != MILD_OK) {
        soft_destroy(soft);
        return NULL;
    }
    return soft;
}

void soft_destroy(Soft *soft) {
    if (!soft) {
        return;
    }
    mild_scratch_destroy(soft->scratch);
    mild_map_destroy(soft->map);
    feet_destroy(soft->foot, soft->feet);
    metric_free(&soft->metric);
    rows_free(&soft->rows);
    free(soft->jacobian);
    free(soft->response);
    free(soft->forces);
    free(soft->passive);
    free(soft->acceleration);
    free(soft);
}

/* Number of feet, 0 when they cannot be made, and the room for their ground. */
static int measure_feet(const mjModel *m, int instance, size_t *bytes) {
    Soft *soft = calloc(1, sizeof *soft);
    const int good = soft && make_feet(soft, m, instance, 1, NULL) == MILD_OK;
    const int feet = good ? soft->feet : 0;
    *bytes = good ? ground_bytes(soft) : 0;
    soft_destroy(soft);
    return feet;
}

size_t soft_room(const mjModel *m, int instance) {
    size_t bytes;
    measure_feet(m, instance, &bytes);
    return bytes;
}

int soft_feet(const mjModel *m, int instance) {
    size_t bytes;
    return measure_feet(m, instance, &bytes);
}

void soft_reset(Soft *soft, void *state, size_t bytes) {
    memset(state, 0, bytes);
    mild_ground_init_imprints(state, soft->soles, soft->feet, soft->def.prints);
    soft->known = soft->solved = soft->warned = soft->tilted = 0;
}

void soft_copy(Soft *soft, const mjModel *m, const Soft *from) {
    const size_t nv = (size_t)m->nv * sizeof(double);
    const size_t rows = (size_t)from->near_rows;
    memcpy(soft->terrain.materials, from->terrain.materials, sizeof soft->terrain.materials);
    memcpy(soft->colour, from->colour, sizeof soft->colour);
    soft->input = from->input;
    soft->input.inverse_inertia = soft->inverse_inertia;
    memcpy(soft->inverse_inertia, from->inverse_inertia, rows * rows * sizeof(double));
    memcpy(soft->near, from->near, sizeof soft->near);
    soft->near_rows = from->near_rows;
    soft->contact = from->contact;
    soft->known = from->known;
    soft->solved = 0;
    soft->fresh = from->fresh;
    soft->rounds = from->rounds;
    soft->warned = from->warned;
    soft->tilted = from->tilted;
    memcpy(soft->passive, from->passive, nv);
    memcpy(soft->jacobian, from->jacobian, rows * nv);
}

/* ---- the feet ---- */

/* Index in the arrays of all feet of a row of the step. */
static int row_of_all(const Soft *soft, int r) {
    return 6 * soft->near[r / 6] + r % 6;
}

/* twist[r] = J_r . velocity; [near_rows]. */
static void twists(const Soft *soft, int nv, const double *velocity, double *twist) {
    for (int r = 0; r < soft->near_rows; r++) {
        twist[r] = mju_dot(soft->jacobian + (size_t)r * (size_t)nv, velocity, nv);
    }
}

/* Pose and present twist of a body, which also is its twist without a ground while it is in the
 * air. cvel has the velocity of the point that moves with the body through the centre of its tree.
 * */
static void locate_body(Soft *soft, const mjModel *m, const mjData *d, int f) {
    MildContactInput *input = &soft->input;
    const int body = soft->foot[f].body;
    const mjtNum *at = d->xpos + 3 * (ptrdiff_t)body, *cvel = d->cvel + 6 * (ptrdiff_t)body;
    const mjtNum *center = d->subtree_com + 3 * (ptrdiff_t)m->body_rootid[body];
    double *twist = input->velocity[f], *free = input->free_velocity + (ptrdiff_t)6 * f;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        input->position[f][k] = at[k];
        twist[k] = cvel[3 + k] + cvel[i] * (at[j] - center[j]) - cvel[j] * (at[i] - center[i]);
        twist[3 + k] = cvel[k];
    }
    memcpy(input->rotation[f], d->xmat + 9 * (ptrdiff_t)body, sizeof input->rotation[f]);
    memcpy(free, twist, sizeof input->velocity[f]);
}

/* Poses of the feet, and which of them have rows: all but the bodies in the air. */
static void find_near(Soft *soft, const mjModel *m, const mjData *d) {
    MildContactInput *input = &soft->input;
    uint32_t feet = 0;
    int bodies = 0;
    input->feet = soft->feet;
    input->inverse_inertia = soft->inverse_inertia;
    input->dt = m->opt.timestep;
    for (int f = 0; f < soft->feet; f++) {
        if (soft->foot[f].shell) {
            locate_body(soft, m, d, f);
            bodies++;
        } else {
            foot_pose(d, &soft->foot[f], input->position[f], input->rotation[f]);
            feet |= 1u << f;
        }
    }
    input->rows = bodies ? feet | mild_ground_near(&soft->terrain, input, soft->scratch) : 0;
    if (bodies && input->rows == 0) {
        input->rows = 1; /* 0 would be all */
    }
    soft->near_rows = 0;
    for (int f = 0; f < soft->feet; f++) {
        if (input->rows == 0 || (input->rows >> f & 1) != 0) {
            soft->near[soft->near_rows / 6] = f;
            soft->near_rows += 6;
        }
    }
}

/* Jacobian and twist of the feet of the step. A round foot transmits no moment, so that its angular
 * rows are 0. */
static void update_feet(Soft *soft, const mjModel *m, const mjData *d) {
    const int nv = (int)m->nv;
    double twist[FOOT_ROWS];
    for (int k = 0; k < soft->near_rows / 6; k++) {
        const int f = soft->near[k];
        double *rows = soft->jacobian + (size_t)(6 * k) * (size_t)nv;
        mj_jac(m, d, rows, rows + 3 * nv, soft->input.position[f], soft->foot[f].body);
        if (soft->foot[f].round) {
            mju_zero(rows + 3 * nv, 3 * nv);
        }
    }
    twists(soft, nv, d->qvel, twist);
    for (int k = 0; k < soft->near_rows / 6; k++) {
        mju_copy(soft->input.velocity[soft->near[k]], twist + (ptrdiff_t)6 * k, 6);
    }
}

/* x = J^T of the metric's degrees of freedom; [dofs][near_rows] */
static void foot_forces(const Soft *soft, int nv, double *x) {
    const Metric *metric = &soft->metric;
    const int rows = soft->near_rows;
    for (int i = 0; i < metric->dofs; i++) {
        for (int r = 0; r < rows; r++) {
            x[i * rows + r] = soft->jacobian[(size_t)r * (size_t)nv + (size_t)metric->dof[i]];
        }
    }
}

/* matrix = J x; [near_rows][near_rows] */
static void foot_motions(const Soft *soft, int nv, const double *x, double *matrix) {
    const Metric *metric = &soft->metric;
    const int rows = soft->near_rows;
    for (int r = 0; r < rows; r++) {
        double *line = matrix + r * rows;
        mju_zero(line, rows);
        for (int i = 0; i < metric->dofs; i++) {
            const double scale = soft->jacobian[(size_t)r * (size_t)nv + (size_t)metric->dof[i]];
            mju_addToScl(line, x + i * rows, scale, rows);
        }
    }
}

/* A = J x, with x = factor^-1 J^T in soft->response. */
static void inverse_inertia(Soft *soft, const double *factor, int nv) {
    const int rows = soft->near_rows;
    double *a = soft->input.inverse_inertia;
    foot_forces(soft, nv, soft->response);
    metric_solve_all(&soft->metric, factor, rows, soft->response);
    foot_motions(soft, nv, soft->response, a);
    for (int r = 0; r < rows; r++) {
        for (int c = 0; c < r; c++) {
            a[c * rows + r] = a[r * rows + c];
        }
    }
}

/* ---- the step ---- */

/* qfrc_passive = what MuJoCo computed + J^T W, and all that follows from it up to qacc and
 * qfrc_constraint. Without `act` nothing follows. */
static void apply(const Soft *soft, const mjModel *m, mjData *d, const double *wrench, int act) {
    const int nv = (int)m->nv;
    mju_copy(d->qfrc_passive, soft->passive, nv);
    for (int r = 0; r < soft->near_rows; r++) {
        mju_addToScl(d->qfrc_passive, soft->jacobian + (size_t)r * (size_t)nv, wrench[r], nv);
    }
    if (act) {
        mj_fwdAcceleration(m, d);
        mj_fwdConstraint(m, d);
    }
}

/* twist += h J a. a: [dofs] */
static void add_rates(const Soft *soft, int nv, const double *a, double *twist) {
    const Metric *metric = &soft->metric;
    for (int r = 0; r < soft->near_rows; r++) {
        const double *row = soft->jacobian + (size_t)r * (size_t)nv;
        for (int i = 0; i < metric->dofs; i++) {
            twist[r] += soft->input.dt * row[metric->dof[i]] * a[i];
        }
    }
}

/* Twists of the feet after the step that MuJoCo would do now. */
static void outcome(Soft *soft, const mjModel *m, const mjData *d, double *twist) {
    const Metric *metric = &soft->metric;
    const int nv = (int)m->nv, direct = metric_is_step(m, d);
    double *a = soft->acceleration;
    for (int i = 0; i < metric->dofs; i++) {
        const int dof = metric->dof[i];
        a[i] = direct ? d->qacc[dof] : d->qfrc_smooth[dof] + d->qfrc_constraint[dof];
    }
    if (!direct) {
        metric_integrate(metric, a);
    }
    twists(soft, nv, d->qvel, twist);
    add_rates(soft, nv, a, twist);
}

/* Solves the ground with V_free and reads its wrench; [near_rows]. */
static void solve_ground(Soft *soft, const MildGround *ground, double *wrench) {
    for (int k = 0; k < soft->near_rows / 6; k++) {
        mju_copy(soft->input.free_velocity + (ptrdiff_t)6 * soft->near[k],
                 soft->free + (ptrdiff_t)6 * k, 6);
    }
    mild_ground_solve(ground, &soft->terrain, &soft->input, soft->scratch, &soft->contact);
    for (int k = 0; k < soft->near_rows / 6; k++) {
        const MildFootResult *foot = &soft->contact.foot[soft->near[k]];
        mju_copy3(wrench + (ptrdiff_t)6 * k, foot->force);
        mju_copy3(wrench + (ptrdiff_t)6 * k + 3, foot->torque);
    }
}

/* V_free = V - h A W, from the outcome V of the wrench W. */
static void free_twists(Soft *soft, const double *twist, const double *wrench) {
    const int rows = soft->near_rows;
    for (int r = 0; r < rows; r++) {
        soft->free[r] = twist[r] - soft->input.dt * mju_dot(soft->input.inverse_inertia + r * rows,
                                                            wrench, rows);
    }
}

/* Everything up to qacc and qfrc_constraint: the clamped actuator forces, which are not there yet,
 * and what follows from them. The metric of `discrete` is complete only between MuJoCo's stages, so
 * there they run as a whole, with mjcb_control. */
static void forces_without_ground(const mjModel *m, mjData *d, int constrain) {
    if (metric_is_discrete(m)) {
        mj_forwardSkip(m, d, mjSTAGE_VEL, 1);
        return;
    }
    mj_fwdActuation(m, d);
    mj_fwdAcceleration(m, d);
    if (constrain) {
        mj_fwdConstraint(m, d);
    }
}

/* change = what MuJoCo gives beyond what the ground counts with; [near_rows]. Returns its largest
 * number. */
static double disagreement(const Soft *soft, const double *twist, double *change) {
    double most = 0;
    for (int r = 0; r < soft->near_rows; r++) {
        change[r] = twist[r] - soft->contact.velocity[row_of_all(soft, r)];
        most = fmax(most, fabs(change[r]));
    }
    return most;
}

/* ---- Newton's method where the integrator's response is not symmetric ---- */

/* E = J N^-1 M K^-1 J^T, with the K of the zones. */
static void exact_response(Soft *soft, int nv) {
    const Metric *metric = &soft->metric;
    const int rows = soft->near_rows, n = metric->dofs;
    foot_forces(soft, nv, soft->response);
    metric_solve_all(metric, metric->held, rows, soft->response);
    mju_mulMatMat(soft->forces, metric->mass, soft->response, n, n, rows);
    metric_integrate_all(metric, rows, soft->forces);
    foot_motions(soft, nv, soft->forces, soft->exact);
}

/* The next V_free to try, from what MuJoCo gives beyond what the ground counts with. The ground's
 * solver leaves its derivative in the scratch. */
static void next_free(Soft *soft, int newton, const double *change) {
    const int rows = soft->near_rows;
    for (int r = 0; r < rows && newton; r++) {
        const int f = soft->near[r / 6];
        mju_zero(soft->derivative + r * rows, rows);
        if (soft->scratch->foot[f].active > 0) {
            mju_copy(soft->derivative + r * rows + r / 6 * 6,
                     soft->scratch->hessian[f] + 6 * (r % 6), 6);
        }
    }
    if (!newton || !mix_newton(&soft->mix, soft->input.inverse_inertia, soft->exact,
                               soft->derivative, change, soft->free)) {
        mix_next(&soft->mix, soft->free, change);
    }
}

/* ---- ground and constraints together ---- */

/* push = J^T W of the metric's degrees of freedom. */
static void push_of(const Soft *soft, int nv, const double *wrench, double *push) {
    const Metric *metric = &soft->metric;
    for (int i = 0; i < metric->dofs; i++) {
        push[i] = 0;
        for (int r = 0; r < soft->near_rows; r++) {
            push[i] += soft->jacobian[(size_t)r * (size_t)nv + (size_t)metric->dof[i]] * wrench[r];
        }
    }
}

/* Twists after the step with the acceleration rows->trial: J (v + h N^-1 M a). */
static void joint_outcome(Soft *soft, const mjModel *m, const mjData *d, const Rows *rows,
                          double *twist) {
    const Metric *metric = &soft->metric;
    const int n = metric->dofs, nv = (int)m->nv;
    double *a = soft->acceleration;
    if (metric_is_step(m, d)) {
        mju_copy(a, rows->trial, n);
    } else {
        mju_mulMatVec(a, metric->mass, rows->trial, n, n);
        metric_integrate(metric, a);
    }
    twists(soft, nv, d->qvel, twist);
    add_rates(soft, nv, a, twist);
}

/* A and V_free for the zones of rows->a. */
static void joint_enter(Soft *soft, const mjModel *m, const mjData *d, Rows *rows) {
    double twist[FOOT_ROWS];
    const double none[FOOT_ROWS] = {0};
    rows_enter(rows, &soft->metric, m, d);
    metric_hold(&soft->metric, m, d, rows->stiffness);
    inverse_inertia(soft, soft->metric.stiff, (int)m->nv);
    mju_zero(rows->push, soft->metric.dofs);
    rows_solve(rows, &soft->metric);
    joint_outcome(soft, m, d, rows, twist);
    free_twists(soft, twist, none);
    mix_start(&soft->mix, soft->near_rows);
}

/* Solves the ground with the response of the constraints in their zones, and finds those zones.
 * Leaves the wrench, and the acceleration in rows->trial. They follow from the zones alone, so that
 * a step that is evaluated again ends at the same. */
static void joint_solve(Soft *soft, const mjModel *m, mjData *d, const MildGround *ground,
                        Rows *rows, double *wrench) {
    Metric *metric = &soft->metric;
    double twist[FOOT_ROWS], change[FOOT_ROWS];
    int tries = 0; /* with these zones */
    for (int round = 0; round < JOINT_ROUNDS; round++) {
        if (tries++ == 0) {
            joint_enter(soft, m, d, rows);
        } else {
            const int newton = tries <= NEWTON_TRIES && !metric_is_step(m, d);
            if (newton && tries == 2) {
                exact_response(soft, (int)m->nv);
            }
            next_free(soft, newton, change);
        }
        solve_ground(soft, ground, wrench);
        push_of(soft, (int)m->nv, wrench, rows->push);
        rows_solve(rows, metric);
        joint_outcome(soft, m, d, rows, twist);
        if (disagreement(soft, twist, change) > JOINT_CLOSE && tries < JOINT_TRIES) {
            continue;
        }
        if (rows_stay(rows, metric, m, d)) {
            break;
        }
        rows_move(rows, metric, m, d);
        tries = 0;
    }
}

/* MuJoCo's solver then starts at the solution, here and when it is called for the step. From
 * elsewhere it would end within its own tolerance of it, 1e-5 m/s at times. */
static void solve_jointly(Soft *soft, const mjModel *m, mjData *d, const MildGround *ground,
                          double *wrench) {
    const Metric *metric = &soft->metric;
    joint_solve(soft, m, d, ground, &soft->rows, wrench);
    for (int i = 0; i < metric->dofs; i++) {
        d->qacc_warmstart[metric->dof[i]] = soft->rows.trial[i];
    }
    apply(soft, m, d, wrench, 1);
}

/* ---- in turn ---- */

/* A and V_free for the constraints that are active now, and after ROUNDS_ACTIVE without any. While
 * A stays the same, V_free moves by the disagreement. */
static void respond(Soft *soft, const mjModel *m, const mjData *d, const double *twist,
                    const double *wrench, const double *change) {
    Metric *metric = &soft->metric;
    const int active = soft->rounds < ROUNDS_ACTIVE;
    if (active ? metric_stiffen(metric, m, d) : soft->rounds == ROUNDS_ACTIVE) {
        inverse_inertia(soft, active ? metric->stiff : metric->factor, (int)m->nv);
        free_twists(soft, twist, wrench);
        mix_start(&soft->mix, soft->near_rows);
    } else {
        mix_next(&soft->mix, soft->free, change);
    }
}

/* Warns of a step in which ground and constraints do not agree, of the first one since a reset. */
static void warn_of_disagreement(Soft *soft, const mjModel *m, const mjData *d) {
    double twist[FOOT_ROWS], change[FOOT_ROWS];
    outcome(soft, m, d, twist);
    const double most = disagreement(soft, twist, change);
    if (most < AGREEMENT || soft->warned) {
        return;
    }
    mju_warning(PLUGIN_NAME
                ": ground and constraints disagree by %.1e m/s at %g s, after %d rounds; <option "
                "cone=\"pyramidal\"/>, more iterations of the solver or a shorter time step may "
                "help; said once until a reset",
                most, d->time, ROUNDS_MAX);
    soft->warned = 1;
}

/* Warns of a loaded foot that has turned so far that its sole is no longer what touches. */
static void warn_of_tilt(Soft *soft, const mjModel *m, const mjData *d) {
    for (int f = 0; f < soft->feet && !soft->tilted; f++) {
        const double up = fabs(soft->input.rotation[f][8]);
        if (!soft->foot[f].shell && soft->contact.foot[f].contacts > 0 && up < STANDS) {
            mju_warning(PLUGIN_NAME
                        ": foot '%s' stands on the ground with its sole tilted by %.0f "
                        "degrees at %g s; beyond 60 what touches is no longer the sole; "
                        "said once until a reset",
                        foot_name(m, &soft->foot[f]), acos(up) * 180 / mjPI, d->time);
            soft->tilted = 1;
        }
    }
}

/* Ground and constraints in turn. Where the response is linear and known the first solve is
 * final. */
static void solve(Soft *soft, const mjModel *m, mjData *d, const MildGround *ground) {
    const int simple = rows_are_simple(d);
    double wrench[FOOT_ROWS] = {0}, twist[FOOT_ROWS], change[FOOT_ROWS];
    forces_without_ground(m, d, !simple);
    metric_build(&soft->metric, m, d);
    const int exact = d->nefc == 0 && !soft->metric.skew;
    const int jointly = simple && rows_start(&soft->rows, &soft->metric, m, d);
    if (simple && !jointly) { /* out of memory */
        mj_fwdConstraint(m, d);
    }
    if (jointly) {
        solve_jointly(soft, m, d, ground, wrench);
    }
    for (soft->rounds = jointly; soft->rounds < ROUNDS_MAX; soft->rounds++) {
        outcome(soft, m, d, twist);
        if (soft->rounds > 0 && disagreement(soft, twist, change) < AGREEMENT) {
            break;
        }
        respond(soft, m, d, twist, wrench, change);
        solve_ground(soft, ground, wrench);
        apply(soft, m, d, wrench, !exact);
        if (exact) {
            break;
        }
    }
    if (soft->rounds == ROUNDS_MAX) {
        warn_of_disagreement(soft, m, d);
    }
    warn_of_tilt(soft, m, d);
    soft->known = soft->solved = 1;
}

static int finite_state(const Soft *soft) {
    for (int r = 0; r < soft->near_rows; r++) {
        if (!isfinite(soft->contact.velocity[row_of_all(soft, r)])) {
            return 0;
        }
    }
    return 1;
}

/* Bool: this integrator evaluates a step once. Complains once if it does not. */
static int integrator_fits(Soft *soft, const mjModel *m) {
    if (m->opt.integrator != mjINT_RK4) {
        return 1;
    }
    if (!soft->refused) {
        mju_warning(PLUGIN_NAME ": integrator RK4 is not supported, the ground is off; set "
                                "<option integrator=\"implicitfast\"/>, discrete or Euler");
        soft->refused = 1;
    }
    return 0;
}

int soft_without_actuation(const mjModel *m) {
    return m->nu == 0 || (m->opt.disableflags & mjDSBL_ACTUATION);
}

int soft_without_passive(const mjModel *m) {
    const int both = mjDSBL_SPRING | mjDSBL_DAMPER;
    return (m->opt.disableflags & both) == both;
}

/* Bool: the ground acts now. */
static int begin(Soft *soft, const mjModel *m, const mjData *d) {
    if (!integrator_fits(soft, m)) {
        soft->known = 0;
        return 0;
    }
    find_near(soft, m, d);
    return 1;
}

int soft_actuation(Soft *soft, const mjModel *m, const mjData *d) {
    return !soft->inside && begin(soft, m, d);
}

/* Without actuators MuJoCo has no stage of actuation. The ground then acts here, before bias forces
 * and constraints of this velocity are known; MuJoCo is made to compute them first. */
int soft_passive(Soft *soft, const mjModel *m, mjData *d) {
    if (soft->inside) {
        return 0;
    }
    soft->fresh = 1;
    if (!soft_without_actuation(m)) {
        return 0;
    }
    soft->inside = 1;
    mj_fwdVelocity(m, d);
    soft->inside = 0;
    return begin(soft, m, d);
}

void soft_step(Soft *soft, const mjModel *m, mjData *d, const MildGround *ground) {
    if (soft_without_passive(m)) {
        mju_zero(soft->passive, (int)m->nv);
    } else if (soft->fresh) {
        mju_copy(soft->passive, d->qfrc_passive, (int)m->nv);
    }
    soft->fresh = 0;
    mju_copy(d->qfrc_passive, soft->passive, (int)m->nv); /* if the stage is evaluated again */
    soft->inside = 1;
    update_feet(soft, m, d);
    memset(soft->metric.tree, 0, (size_t)m->ntree * sizeof *soft->metric.tree);
    for (int k = 0; k < soft->near_rows / 6; k++) {
        soft->metric.tree[m->body_treeid[soft->foot[soft->near[k]].body]] = 1;
    }
    solve(soft, m, d, ground);
    soft->inside = 0;
}

void soft_advance(Soft *soft, const mjModel *m, const mjData *d, MildGround *ground) {
    double twist[FOOT_ROWS];
    if (!soft->known) {
        return;
    }
    if (!soft->solved) {
        mild_ground_solve(ground, &soft->terrain, &soft->input, soft->scratch, &soft->contact);
    }
    twists(soft, (int)m->nv, d->qvel, twist);
    for (int r = 0; r < soft->near_rows; r++) {
        soft->contact.velocity[row_of_all(soft, r)] = twist[r];
    }
    if (finite_state(soft)) {
        mild_ground_advance(ground, &soft->terrain, &soft->input, soft->scratch, &soft->contact);
    }
    soft->known = soft->solved = 0;
}
