/* One foot on the ground over time: published impact depths, no creep, memory, and the same at 5 ms
 * as at 0.25 ms. */
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

/* [m] Where a plate of 77 elements first stops: as one of them with its share of the mass. */
static double exact_stop(const MildMaterial *m, double mass, double height) {
    MildSole *element = kit_plate(1, 1);
    const double stop = kit_exact_stop(m, element, mass / 77.0, sqrt(2.0 * KIT_GRAVITY * height));
    mild_sole_destroy(element);
    return stop;
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

/* Choi 2023 set, dropped from rest from 12.74 mm (0.5 m/s): 1.221 / 3.384 / 38.98 mm. A light foot
 * stops within a step of 5 ms. */
TEST(test_exact_impact) {
    static const double mass[3] = {1.0, 3.0, 20.0}, published[3] = {1.221e-3, 3.384e-3, 38.98e-3},
                        dt[4] = {0.25e-3, 1e-3, 2.5e-3, 5e-3};
    static const double allowed[4][3] = {
        {0.005, 0.002, 0.002}, {0.01, 0.005, 0.002}, {0.03, 0.01, 0.002}, {0.08, 0.02, 0.002}};
    MildMaterial m = choi();
    MildSole *sole = kit_plate(11, 7);
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
                    drop_depth(sole, &m, mass[i], dt[d], height) / exact_stop(&m, mass[i], height) -
                    1.0;
                worst = fmax(worst, fabs(error));
            }
            char name[64];
            snprintf(name, sizeof name, "impact of %g kg at %g ms", mass[i], 1e3 * dt[d]);
            expect_below(name, worst, allowed[d][i]);
        }
    }
    mild_sole_destroy(sole);
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
        double worst = 0.0;
        for (int g = 0; g < GROUNDS; g++) {
            for (int s = 0; s < SPEEDS; s++) {
                for (int p = 0; p < PHASES; p++) {
                    MildMaterial m = kit_preset(grounds[g]);
                    double height =
                        0.5 * speed[s] * speed[s] / KIT_GRAVITY + speed[s] * dt * p / PHASES;
                    double error = drop_depth(sole, &m, mass[i], dt, height) /
                                       exact_stop(&m, mass[i], height) -
                                   1.0;
                    worst = fmax(worst, fabs(error));
                }
            }
        }
        char name[64];
        snprintf(name, sizeof name, "print of a drop of %g kg at 5 ms", mass[i]);
        expect_below(name, worst, allowed[i]);
    }
    mild_sole_destroy(sole);
}

/* Whole feet on ground with imprints, or with a load to the side. */
TEST(test_no_creep) {
    static const double steps[3] = {0.25e-3, 1e-3, 5e-3};
    MildSole *sole = kit_sole(0, 77);
    const double wait = kit_seconds(10.0);
    double worst = 0.0;
    for (int n = 0; n < mild_material_preset_count() * 6; n++) {
        const int d = n / 2 % 3, side = n % 2;
        const double dt = steps[d];
        if (d < kit_finest()) {
            continue;
        }
        const MildMaterial m = kit_preset(mild_material_preset_name(n / 6));
        const double force[1][3] = {{side ? 0.4 * m.mu * 20.0 * KIT_GRAVITY : 0.0, 0.0, 0.0}};
        Kit kit;
        kit_open(&kit, 1, sole, NULL, &m, dt);
        kit_prints(&kit, side ? 0 : 128);
        kit.center[0][0] = 0.0622;
        kit.center[0][1] = 0.0035;
        kit.center[0][2] = KIT_SOLE_Z - 0.005;      /* low: a load to the side tilts it little */
        for (int s = 0; s < (int)(2.0 / dt); s++) { /* foam and rubber have no damping */
            kit_step(&kit, force);
            for (int k = 0; k < 6; k++) {
                kit.input.velocity[0][k] *= exp(-30.0 * dt);
            }
        }
        double start[3];
        memcpy(start, kit.input.position[0], sizeof start);
        for (int s = 0; s < (int)(wait / dt); s++) {
            kit_step(&kit, force);
        }
        for (int k = 0; k < 3; k++) {
            worst = fmax(worst, fabs(kit.input.position[0][k] - start[k]));
        }
        if (!(worst < 1e-4)) {
            fail_msg("%s, dt %g, load %d: %.2e m", mild_material_preset_name(n / 6), dt, side,
                     worst);
        }
        kit_close(&kit);
    }
    expect_below("creep [m]", worst, 1e-4);
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
    expect_below("jump of the force from foam onto rubber [N]", jump, 1e-9);
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
    expect_near("set down again", kit.result.foot[0].force[2], expected, 0.02 * expected);
    kit_close(&kit);
    mild_sole_destroy(sole);
}

