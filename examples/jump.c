/* A hopper plans a jump to a height off loose sand, as Hubicki, Aguilar, Goldman and Ames (IROS
 * 2016) planned those of theirs off poppy seeds: a body and a foot, between them a spring whose end
 * a motor moves through knots in time.
 *
 * Gauss-Newton on the apex h(a) of the knots a: the change that reaches the target, and of these
 * the one with the least sum of (da_i - da_{i-1})^2, so that the motor stays smooth. With g = dh/da
 *
 *     da = Q^-1 g (target - h)/(g Q^-1 g),   Q^-1_ij = min(i, j) + 1
 *
 * g includes what the ground remembers: each number is the difference of a roll-out that begins
 * with a copy of the ground's block. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "mild/ground.h"

enum { KNOTS = 6, ITERATIONS = 20, CORNERS = 24 };
static const double body_mass = 1, foot_mass = 0.2, gravity = 9.81;  /* [kg, kg, m/s^2] */
static const double leg_length = 0.2, stiffness = 3000, damping = 4; /* [m, N/m, N s/m] */
static const double radius = 0.0381; /* [m] of the foot, a disc of three inches */
static const double stroke = 0.08;   /* [m] of the motor, to both sides */
static const double pushes = 0.16;   /* [s] to the last knot */
static const double change = 1e-6;   /* [m] of a knot, for a difference */
static const double within = 1e-4;   /* [m] of the target, where a plan ends */

typedef struct {
    double body, foot, body_speed, foot_speed; /* [m, m/s] */
} Hopper;

/* Sand under a foot, and the hopper that stands on it. */
typedef struct {
    MildSole *sole;
    MildScratch *scratch;
    MildGround *ground, *stood; /* now, and when it stood */
    MildTerrain terrain;
    Hopper stands;
    double dt; /* [s] */
} World;

/* [m] Where the motor is: on straight lines from 0 through the knots. */
static double motor(const double *knot, double time) {
    const double at = fmin(fmax(time, 0) / pushes * KNOTS, KNOTS - 1e-9);
    const int i = (int)at;
    const double from = i > 0 ? knot[i - 1] : 0;
    return from + (at - i) * (knot[i] - from);
}

/* A step of hopper and ground. */
static void step(World *world, Hopper *h, double shift, double damp) {
    double A[36] = {[2 * 6 + 2] = 1 / foot_mass};
    MildContactInput in = {.feet = 1,
                           .dt = world->dt,
                           .inverse_inertia = A,
                           .rotation = {{1, 0, 0, 0, 1, 0, 0, 0, 1}}};
    MildContactResult out;
    const double leg = stiffness * (leg_length + shift - (h->body - h->foot)) -
                       damp * (h->body_speed - h->foot_speed);
    in.position[0][2] = h->foot;
    in.velocity[0][2] = h->foot_speed;
    in.free_velocity[2] = h->foot_speed - world->dt * (leg / foot_mass + gravity);
    mild_ground_solve(world->ground, &world->terrain, &in, world->scratch, &out);
    mild_ground_advance(world->ground, &world->terrain, &in, world->scratch, &out);
    h->body_speed += world->dt * (leg / body_mass - gravity);
    h->foot_speed = out.velocity[2];
    h->body += world->dt * h->body_speed;
    h->foot += world->dt * h->foot_speed;
}

/* [m] Rise of the centre of mass above where it stood, to where it turns after the push. */
static double jump(World *world, const double *knot) {
    const double mass = body_mass + foot_mass;
    const Hopper *from = &world->stands;
    Hopper h = *from;
    double speed = 0;
    memcpy(world->ground, world->stood, mild_ground_size(world->stood));
    for (int i = 0; i * world->dt < pushes || speed > 0; i++) {
        step(world, &h, motor(knot, i * world->dt), damping);
        speed = (body_mass * h.body_speed + foot_mass * h.foot_speed) / mass;
    }
    const double rise =
        (body_mass * (h.body - from->body) + foot_mass * (h.foot - from->foot)) / mass;
    return rise + speed * speed / (2 * gravity); /* what the last step missed */
}

