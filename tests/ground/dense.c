#include "dense.h"

#include "dense_element.h"

/* The constants of these five. */
#include "ground/law/begin.h"
#include "ground/law/element_law.h"
#include "ground/law/friction.h"
#include "ground/law/impulse.h"
#include "ground/law/plate.h"
#include "ground/sole/sole.h"
#include "ground/step/scratch.h"

#define DENSE_STEPS 200 /* of Newton's method at given bounds */
#define DENSE_ROUNDS 3000
#define DENSE_SMALL 1e-12 /* relative motion at which a method rests */
#define DENSE_JACOBI 60
#define DENSE_SINGULAR 1e-13 /* least eigenvalue by the largest */

/* ---- the element's law ---- */

/* Virgin ground above the bed. */
static double virgin_force(const DenseLaw *law, double u) {
    double force = (law->k_pen - law->kappa) * cone_share(law, u) + law->kappa * u;
    return law->sinkage > 0.0 ? force + power_at(law->sinkage, law->sinkage_power, u) : force;
}

static double virgin_slope(const DenseLaw *law, double u) {
    double slope = (law->k_pen - law->kappa) * cone_flat(law, u) + law->kappa;
    return law->sinkage > 0.0 ? slope + power_rise(law->sinkage, law->sinkage_power, u) : slope;
}

/* Its mean over a way down, the power's apart: Simpson's rule, exact on a cubic. */
static double virgin_mean(const DenseLaw *law, double u, double way) {
    DenseLaw cone = *law;
    cone.sinkage = 0.0;
    double simpson = (virgin_force(&cone, u) + 4.0 * virgin_force(&cone, u + 0.5 * way) +
                      virgin_force(&cone, u + way)) /
                     6.0;
    return simpson + power_mean(law->sinkage, law->sinkage_power, u, way);
}

/* Integral of the ground's force from m0 to m1: the unloading line up to the front, virgin ground
 * beyond, the bed with its force at m1. */
static double law_work(const DenseElement *e, double m1) {
    const DenseLaw *law = &e->law;
    double from = fmax(e->m0 - e->slack, 0.0), to = fmax(fmin(m1, e->front) - e->slack, 0.0),
           way = m1 - e->front;
    double work = 0.5 * e->line * (to - from) * (to + from), u = e->deep;
    if (way <= 0.0) {
        return work;
    }
    return work +
           way * (virgin_mean(law, u, way) + law->bed_stiffness * fmax(u + way - law->bed, 0.0));
}

/* Impulse of ground without memory: its force's mean over the way, in the air 0, and the damping's
 * integral, which is loss times what the static force does. */
static double dense_elastic(double dt, const DenseElement *e, double m1) {
    const DenseLaw *law = &e->law;
    if (law->elastic == 0.0) {
        return 0.0;
    }
    double low = fmax(fmin(e->m0, m1), 0.0), deep = fmax(fmax(e->m0, m1), 0.0),
           mean = power_mean(law->elastic, law->elastic_power, low, deep - low),
           whole = fabs(m1 - e->m0), share = whole > 1e-16 ? (deep - low) / whole : low > 0.0;
    return mean * (dt * share + law->loss * copysign(deep - low, m1 - e->m0));
}

/* Impulse of the mass that is recruited in the step, and of drag, by the growth of P. */
static double dense_recruited(const DenseElement *e, double down) {
    double mass = fmax(e->law.mass_rate, 0.0), extra = fmax(e->law.drag_rate, 0.0) - mass,
           lost = fmax(e->hit - down, 0.0);
    if (extra < 0.0) {
        return mass * down + 0.5 * extra * (down + fmin(down, e->w0));
    }
    return mass * down + extra * (0.5 * (e->hit + down) +
                                  (lost > 0.0 ? (e->still - 0.5) * lost * lost / e->hit : 0.0));
}

static double law_normal(double dt, const DenseElement *e, double w) {
    const DenseLaw *law = &e->law;
    double m1 = e->u0 + 0.5 * dt * w, way = m1 - e->m0,
           force = e->line * fmax(e->m0 - e->slack, 0.0);
    if (fabs(way) > 1e-16) {
        force = law_work(e, m1) / way;
    }
    if (fmin(m1, e->m0) > e->slack && m1 <= e->front) {
        force = e->line * (0.5 * (e->m0 + m1) - e->slack); /* nothing cancels */
    }
    double impulse = dt * force + e->mass * (fmax(w, e->reach) - e->w_a);
    if (m1 > e->front) {
        double gained = moved(law, e->deep + m1 - e->front) - moved(law, e->deep);
        impulse += fmax(gained, fmin(2.0 * gained, e->stopped)) * dense_recruited(e, fmax(w, 0.0));
    }
    double back = fmin(w + e->hit, 0.0), eased = back < -IMPULSE_EASE
                                                     ? back + 0.5 * IMPULSE_EASE
                                                     : -0.5 * back * back / IMPULSE_EASE;
    impulse += dt * ELEMENT_LAG * e->line * eased + dense_elastic(dt, e, m1);
    return fmax(impulse + e->active, 0.0);
}

