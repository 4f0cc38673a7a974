#include <string.h>

#include "ground/resist.h"
#include "ground/step.h"

#define PREPARE_MARGIN 1e-3      /* [m] elements this close to the ground are listed */
#define PREPARE_EXTRA_SPEED 2.0  /* [m/s] an impact at the heel may swing the toe down faster than its free motion */
#define PREPARE_BLEND_SLOW 0.02  /* [m/s] below: chi = 1; see step.h */
#define PREPARE_BLEND_FAST 0.05  /* [m/s] above: chi in full */

/* Where every element is, and how deep. */
static void foot_place(FootScratch *foot, const MildTerrain *terrain, const double *position, const double *R) {
    double cx = position[0] + R[2] * foot->z, cy = position[1] + R[5] * foot->z, cz = position[2] + R[8] * foot->z;
    const double *x = foot->x, *y = foot->y;
#pragma omp simd
    for (int i = 0; i < foot->padded; i++) {
        foot->point_x[i] = cx + R[0] * x[i] + R[1] * y[i];
        foot->point_y[i] = cy + R[3] * x[i] + R[4] * y[i];
        foot->point_z[i] = cz + R[6] * x[i] + R[7] * y[i];
    }
    terrain_heights(terrain, foot->point_x, foot->point_y, foot->padded, foot->depth);
#pragma omp simd
    for (int i = 0; i < foot->padded; i++) foot->depth[i] -= foot->point_z[i];
}

/* Fastest any point of the foot can come down under twist V. */
static double foot_descent(const FootScratch *foot, const double *V) {
    return step_max(-V[2], 0.0) + foot->radius * sqrt(V[3] * V[3] + V[4] * V[4]);
}

/* Lists the elements that may touch, in order. All or none, the common cases, are found without a branch per element. */
static void foot_list(FootScratch *foot, const MildContactInput *input, int f) {
    double descent = step_max(foot_descent(foot, input->velocity[f]), foot_descent(foot, input->free_velocity + 6 * f));
    double least = -PREPARE_MARGIN - input->dt * (descent + PREPARE_EXTRA_SPEED), near = 0.0;
#pragma omp simd reduction(+ : near)
    for (int i = 0; i < foot->elements; i++) near += foot->depth[i] > least ? 1.0 : 0.0;
    foot->active = (int)near;
    if (foot->active == 0) return;
    int all = foot->active == foot->elements, active = 0;
    for (int i = 0; all && i < foot->elements; i++) foot->element[i] = i;
    for (int i = 0; !all && i < foot->elements; i++) {
        foot->element[active] = i;
        active += foot->depth[i] > least;
    }
}

/* Derives the laws of the terrain's materials anew where their numbers have changed. */
static void foot_laws(MildScratch *scratch, const MildTerrain *terrain, int f) {
    const FootScratch *foot = &scratch->foot[f];
    for (int m = 0; m < terrain->material_count; m++) {
        DerivedLaw *derived = &scratch->derived[f][m];
        const MildMaterial *wanted = &terrain->materials[m];
        if (derived->known && memcmp(&derived->material, wanted, sizeof *wanted) == 0) continue;
        *derived = (DerivedLaw){*wanted, law_of(wanted, foot->pitch), 1};
        for (int i = foot->start; i < foot->start + foot->padded; i++)
            if (scratch->slot_material[i] == m) scratch->slot_material[i] = -1;
    }
}

static void slot_set_law(const Slots *s, int i, const Law *law, const MildMaterial *material) {
    s->flat[i] = law->flat;
    s->cone[i] = law->cone;
    s->full[i] = law->full;
    s->inverse_full[i] = law->inverse_full;
    s->drag[i] = law->drag;
    s->mass_rate[i] = law->mass;
    s->bed[i] = law->bed;
    s->bed_stiffness[i] = law->bed_stiffness;
    s->mu[i] = material->mu;
    s->k_drift[i] = material->k_drift;
    s->b_drift[i] = material->b_drift;
    s->recovery[i] = material->recovery;
    s->lead[i] = 0.0;
}

/* Material of each slot: the one it touched down on, so that a foot sliding over a border keeps its law. */
static void slots_materials(MildScratch *scratch, const MildTerrain *terrain, const Memory *memory, int f) {
    const FootScratch *foot = &scratch->foot[f];
    int one = terrain->patch_count == 0, wrong = 0;
    for (int k = 0; one && k < foot->active; k++) { /* uniform ground whose law stands in the slots already */
        int m = memory->material[foot->element[k]];
        wrong += (m > 0) | (scratch->slot_material[foot->start + k] != 0);
    }
    if (one && wrong == 0) return;
    for (int k = 0; k < foot->active; k++) {
        int i = foot->start + k, e = foot->element[k], m = memory->material[e];
        if (m < 0 || m >= terrain->material_count)
            m = mild_terrain_material_at(terrain, foot->point_x[e], foot->point_y[e]);
        if (scratch->slot_material[i] == m) continue;
        scratch->slot_material[i] = m;
        slot_set_law(&scratch->slot, i, &scratch->derived[f][m].law, &terrain->materials[m]);
    }
}