/* Lets the hopper stand on a ground. */
static int stand(World *world, const char *soil, double pitch, double dt) {
    double outline[2 * CORNERS];
    for (int i = 0; i < CORNERS; i++) {
        const double angle = 2 * 3.14159265358979 * i / CORNERS;
        outline[2 * i] = radius * cos(angle);
        outline[2 * i + 1] = radius * sin(angle);
    }
    const MildSoleDef def = {.outline = outline, .points = CORNERS, .pitch = pitch};
    MildError error = {0};
    MildMaterial material = mild_material_default();
    if (!mild_material_preset(soil, &material)) {
        fprintf(stderr, "jump: there is no ground '%s'\n", soil);
        return 0;
    }
    world->terrain = mild_terrain_uniform(&material);
    world->dt = dt;
    world->sole = mild_sole_create(&def, &error);
    const MildSole *const soles[] = {world->sole};
    world->scratch = world->sole ? mild_scratch_create(soles, 1, &error) : NULL;
    if (!world->scratch) {
        fprintf(stderr, "jump: %s\n", error.text);
        return 0;
    }
    const size_t bytes = mild_ground_bytes(soles, 1);
    void *block = aligned_alloc(64, bytes);
    world->stood = malloc(bytes);
    if (!block || !world->stood) {
        fprintf(stderr, "jump: out of memory\n");
        return 0;
    }
    world->ground = mild_ground_init(block, soles, 1);
    world->stands = (Hopper){.body = leg_length};
    for (int i = 0; i * dt < 1; i++) {
        step(world, &world->stands, 0, 20 * damping);
    }
    memcpy(world->stood, world->ground, bytes);
    return 1;
}

static void leave(World *world) {
    free(world->ground);
    free(world->stood);
    mild_scratch_destroy(world->scratch);
    mild_sole_destroy(world->sole);
}

/* The next knots of the plan from those before, which stay where nothing on the way is better.
 * Returns the apex of those before [m]. */
static double improve(World *world, double target, double *knot) {
    const double apex = jump(world, knot);
    double slope[KNOTS], way[KNOTS] = {0}, steep = 0;
    for (int i = 0; i < KNOTS; i++) {
        const double kept = knot[i];
        knot[i] += change;
        slope[i] = (jump(world, knot) - apex) / change;
        knot[i] = kept;
    }
    for (int i = 0; i < KNOTS; i++) {
        for (int j = 0; j < KNOTS; j++) {
            way[i] += ((i < j ? i : j) + 1) * slope[j];
        }
        steep += slope[i] * way[i];
    }
    for (double share = 1; share > 0.02 && steep > 0; share /= 2) {
        double next[KNOTS];
        for (int i = 0; i < KNOTS; i++) {
            const double moved = share * way[i] * (target - apex) / steep;
            next[i] = fmin(fmax(knot[i] + moved, -stroke), stroke);
        }
        if (fabs(jump(world, next) - target) <= 0.9 * fabs(apex - target)) {
            memcpy(knot, next, sizeof next);
            break;
        }
    }
    return apex;
}

/* Plans on one ground; returns the time it took [s]. */
static double plan(World *world, double target, double *knot, int *iterations) {
    const clock_t start = clock();
    for (int i = 0; i < KNOTS; i++) {
        knot[i] = i < KNOTS / 2 ? -0.01 : 0.02; /* squats, then pushes */
    }
    *iterations = 0;
    while (*iterations < ITERATIONS && fabs(improve(world, target, knot) - target) > within) {
        ++*iterations;
    }
    return (double)(clock() - start) / CLOCKS_PER_SEC;
}

int main(void) {
    World sand, floor, fine; /* to plan on; the same for hard ground; to jump from, finer */
    double least = INFINITY, most = 0; /* [s] that a plan took */
    int missed = 0;                    /* targets that a plan did not reach */
    if (!stand(&sand, "dry_sand_loose", 0.0195, 1e-3) ||
        !stand(&floor, "rubber_tile", 0.0195, 1e-3) ||
        !stand(&fine, "dry_sand_loose", 0.006, 0.25e-3)) {
        return 1;
    }
    printf("%10s %6s %11s %8s %12s\n", "target/mm", "steps", "planned/mm", "jump/mm",
           "for hard/mm");
    for (int target = 45; target <= 120; target += 15) {
        double knot[KNOTS], hard[KNOTS];
        int steps, ignored;
        const double time = plan(&sand, 1e-3 * target, knot, &steps);
        plan(&floor, 1e-3 * target, hard, &ignored);
        least = fmin(least, time);
        most = fmax(most, time);
        const double planned = jump(&sand, knot), other = jump(&floor, hard);
        if (!(fabs(planned - 1e-3 * target) <= within && fabs(other - 1e-3 * target) <= within)) {
            fprintf(stderr, "jump: no plan reaches %d mm\n", target);
            missed++;
        }
        printf("%10d %6d %11.2f %8.2f %12.2f\n", target, steps, 1e3 * planned,
               1e3 * jump(&fine, knot), 1e3 * jump(&fine, hard));
    }
    fprintf(stderr, "a plan took %.0f to %.0f ms\n", 1e3 * least, 1e3 * most);
    leave(&sand);
    leave(&floor);
    leave(&fine);
    return missed > 0;
}