/* ---- the problem ---- */

static void rotate(double *x, double *z, double c, double s) {
    double turned = c * *x - s * *z;
    *z = s * *x + c * *z;
    *x = turned;
}

/* Eigenvectors of a symmetric matrix by Jacobi's rotations, scaled by the roots of the eigenvalues:
 * A = L L^T. */
static void dense_factor(Dense *d, const double *A) {
    int n = d->n;
    double S[12][12], Q[12][12] = {{0}}, largest = 0.0;
    for (int i = 0; i < n; i++) {
        Q[i][i] = 1.0;
        for (int j = 0; j < n; j++) {
            S[i][j] = 0.5 * (A[i * n + j] + A[j * n + i]);
        }
    }
    for (int sweep = 0; sweep < DENSE_JACOBI; sweep++) {
        for (int p = 0; p < n; p++) {
            for (int q = p + 1; q < n; q++) {
                double angle = 0.5 * atan2(2.0 * S[p][q], S[q][q] - S[p][p]), c = cos(angle),
                       s = sin(angle);
                if (S[p][q] == 0.0) {
                    continue;
                }
                for (int k = 0; k < n; k++) {
                    rotate(&S[k][p], &S[k][q], c, s);
                }
                for (int k = 0; k < n; k++) {
                    rotate(&S[p][k], &S[q][k], c, s);
                }
                for (int k = 0; k < n; k++) {
                    rotate(&Q[k][p], &Q[k][q], c, s);
                }
                S[p][q] = S[q][p] = 0.0;
            }
        }
    }
    for (int k = 0; k < n; k++) {
        largest = fmax(largest, S[k][k]);
    }
    for (int k = 0; k < n; k++) {
        if (S[k][k] <= DENSE_SINGULAR * largest) {
            continue;
        }
        for (int i = 0; i < n; i++) {
            d->L[i][d->rank] = sqrt(S[k][k]) * Q[i][k];
        }
        d->rank++;
    }
}

/* The line runs from (a, F(a)) to no force after recovery a, not within ELEMENT_ELASTIC, and is
 * never flatter than F at a; in the bed the steepest slope is taken. */
static void element_line(DenseElement *e) {
    const DenseLaw *law = &e->law;
    double a = e->deep, in_bed = fmax(a - law->bed, 0.0),
           force = virgin_force(law, a) + law->bed_stiffness * in_bed;
    double travel = fmax(law->recovery * a, fmin(ELEMENT_ELASTIC, a)), slope = virgin_slope(law, a);
    if (in_bed > 0.0) {
        double power = law->sinkage > 0.0 ? fmax(power_rise(law->sinkage, law->sinkage_power, 0.0),
                                                 power_rise(law->sinkage, law->sinkage_power, a))
                                          : 0.0;
        slope = fmax(law->k_pen, law->kappa) + power + law->bed_stiffness;
    }
    e->line = travel > 0.0 ? fmax(force / travel, slope) : slope;
    e->slack = e->line > 0.0 ? a - force / e->line : a;
}

/* ---- resistive force theory ---- */

/* Resistance backward and upward on a face with normal n (into the ground) that moves along the
 * heading at these speeds. */
static void resist_alpha(int model, const double *n, const double *heading, double level,
                         double down, double alpha[2]) {
    double gamma = atan2(down, level);
    if (model == MILD_MODEL_ECC_QUASI) {
        mild_resist_plane(atan2(n[0] * heading[0] + n[1] * heading[1], -n[2]), gamma, alpha);
        return;
    }
    const double direction[3] = {cos(gamma) * heading[0], cos(gamma) * heading[1], -sin(gamma)};
    double force[3];
    mild_resist_space(n, direction, force);
    alpha[0] = -force[0] * heading[0] - force[1] * heading[1];
    alpha[1] = force[2];
}

/* The line is that of the greatest coefficient. It gives the yield force, a share of it, at the
 * front, which lies behind the depth that the line belongs to and never behind the element. v: the
 * element's velocity, w: du/dt, now. */