/* ---- the same experiment at 5 ms and at 0.25 ms ---- */

typedef enum { PRESS, DRAG, STAND, EXPERIMENTS } Experiment;
static const char *const experiments[EXPERIMENTS] = {"press", "drag", "stand"};
static const double settles[EXPERIMENTS] = {1.0, 4.0, 0.0}; /* [s] a foot bounces 3 s on foam */
static const double lasts[EXPERIMENTS] = {0.6, 1.5, 2.0};   /* [s] after that */

enum { SINKAGE, DRIFT, IMPULSE, OUTCOMES };

/* A foot of 16.5 kg under a low weight over the middle of its sole: [m], [m], [N s]. */
static void experiment(Experiment e, MildSole *sole, const MildMaterial *m, double dt,
                       double out[OUTCOMES]) {
    const int count = mild_sole_elements(sole);
    const int settle = (int)(settles[e] / dt + 0.5);
    double from[2] = {0, 0};
    Kit kit;
    kit_open(&kit, 1, sole, NULL, m, dt);
    for (int i = 0; i < count; i++) {
        kit.center[0][0] += mild_sole_x(sole)[i] / count;
        kit.center[0][1] += mild_sole_y(sole)[i] / count;
    }
    kit.center[0][2] = KIT_SOLE_Z + 0.02;
    kit.mass[0] = 16.5;
    kit.inertia[0] = 0.02 * kit.mass[0];
    const double weight = kit.mass[0] * KIT_GRAVITY;
    memset(out, 0, OUTCOMES * sizeof *out);
    for (int s = 0; s < (int)((settles[e] + lasts[e]) / dt + 0.5); s++) {
        const double t = (s - settle + 0.5) * dt;
        double force[1][3] = {{0}};
        if (s == settle) {
            memcpy(from, kit.input.position[0], sizeof from);
        }
        if (s >= settle) {
            force[0][2] = e == PRESS ? -2.0 * weight * fmin(t / 0.3, 1.0) : 0.0;
            force[0][0] = e == DRAG && t < 0.4 ? 1.2 * m->mu * weight
                          : e == STAND         ? 0.4 * m->mu * weight
                                               : 0.0;
        }
        kit_step(&kit, (const double(*)[3])force);
        const double *F = kit.result.foot[0].force;
        out[IMPULSE] += s < settle ? 0.0 : dt * hypot(F[2], hypot(F[0], F[1]));
        for (int i = 0; i < count && s >= settle; i++) {
            out[SINKAGE] = fmax(out[SINKAGE], mild_ground_depth_max(kit.ground, 0)[i]);
        }
    }
    out[DRIFT] = hypot(kit.input.position[0][0] - from[0], kit.input.position[0][1] - from[1]);
    kit_close(&kit);
}

/* An engine moves by the new velocity, which belongs to the middle of the step before: experiments
 * start from rest, where that is no difference. */
TEST(test_load) {
    static const char *const grounds[5] = {"sand_loose", "sand_dense", "grass", "foam45", "foam28"};
    static const double least[OUTCOMES] = {1e-3, 5e-3, 0.1}; /* counts at the least */
    MildSole *sole = kit_sole(0, 77);
    for (int n = 0; n < 5 * EXPERIMENTS; n++) {
        const Experiment e = (Experiment)(n % EXPERIMENTS);
        const MildMaterial m = kit_preset(grounds[n / EXPERIMENTS]);
        double fine[OUTCOMES], coarse[OUTCOMES], worst = 0.0;
        char name[64];
        experiment(e, sole, &m, 0.25e-3, fine);
        experiment(e, sole, &m, 5e-3, coarse);
        for (int k = 0; k < OUTCOMES; k++) {
            worst = fmax(worst, fabs(coarse[k] - fine[k]) / fmax(fine[k], least[k]));
        }
        snprintf(name, sizeof name, "%s on %s", experiments[e], grounds[n / EXPERIMENTS]);
        expect_below(name, worst, 0.02);
    }
    mild_sole_destroy(sole);
}

/* ---- what a step reports of a foot: where the wrench acts, in world axes, with every sign ---- */

/* A single element at (x, y) of the sole, the foot turned, tilted and shifted: all force acts at
 * that element's centre, wherever the ankle is. */
