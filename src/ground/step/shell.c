/* Shells: soles whose elements have a height, a normal and an area each. */
#include <string.h>

#include "ground/law/models.h"
#include "ground/law/rim.h"
#include "ground/step/step.h"
#include "ground/terrain/terrain.h"

const double shell_level[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

/* Depth and area share of every element. */
static void shell_locate(FootScratch *foot, const MildTerrain *terrain) {
    const double ez = foot->arm[1][2], nz = foot->arm[2][2], tz = foot->arm[3][2];
    foot_points(foot);
    if (foot->uneven) {
        foot_surface(foot, terrain);
    } else {
        for (int i = 0; i < foot->padded; i++) {
            foot->depth[i] = terrain->height - foot->point_z[i];
        }
    }
    for (int i = 0; i < foot->elements; i++) {
        const double down =
            -(ez * foot->face[0][i] + nz * foot->face[1][i] + tz * foot->face[2][i]);
        foot->area_share[i] = down > SHARE_STEEP ? down * foot->area[i] : 0.0;
    }
    for (int i = foot->elements; i < foot->padded; i++) {
        foot->depth[i] = PADDING_DEPTH;
    }
}

void shell_list(FootScratch *foot, const MildTerrain *terrain, double steepest) {
    foot->active = 0;
    if (foot_is_away(foot, terrain, steepest)) {
        return;
    }
    shell_locate(foot, terrain);
    for (int i = 0; i < foot->elements; i++) {
        foot->element[foot->active] = i;
        foot->active += foot->area_share[i] > 0.0 && foot->depth[i] > foot->least;
    }
}

/* Height and area share of the slots. A loaded element keeps that of its touchdown. */
static void shell_gather(const FootScratch *foot, const Memory *memory) {
    for (int i = 0; i < foot_end(foot); i++) {
        Slots *s = slot_block(foot, i);
        const int l = i % SLOT_LANES;
        s->z[l] = s->area_share[l] = 0.0;
        if (i < foot->active) {
            const int e = foot->element[i];
            s->z[l] = foot->height[e];
            s->area_share[l] =
                memory->material[e] >= 0 ? memory->area_share[e] : foot->area_share[e];
        }
    }
}

/* [m] Depth of a slot in the middle of the last step, by its present speed. */
static double slot_middle(const Slots *s, int i, const Motion *now, double dt) {
    return s->depth[i] - 0.5 * dt * slot_velocity(s, i, now, SLOT_UNEVEN | SLOT_SHELL).descent;
}

/* Bool: the element of a slot, which carried nothing, was below the surface: it faced up there, or
 * had lifted off in an imprint. */
static int slot_is_under(const FootScratch *foot, int i, const Memory *memory, const Motion *now,
                         double dt) {
    const int e = foot->element[i];
    const double middle = slot_middle(slot_block(foot, i), i % SLOT_LANES, now, dt);
    return (memory->material[e] == MATERIAL_BURIED && middle > 0.0) ||
           (memory->material[e] == MATERIAL_FREE && memory->middle[e] > 0.0);
}

/* Gives each slot the law of its material times its area share. An element that was under elastic
 * ground gets none. */
static void shell_laws(const FootScratch *foot, const MildTerrain *terrain, const Memory *memory,
                       const Motion *now, double dt) {
    for (int i = 0; i < foot->active; i++) {
        foot->slot_material[i] = MATERIAL_NONE; /* scaled in the last step */
    }
    slots_materials(foot, terrain, memory);
    for (int i = 0; i < foot->active; i++) {
        Slots *s = slot_block(foot, i);
        const int l = i % SLOT_LANES;
        const int e = foot->element[i];
        const int model = terrain->materials[foot->slot_material[i] & 0xff].model;
        if (!(s->recovery[l] < 1.0) && slot_is_under(foot, i, memory, now, dt)) {
            s->area_share[l] = 0.0;
        }
        /* The theory's coefficients count the slope themselves. */
        const int directed = (model_row(model)->motion & LAW_RESIST) && slot_directed(s, l);
        slot_scale(s, l, directed && s->area_share[l] > 0.0 ? foot->area[e] : s->area_share[l]);
    }
}

/* A buried element begins without force, at the end of the unloading line of some greater depth. */
static void shell_unload(const FootScratch *foot, const Memory *memory, const Motion *now,
                         double dt) {
    for (int i = 0; i < foot->active; i++) {
        Slots *s = slot_block(foot, i);
        const int l = i % SLOT_LANES;
        const double lasting = 1.0 - s->recovery[l];
        const double m0 = slot_middle(s, l, now, dt);
        if (memory->material[foot->element[i]] == MATERIAL_BURIED && lasting > 0.0 && m0 > 0.0) {
            const double least = real_max(m0 / lasting, m0 + ELEMENT_ELASTIC);
            s->depth_max[l] = real_max(s->depth_max[l], least);
        }
    }
}

void shell_slots(FootScratch *foot, const MildGround *ground, int f, const MildTerrain *terrain,
                 const Memory *memory, const Motion *now, double dt) {
    slots_gather(foot, memory);
    shell_gather(foot, memory);
    if (foot->uneven) {
        slots_uneven(foot, ground->uneven[f], memory, terrain->height, now);
    }
    shell_laws(foot, terrain, memory, now, dt);
    if (ground->tiles > 0) {
        const Imprints imprints = ground_imprints(ground);
        slots_imprints(foot, &imprints, memory, shell_level);
    }
    shell_unload(foot, memory, now, dt);
}

double shell_loaded(const FootScratch *foot, double *area) {
    double z = 0.0;
    *area = 0.0;
    for (int i = 0; i < foot->active; i++) {
        const Slots *s = slot_block(foot, i);
        const int l = i % SLOT_LANES;
        z += s->z[l] * s->iz[l];
        *area += s->iz[l] > 0.0 ? s->area_share[l] * foot->pitch * foot->pitch : 0.0;
    }
    return z;
}

/* ---- rim (rim.h) ---- */

/* A slot of a shell, as the rim sees it. */
typedef struct {
    double x, y, u; /* [m] its place, world axes, and rim_depth */
    double down;    /* [-] downward part of its outward normal */
} RimPoint;

static RimPoint point_of(const FootScratch *foot, int i) {
    const Slots *s = slot_block(foot, i);
    const int e = foot->element[i], l = i % SLOT_LANES;
    return (RimPoint){foot->point_x[e] - foot->origin[0], foot->point_y[e] - foot->origin[1],
                      rim_depth(s->depth[l], s->depth_max[l]), foot->area_share[e] / foot->area[e]};
}

/* [N] share_ahead of slot i, whose law is `element`. down: downward part of its outward normal. */
static double ahead_of(const FootScratch *foot, int i, const Element *element, const Motion *now,
                       Real down) {
    const Slots *s = slot_block(foot, i);
    const int e = foot->element[i], l = i % SLOT_LANES;
    const SlotVelocity v = slot_velocity(s, l, now, SLOT_UNEVEN | SLOT_SHELL);
    const Share share = slot_share(s, l);
    Real n[3] = {0, 0, -down};
    for (int k = 0; k < 3; k++) {
        n[0] += foot->face[k][e] * foot->arm[k + 1][0];
        n[1] += foot->face[k][e] * foot->arm[k + 1][1];
    }
    return share_ahead(element, &share, s->lean[l], n, v.x, v.y, v.descent);
}

/* [-] rim_share of a slot at the depth u. */
static double share_of_slot(const Slots *s, int l, double bears, double u) {
    const Element element = slot_element(s, l);
    Law law = element.law;
    law.cone_begin = s->cone_begin[l];
    return rim_share(&element.law, s->recovery[l], bears, rim_force(&law, u));
}

void shell_lean(const FootScratch *foot, const Motion *now) {
    Real sums[RIM_SUMS] = {0};
    for (int i = 0; i < foot->active; i++) {
        const RimPoint at = point_of(foot, i);
        const double area = foot->area[foot->element[i]] * foot->pitch * foot->pitch;
        rim_add(sums, at.x, at.y, at.u, at.down, area);
    }
    const Rim rim = rim_of(sums);
    for (int i = 0; i < foot->active; i++) {
        const RimPoint at = point_of(foot, i);
        Slots *s = slot_block(foot, i);
        const int l = i % SLOT_LANES;
        const Element element = slot_element(s, l);
        const double bears =
            rim_bears(&rim, &element.law, foot->heap->width, at.x, at.y, at.u, at.down);
        const double level = share_of_slot(s, l, bears, at.u);
        s->lean[l] = s->projects[l] > 0.0 && at.u > 0.0 ? level : 1.0;
        s->ahead[l] = ahead_of(foot, i, &element, now, at.down);
    }
}

/* ---- hessian ---- */

/* torque += p x I */
static void shell_cross(const double *p, const double *I, double *torque) {
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        torque[k] += p[i] * I[j] - p[j] * I[i];
    }
}

void shell_hessian(const FootScratch *foot, const ShellMoments M, double *H) {
    static const int product[4][4] = {{0, 1, 2, 3}, {1, 4, 5, 9}, {2, 5, 6, 7}, {3, 9, 7, 8}};
    memset(H, 0, 36 * sizeof *H);
    for (int k = 0; k < 4; k++) {
        double rows[3][6] = {{0.0}};
        for (int r = 0; r < 3; r++) {
            for (int l = 0; l < 4; l++) {
                const int at = product[k][l];
                shell_cross(foot->lever[l],
                            (const double[3]){M[r][0][at], M[r][1][at], M[r][2][at]}, rows[r] + 3);
            }
            for (int c = 0; c < 3; c++) {
                rows[r][c] = M[r][c][k];
            }
        }
        for (int c = 0; c < 6; c++) { /* column c of the rows is a force: k = 0 adds it, too */
            const double force[3] = {rows[0][c], rows[1][c], rows[2][c]};
            double torque[3] = {0.0};
            shell_cross(foot->lever[k], force, torque);
            for (int r = 0; r < 3; r++) {
                H[6 * r + c] += k == 0 ? force[r] : 0.0;
                H[6 * (3 + r) + c] += torque[r];
            }
        }
    }
}
