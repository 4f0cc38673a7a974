/* A plate of 5 kg falls 20 mm onto foam, bounces and comes to rest where the foam's own law says.
 * The smallest engine there is: one free body, whose twist is the foot's twist. */
#include <stdio.h>
#include <stdlib.h>

#include "mild/ground.h"

enum { STEPS = 1500, ROW = 100 };
static const double mass = 5, inertia = 0.02; /* [kg, kg m^2] the same about every axis */
static const double gravity = 9.81, dt = 0.002, pitch = 0.0195; /* [m/s^2, s, m] */

/* Elastic ground unloads along the line from its deepest point to the surface; the weight rests on
 * that line. */
static double rest_depth(const MildMaterial *foam, int elements, double depth_max) {
    return depth_max * mass * gravity / (elements * mild_element_law(foam, pitch, depth_max).force);
}

int main(void) {
    /* the sole: a plate of 200 mm x 100 mm, its reference point at its centre of mass */
    static const double outline[] = {-0.1, -0.05, 0.1,  -0.05,
                                     0.1,  0.05,  -0.1, 0.05}; /* [m] x, y of four corners */
    const MildSoleDef def = {.outline = outline, .points = 4, .pitch = pitch};
    MildError error = {.text = "out of memory"};
    MildSole *sole = mild_sole_create(&def, &error);
    const MildSole *soles[] = {sole};
    MildScratch *scratch = sole ? mild_scratch_create(soles, 1, &error) : NULL;
    void *block = scratch ? aligned_alloc(64, mild_ground_bytes(soles, 1)) : NULL;
    if (!block) {
        return fprintf(stderr, "dropped_plate: %s\n", error.text), 1;
    }
    MildGround *ground = mild_ground_init(block, soles, 1);
    MildMaterial foam = mild_material_default();
    mild_material_preset("foam45", &foam);
    const MildTerrain terrain = mild_terrain_uniform(&foam);

    double A[36] = {0}; /* J M^-1 J^T */
    MildContactInput in = {.feet = 1,
                           .dt = dt,
                           .inverse_inertia = A,
                           .position = {{0, 0, 0.02}},
                           .rotation = {{1, 0, 0, 0, 1, 0, 0, 0, 1}}};
    MildContactResult out;
    for (int i = 0; i < 6; i++) {
        A[7 * i] = 1 / (i < 3 ? mass : inertia); /* A: 6 x 6, diagonal */
    }

    printf("%8s %10s %10s %10s %10s\n", "time/s", "height/mm", "speed/mm/s", "force/N", "elements");
    for (int step = 0; step < STEPS; step++) {
        for (int i = 0; i < 6; i++) {
            in.free_velocity[i] = in.velocity[0][i];
        }
        in.free_velocity[2] -= gravity * dt;
        mild_ground_solve(ground, &terrain, &in, scratch, &out);
        mild_ground_advance(ground, &terrain, &in, scratch, &out);
        for (int i = 0; i < 6; i++) {
            in.velocity[0][i] = out.velocity[i];
        }
        for (int i = 0; i < 3; i++) {
            in.position[0][i] += dt * in.velocity[0][i];
        }
        if ((step + 1) % ROW == 0) {
            printf("%8.3f %10.3f %10.3f %10.2f %10d\n", (step + 1) * dt, 1e3 * in.position[0][2],
                   1e3 * in.velocity[0][2], out.foot[0].force[2], out.foot[0].contacts);
        }
    }
    const double depth_max =
        mild_ground_depth_max(ground, 0)[0]; /* since the plate touched down last */
    printf("deepest %.3f mm, at rest %.3f mm, by the law %.3f mm\n", 1e3 * depth_max,
           -1e3 * in.position[0][2], 1e3 * rest_depth(&foam, mild_sole_elements(sole), depth_max));
    free(block);
    mild_scratch_destroy(scratch);
    mild_sole_destroy(sole);
    return 0;
}