static MildSole *element_at(double x, double y) {
    double h = 0.5 * KIT_PITCH,
           outline[8] = {x - h, y - h, x + h, y - h, x + h, y + h, x - h, y + h};
    return kit_sole_of(outline, 4, KIT_PITCH, 1);
}

static double gap(const double *ours, const double *expected, int count) {
    double worst = 0.0;
    for (int k = 0; k < count; k++) {
        worst = fmax(worst, fabs(ours[k] - expected[k]));
    }
    return worst;
}

TEST(test_one_element_carries_all) {
    static const double place[4][2] = {{0.08, 0.03}, {-0.05, 0.04}, {0.07, -0.05}, {-0.06, -0.02}};
    static const double turn[3][3] = {{0, 0, 0}, {0, 0, 2.0}, {0.1, -0.15, 0.7}};
    MildMaterial sand = mild_material_default();
    double worst = 0.0, least = 1.0;
    for (int p = 0; p < 4; p++) {
        MildSole *sole = element_at(place[p][0], place[p][1]);
        for (int t = 0; t < 3; t++) {
            Kit kit;
            kit_open(&kit, 1, sole, NULL, &sand, 1e-3);
            kit_rotate(kit.input.rotation[0], turn[t]);
            const double *R = kit.input.rotation[0],
                         local[3] = {mild_sole_x(sole)[0], mild_sole_y(sole)[0], KIT_SOLE_Z};
            double *at = kit.input.position[0], arm[3];
            for (int k = 0; k < 3; k++) {
                arm[k] = R[3 * k] * local[0] + R[3 * k + 1] * local[1] + R[3 * k + 2] * local[2];
            }
            at[0] = 1.5, at[1] = -0.7, at[2] = -arm[2] + 1e-6;
            /* down into the ground and aside, so that there is friction; the foot is immovable */
            kit.input.velocity[0][0] = kit.input.free_velocity[0] = 0.3;
            kit.input.velocity[0][1] = kit.input.free_velocity[1] = -0.2;
            kit.input.velocity[0][2] = kit.input.free_velocity[2] = -5.0;
            kit_solve(&kit);
            const MildFootResult *r = &kit.result.foot[0];
            const double *F = r->force;
            assert_true(F[2] > 1.0 && F[0] < -0.05 * F[2] && F[1] > 0.05 * F[2]);
            double torque[3], axis[3], square = F[0] * F[0] + F[1] * F[1] + F[2] * F[2],
                                       along = (arm[0] * F[0] + arm[1] * F[1] + arm[2] * F[2]);
            kit_cross(arm, F, torque);
            worst = fmax(worst, gap(r->torque, torque, 3) / F[2]);
            worst = fmax(worst, gap(r->zmp_sole, arm, 2)); /* the centre is on the sole's plane */
            for (int k = 0; k < 3; k++) { /* the line through the element, where nearest */
                axis[k] = arm[k] - along / square * F[k];
            }
            worst = fmax(worst, gap(r->zmp_axis, axis, 3));
            const double center[3] = {at[0] + arm[0], at[1] + arm[1], at[2] + arm[2]};
            worst = fmax(worst, gap(r->pressure_center, center, 3));
            least = fmin(least, fmin(fabs(arm[0]), fabs(arm[1])));
            assert_int_equal(r->contacts, 1);
            assert_true(fabs(r->area - KIT_PITCH * KIT_PITCH) < 1e-12);
            kit_close(&kit);
        }
        mild_sole_destroy(sole);
    }
    expect_below("zero moment points, pressure centre, torque of one element", worst, 1e-9);
    assert_true(least > 1e-3);
}

/* Many elements, tilted so that some are loaded: about zmp_sole, which lies in the height of the
 * sole's centre, the wrench has no horizontal torque; about zmp_axis only one along the force. */
