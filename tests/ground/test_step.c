/* One foot on the ground over time: published impact depths, no creep, memory. */
#include "ground_kit.h"

static MildMaterial choi(void) {
    MildMaterial m = mild_material_default();
    m.k_pen = 1e6 * KIT_PITCH * KIT_PITCH;
    m.sigma_cone = 0.15e6;
    m.alpha = acos(-1.0) / 3.0;
    m.nu = 2.0;
    m.c_g = 2.7;
    m.c_d = 17.2;
    m.phi = 0.57;
    m.rho = 1000.0;
    return m;
}

/* dK/du = (M g - F_g - 2 c_d m_a' K)/(M + m_a), K = w^2/2, from K = g h at the surface to K = 0:
 * depth of the first stop [m]. A plate of 77 elements. */
static double exact_slope(const MildMaterial *m, double mass, double u, double K) {
    MildElementLaw law = mild_element_law(m, KIT_PITCH, u);
    return (mass * KIT_GRAVITY - 77.0 * law.force -
            2.0 * m->c_d * 77.0 * law.added_mass_per_depth * K) /
           (mass + 77.0 * law.added_mass);
}

static double exact_stop(const MildMaterial *m, double mass, double height) {
    double u = 0.0, K = KIT_GRAVITY * height, step = 4e-6;
    for (;;) {
        double a = exact_slope(m, mass, u, K),
               b = exact_slope(m, mass, u + 0.5 * step, K + 0.5 * step * a), next = K + step * b;
        if (next <= 0.0) {
            return u + step * K / (K - next);
        }
        K = next;
        u += step;
    }
}

static double stop_depth(const MildMaterial *m, double mass, double dt, double height) {
    MildSole *sole = kit_plate(11, 7);
    Kit kit;
    kit_open(&kit, 1, sole, NULL, m, dt);
    kit.mass[0] = mass;
    kit.inertia[0] = 0.05 * mass;
    kit.input.position[0][2] += height;
    double deepest = 0.0;
    for (int s = 0; s < (int)(0.5 / dt) && kit.input.velocity[0][2] <= 0.0; s++) {
        kit_step(&kit, NULL);
        deepest = fmax(deepest, mild_ground_depth_max(kit.ground, 0)[0]);
    }
    kit_close(&kit);
    mild_sole_destroy(sole);
    return deepest;
}

/* Choi 2023 set, dropped from rest from 12.74 mm (0.5 m/s): 1.221 / 3.384 / 38.98 mm. A light foot
 * stops within a step of 5 ms. */
TEST(test_exact_impact) {
    static const double mass[3] = {1.0, 3.0, 20.0}, published[3] = {1.221e-3, 3.384e-3, 38.98e-3},
                        dt[4] = {0.25e-3, 1e-3, 2.5e-3, 5e-3};
    static const double allowed[4][3] = {
        {0.005, 0.002, 0.002}, {0.01, 0.005, 0.002}, {0.03, 0.01, 0.002}, {0.08, 0.02, 0.002}};
    MildMaterial m = choi();
    double fall = 0.125 / KIT_GRAVITY;
    for (int i = 0; i < 3; i++) {
        assert_true(fabs(exact_stop(&m, mass[i], fall) / published[i] - 1.0) < 5e-4);
    }
    for (int d = 0; d < 4; d++) {
        for (int i = 0; i < 3; i++) {
            double worst = 0.0;
            for (int g = 0; g < 5; g++) { /* the ground is met at different moments of a step */
                double height = fall + 0.2 * g * 0.5 * dt[d];
                double error =
                    stop_depth(&m, mass[i], dt[d], height) / exact_stop(&m, mass[i], height) - 1.0;
                if (fabs(error) > fabs(worst)) {
                    worst = error;
                }
            }
            print_message("impact %4.0f kg at %.2f ms: stops within %+.2f %% of the exact depth\n",
                          mass[i], 1e3 * dt[d], 100.0 * worst);
            assert_true(fabs(worst) < allowed[d][i]);
        }
    }
}

/* Deepest print of a plate dropped from rest, a level body that falls and springs up for 0.3 s more
 * [m]. */
static double drop_depth(MildSole *sole, const MildMaterial *m, double mass, double dt,
                         double height) {
    Kit kit;
    kit_open(&kit, 1, sole, NULL, m, dt);
    kit.mass[0] = mass;
    kit.inertia[0] = 1e12;
    kit.input.position[0][2] += height;
    double deepest = 0.0;
    for (double t = 0.0; t < sqrt(2.0 * height / KIT_GRAVITY) + 0.3; t += dt) {
        kit_step(&kit, NULL);
        deepest = fmax(deepest, mild_ground_depth_max(kit.ground, 0)[0]);
    }
    kit_close(&kit);
    return deepest;
}

/* Drops at 5 ms against the exact impact: every mass, speed, ground, and moment of a step at which
 * the ground is met. Half a step's way at 1 m/s is 2.5 mm, and an engine has gone it before the
 * ground can answer; 1 kg stops on dense sand after 1.5. */
