/* Eccentric load: force and moment of a tilted plate, contact step against the integral of each law
 * in closed form; and what a concentric model makes of the same plate. */
#include "ground_kit.h"

#define SOFT_MODELS MILD_MODEL_RIGID
#define LENGTH 11 /* elements along x, across the tilt axis */
#define WIDTH 7

/* f(u) = flat (u_f/3)(1 - c^3) + cone u + power u^n, c = max(1 - u/u_f, 0): force of one cell,
 * without inertia; and its first two integrals from 0, needed for a moment because x = (u -
 * d)/sin(tilt). */
typedef struct {
    double flat, cone, full, power, n;
} Cell;

static double force_of(const Cell *l, double u) {
    double c = fmax(1.0 - u / l->full, 0.0);
    return u <= 0.0 ? 0.0
                    : l->flat * l->full / 3.0 * (1.0 - c * c * c) + l->cone * u +
                          l->power * pow(u, l->n);
}

static double first_integral(const Cell *l, double u) {
    double c = fmax(1.0 - u / l->full, 0.0);
    if (u <= 0.0) {
        return 0.0;
    }
    return l->flat * l->full / 3.0 * (u + l->full / 4.0 * (pow(c, 4) - 1.0)) +
           l->cone * u * u / 2.0 + l->power * pow(u, l->n + 1.0) / (l->n + 1.0);
}

static double second_integral(const Cell *l, double u) {
    double c = fmax(1.0 - u / l->full, 0.0), f = l->full;
    if (u <= 0.0) {
        return 0.0;
    }
    return l->flat * f / 3.0 * (u * u / 2.0 - f * u / 4.0 + f * f / 20.0 * (1.0 - pow(c, 5))) +
           l->cone * u * u * u / 6.0 +
           l->power * pow(u, l->n + 2.0) / ((l->n + 1.0) * (l->n + 2.0));
}

static Cell cell_of(const MildMaterial *m, double tilt, double area) {
    double kappa = m->sigma_cone * area / cos(m->alpha), alpha[3] = {0.0, 1.0, 1.0};
    const double normal[3] = {-sin(tilt), 0.0, -cos(tilt)}, down[3] = {0.0, 0.0, -1.0};
    if (m->model == MILD_MODEL_MILD || m->model == MILD_MODEL_CON_CONE) {
        return (Cell){m->k_pen - kappa, kappa,
                      sqrt(area / 3.14159265358979) * tan(m->alpha) / m->nu, 0.0, 1.0};
    }
    if (m->model == MILD_MODEL_ECC_QUASI) {
        mild_resist_plane(tilt, 1.5707963267948966, alpha);
    }
    if (m->model == MILD_MODEL_ECC_QUASI_3D) {
        mild_resist_space(normal, down, alpha);
    }
    if (m->model == MILD_MODEL_ECC_QUASI) {
        return (Cell){0.0, alpha[1] * m->zeta * 1e6 * area, 1.0, 0.0, 1.0};
    }
    if (m->model == MILD_MODEL_ECC_QUASI_3D) {
        return (Cell){0.0, alpha[2] * m->zeta * 1e6 * area, 1.0, 0.0, 1.0};
    }
    if (m->model == MILD_MODEL_BEKKER) {
        return (Cell){0.0, 0.0, 1.0, (m->k_c / fmin(LENGTH, WIDTH) + m->k_phi) * area, m->exponent};
    }
    if (m->model == MILD_MODEL_HUNT_CROSSLEY) {
        return (Cell){0.0, 0.0, 1.0, m->k_pen * pow(0.01, 1.0 - m->exponent), m->exponent};
    }
    return (Cell){0.0, m->k_pen, 1.0, 0.0, 1.0};
}

/* Force and moment about the axis through the plate's middle, front edge down by `tilt`. */
static void closed_form(const MildMaterial *m, double depth, double tilt, double *force,
                        double *moment) {
    double cells = LENGTH * WIDTH, area = KIT_PITCH * KIT_PITCH, half = 0.5 * LENGTH * KIT_PITCH,
           s = sin(tilt);
    if (mild_model_is_concentric((MildModel)m->model)) {
        Cell one = cell_of(m, tilt, cells * area);
        *force = force_of(&one, depth);
        *moment = 0.0;
        return;
    }
    Cell l = cell_of(m, tilt, area);
    double a = depth - half * s, b = depth + half * s,
           rows = WIDTH / KIT_PITCH; /* cells per length along x */
    double whole = first_integral(&l, b) - first_integral(&l, a);
    double turned = half * (first_integral(&l, b) + first_integral(&l, a)) -
                    (second_integral(&l, b) - second_integral(&l, a)) / s;
    *force = rows * whole / s;
    *moment = rows * turned / s * cos(tilt); /* lever: level */
}

