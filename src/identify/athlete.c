#include "identify/athlete.h"

#include <math.h>
#include <stdlib.h>

#include "ground/law/width.h"

#define STEP 0.01     /* [-] of sqrt(m/k): a contact on concrete takes 300 steps */
#define LONGEST 2.0   /* [s] */
#define BOTTOMLESS 10 /* [m] */

const AthleteDevice athlete_shock = {.fall = 0.055, .spring = 2e6};
const AthleteDevice athlete_deform = {.fall = 0.120, .spring = 4e4};

typedef struct {
    MildTerrain terrain;
    MildContactInput input;
    MildContactResult contact;
    double inverse_inertia[36]; /* of the input */
    MildGround *ground;
    MildScratch *scratch;
    double way;    /* [m] of the mass since it touched, down */
    double speed;  /* [m/s] of the mass, down */
    double middle; /* [m] depth of the foot in the middle of the last step */
    double depth;  /* [m] mean of that and the one before: a foot without mass may jitter */
} Drop;

typedef struct {
    double peak;     /* [N] */
    double deepest;  /* [m] of the foot */
    double returned; /* [-] as in Athlete */
} Fall;

/* [N] On concrete: m g (h + F/k) = F^2/(2 k). */
static double concrete_peak(const AthleteDevice *device) {
    const double weight = ATHLETE_MASS * ATHLETE_GRAVITY;
    return weight * (1.0 + sqrt(1.0 + 2.0 * device->fall * device->spring / weight));
}

/* The elements have the area of the disc. */
static MildSole *foot_create(MildError *error) {
    enum { CORNERS = 96, ELEMENTS = 12 };
    const double pi = 3.141592653589793;
    double outline[2 * CORNERS];
    for (int i = 0; i < CORNERS; i++) {
        const double angle = 2.0 * pi * (i + 0.5) / CORNERS;
        outline[2 * i] = 0.5 * ATHLETE_FOOT * cos(angle);
        outline[2 * i + 1] = 0.5 * ATHLETE_FOOT * sin(angle);
    }
    const MildSoleDef def = {.outline = outline,
                             .points = CORNERS,
                             .pitch = 0.5 * ATHLETE_FOOT * sqrt(pi / ELEMENTS),
                             .target_elements = ELEMENTS};
    return mild_sole_create(&def, error);
}

/* One step; returns the force [N]. The foot weighs nothing, so the ground carries the spring's
 * force F = k (x + dt/2 (v' - w')), x its compression, v' and w' the new speeds of mass and foot.
 * With v' = v + dt (g - F/m) and the impulse P = dt F this is
 *
 *     w' = v + dt g + 2 x/dt - P (1/m + 2/(k dt^2))
 * whose two parts are the foot's free velocity and its A. */
static double drop_step(Drop *drop) {
    MildContactInput *input = &drop->input;
    const double dt = input->dt;
    const double squeezed = drop->way + input->position[0][2];
    const double fallen = drop->speed + dt * ATHLETE_GRAVITY;
    input->free_velocity[2] = -(fallen + 2.0 * squeezed / dt);
    mild_ground_solve(drop->ground, &drop->terrain, input, drop->scratch, &drop->contact);
    mild_ground_advance(drop->ground, &drop->terrain, input, drop->scratch, &drop->contact);
    const double force = drop->contact.foot[0].force[2];
    drop->speed = fallen - dt * force / ATHLETE_MASS;
    drop->way += dt * drop->speed;
    const double rise = drop->contact.velocity[2];
    const double middle = -input->position[0][2] - dt / 2.0 * rise;
    drop->depth = (drop->middle + middle) / 2.0;
    drop->middle = middle;
    input->velocity[0][2] = rise;
    input->position[0][2] += dt * rise;
    return force;
}

/* Until the mass leaves the ground or falls again. */
static Fall drop_run(Drop *drop) {
    double fastest = drop->speed;
    double rise = 0.0;
    Fall fall = {0};
    const int steps = (int)(LONGEST / drop->input.dt);
    for (int i = 0; i < steps; i++) {
        const double force = drop_step(drop);
        fall.peak = fmax(fall.peak, force);
        fall.deepest = fmax(fall.deepest, drop->depth);
        fastest = fmax(fastest, drop->speed);
        rise = fmax(rise, -drop->speed);
        if (rise > 0.0 && (force == 0.0 || drop->speed > 0.0)) {
            break;
        }
    }
    fall.returned = rise * rise / (fastest * fastest);
    return fall;
}

static MildStatus drop_on(const MildMaterial *material, const AthleteDevice *device,
                          const MildSole *foot, Fall *fall, MildError *error) {
    const double speed = sqrt(2.0 * ATHLETE_GRAVITY * device->fall);
    const double dt = STEP * sqrt(ATHLETE_MASS / device->spring);
    Drop drop = {.terrain = mild_terrain_uniform(material), .speed = speed};
    void *block = aligned_alloc(64, mild_ground_bytes(&foot, 1));
    drop.scratch = mild_scratch_create(&foot, 1, error);
    if (!block || !drop.scratch) {
        mild_scratch_destroy(drop.scratch);
        free(block);
        return mild_fail(error, MILD_ERROR_MEMORY, "athlete: out of memory");
    }
    drop.ground = mild_ground_init(block, &foot, 1);
    drop.inverse_inertia[14] = 1.0 / ATHLETE_MASS + 2.0 / (device->spring * dt * dt);
    drop.input.inverse_inertia = drop.inverse_inertia;
    drop.input.feet = 1;
    drop.input.dt = dt;
    drop.input.velocity[0][2] = -speed;
    for (int i = 0; i < 3; i++) {
        drop.input.rotation[0][4 * i] = 1.0;
    }
    *fall = drop_run(&drop);
    mild_scratch_destroy(drop.scratch);
    free(block);
    return MILD_OK;
}

MildStatus athlete_drop(const MildMaterial *material, Athlete *result, MildError *error) {
    MildMaterial deep = *material;
    deep.bed_depth = BOTTOMLESS;
    MildSole *foot = foot_create(error);
    if (!foot) {
        return MILD_ERROR_MEMORY;
    }
    Fall shock = {0}, deform = {0};
    MildStatus status = mild_material_check(&deep, error);
    if (status == MILD_OK) {
        status = width_check(&deep, mild_sole_width(foot), error);
    }
    if (status == MILD_OK) {
        status = drop_on(&deep, &athlete_shock, foot, &shock, error);
    }
    if (status == MILD_OK) {
        status = drop_on(&deep, &athlete_deform, foot, &deform, error);
    }
    mild_sole_destroy(foot);
    const double concrete = concrete_peak(&athlete_shock);
    *result = (Athlete){.reduction = 1.0 - shock.peak / concrete,
                        .concrete = concrete,
                        .returned = shock.returned,
                        .deformation = deform.deepest * ATHLETE_REFERENCE / deform.peak};
    return status;
}
