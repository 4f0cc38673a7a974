/* The elements of a foot, for dense.c: their law, where they are and what ground they find, and the
 * rim of a shell. */
#ifndef DENSE_ELEMENT_H
#define DENSE_ELEMENT_H

#include <math.h>

#include "dense.h"
#include "ground/law/element_law.h"
#include "ground/sole/sole.h"
#include "ground/step/scratch.h"

/* ---- a material's law, of two that blend, of a part of an element ---- */

/* A force that grows with a power of the depth, as the dense reference takes it: from docs/model.md
 * section 19, by libm and quadrature. */

#define DENSE_ROUND 1e-4 /* [m] within which it is straight */
#define DENSE_DEPTH 0.01 /* [m] at which it is given */

/* F z q^((n - 1)/2) with z = u/10 mm and q = (u^2 + e^2)/(10 mm)^2. */
static inline double power_at(double force, double n, double u) {
    double z = u / DENSE_DEPTH, e = DENSE_ROUND / DENSE_DEPTH;
    return force * z * pow(z * z + e * e, 0.5 * (n - 1.0));
}

/* Its derivative: F q^((n - 3)/2) (n z^2 + e^2), by the depth. */
static inline double power_rise(double force, double n, double u) {
    double z = u / DENSE_DEPTH, e = DENSE_ROUND / DENSE_DEPTH;
    return force / DENSE_DEPTH * pow(z * z + e * e, 0.5 * (n - 3.0)) * (n * z * z + e * e);
}

/* Its mean from the depth u over a way down: Gauss's rule of eight points on pieces that are short
 * beside the distance to the curve's poles at +-e i. */
static inline double power_mean(double force, double n, double u, double way) {
    static const double place[4] = {0.18343464249564980, 0.52553240991632899, 0.79666647741362674,
                                    0.96028985649753623};
    static const double weight[4] = {0.36268378337836198, 0.31370664587788729, 0.22238103445337447,
                                     0.10122853629037626};
    double sum = 0.0;
    if (force == 0.0) {
        return 0.0;
    }
    for (double done = 0.0, piece; done < 1.0; done += piece) {
        double at = u + done * way, short_way = 0.5 * hypot(at, DENSE_ROUND);
        piece = way > (1.0 - done) * 1e-9 ? fmin(1.0 - done, short_way / way) : 1.0 - done;
        for (int k = 0; k < 8; k++) {
            double x = k < 4 ? place[k] : -place[k - 4];
            double here = at + 0.5 * piece * way * (1.0 + x);
            sum += 0.5 * piece * weight[k % 4] * power_at(force, n, here);
        }
    }
    return sum;
}

static int is_resistive(const MildMaterial *m) {
    return m->model == MILD_MODEL_ECC_QUASI || m->model == MILD_MODEL_ECC_QUASI_3D;
}

/* A cone that is complete at once: yielding springs, resistive force theory, and ground that is
 * nothing but a bed below its other curve. */
static int is_straight(const MildMaterial *m) {
    return is_resistive(m) || m->model == MILD_MODEL_CON_SPRING ||
           m->model == MILD_MODEL_ECC_SPRING || m->model == MILD_MODEL_BEKKER ||
           m->model == MILD_MODEL_HUNT_CROSSLEY;
}

/* Bekker: (k_c/b + k_phi) z^n on the element's area. Hunt and Crossley: k_pen u at 10 mm, damped by
 * 3/2 d; it springs back whole. */
static void law_curve(const MildMaterial *m, double area, double k_pen, DenseLaw *law) {
    if (m->model == MILD_MODEL_BEKKER) {
        law->sinkage = (m->k_c / m->plate_width + m->k_phi) * pow(DENSE_DEPTH, m->exponent) * area;
        law->sinkage_power = m->exponent;
    } else if (m->model == MILD_MODEL_HUNT_CROSSLEY) {
        law->elastic = k_pen * DENSE_DEPTH;
        law->elastic_power = m->exponent;
        law->loss = 1.5 * m->dissipation;
        law->recovery = 1.0;
    }
}

/* Of an element of that pitch. Stiffness, drift and cone are those of the paper's element, by area;
 * of a concentric model those of the whole sole. heap: where the heap of the element begins
 * to close, and its width, by the radius of a disc of the paper's element. */