static void dense_resist(double dt, DenseElement *e, int model, const double *n, const double *v,
                         double w) {
    DenseLaw *law = &e->law;
    double tilt = hypot(n[0], n[1]), heading[2] = {v[0], v[1]}, level = hypot(v[0], v[1]),
           down = fmax(w, 0.0), x[2], z[2];
    for (int k = 0; k < 2 && tilt > 0.0; k++) {
        heading[k] += RESIST_REST * n[k] / tilt;
    }
    if (level * ELEMENT_LAG < FRICTION_ELASTIC) {
        level = 0.0; /* friction may hold it yet */
    }
    double length = hypot(heading[0], heading[1]), strength = law->kappa;
    for (int k = 0; k < 2 && length > 0.0; k++) {
        heading[k] /= length;
    }
    resist_alpha(model, n, heading, level + RESIST_REST, down, x);
    resist_alpha(model, n, heading, level, down + RESIST_REST, z);
    double share = fmin(fmax(z[1] / RESIST_PEAK, 0.0), 1.0), peak = RESIST_PEAK * strength;
    /* Virgin ground begins a whole elastic travel deep, ahead of an element that yields early. */
    e->deep = fmax(e->deep, fmax(ELEMENT_ELASTIC, e->m0 + (1.0 - share) * ELEMENT_ELASTIC));
    double bed = law->bed_stiffness * fmax(e->deep - law->bed, 0.0);
    e->line = (peak * e->deep + bed) / ELEMENT_ELASTIC;
    if (bed > 0.0) {
        e->line = fmax(e->line, peak + law->bed_stiffness);
    }
    e->slack = e->deep - (peak * e->deep + bed) / e->line;
    e->front = e->slack + (share * peak * e->deep + bed) / e->line;
    e->radius += dt * strength * fmax(x[0], 0.0) * fmax(e->u0, 0.0);
    law->k_pen = law->kappa = share * peak;
}

/* ---- what an element finds and remembers ---- */

/* What friction holds: k from the bound at the front's yield force, and at the force of ground
 * without memory where the way begins; the force held falls where k has fallen. */
static void element_hold(double dt, DenseElement *e, double x, double y, double old) {
    const DenseLaw *law = &e->law;
    double force = e->line * (e->front - e->slack);
    if (law->elastic > 0.0) {
        force += power_at(law->elastic, law->elastic_power, fmax(e->m0, 0.0));
    }
    double k = (law->mu * force + e->radius / dt) / FRICTION_ELASTIC,
           keeps = k < old ? k / old : 1.0;
    e->grip = dt * dt * k;
    e->hold[0] = dt * keeps * x;
    e->hold[1] = dt * keeps * y;
}

/* Janosi and Hanamoto: with the path j that the element has slid, the nearer material's strength
 * c s + mu N has grown to the share 1 - exp(-j/K). */
static void dense_shear(double dt, DenseElement *e, const MildMaterial *m, double area,
                        double slid) {
    double share = -expm1(-slid / m->shear_length);
    e->law.mu *= share;
    e->radius += e->u0 > 0.0 ? dt * share * m->cohesion * area : 0.0;
}

/* What the rim of a shell leaves of the load of an element at the depth u: the pressure that the
 * rim's depth and the distance to it give, over its own. */
static double rim_share(const DenseElement *e, const Find *find) {
    const DenseLaw *law = &e->law;
    const double radius = 0.0195 / sqrt(acos(-1.0)), u = fmax(e->u0, e->seen);
    if (!(e->u0 > 0.0) || !(law->k_pen > law->kappa)) {
        return 1.0;
    }
    double rim = find->plane[0] + find->plane[1] * find->p[0] + find->plane[2] * find->p[1];
    double high = (u - rim + 5.0 / 9.0 * 2e-4) / (find->round + 2e-4);
    double edge = find->half * (1.0 - sqrt(1.0 - fmin(fmax(high, 0.0), 1.0)));
    double heap = law->full * edge / (radius * find->heap[1]);
    double bears = law->kappa * fmax(rim, heap) + (law->k_pen - law->kappa) * heap;
    double own = law->kappa * u + (law->k_pen - law->kappa) * cone_share(law, u);
    double left = -find->normal[2] >= 0.5 ? bears / own : 0.0;
    return left + (1.0 - left) * law->recovery;
}

/* The share of virgin ground that it carries: the line keeps its slope and ends deeper. up: normal
 * of the sole's upper face. */
