/* The elements of a foot, where they are and what ground they find, and the rim of a shell, for
 * dense.c. */
#ifndef DENSE_FIND_H
#define DENSE_FIND_H

#include "dense_law.h"

#include "ground/sole/sole.h"
#include "ground/step/scratch.h"

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
    double heap[2];               /* [-] of the element, see dense_law.h */
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