static void slots_gather(MildScratch *scratch, const Memory *memory, const double *R, int f) {
    const FootScratch *foot = &scratch->foot[f];
    const Slots *s = &scratch->slot;
    double cx = R[2] * foot->z, cy = R[5] * foot->z, cz = R[8] * foot->z;
#pragma omp simd
    for (int k = 0; k < foot->active; k++) {
        int i = foot->start + k, e = foot->element[k];
        double x = foot->x[e], y = foot->y[e];
        s->px[i] = cx + R[0] * x + R[1] * y;
        s->py[i] = cy + R[3] * x + R[4] * y;
        s->pz[i] = cz + R[6] * x + R[7] * y;
        s->depth[i] = foot->depth[e];
        s->depth_max[i] = memory->depth_max[e];
        s->front_speed[i] = memory->front_speed[e];
        s->drift[i] = memory->drift[e];
    }
    for (int i = foot->start + foot->active; i < foot_end(foot); i++) {
        s->px[i] = s->py[i] = s->pz[i] = 0.0;
        s->depth[i] = -1e3; /* never reaches the ground */
        s->depth_max[i] = s->front_speed[i] = s->drift[i] = 0.0;
        s->ix[i] = s->iy[i] = s->iz[i] = 0.0;
    }
}

/* Everything of step.h that does not depend on the new velocity. The unloading line runs from (a, F_g(a)) to zero force
 * after recovery * a, but not within CONTACT_ELASTIC. It is never flatter than the loading curve at a, and so never above
 * it: a concave curve lies above its chords, a convex one above its tangent; in the bed the steepest slope is taken. */
static void slots_prepare(const Slots *s, int start, int end, double dt, const double *now, const double *free) {
    double rate = 1.0 / dt;
#pragma omp simd
    for (int i = start; i < end; i++) {
        double u0 = s->depth[i], used = s->depth_max[i], a = step_max(step_max(u0, used), 0.0);
        double c0 = step_max(1.0 - a * s->inverse_full[i], 0.0), flat_share = s->full[i] * (1.0 / 3.0) * (1.0 - c0 * c0 * c0);
        double in_bed = a - s->bed[i], bed_stiffness = s->bed_stiffness[i], bed = in_bed > 0.0 ? bed_stiffness : 0.0;
        double force = s->flat[i] * flat_share + s->cone[i] * a + bed * in_bed;
        double travel = step_max(s->recovery[i] * a, step_min(CONTACT_ELASTIC, a));
        double curve = s->flat[i] * c0 * c0, flat = step_max(s->flat[i], 0.0), steepest = in_bed > 0.0 ? flat : curve;
        s->front[i] = a;
        s->front_force[i] = force;
        s->line[i] = step_max(force / (travel + STEP_TINY), steepest + s->cone[i] + bed);
        s->gap[i] = used > 0.0 ? 0.0 : step_max(-u0, 0.0);
        double reach = (a - u0) * rate, py = s->py[i], px = s->px[i], added = s->mass_rate[i] * flat_share;
        double speed = step_max(now[4] * px - now[3] * py - now[2], 0.0), w_free = free[4] * px - free[3] * py - free[2];
        double blend = (speed - PREPARE_BLEND_SLOW) * (1.0 / (PREPARE_BLEND_FAST - PREPARE_BLEND_SLOW));
        s->reach[i] = reach;
        s->front_speed[i] = step_max(s->front_speed[i], reach);
        s->speed[i] = speed;
        s->blend[i] = step_min(step_max(blend, 0.0), 1.0);
        s->mass[i] = step_max(added, 0.0);
        /* Energy-creating parameters (passive = false) cannot be implicit: they enter with the free motion. */
        double pull = step_min(s->drag[i], 0.0), inside = u0 > 0.0 ? 1.0 : 0.0;
        s->explicit_impulse[i] = inside * (u0 >= used ? 1.0 : 0.0) *
                                 (step_min(added, 0.0) * (w_free - s->front_speed[i]) + pull * c0 * c0 * dt * speed * speed);
        s->drag_now[i] = step_max(s->drag[i], 0.0);
        s->drift_radius[i] = dt * s->k_drift[i] * s->drift[i] * step_max(u0, 0.0);
        s->damping[i] = dt * s->b_drift[i] * inside;
    }
}

int contact_prepare(const MildGround *ground, const MildTerrain *terrain, const MildContactInput *input, MildScratch *scratch) {
    int total = 0;
    for (int f = 0; f < scratch->feet; f++) {
        FootScratch *foot = &scratch->foot[f];
        foot_place(foot, terrain, input->position[f], input->rotation[f]);
        foot_list(foot, input, f);
        if (foot->active == 0) continue;
        Memory memory = ground_memory(ground, f);
        foot_laws(scratch, terrain, f);
        slots_materials(scratch, terrain, &memory, f);
        slots_gather(scratch, &memory, input->rotation[f], f);
        slots_prepare(&scratch->slot, foot->start, foot_end(foot), input->dt, input->velocity[f],
                      input->free_velocity + 6 * f);
        slots_resist(scratch, terrain, f, input->dt, input->rotation[f], input->velocity[f]);
        total += foot->active;
    }
    return total;
}