static DenseLaw law_material(const MildMaterial *m, double pitch, const double heap[2]) {
    double area = pitch * pitch, c_g = m->passive ? fmax(m->c_g, 0.0) : m->c_g,
           c_d = m->passive ? fmax(m->c_d, 0.5) : m->c_d;
    int whole = m->model == MILD_MODEL_CON_CONE || m->model == MILD_MODEL_CON_SPRING;
    double square = whole ? area : 0.0195 * 0.0195, k_pen = m->k_pen * (area / square);
    DenseLaw law = {.bed = m->bed_depth,
                    .bed_stiffness = LAW_BED_STRESS * area,
                    .recovery = is_resistive(m) ? 0.0 : m->recovery,
                    .mu = m->mu,
                    .k_drift = m->k_drift * (area / square),
                    .b_drift = m->b_drift * (area / square)};
    if (is_straight(m)) {
        int spring = m->model == MILD_MODEL_CON_SPRING || m->model == MILD_MODEL_ECC_SPRING;
        law.k_pen = law.kappa = is_resistive(m) ? m->zeta * LAW_RESIST_STRESS * area
                                : spring        ? k_pen
                                                : 0.0;
        law.full = LAW_LINE_DEPTH;
        law_curve(m, area, k_pen, &law);
        return law;
    }
    law.k_pen = k_pen;
    law.kappa = m->sigma_cone * area / cos(m->alpha);
    law.full = sqrt(square / acos(-1.0)) * tan(m->alpha) / m->nu;
    if (m->model == MILD_MODEL_MILD_MERGED) {
        law.begin = law.full * heap[0];
        law.full *= heap[1];
        law.projected = 1.0;
    }
    if (m->slip_length > 0.0) {
        law.slip = 1.0 / m->slip_length;
        law.grip = m->grip;
        law.weight = m->grip > 0.0 ? m->phi * m->rho * 9.81 : 0.0;
        law.k_drift = law.b_drift = 0.0;
    }
    law.mass_rate = c_g * m->phi * m->rho * m->nu * area;
    law.drag_rate = c_d * law.mass_rate;
    return law;
}

/* The power of a curve that only one of two laws has, and its damping, stay as they are. */
static void law_alone(double one, double other, double *a, double *b) {
    if (one == 0.0) {
        *a = *b;
    } else if (other == 0.0) {
        *b = *a;
    }
}

/* All numbers of one law change linearly into the other's. */
static DenseLaw law_blend(const DenseLaw *one, const DenseLaw *other, double share) {
    enum { NUMBERS = sizeof(DenseLaw) / sizeof(double) };
    double a[NUMBERS], b[NUMBERS];
    DenseLaw law, from = *one, to = *other;
    law_alone(one->sinkage, other->sinkage, &from.sinkage_power, &to.sinkage_power);
    law_alone(one->elastic, other->elastic, &from.elastic_power, &to.elastic_power);
    law_alone(one->elastic, other->elastic, &from.loss, &to.loss);
    memcpy(a, &from, sizeof a);
    memcpy(b, &to, sizeof b);
    for (int k = 0; k < NUMBERS; k++) {
        a[k] = (1.0 - share) * a[k] + share * b[k];
    }
    memcpy(&law, a, sizeof a);
    law.recovery = law.elastic > 0.0 ? 1.0 : law.recovery; /* part of it has no memory */
    return law;
}

/* All that makes force or mass, times a share. */
static void law_times(DenseLaw *law, double share) {
    double *const forces[] = {&law->k_pen,     &law->kappa,         &law->mass_rate,
                              &law->drag_rate, &law->bed_stiffness, &law->k_drift,
                              &law->b_drift,   &law->sinkage,       &law->elastic};
    for (size_t k = 0; k < sizeof forces / sizeof *forces; k++) {
        *forces[k] *= share;
    }
}

/* P(u) = u_f/3 (1 - (1 - t)^3), t = min(u/u_f, 1): the flat area's integral over the depth, by the
 * element's area. */
static double cone_share(const DenseLaw *law, double u) {
    double left = 1.0 - fmin(fmax(u - law->begin, 0.0) / law->full, 1.0);
    return fmin(u, law->begin) + law->full / 3.0 * (1.0 - left * left * left);
}

/* Share of the element's area that is still flat. */
static double cone_flat(const DenseLaw *law, double u) {
    double left = 1.0 - fmin(fmax(u - law->begin, 0.0) / law->full, 1.0);
    return left * left;
}

/* [-], [m] Growth by depth of what moves with an element, and all that moves at the depth u: with a
 * cone what is recruited, with a heap a part of the depth until that is the whole heap. */
static double moved_rate(const DenseLaw *law, double u) {
    if (law->begin == 0.0) {
        return cone_flat(law, u);
    }
    return u / LAW_MOVES < law->begin + law->full / 3.0 ? 1.0 / LAW_MOVES : LAW_TAIL;
}