static void dense_share(double dt, DenseElement *e, const Find *find, const double now[4]) {
    DenseLaw *law = &e->law;
    const double *g = find->slope, a = e->deep;
    double level = (-find->normal[2] + g[0] * find->normal[0] + g[1] * find->normal[1]) /
                   sqrt(1.0 + g[0] * g[0] + g[1] * g[1]);
    level = fmin(fmax(level, 0.02), 1.0);
    level = find->shell ? fmin(fmax(rim_share(e, find), 0.02), 1.0) : level;
    double c = 1.0 - law->projected * (1.0 - level), q = fmin(1.0 - find->memory.worn[find->i], c),
           soil = virgin_force(law, a), bed = law->bed_stiffness * fmax(a - law->bed, 0.0);
    if (law->grip > 0.0) {
        double t = (3.0 + sqrt(8.0)) * law->grip,
               least = find->shell || !(law->projected * law->weight > 0.0) ? 0.1 : 0.0,
               held = fmin(law->mu, fmax(least, t * (c - q) / (2.0 * c - q))),
               way = fmax(e->u0 + 0.5 * dt * e->w0 - a, 0.0), carried = q * soil + bed,
               struck = fmax(law->drag_rate, 0.0) * moved_rate(law, a) * way * e->w0 / dt,
               along = now[0] * now[0] + now[1] * now[1],
               sine = along / fmax(along + e->w0 * e->w0, 1e-300);
        law->mu = held + (law->mu * sine - held) * struck / fmax(carried + struck, 1e-300);
    }
    double side = find->shell ? 0.0 : 1.5 * law->weight * find->pitch * find->pitch / find->width;
    e->radius += dt * side * e->u0 * fmax(e->u0, 0.0);
    if (find->shell && law->slip > 0.0) { /* what is ahead of a face pushes along its normal */
        const double *n = find->normal, pressed = q * soil + bed - e->line * (a - e->u0),
                     steep = fmax(-n[2], sin(10.0 / 45.0 * atan(1.0))),
                     ahead = fmax(n[0] * now[0] + n[1] * now[1], 0.0) / steep;
        e->radius += dt * fmax(pressed, 0.0) * ahead / (hypot(now[0], now[1]) + e->w0 + 1e-3);
    }
    e->slack = e->line > 0.0 ? a - (q * soil + bed) / e->line : a;
    law->k_pen *= q;
    law->kappa *= q;
    law->sinkage *= q;
}

/* Velocity of a point at p along the axes in which the foot presses, and the speed at which it
 * penetrates, of the foot's twist. */
static void point_velocity(const Find *find, const double *twist, double v[4]) {
    double moves[3];
    kit_cross(twist + 3, find->p, moves);
    for (int k = 0; k < 3; k++) {
        moves[k] += twist[k];
    }
    for (int k = 0; k < 3; k++) {
        const double *axis = find->frame[k];
        v[k] = axis[0] * moves[0] + axis[1] * moves[1] + axis[2] * moves[2];
    }
    v[3] = find->slope[0] * v[0] + find->slope[1] * v[1] - v[2];
}

/* How the drag of an element that goes on into virgin ground counts: see src/ground/law/begin.h. */
static void dense_drag(double dt, DenseElement *e, double gained) {
    const DenseLaw *law = &e->law;
    double a = e->front, extra = fmax(law->drag_rate, 0.0) - fmax(law->mass_rate, 0.0),
           deep = fmax(e->u0, a);
    e->hit = e->w0;
    e->still = 0.5;
    if (!(extra > 0.0 && e->u0 + 0.5 * dt * e->w0 > a + ELEMENT_ELASTIC)) {
        return;
    }
    double force = virgin_force(law, a) + 0.5 * virgin_slope(law, a) * (deep - a),
           drag = extra * moved_rate(law, a);
    e->hit = sqrt(e->w0 * e->w0 + 2.0 * fmax(gained, 0.0) / dt * (a - e->m0));
    e->still =
        fmin(BEGIN_STOP + sqrt(force / fmax(drag * e->hit * e->hit, 1e-300)), BEGIN_STOP_MOST);
    e->stopped = moved(law, deep) - moved(law, a);
}