TEST(test_drops) {
    enum { MASSES = 8, SPEEDS = 5, PHASES = 8, GROUNDS = 5 };
    static const char *const grounds[GROUNDS] = {"sand_loose", "sand_dense", "grass", "foam45",
                                                 "rubber"};
    static const double mass[MASSES] = {1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 40.0},
                        speed[SPEEDS] = {0.2, 0.3, 0.5, 0.7, 1.0};
    static const double allowed[MASSES] = {0.22, 0.17, 0.06, 0.018, 0.015, 0.01, 0.005, 0.005},
                        dt = 5e-3;
    MildSole *sole = kit_plate(11, 7);
    for (int i = 0; i < MASSES; i++) {
        double low = 0.0, high = 0.0, slow = 0.0;
        for (int g = 0; g < GROUNDS; g++) {
            for (int s = 0; s < SPEEDS; s++) {
                for (int p = 0; p < PHASES; p++) {
                    MildMaterial m = kit_preset(grounds[g]);
                    double height =
                        0.5 * speed[s] * speed[s] / KIT_GRAVITY + speed[s] * dt * p / PHASES;
                    double error = drop_depth(sole, &m, mass[i], dt, height) /
                                       exact_stop(&m, mass[i], height) -
                                   1.0;
                    low = fmin(low, error);
                    high = fmax(high, error);
                    if (s < 2) {
                        slow = fmax(slow, fabs(error));
                    }
                }
            }
        }
        print_message("drop of %4g kg at 5 ms: prints within %+.2f and %+.2f %% of the exact "
                      "depth; up to 0.3 m/s %.2f %%\n",
                      mass[i], 100.0 * low, 100.0 * high, 100.0 * slow);
        assert_true(fmax(-low, high) < allowed[i]);
    }
    mild_sole_destroy(sole);
}

/* An element led by hand (A = 0) into some state: its impulse must never fall with the speed of
 * descent. */
TEST(test_rises) {
    enum { DRAWS = 3000, SPEEDS = 400 };
    static const double steps[3] = {0.25e-3, 1e-3, 5e-3};
    MildSole *sole = kit_plate(1, 1);
    uint64_t random = 29;
    double worst = 0.0;
    for (int draw = 0; draw < kit_draws(DRAWS); draw++) {
        MildMaterial m = kit_material(&random);
        Kit kit;
        kit_open(&kit, 1, sole, NULL, &m, steps[draw % 3]);
        double fast = kit_uniform(&random, 0.0, 1.0) < 0.3 ? 0.02 : 1.5;
        for (int s = kit_index(&random, 6); s >= 0; s--) { /* down, mostly */
            kit.input.free_velocity[2] = -kit_uniform(&random, -0.3, 1.0) * fast;
            kit_solve(&kit);
            kit_advance(&kit);
        }
        kit.input.position[0][2] -=
            kit_uniform(&random, 0.0, 1.0) < 0.3 ? kit_uniform(&random, 0.0, 0.01) : 0.0;
        double last = 0.0, most = 0.0, drop = 0.0;
        for (int k = 0; k < SPEEDS; k++) {
            kit.input.free_velocity[2] = fast * (1.2 - 3.0 * k / SPEEDS);
            kit_solve(&kit);
            double impulse = kit.result.foot[0].force[2] * kit.input.dt;
            drop = fmax(drop, last - impulse);
            most = fmax(most, impulse);
            last = impulse;
        }
        if (most > 0.0) {
            worst = fmax(worst, drop / most);
        }
        kit_close(&kit);
    }
    print_message(
        "impulse over the speed of descent: falls by at most %.1e of its greatest value\n", worst);
    mild_sole_destroy(sole);
    assert_true(worst < 1e-9);
}