TEST(test_zmp_takes_the_horizontal_torque) {
    uint64_t random = 31;
    MildSole *sole = kit_sole(0, 77);
    double worst = 0.0, center[3] = {0.0, 0.0, KIT_SOLE_Z};
    int loaded = 0;
    for (int e = 0; e < 77; e++) {
        center[0] += mild_sole_x(sole)[e] / 77;
        center[1] += mild_sole_y(sole)[e] / 77;
    }
    for (int draw = 0; draw < 200; draw++) {
        MildMaterial m = kit_material(&random);
        Kit kit;
        kit_open(&kit, 1, sole, NULL, &m, 1e-3);
        double turn[3] = {kit_uniform(&random, -0.2, 0.2), kit_uniform(&random, -0.2, 0.2),
                          kit_uniform(&random, -3.0, 3.0)};
        kit_rotate(kit.input.rotation[0], turn);
        kit.input.position[0][2] += kit_uniform(&random, -0.02, 0.0);
        for (int k = 0; k < 3; k++) {
            kit.input.velocity[0][k] = kit.input.free_velocity[k] = kit_uniform(&random, -0.5, 0.0);
        }
        kit_solve(&kit);
        const MildFootResult *r = &kit.result.foot[0];
        const double *R = kit.input.rotation[0], *F = r->force;
        if (F[2] > 1.0) {
            double height = R[6] * center[0] + R[7] * center[1] + R[8] * center[2], moment[3],
                   point[3] = {r->zmp_sole[0], r->zmp_sole[1], height};
            kit_cross(point, F, moment);
            worst = fmax(worst, gap(r->torque, moment, 2) / F[2]);
            kit_cross(r->zmp_axis, F, moment);
            double twist[3], left[3] = {r->torque[0] - moment[0], r->torque[1] - moment[1],
                                        r->torque[2] - moment[2]};
            kit_cross(left, F, twist);
            const double zero[3] = {0};
            worst = fmax(worst, gap(twist, zero, 3) / (F[2] * F[2]));
            loaded++;
        }
        kit_close(&kit);
    }
    expect_below("torque that is left, by the force [m]", worst, 1e-9);
    assert_true(loaded > 100);
    mild_sole_destroy(sole);
}

/* Depths, area and count are those of the loaded elements. */
TEST(test_depths_of_the_loaded_elements) {
    MildSole *sole = kit_plate(4, 1);
    MildMaterial sand = mild_material_default();
    Kit kit;
    kit_open(&kit, 1, sole, NULL, &sand, 1e-3);
    double turn[3] = {0, asin(0.5), 0}; /* pitched by 30 degrees: a column is 9.75 mm deeper */
    kit_rotate(kit.input.rotation[0], turn);
    const double *R = kit.input.rotation[0];
    double step = 0.5 * KIT_PITCH, speed = 0.01;
    /* the second element from below is 4 mm deep, the third 5.75 mm above the ground */
    kit.input.position[0][2] = -R[8] * KIT_SOLE_Z + 0.5 * step - 0.004;
    kit.input.velocity[0][2] = kit.input.free_velocity[2] = -speed;
    kit_solve(&kit);
    const MildFootResult *r = &kit.result.foot[0];
    assert_int_equal(r->contacts, 2);
    assert_true(fabs(r->area - 2 * KIT_PITCH * KIT_PITCH) < 1e-12);
    double move = speed * 1e-3; /* depths of the step's start or end */
    assert_true(fabs(r->depth_max - (0.004 + step)) <= move + 1e-12);
    assert_true(fabs(r->depth_mean - (0.004 + 0.5 * step)) <= move + 1e-12);
    kit.input.position[0][2] += 1.0; /* in the air all is zero */
    kit_solve(&kit);
    static const MildFootResult zero;
    assert_memory_equal(r, &zero, sizeof zero);
    kit_close(&kit);
    mild_sole_destroy(sole);
}

/* Forces whose square is 0 or infinite, and torques beside next to no force, have a finite axis. */
TEST(test_axis_is_finite) {
    MildSole *sole = kit_sole(0, 77);
    uint64_t random = 3;
    int loaded = 0;
    for (int draw = 0; draw < 3000; draw++) {
        MildMaterial m = kit_material(&random);
        Kit kit;
        kit_open(&kit, 1, sole, NULL, &m, 1e-3);
        kit.input.position[0][2] -= pow(10.0, kit_uniform(&random, -320.0, -2.0));
        double *V = kit.input.free_velocity; /* led by hand */
        for (int k = 0; k < 6; k++) {
            V[k] = kit_uniform(&random, -1.0, 1.0) * pow(10.0, kit_uniform(&random, -320.0, 200.0));
        }
        kit_solve(&kit);
        const MildFootResult *r = &kit.result.foot[0];
        double sum = 0.0 * (r->zmp_sole[0] + r->zmp_sole[1]);
        for (int k = 0; k < 3; k++) {
            sum += 0.0 * r->zmp_axis[k] + 0.0 * r->pressure_center[k] + 0.0 * r->force[k];
        }
        assert_true(!kit.result.converged || sum == 0.0);
        loaded += kit.result.converged && r->contacts > 0;
        kit_close(&kit);
    }
    mild_sole_destroy(sole);
    assert_true(loaded > 300);
}

TEST_MAIN(NULL, NULL)