static void dense_element(Dense *d, const Find *find) {
    DenseElement *e = &d->element[d->elements++];
    const Memory *memory = &find->memory;
    int i = find->i, directed;
    const MildMaterial *nearer = find_law(find, &e->law, &directed);
    double now[4], deepest = find_deepest(find, e->law.recovery);
    point_velocity(find, find->kit->input.velocity[find->f], now);
    for (int c = -1; c < d->rank; c++) { /* -1: the free twist */
        double twist[6], v[4];
        for (int k = 0; k < 6; k++) {
            twist[k] = c < 0 ? d->free[6 * find->f + k] : d->L[6 * find->f + k][c];
        }
        point_velocity(find, twist, v);
        for (int k = 0; k < 4; k++) {
            *(c < 0 ? &e->free[k] : &e->C[k][c]) = v[k];
        }
    }
    e->u0 = find_depth(find);
    const double share =
        find_share(find, &e->law, directed, e->u0 - 0.5 * d->dt * now[3], &deepest);
    if (share == 0.0) {
        memset(e, 0, sizeof *e);
        d->elements--;
        return;
    }
    if (find->shell) {
        law_times(&e->law, share);
    }
    memcpy(e->before, now, sizeof e->before);
    e->w0 = fmax(now[3], 0.0);
    e->m0 = memory->middle[i] > 0.0 ? memory->middle[i] : e->u0 - 0.5 * d->dt * now[3];
    e->front = e->deep = fmax(fmax(e->m0, deepest), 0.0);
    e->seen = deepest;
    e->reach = fmax(2.0 * (e->front - e->u0) / d->dt, 0.0);
    e->w_a = fmax(memory->front_speed[i], e->reach);
    e->mass = fmax(e->law.mass_rate, 0.0) * moved(&e->law, e->deep);
    e->radius = d->dt * e->law.k_drift * memory->drift[i] * fmax(e->u0, 0.0);
    e->damping = e->u0 > 0.0 ? d->dt * e->law.b_drift : 0.0;
    if (e->u0 > 0.0 && e->m0 >= deepest) {
        e->active =
            fmin(e->law.mass_rate, 0.0) * moved(&e->law, e->deep) * (e->free[3] - e->w_a) +
            fmin(e->law.drag_rate, 0.0) * moved_rate(&e->law, e->deep) * d->dt * e->w0 * e->w0;
    }
    element_line(e);
    dense_share(d->dt, e, find, now);
    dense_drag(d->dt, e, e->free[3] - now[3]);
    if (directed) {
        dense_resist(d->dt, e, nearer->model, find->normal, now, now[3]);
    }
    if (nearer->model == MILD_MODEL_BEKKER) {
        dense_shear(d->dt, e, nearer, find->area_share * find->pitch * find->pitch,
                    memory->drift[i]);
    }
    element_hold(d->dt, e, memory->held_x[i], memory->held_y[i], memory->held_stiffness[i]);
}

/* [m] The greatest depth that the ground of find->i remembers. */
static double find_seen(const Find *find, double dt) {
    double now[4], deepest;
    int directed;
    DenseLaw law;
    find_law(find, &law, &directed);
    deepest = find_deepest(find, law.recovery);
    point_velocity(find, find->kit->input.velocity[find->f], now);
    find_share(find, &law, directed, find_depth(find) - 0.5 * dt * now[3], &deepest);
    return deepest;
}

/* The axes are the world's; under a plane sole on ground whose cones merge they are turned by the
 * smallest rotation that takes the normal of the ground under the point (0, 0, z) to one that is
 * t = 0.6 (1 - 5 recovery) of the way from it to the sole's, at least 0: about their cross product,
 * by their angle, whose sine is at most 0.32. */
static void find_frame(Find *find, const MildSole *sole, const double *R) {
    const MildTerrain *terrain = &find->kit->terrain;
    const double *at = find->kit->input.position[find->f], z = mild_sole_z(sole);
    const double x = at[0] + R[2] * z, y = at[1] + R[5] * z;
    double slope[2], n[3], e[3], axis[3], size = 0.0, sine, angle;
    mild_terrain_slope_at(terrain, x, y, slope);
    const MildMaterial *m = &terrain->materials[mild_terrain_material_at(terrain, x, y)];
    const double t =
        m->model == MILD_MODEL_MILD_MERGED ? 0.6 * fmax(1.0 - 5.0 * m->recovery, 0.0) : 0.0;
    for (int k = 0; k < 3; k++) {
        n[k] = (k < 2 ? -slope[k] : 1.0) / sqrt(1.0 + slope[0] * slope[0] + slope[1] * slope[1]);
        e[k] = (1.0 - t) * n[k] - t * find->normal[k];
        size += e[k] * e[k];
    }
    kit_cross(n, e, axis);
    sine = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]) / sqrt(size);
    angle = atan2(sine, (n[0] * e[0] + n[1] * e[1] + n[2] * e[2]) / sqrt(size));
    angle = fmin(angle, asin(0.32));
    for (int k = 0; k < 3; k++) {
        double unit[3] = {k == 0, k == 1, k == 2}, turned[3];
        memcpy(find->frame[k], unit, sizeof unit);
        if (find->shell || t == 0.0 || sine < 1e-12) {
            continue;
        }
        const double a[3] = {axis[0] / sine / sqrt(size), axis[1] / sine / sqrt(size),
                             axis[2] / sine / sqrt(size)};
        kit_cross(a, unit, turned);
        for (int i = 0; i < 3; i++) {
            find->frame[k][i] =
                cos(angle) * unit[i] + sin(angle) * turned[i] + (1.0 - cos(angle)) * a[k] * a[i];
        }
    }
}