TEST(test_no_creep) {
    static const double steps[3] = {0.25e-3, 1e-3, 5e-3};
    MildSole *sole = kit_sole(0, 77);
    const double wait = kit_seconds(10.0);
    double worst_down = 0.0, worst_side = 0.0;
    for (int p = 0; p < mild_material_preset_count(); p++) {
        for (int d = kit_finest(); d < 3; d++) {
            for (int side = 0; side < 2; side++) {
                MildMaterial m = kit_preset(mild_material_preset_name(p));
                Kit kit;
                kit_open(&kit, 1, sole, NULL, &m, steps[d]);
                kit.center[0][0] = 0.0622;
                kit.center[0][1] = 0.0035;
                kit.center[0][2] =
                    KIT_SOLE_Z - 0.005; /* a low weight: a lateral load tilts it little */
                double start[3],
                    force[1][3] = {{side ? 0.4 * m.mu * 20.0 * KIT_GRAVITY : 0.0, 0.0, 0.0}};
                int settle = (int)(2.0 / steps[d]), run = (int)(wait / steps[d]);
                for (int s = 0; s < settle; s++) { /* brought to rest by hand: foam and rubber have
                                                      no damping of their own */
                    kit_step(&kit, (const double(*)[3])force);
                    for (int k = 0; k < 6; k++) {
                        kit.input.velocity[0][k] *= exp(-30.0 * steps[d]);
                    }
                }
                memcpy(start, kit.input.position[0], sizeof start);
                for (int s = 0; s < run; s++) {
                    kit_step(&kit, (const double(*)[3])force);
                }
                double down = fabs(kit.input.position[0][2] - start[2]);
                double sideways =
                    hypot(kit.input.position[0][0] - start[0], kit.input.position[0][1] - start[1]);
                if (down > 1e-4 || sideways > 1e-4) {
                    print_message("%s dt %g load %d: %.4f mm down, %.4f mm sideways\n",
                                  mild_material_preset_name(p), steps[d], side, 1e3 * down,
                                  1e3 * sideways);
                }
                worst_down = fmax(worst_down, down);
                worst_side = fmax(worst_side, sideways);
                kit_close(&kit);
            }
        }
    }
    print_message("creep in %g s: worst %.5f mm down, %.5f mm sideways\n", wait, 1e3 * worst_down,
                  1e3 * worst_side);
    mild_sole_destroy(sole);
    assert_true(worst_down < 1e-4 && worst_side < 1e-4);
}

TEST(test_memory) {
    MildMaterial sand = mild_material_default(), foam;
    mild_material_preset("foam28", &foam);
    MildSole *sole = kit_plate(3, 3);
    double rise[2];
    for (int i = 0; i < 2;
         i++) { /* pressed by hand at constant speed: A = 0 makes the foot immovable */
        Kit kit;
        kit_open(&kit, 1, sole, NULL, i ? &foam : &sand, 1e-3);
        double down = 0.0, up = 0.0;
        for (int s = 0; s < 410; s++) {
            double speed = s < 200 ? -0.1 : 0.1;
            kit.input.velocity[0][2] = kit.input.free_velocity[2] = speed;
            kit_solve(&kit);
            kit_advance(&kit);
            if (s < 200) {
                down = kit.result.foot[0].force[2];
            } else if (kit.result.foot[0].force[2] > 0.0) {
                up = 1e-4 * (s - 199);
            }
        }
        print_message("%s: %.2f N at 20 mm, pushes back over %.2f mm\n",
                      i ? "foam28" : "sand_loose", down, 1e3 * up);
        rise[i] = up;
        for (int e = 0; e < 9; e++) {
            assert_true(mild_ground_depth_max(kit.ground, 0)[e] == 0.0);
        }
        kit_close(&kit);
    }
    assert_true(rise[0] < 3e-4);
    assert_true(rise[1] > 0.0195);
    mild_sole_destroy(sole);
}

/* A foot that slides from one material onto another keeps the law it touched down on. */
TEST(test_border) {
    MildMaterial foam, rubber;
    mild_material_preset("foam28", &foam);
    mild_material_preset("rubber", &rubber);
    MildSole *sole = kit_plate(1, 1);
    MildError error;
    Kit kit;
    kit_open(&kit, 1, sole, NULL, &foam, 1e-3);
    kit.terrain.materials[1] = rubber;
    kit.terrain.material_count = 2;
    assert_int_equal(mild_terrain_add_patch(&kit.terrain,
                                            &(MildPatch){0.05, INFINITY, -INFINITY, INFINITY, 1},
                                            &error),
                     MILD_OK);
    double last = 0.0, jump = 0.0;
    for (int s = 0; s < 200; s++) {
        kit.input.velocity[0][2] = kit.input.free_velocity[2] = s < 100 ? -0.1 : 0.0;
        kit.input.velocity[0][0] = kit.input.free_velocity[0] = s < 100 ? 0.0 : 1.0;
        kit_solve(&kit);
        kit_advance(&kit);
        if (s > 101) {
            jump = fmax(jump, fabs(kit.result.foot[0].force[2] - last));
        }
        last = kit.result.foot[0].force[2];
    }
    print_message("sliding from foam onto rubber: the force jumps by %.2e N\n", jump);
    assert_true(jump < 1e-9);
    kit.input.position[0][2] = 0.1;
    kit.input.velocity[0][2] = kit.input.free_velocity[2] = 0.0;
    kit_solve(&kit);
    kit_advance(&kit);
    kit.input.position[0][2] = -KIT_SOLE_Z;
    kit.input.velocity[0][2] = kit.input.free_velocity[2] = -0.1;
    for (int s = 0; s < 100; s++) {
        kit_solve(&kit);
        kit_advance(&kit);
    }
    double expected = mild_element_law(&rubber, KIT_PITCH, 0.01).force;
    print_message("lifted and set down again: %.2f N, rubber's law %.2f N\n",
                  kit.result.foot[0].force[2], expected);
    assert_true(fabs(kit.result.foot[0].force[2] / expected - 1.0) < 0.02);
    kit_close(&kit);
    mild_sole_destroy(sole);
}

TEST_MAIN(NULL, NULL)