static double moved(const DenseLaw *law, double u) {
    double all = cone_share(law, 1e3);
    return law->begin == 0.0 ? cone_share(law, u)
                             : fmin(u / LAW_MOVES, all) + LAW_TAIL * fmax(u - LAW_MOVES * all, 0.0);
}

/* ---- where an element is ---- */

/* A foot of the kit, and of the element in hand its place in the world. */
typedef struct {
    const Kit *kit;
    int f;
    Memory memory;
    double pitch, width, normal[3]; /* width: shorter side; normal: of the face that looks down */
    int i;
    double p[3], at[3], slope[2]; /* ankle -> element, world point, gradient of the ground */
    double area_share, area;      /* [-] of a shell: what it presses with, and its area, both
                                     over those of a square of the raster; else 1 */
    int shell;                    /* bool */
    double frame[3][3];           /* rows: the axes in which the foot presses, world */
    double heap[2];               /* [-] of the element, as law_material has it */
    double plane[3];    /* of a shell, dense_rim: least squares through its depths less half of
                        `round`, [m] and [-] */
    double round, half; /* [m] height of what is round; half breadth */
} Find;

/* Depth under the ground as it is here or, if that is less, under the plane that the last step took
 * it for. */
static double find_depth(const Find *find) {
    const MildTerrain *terrain = &find->kit->terrain;
    const Memory *memory = &find->memory;
    int i = find->i, code = memory->material[i];
    double here = mild_terrain_height_at(terrain, find->at[0], find->at[1]) - find->at[2];
    if (!terrain->map || mild_map_is_level(terrain->map) || !find->kit->ground->uneven[find->f]) {
        return here;
    }
    if (code == MATERIAL_NONE || code == MATERIAL_BURIED ||
        (code == MATERIAL_FREE && here <= 0.0)) {
        return here;
    }
    double plane =
        memory->plane[i] + memory->slope_x[i] * find->at[0] + memory->slope_y[i] * find->at[1];
    return fmin(here, terrain->height + plane - find->at[2]);
}

/* u_max: the element's own; when it carries nothing the print's under it, and at least the one
 * whose line ends here. */