static void dense_foot(Dense *d, const Kit *kit, int f) {
    const MildSole *sole = kit->soles[f];
    const double *R = kit->input.rotation[f], side = R[8] > 0.0 ? -1.0 : 1.0;
    Find find = {.kit = kit,
                 .f = f,
                 .memory = ground_memory(kit->ground, f),
                 .pitch = mild_sole_pitch(sole),
                 .width = mild_sole_width(sole),
                 .normal = {side * R[2], side * R[5], side * R[8]},
                 .area_share = 1.0,
                 .area = 1.0,
                 .shell = mild_sole_surface_z(sole) != NULL};
    const int n = mild_sole_elements(sole);
    find_frame(&find, sole, R);
    if (find.shell) {
        RimPoint *point = calloc((size_t)n, sizeof *point);
        int count = 0;
        for (find.i = 0; point && find.i < n; find.i++) {
            if (find_element(&find, sole) && find_depth(&find) > 0.0 && -find.normal[2] >= 0.5) {
                const double area = find.area * find.pitch * find.pitch;
                point[count++] = (RimPoint){find.p[0], find.p[1],
                                            fmax(find_depth(&find), find_seen(&find, d->dt)),
                                            -find.normal[2] * area, area / (4.0 * acos(-1.0))};
            }
        }
        dense_rim(&find, point, count);
        free(point);
    }
    for (find.i = 0; find.i < n; find.i++) {
        if (find_element(&find, sole)) {
            dense_element(d, &find);
        }
    }
}

void dense_open(Dense *dense, const Kit *kit) {
    memset(dense, 0, sizeof *dense);
    dense->n = 6 * kit->feet;
    dense->dt = kit->input.dt;
    memcpy(dense->free, kit->input.free_velocity, sizeof dense->free);
    dense_factor(dense, kit->input.inverse_inertia);
    for (int f = 0; f < kit->feet; f++) {
        dense_foot(dense, kit, f);
    }
}

/* ---- its minimum ---- */

static void element_velocity(const Dense *d, const DenseElement *e, const double *y, double *v) {
    for (int k = 0; k < 4; k++) {
        v[k] = e->free[k];
        for (int c = 0; c < d->rank; c++) {
            v[k] += e->C[k][c] * y[c];
        }
    }
}

/* d: the velocity v less the nearest point of the way from 0 to -turn. Returns whether that point
 * is within the way, along = the way's direction. */
static int element_opposed(const DenseElement *e, const double *v, double *d, double *along) {
    double length = hypot(e->turn[0], e->turn[1]);
    d[0] = v[0];
    d[1] = v[1];
    if (length == 0.0) {
        return 0;
    }
    along[0] = -e->turn[0] / length;
    along[1] = -e->turn[1] / length;
    double at = v[0] * along[0] + v[1] * along[1], to = fmin(fmax(at, 0.0), length);
    d[0] -= to * along[0];
    d[1] -= to * along[1];
    return at > 0.0 && at < length;
}

/* Friction under the bound r. */
static void element_friction(const DenseElement *e, double r, const double *v, double *I) {
    double d[2], along[2], k = e->grip + r * ELEMENT_LAG / FRICTION_ELASTIC;
    element_opposed(e, v, d, along);
    double tx = e->hold[0] - k * d[0], ty = e->hold[1] - k * d[1], t = hypot(tx, ty);
    double share = t > r ? r / t : 1.0;
    I[0] = share * tx - e->damping * d[0];
    I[1] = share * ty - e->damping * d[1];
}

/* Gradient y - sum C^T I and, if wanted, the Hessian 1 + sum C^T K C; the normal law's slope by
 * difference. The normal impulse acts along -grad u: its power is -I_z du/dt, so its row of C is
 * minus that of du/dt. */
