/* A one-legged hopper on dense sand: a body, a springy leg that only grows or shrinks, a plate of
 * 160 mm as its foot.
 *
 *     q = (z_body, z_foot)      M = diag(m_body, m_foot)      J = (0, 1) in the vertical row, else
 * 0 A = J M^-1 J^T has one entry, 1/m_foot                  v_free = J (qd + dt M^-1 (leg -
 * weight))
 *
 * The leg pushes on its way up from the deepest point; sand and damper take energy away. The height
 * of the hops settles where the two are equal. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "mild/ground.h"

static const double body_mass = 3, foot_mass = 0.3, gravity = 9.81,
                    dt = 0.0005;                                       /* [kg, kg, m/s^2, s] */
static const double leg_length = 0.4, stiffness = 1500, thrust = 0.03; /* [m, N/m, m] */
static const double damping = 5, damping_stretched = 20; /* [N s/m], the latter at its stop */

/* The leg pushes body and foot apart [N]; while it pushes off, its spring is `thrust` longer. */
static double leg_force(double length, double speed, int pushing) {
    const double rest = leg_length + (pushing ? thrust : 0);
    return stiffness * (rest - length) - (length > rest ? damping_stretched : damping) * speed;
}

int main(void) {
    static const double outline[] = {-0.08, -0.08, 0.08,  -0.08,
                                     0.08,  0.08,  -0.08, 0.08}; /* [m] x, y of four corners */
    const MildSoleDef def = {.outline = outline, .points = 4, .pitch = 0.0195};
    MildError error = {.text = "out of memory"};
    MildSole *sole = mild_sole_create(&def, &error);
    const MildSole *soles[] = {sole};
    MildScratch *scratch = sole ? mild_scratch_create(soles, 1, &error) : NULL;
    void *block = scratch ? aligned_alloc(64, mild_ground_bytes(soles, 1)) : NULL;
    if (!block) {
        return fprintf(stderr, "hopper: %s\n", error.text), 1;
    }
    MildGround *ground = mild_ground_init(block, soles, 1);
    MildMaterial sand = mild_material_default();
    mild_material_preset("sand_dense", &sand);
    const MildTerrain terrain = mild_terrain_uniform(&sand);
    double A[36] = {0}; /* J M^-1 J^T */
    MildContactInput in = {
        .feet = 1, .dt = dt, .inverse_inertia = A, .rotation = {{1, 0, 0, 0, 1, 0, 0, 0, 1}}};
    MildContactResult out;
    A[2 * 6 + 2] = 1 / foot_mass; /* A: the foot moves up and down, and nowhere else */

    double body = leg_length + 0.1, foot = 0.1, body_speed = 0, foot_speed = 0; /* [m, m/s] */
    double force_max = 0, depth_max = 0, stance = 0;
    printf("%4s %8s %8s %8s %9s %9s %9s\n", "hop", "time/s", "body/m", "foot/m", "print/mm",
           "force/N", "stance/ms");
    for (int step = 0, hop = 0; hop < 10 && step < 40000; step++) {
        const int touching = foot<0, rising = body_speed> 0;
        const double leg = leg_force(body - foot, body_speed - foot_speed, touching && rising);
        in.position[0][2] = foot;
        in.velocity[0][2] = foot_speed;
        in.free_velocity[2] = foot_speed + dt * (-leg / foot_mass - gravity);
        mild_ground_solve(ground, &terrain, &in, scratch, &out);
        mild_ground_advance(ground, &terrain, &in, scratch, &out);
        body_speed += dt * (leg / body_mass - gravity);
        foot_speed = in.free_velocity[2] +
                     dt * out.foot[0].force[2] / foot_mass; /* qd += dt M^-1 J^T force */
        body += dt * body_speed;
        foot += dt * foot_speed;

        force_max = fmax(force_max, out.foot[0].force[2]);
        depth_max = fmax(depth_max, out.foot[0].depth_max);
        stance += touching ? dt : 0;
        if (rising && body_speed <= 0 && !touching && stance > 0) { /* the apex ends a hop */
            printf("%4d %8.3f %8.4f %8.4f %9.2f %9.1f %9.1f\n", ++hop, step * dt, body, foot,
                   1e3 * depth_max, force_max, 1e3 * stance);
            force_max = depth_max = stance = 0;
        }
    }
    free(block);
    mild_scratch_destroy(scratch);
    mild_sole_destroy(sole);
    return 0;
}