static double find_deepest(const Find *find, double recovery) {
    const MildGround *ground = find->kit->ground;
    static const double level[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const double *R = find->shell ? level : find->kit->input.rotation[find->f];
    double deepest = find->memory.depth_max[find->i], m0 = find->memory.middle[find->i], sum = 0.0;
    if (ground->tiles == 0 || find->memory.material[find->i] >= 0 || recovery >= 1.0) {
        return deepest;
    }
    for (int k = 0; k < 9; k++) {
        double a = (k % 3 - 1) * find->pitch / 3.0, b = (k / 3 - 1) * find->pitch / 3.0;
        sum += mild_ground_imprint_at(ground, find->at[0] + R[0] * a + R[1] * b,
                                      find->at[1] + R[3] * a + R[4] * b);
    }
    deepest = sum / 9.0;
    if (find->memory.material[find->i] == MATERIAL_FREE && m0 > 0.0) {
        deepest = fmax(deepest, fmax(m0 / (1.0 - recovery), m0 + ELEMENT_ELASTIC));
    }
    return deepest;
}

/* Law of the material, or the two that blend, that it touched down on or finds; returns the nearer
 * one. *directed: its resistance has a direction. Blended with a cone or with pressure and sinkage
 * it has none: both are as under a level plate. */
static const MildMaterial *find_law(const Find *find, DenseLaw *law, int *directed) {
    const MildTerrain *terrain = &find->kit->terrain;
    int code = find->memory.material[find->i];
    MildBlend blend = {code & 0xff, code >> 8 & 0xff, (code >> 16) / 255.0};
    if (code < 0) {
        blend = mild_terrain_blend_at(terrain, find->at[0], find->at[1]);
    }
    const MildMaterial *first = &terrain->materials[blend.first],
                       *second = &terrain->materials[blend.second];
    DenseLaw one = law_material(first, find->pitch, find->heap),
             other = law_material(second, find->pitch, find->heap);
    *law = blend.share > 0.0 ? law_blend(&one, &other, blend.share) : one;
    *directed = is_resistive(first) &&
                (blend.share == 0.0 || (is_straight(second) && second->model != MILD_MODEL_BEKKER));
    return first;
}

/* What it presses with of a square of the raster, by its projected area when it touched down; by
 * its whole area where the law counts the slope. 0: it came to face down below the surface of
 * elastic ground, or was moved there in an imprint. Below that of other ground it begins at the end
 * of the unloading line of a greater depth, *deepest. m0: where the step begins. */
static double find_share(const Find *find, const DenseLaw *law, int directed, double m0,
                         double *deepest) {
    const int code = find->memory.material[find->i];
    const int buried = code == MATERIAL_BURIED && m0 > 0.0;
    const int lifted = code == MATERIAL_FREE && find->memory.middle[find->i] > 0.0 &&
                       (find->shell || find->kit->ground->tiles > 0);
    if (law->recovery >= 1.0 && (buried || lifted)) {
        return 0.0;
    }
    if (buried) {
        *deepest = fmax(*deepest, fmax(m0 / (1.0 - law->recovery), m0 + ELEMENT_ELASTIC));
    }
    return !find->shell ? 1.0 : directed ? find->area : find->area_share;
}

/* An element in the ground, for dense_rim. */
typedef struct {
    double x, y, u, weight, own;
} RimPoint;

/* The plane of least squares through the depths, about their middle; the residual's standard
 * deviation is H/sqrt(12). The breadth is from the smaller principal moment of the points and their
 * discs. */
static void dense_rim(Find *find, const RimPoint *at, int count) {
    double w = 0, x = 0, y = 0, u = 0, m[5] = {0}, own = 0, rest = 0;
    for (int i = 0; i < count; i++) {
        w += at[i].weight;
        x += at[i].weight * at[i].x;
        y += at[i].weight * at[i].y;
        u += at[i].weight * at[i].u;
        own += at[i].weight * at[i].own;
    }
    memset(find->plane, 0, sizeof find->plane);
    find->round = find->half = 0.0;
    if (count == 0) {
        return;
    }
    x /= w, y /= w, u /= w, own /= w;
    for (int i = 0; i < count; i++) {
        double dx = at[i].x - x, dy = at[i].y - y, du = at[i].u - u, part = at[i].weight / w;
        m[0] += part * dx * dx;
        m[1] += part * dx * dy;
        m[2] += part * dy * dy;
        m[3] += part * dx * du;
        m[4] += part * dy * du;
    }
    double a = m[0] + 1e-4 * own, b = m[2] + 1e-4 * own, det = fmax(a * b - m[1] * m[1], 1e-20);
    double gx = (b * m[3] - m[1] * m[4]) / det, gy = (a * m[4] - m[1] * m[3]) / det;
    for (int i = 0; i < count; i++) {
        double du = at[i].u - u, flat = gx * (at[i].x - x) + gy * (at[i].y - y);
        rest += at[i].weight / w * du * (du - flat);
    }
    find->round = sqrt(12.0 * fmax(rest, 0.0) + 4e-10) - 2e-5;
    find->plane[1] = gx;
    find->plane[2] = gy;
    find->plane[0] = u - 0.5 * find->round - gx * x - gy * y;
    double angle = 0.5 * atan2(2.0 * m[1], m[0] - m[2]), c = cos(angle), s = sin(angle);
    double across = s * s * m[0] - 2.0 * s * c * m[1] + c * c * m[2]; /* the smaller one */
    find->half = 2.0 * sqrt(fmax(across + own, 0.0));
}

/* The place, the shape and the ground of element find->i; false: it faces up. */
static int find_element(Find *find, const MildSole *sole) {
    const double *R = find->kit->input.rotation[find->f];
    double x = mild_sole_x(sole)[find->i], y = mild_sole_y(sole)[find->i], z = mild_sole_z(sole);
    if (find->shell) {
        z = mild_sole_surface_z(sole)[find->i];
        find->area = mild_sole_surface_area(sole)[find->i] / (find->pitch * find->pitch);
        for (int k = 0; k < 3; k++) {
            find->normal[k] = 0.0;
            for (int j = 0; j < 3; j++) {
                find->normal[k] += R[3 * k + j] * mild_sole_surface_normal(sole, j)[find->i];
            }
        }
        find->area_share = find->memory.material[find->i] >= 0 ? find->memory.area_share[find->i]
                                                               : -find->normal[2] * find->area;
        if (!(-find->normal[2] > cos(80.0 / 180.0 * acos(-1.0)))) {
            return 0;
        }
    }
    const SoleHeap heap = sole_heap(sole, find->i);
    find->heap[0] = heap.begin;
    find->heap[1] = heap.width;
    for (int k = 0; k < 3; k++) {
        find->p[k] = R[3 * k] * x + R[3 * k + 1] * y + R[3 * k + 2] * z;
        find->at[k] = find->kit->input.position[find->f][k] + find->p[k];
    }
    mild_terrain_slope_at(&find->kit->terrain, find->at[0], find->at[1], find->slope);
    return 1;
}

#endif