static void dense_gradient(const Dense *d, const double *y, double *g, double H[12][12]) {
    int n = d->rank;
    memcpy(g, y, 12 * sizeof *g);
    for (int r = 0; H && r < n; r++) {
        for (int c = 0; c < n; c++) {
            H[r][c] = r == c;
        }
    }
    for (int i = 0; i < d->elements; i++) {
        const DenseElement *e = &d->element[i];
        double v[4];
        element_velocity(d, e, y, v);
        double I[3] = {0.0, 0.0, law_normal(d->dt, e, v[3])};
        element_friction(e, d->bound[i], v, I);
        for (int c = 0; c < n; c++) {
            g[c] -= e->C[0][c] * I[0] + e->C[1][c] * I[1] - e->C[3][c] * I[2];
        }
        if (!H) {
            continue;
        }
        double h = 1e-7, stiff = (law_normal(d->dt, e, v[3] + h) - law_normal(d->dt, e, v[3] - h)) /
                                 (2.0 * h);
        double o[2], way[2], r = d->bound[i], along = e->grip + r * ELEMENT_LAG / FRICTION_ELASTIC;
        int within = element_opposed(e, v, o, way);
        double tx = e->hold[0] - along * o[0], ty = e->hold[1] - along * o[1], t = hypot(tx, ty),
               share = t > r ? r / t : 1.0;
        double nx = t > r ? tx / t : 0.0, ny = t > r ? ty / t : 0.0, pull = share * along;
        double xx = e->damping + pull * (1.0 - nx * nx), xy = -pull * nx * ny,
               yy = e->damping + pull * (1.0 - ny * ny);
        if (within) { /* along the way nothing changes; across it d does, at a right angle to it */
            double across =
                way[1] * way[1] * xx - 2.0 * way[0] * way[1] * xy + way[0] * way[0] * yy;
            xx = across * way[1] * way[1];
            xy = -across * way[0] * way[1];
            yy = across * way[0] * way[0];
        }
        if (xx + yy == 0.0 && stiff == 0.0) {
            continue;
        }
        for (int r = 0; r < n; r++) {
            double X = xx * e->C[0][r] + xy * e->C[1][r], Y = xy * e->C[0][r] + yy * e->C[1][r],
                   W = stiff * e->C[3][r];
            for (int c = 0; c <= r; c++) {
                H[r][c] += X * e->C[0][c] + Y * e->C[1][c] + W * e->C[3][c];
            }
        }
    }
}

/* x = -H^-1 g by Cholesky's method, in place of H's lower half. */
static void dense_direction(int n, double H[12][12], const double *g, double *x) {
    for (int j = 0; j < n; j++) {
        for (int k = 0; k < j; k++) {
            H[j][j] -= H[j][k] * H[j][k];
        }
        H[j][j] = sqrt(fmax(H[j][j], 0.5)); /* no eigenvalue is below 1 */
        for (int i = j + 1; i < n; i++) {
            for (int k = 0; k < j; k++) {
                H[i][j] -= H[i][k] * H[j][k];
            }
            H[i][j] /= H[j][j];
        }
    }
    for (int i = 0; i < n; i++) {
        x[i] = -g[i];
        for (int k = 0; k < i; k++) {
            x[i] -= H[i][k] * x[k];
        }
        x[i] /= H[i][i];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++) {
            x[i] -= H[k][i] * x[k];
        }
        x[i] /= H[i][i];
    }
}

static double dot(int n, const double *a, const double *b) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* Slope of the function along the line, at y + t x. */
static double dense_along(const Dense *d, const double *y, const double *x, double t) {
    double at[12] = {0}, g[12];
    for (int i = 0; i < d->rank; i++) {
        at[i] = y[i] + t * x[i];
    }
    dense_gradient(d, at, g, NULL);
    return dot(d->rank, g, x);
}

/* Where the slope along x vanishes: the lowest point of the line. A full step is kept that nearly
 * reaches it. */
static double dense_line(const Dense *d, const double *y, const double *x, double slope) {
    double low = 0.0, high = 1.0, at = dense_along(d, y, x, 1.0);
    if (fabs(at) <= 0.1 * fabs(slope)) {
        return 1.0;
    }
    for (int k = 0; k < 30 && at < 0.0; k++) {
        low = high;
        high *= 2.0;
        at = dense_along(d, y, x, high);
    }
    for (int k = 0; k < 40; k++) {
        double middle = 0.5 * (low + high);
        *(dense_along(d, y, x, middle) < 0.0 ? &low : &high) = middle;
    }
    return 0.5 * (low + high);
}

/* The minimum at the present bounds, by Newton's method with an exact line search; true when it
 * rests. */