/* The same pressed by hand at 1 mm/s, the force at the depth wanted: mean of the step before and
 * the step after. */
static void pressed(const MildMaterial *m, const MildSole *sole, double depth, double tilt,
                    double *force, double *moment) {
    const double speed = 1e-3, dt = 0.05;
    Kit kit;
    kit_open(&kit, 1, (MildSole *)(uintptr_t)sole, NULL, m, dt);
    const double turn[3] = {0.0, tilt, 0.0};
    kit_rotate(kit.input.rotation[0], turn);
    const double *R = kit.input.rotation[0];
    double p[3] = {R[2] * KIT_SOLE_Z, 0.0, R[8] * KIT_SOLE_Z}, start = -0.05;
    int steps = (int)lround((depth - start) / (speed * dt));
    double f[2] = {0.0, 0.0}, t[2] = {0.0, 0.0};
    kit.input.velocity[0][2] = kit.input.free_velocity[2] = -speed;
    for (int s = 0; s <= steps; s++) {
        kit.input.position[0][2] = -p[2] - (start + s * speed * dt);
        kit_solve(&kit);
        mild_ground_advance(kit.ground, &kit.terrain, &kit.input, kit.scratch, &kit.result);
        const MildFootResult *foot = &kit.result.foot[0];
        f[s % 2] = foot->force[2];
        t[s % 2] = foot->torque[1] - (p[2] * foot->force[0] - p[0] * foot->force[2]);
    }
    *force = 0.5 * (f[0] + f[1]);
    *moment =
        -0.5 *
        (t[0] + t[1]); /* front edge down is a positive turn about y: the ground turns it back */
    kit_close(&kit);
}

TEST(test_tilted_plate) {
    static const char *const grounds[3] = {"sand_loose", "foam45", "rubber"};
    MildSole *plate = kit_plate(LENGTH, WIDTH);
    MildError error = {0};
    MildSole *one = mild_sole_concentric(plate, &error);
    double worst = 0.0;
    for (int model = 0; model < SOFT_MODELS; model++) {
        if (model == MILD_MODEL_MILD_MERGED) {
            continue; /* test_tilt in test_merged.c: the place of an element matters */
        }
        double worst_force = 0.0, worst_moment = 0.0, largest = 0.0;
        for (int g = 0; g < 3; g++) {
            for (int d = 0; d < 4; d++) {
                MildMaterial mild, m;
                assert_true(mild_material_preset(grounds[g], &mild));
                assert_int_equal(mild_model_match((MildModel)model, &mild, plate,
                                                  20.0 * KIT_GRAVITY, &m, &error),
                                 MILD_OK);
                const MildSole *sole = mild_model_is_concentric((MildModel)model) ? one : plate;
                double depth = 0.01 + 0.01 * (d % 2), tilt = d < 2 ? 0.0873 : 0.2618, f, t, force,
                       moment; /* 5, 15 degrees */
                closed_form(&m, depth, tilt, &f, &t);
                pressed(&m, sole, depth, tilt, &force, &moment);
                worst_force = fmax(worst_force, fabs(force / f - 1.0));
                worst_moment = fmax(worst_moment, fabs(moment - t) / (f * LENGTH * KIT_PITCH));
                largest = fmax(largest, fabs(moment) / (f * LENGTH * KIT_PITCH));
            }
        }
        print_message(
            "%-12s force within %.2e, moment within %.2e of F L; largest moment %.3f F L\n",
            mild_model_names[model], worst_force, worst_moment, largest);
        worst = fmax(worst, fmax(worst_force, worst_moment));
        if (mild_model_is_concentric((MildModel)model)) {
            assert_true(largest < 1e-12);
        } else {
            assert_true(largest > 0.05);
        }
    }
    mild_sole_destroy(one);
    mild_sole_destroy(plate);
    assert_true(worst <
                0.02); /* the raster: 11 cells along the tilt, some of them cut by the surface */
}

TEST_MAIN(NULL, NULL)