static int dense_minimum(Dense *d) {
    for (int k = 0; k < DENSE_STEPS; k++) {
        double g[12], H[12][12], x[12] = {0};
        dense_gradient(d, d->y, g, H);
        dense_direction(d->rank, H, g, x);
        if (dot(d->rank, x, x) <= DENSE_SMALL * DENSE_SMALL * dot(d->rank, d->y, d->y)) {
            return 1;
        }
        double t = dense_line(d, d->y, x, dot(d->rank, g, x));
        for (int i = 0; i < d->rank; i++) {
            d->y[i] += t * x[i];
        }
    }
    return 0;
}

/* Moves every bound by a share of the way to what the normal impulses ask for. */
static void dense_bounds(Dense *d, double share) {
    for (int i = 0; i < d->elements; i++) {
        const DenseElement *e = &d->element[i];
        double v[4];
        element_velocity(d, e, d->y, v);
        d->bound[i] += share * (e->law.mu * law_normal(d->dt, e, v[3]) + e->radius - d->bound[i]);
    }
}

static int dense_settle(Dense *d) {
    double share = 1.0, last = INFINITY;
    int settled = 0;
    for (int round = 0; round < DENSE_ROUNDS && !settled; round++) {
        double before[12], moved[12];
        memcpy(before, d->y, sizeof before);
        int found = dense_minimum(d);
        for (int i = 0; i < d->rank; i++) {
            moved[i] = d->y[i] - before[i];
        }
        double change = sqrt(dot(d->rank, moved, moved));
        settled =
            found && round > 1 && change <= share * DENSE_SMALL * sqrt(dot(d->rank, d->y, d->y));
        if (round % 16 == 15) { /* bounds that run to and fro come to rest by smaller moves */
            if (change > 0.5 * last) {
                share = fmax(0.5 * share, 0.02);
            }
            last = change;
        }
        dense_bounds(d, share);
    }
    for (int i = 0; i < d->n; i++) {
        d->twist[i] = d->free[i] + dot(d->rank, d->L[i], d->y);
    }
    return settled;
}

/* Section 17: turns the elements whose friction gave energy at the mean speed beyond what it had
 * stored, or all; false where that is no matter. */
static int dense_turn(Dense *d, int all) {
    double caused = 0.0, gift = 0.0, gifts[DENSE_ELEMENTS],
           least = 0.08 * 0.5 * dot(d->rank, d->y, d->y);
    for (int i = 0; i < d->elements; i++) {
        const DenseElement *e = &d->element[i];
        double v[4], I[2], held[2], work = 0.0;
        element_velocity(d, e, d->y, v);
        element_friction(e, d->bound[i], v, I);
        for (int k = 0; k < 2; k++) {
            caused -= 0.5 * I[k] * (v[k] - e->free[k]);
            work += 0.5 * I[k] * (v[k] + e->before[k]);
            held[k] = e->hold[k] - e->grip * v[k];
        }
        double left = fmin(hypot(held[0], held[1]), d->bound[i]),
               had = hypot(e->hold[0], e->hold[1]);
        double stored = e->grip > 0.0 ? fmax(had * had - left * left, 0.0) / (2.0 * e->grip) : 0.0;
        gifts[i] = fmax(work - stored, 0.0);
        gift += gifts[i];
    }
    if (caused <= least || gift <= least) {
        return 0;
    }
    for (int i = 0; i < d->elements; i++) {
        DenseElement *e = &d->element[i];
        if (all || gifts[i] > 0.0) {
            memcpy(e->turn, e->before, sizeof e->turn);
            e->hold[0] = e->hold[1] = e->grip = 0.0;
        }
    }
    return 1;
}

int dense_solve(Dense *d) {
    int settled = dense_settle(d);
    for (int round = 0; settled && round < 2 && dense_turn(d, round == 1); round++) {
        settled = dense_settle(d);
    }
    return settled;
}

void dense_start(Dense *d, const double *twist) {
    for (int c = 0; c < d->rank; c++) { /* the columns of L are orthogonal */
        double along = 0.0, length = 0.0;
        for (int i = 0; i < d->n; i++) {
            along += d->L[i][c] * (twist[i] - d->free[i]);
            length += d->L[i][c] * d->L[i][c];
        }
        d->y[c] = along / length;
    }
    dense_bounds(d, 1.0);
}

double dense_distance(const Dense *d, const double *one, const double *other) {
    double square = 0.0;
    for (int c = 0; c < d->rank; c++) { /* the columns of L are orthogonal */
        double along = 0.0, length = 0.0;
        for (int i = 0; i < d->n; i++) {
            along += d->L[i][c] * (one[i] - other[i]);
            length += d->L[i][c] * d->L[i][c];
        }
        square += along * along / (length * length);
    }
    return sqrt(square / dot(d->rank, d->y, d->y));
}
