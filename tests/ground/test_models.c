/* The contract of the ground models: every soft model through the same tests, and each rival
 * matched to mild. */
#include "ground_kit.h"

#include "ground/law/plate.h"

#define SOFT_MODELS MILD_MODEL_RIGID
#define LOAD (20.0 * KIT_GRAVITY) /* [N] half of the paper's robot */

static MildSole *raster[2], *center[2]; /* left, right */

static int make_soles(void **state) {
    (void)state;
    MildError error = {0};
    for (int right = 0; right < 2; right++) {
        raster[right] = kit_sole(right, 77);
        center[right] = mild_sole_concentric(raster[right], &error);
        if (!center[right]) {
            return 1;
        }
    }
    return 0;
}

static int drop_soles(void **state) {
    (void)state;
    for (int right = 0; right < 2; right++) {
        mild_sole_destroy(raster[right]);
        mild_sole_destroy(center[right]);
    }
    return 0;
}

static MildSole *sole_of(int model, int right) {
    return mild_model_is_concentric((MildModel)model) ? center[right] : raster[right];
}

static MildMaterial rival_of(int model, const MildMaterial *mild) {
    MildMaterial rival;
    MildError error = {0};
    assert_int_equal(mild_model_match((MildModel)model, mild, raster[0], LOAD, &rival, &error),
                     MILD_OK);
    assert_int_equal(rival.model, model);
    return rival;
}

/* ---- matching ---- */

/* [m] by how much resistive force theory yields deeper than the element is, going straight down:
 * the elastic travel belongs to its greatest coefficient (src/ground/models/model_resist.c).
 * 7 um: 0.4 % of the force at 1.9 mm. */
#define RESIST_LEAD (ELEMENT_ELASTIC * (1.0 - 1.0 / RESIST_PEAK))

#define PRESS_SPEED 0.01 /* [m/s] */

/* Force of the level sole pushed slowly to `depth` by hand: A = 0. */
static double pressed_force(int model, const MildMaterial *material, double depth) {
    enum { STEPS = 200 };
    Kit kit;
    kit_open(&kit, 1, sole_of(model, 0), NULL, material, depth / PRESS_SPEED / STEPS);
    kit.input.velocity[0][2] = kit.input.free_velocity[2] = -PRESS_SPEED;
    double force = 0.0;
    for (int s = 0; s <= STEPS;
         s++) { /* a step's force is the mean about the depth it starts from */
        kit_solve(&kit);
        kit_advance(&kit);
        force = kit.result.foot[0].force[2];
    }
    kit_close(&kit);
    return force;
}

TEST(test_matched) {
    double worst_depth = 0.0, worst_force = 0.0;
    for (int p = 0; p < PAPER_PRESETS; p++) {
        MildMaterial mild = kit_preset(mild_material_preset_name(p));
        double depth = mild_sole_sinkage(raster[0], &mild, LOAD);
        for (int model = 0; model < SOFT_MODELS; model++) {
            MildMaterial rival = rival_of(model, &mild);
            MildError error = {0};
            expect_good(mild_material_check(&rival, &error) == MILD_OK, &error);
            double sinks = mild_sole_sinkage(sole_of(model, 0), &rival, LOAD);
            worst_depth = fmax(worst_depth, fabs(sinks - depth));
            double off = pressed_force(model, &rival, depth) / LOAD - 1.0;
            if (model == MILD_MODEL_ECC_QUASI || model == MILD_MODEL_ECC_QUASI_3D) {
                off -= RESIST_LEAD / depth;
            }
            const MildSole *sole = sole_of(model, 0);
            off -= mild_sole_elements(sole) * PRESS_SPEED / LOAD *
                   mild_element_law(&rival, mild_sole_pitch(sole), depth).damping;
            worst_force = fmax(worst_force, fabs(off));
        }
    }
    expect_below("sinkage beside mild's [m]", worst_depth, 1e-7); /* the bar is 0.1 mm */
    expect_below("force pressed to that depth, the lead aside", worst_force, 2e-3);
}

/* con_cone is Choi's ground scaled: his k = 1e6 N/m^3 times the area of the foot beside his
 * sigma_cone = 0.15e6 N/m^3, whatever it is matched to. */
TEST(test_con_cone_is_scaled) {
    const double pitch = mild_sole_pitch(raster[0]);
    const double area = mild_sole_elements(raster[0]) * pitch * pitch;
    for (int p = 0; p < PAPER_PRESETS; p++) {
        const MildMaterial mild = kit_preset(mild_material_preset_name(p));
        const MildMaterial rival = rival_of(MILD_MODEL_CON_CONE, &mild);
        assert_true(fabs(rival.k_pen / rival.sigma_cone * 0.15e6 / (1e6 * area) - 1.0) < 1e-9);
    }
}

/* A preset of mild has numbers for the other models, too: bekker's are those of dry sand, the plate
 * of resistive force theory is generic, and at 1 m/s hunt_crossley bounces back at 0.7 m/s. Drift
 * settles within a physics step of 1 ms. */
TEST(test_presets_serve_every_model) {
    const MildMaterial sand = kit_preset("dry_sand");
    for (int p = 0; p < PAPER_PRESETS; p++) {
        const MildMaterial m = kit_preset(mild_material_preset_name(p));
        assert_true(m.k_c == sand.k_c && m.k_phi == sand.k_phi && m.exponent == sand.exponent);
        assert_true(m.cohesion == sand.cohesion && m.shear_length == sand.shear_length);
        assert_true(m.zeta == 1.0 && fabs(1.0 - m.dissipation - 0.7) < 1e-12);
        assert_true(m.b_drift > 0.0 && m.b_drift < 1e-3 * m.k_drift);
    }
}

/* Materials from all of the accepted ranges: what a match returns can be used, or it fails, says
 * why and returns nothing. */
TEST(test_match_is_accepted) {
    uint64_t random = 41;
    int matched = 0, refused = 0;
    for (int draw = 0; draw < 20000; draw++) {
        MildMaterial mild = mild_material_default();
        for (int f = 0; f < mild_material_field_count; f++) {
            const MildField *field = &mild_material_fields[f];
            double *value = (double *)((char *)&mild + field->offset);
            if (field->type == MILD_FIELD_DOUBLE && kit_index(&random, 2)) {
                *value = kit_uniform(&random, field->min, field->max);
            }
        }
        const MildModel model = (MildModel)kit_index(&random, MILD_MODEL_RIGID);
        const double load = pow(10.0, kit_uniform(&random, -3.0, 7.0));
        MildMaterial rival = {.k_pen = -1.0};
        MildError error = {0};
        if (mild_model_match(model, &mild, raster[0], load, &rival, &error) == MILD_OK) {
            matched++;
            assert_int_equal(mild_material_check(&rival, &error), MILD_OK);
            continue;
        }
        refused++;
        assert_true(rival.k_pen == -1.0);
        char name[64] = "?";
        for (int f = 0; f < mild_material_field_count && !kit_named(error.text, name); f++) {
            snprintf(name, sizeof name, "ground.%s", mild_material_fields[f].name);
        }
        assert_error(&error, MILD_ERROR_RANGE, name);
    }
    assert_true(matched > 1000 && refused > 100);
}

/* A concentric model has the sole in one element: the area of all in its middle, and drift as stiff
 * and damped as that of all. */
TEST(test_concentration) {
    const int cells = mild_sole_elements(raster[0]);
    double x = 0.0, y = 0.0;
    for (int e = 0; e < cells; e++) {
        x += mild_sole_x(raster[0])[e] / cells;
        y += mild_sole_y(raster[0])[e] / cells;
    }
    assert_int_equal(mild_sole_elements(center[0]), 1);
    assert_true(fabs(pow(mild_sole_pitch(center[0]), 2) - cells * KIT_PITCH * KIT_PITCH) < 1e-15);
    assert_true(fabs(mild_sole_x(center[0])[0] - x) < 1e-15);
    assert_true(fabs(mild_sole_y(center[0])[0] - y) < 1e-15);
    assert_true(mild_sole_z(center[0]) == KIT_SOLE_Z);
    for (int model = 0; model < SOFT_MODELS; model++) {
        const MildMaterial mild = kit_preset("sand_loose"), rival = rival_of(model, &mild);
        const double all = mild_model_is_concentric((MildModel)model) ? cells : 1;
        const double share = rival.mu / mild.mu; /* 0: friction is part of resistive force theory */
        assert_true(share == 0.0 || share == 1.0);
        assert_true(rival.k_drift == share * all * mild.k_drift);
        assert_true(rival.b_drift == share * all * mild.b_drift);
    }
    const MildMaterial grass = kit_preset("grass"), cone = rival_of(MILD_MODEL_CON_CONE, &grass);
    assert_true(cone.nu == 2.0 && fabs(cone.alpha - acos(0.5)) < 1e-12); /* Choi's set */
    assert_true(cone.c_g == 2.7 && cone.c_d == 17.2 && cone.phi == 0.57 && cone.rho == 1000.0);
    const MildMaterial foam = kit_preset("foam45"); /* springs yield, on foam too */
    assert_true(foam.recovery == 1.0 && rival_of(MILD_MODEL_ECC_SPRING, &foam).recovery == 0.0 &&
                rival_of(MILD_MODEL_CON_SPRING, &foam).recovery == 0.0);
}

TEST(test_refusals) {
    MildMaterial mild = mild_material_default(), rival = mild,
                 spring = rival_of(MILD_MODEL_ECC_SPRING, &mild);
    MildError error = {0};
    assert_refused(mild_model_match(MILD_MODEL_RIGID, &mild, raster[0], LOAD, &rival, &error),
                   MILD_ERROR_ARGUMENT, &error, "model rigid");
    assert_refused(mild_model_match(MILD_MODEL_CON_CONE, &spring, raster[0], LOAD, &rival, &error),
                   MILD_ERROR_ARGUMENT, &error, "model mild mild_merged ecc_spring");
    assert_int_not_equal(
        mild_model_match(MILD_MODEL_CON_CONE, &mild, raster[0], NAN, &rival, &error), MILD_OK);
    static const int unknown[] = {-1, MILD_MODELS, 1 << 30};
    char names[32];
    for (int i = 0; i < 3; i++) {
        MildMaterial odd = mild;
        odd.model = unknown[i];
        assert_int_not_equal(
            mild_model_match(MILD_MODEL_CON_CONE, &odd, raster[0], LOAD, &rival, &error), MILD_OK);
        snprintf(names, sizeof names, "ground.model %.9g", (double)unknown[i]);
        assert_error(&error, MILD_ERROR_RANGE, names);
        assert_int_not_equal(
            mild_model_match((MildModel)unknown[i], &mild, raster[0], LOAD, &rival, &error),
            MILD_OK);
        snprintf(names, sizeof names, "model %d", unknown[i]);
        assert_error(&error, MILD_ERROR_ARGUMENT, names);
    }
    MildMaterial flat = mild; /* which mild_material_check refuses */
    flat.bed_depth = 0;
    const double sinkage = mild_sole_sinkage(raster[0], &flat, LOAD);
    assert_true(sinkage >= 0 && sinkage < 0.01);
    mild.model = MILD_MODEL_RIGID;
    assert_refused(mild_material_check(&mild, &error), MILD_ERROR_ARGUMENT, &error,
                   "ground.model rigid");
    mild.model = 17;
    assert_int_not_equal(mild_material_check(&mild, &error), MILD_OK);
}

/* ---- rest ---- */

/* A body that cannot turn, let down under strong damping until it rests. */
static void settle(Kit *kit, int model, const MildMaterial *material, double dt) {
    kit_open(kit, 1, sole_of(model, 0), NULL, material, dt);
    kit->inertia[0] = 1e12;
    for (int s = 0; s < (int)(4.0 / dt); s++) {
        kit_step(kit, NULL);
        for (int k = 0; k < 6; k++) {
            kit->input.velocity[0][k] *= exp(-150.0 * dt);
        }
    }
}

static double depth_of(const Kit *kit) {
    return -KIT_SOLE_Z - kit->input.position[0][2];
}

/* Rests where the closed form says, and neither creeps nor sinks under a load to the side and after
 * it. */
TEST(test_rest) {
    static const double steps[3] = {0.25e-3, 1e-3, 5e-3};
    const double wait = kit_seconds(10.0);
    double miss = 0.0, off = 0.0, down = 0.0, sideways = 0.0;
    for (int n = 0; n < SOFT_MODELS * PAPER_PRESETS * 3; n++) {
        const int model = n / 3 / PAPER_PRESETS;
        const char *ground = mild_material_preset_name(n / 3 % PAPER_PRESETS);
        const double dt = steps[n % 3];
        if (n % 3 < kit_finest()) {
            continue;
        }
        const MildMaterial mild = kit_preset(ground), rival = rival_of(model, &mild);
        Kit kit;
        settle(&kit, model, &rival, dt);
        miss = fmax(miss, fabs(depth_of(&kit) - mild_sole_sinkage(raster[0], &mild, LOAD)));
        off = fmax(off, fabs(kit.result.foot[0].force[2] / LOAD - 1.0));
        if (strcmp(ground, "sand_loose") == 0 || strcmp(ground, "foam28") == 0) {
            /* resistive force theory carries 0.13 (2D) and 0.05 (3D) of the weight sideways, the
             * others mu times it */
            const double side = rival.mu > 0.0 ? 0.4 * rival.mu : 0.02;
            const double force[1][3] = {{side * LOAD, 0.0, 0.0}};
            for (int s = 0; s < (int)(0.2 / dt); s++) {
                kit_step(&kit, force);
            }
            const double x = kit.input.position[0][0], z = kit.input.position[0][2];
            for (int s = 0; s < (int)(wait / dt); s++) {
                kit_step(&kit, s * dt < 0.5 * wait ? force : NULL);
            }
            down = fmax(down, fabs(kit.input.position[0][2] - z));
            sideways = fmax(sideways, fabs(kit.input.position[0][0] - x));
        }
        if (!(miss < 1e-4 && off < 1e-3 && down < 1e-4 && sideways < 1e-4)) {
            fail_msg("%s on %s, dt %g: depth off by %.2e m, force by %.1e; creeps %.2e m down, "
                     "%.2e m sideways",
                     mild_model_names[model], ground, dt, miss, off, down, sideways);
        }
        kit_close(&kit);
    }
}

/* ---- impact ---- */

/* Choi's own set on the whole sole of 77 cells. */
static MildMaterial choi(void) {
    MildMaterial m = mild_material_default();
    m.model = MILD_MODEL_CON_CONE;
    m.k_pen = 1e6 * 77.0 * KIT_PITCH * KIT_PITCH;
    m.sigma_cone = 0.15e6;
    m.alpha = acos(-1.0) / 3.0;
    m.nu = 2.0;
    m.c_g = 2.7;
    m.c_d = 17.2;
    m.phi = 0.57;
    m.rho = 1000.0;
    m.bed_depth = 1.0;
    return m;
}

/* Where a body dropped from rest first stops; the ground is met at different moments of a step. */
static double worst_stop(const MildMaterial *m, double mass, double dt) {
    const MildSole *sole = sole_of(m->model, 0);
    double worst = 0.0;
    for (int g = 0; g < (kit_short() ? 1 : 5); g++) {
        Kit kit;
        kit_open(&kit, 1, sole_of(m->model, 0), NULL, m, dt);
        kit.mass[0] = mass;
        kit.inertia[0] = 1e12;
        double height = 0.125 / KIT_GRAVITY + 0.2 * g * 0.5 * dt, deepest = 0.0;
        double exact = kit_exact_stop(m, sole, mass, sqrt(2.0 * KIT_GRAVITY * height));
        kit.input.position[0][2] += height;
        while (kit.input.velocity[0][2] <= 0.0) {
            kit_step(&kit, NULL);
            deepest = fmax(deepest, depth_of(&kit));
        }
        worst = fmax(worst, fabs(deepest / exact - 1.0));
        kit_close(&kit);
    }
    return worst;
}

TEST(test_impact) {
    static const double masses[3] = {1.0, 3.0, 20.0}, steps[3] = {0.25e-3, 1e-3, 5e-3};
    static const double allowed[3][3] = {{0.01, 0.01, 0.15},
                                         {0.005, 0.005, 0.02},
                                         {0.002, 0.002, 0.005}}; /* 1 kg stops within 5 ms */
    for (int model = 0; model < SOFT_MODELS; model++) {
        MildMaterial mild = mild_material_default(),
                     m = model == MILD_MODEL_CON_CONE ? choi() : rival_of(model, &mild);
        for (int i = 0; i < 3; i++) {
            for (int d = 0; d < 3; d++) {
                expect_below(mild_model_names[model], worst_stop(&m, masses[i], steps[d]),
                             allowed[i][d]);
            }
        }
    }
}

/* ---- energy ---- */

/* The foot is hard to turn: on one element it would tumble, and at 20 rad/s an engine's linear step
 * alone loses count of the depth (28 N on the bed). */
TEST(test_passive) {
    static const double steps[3] = {0.25e-3, 1e-3, 5e-3};
    for (int model = 0; model < SOFT_MODELS; model++) {
        uint64_t random = 11;
        Shaken all = {0};
        for (int draw = 0; draw < kit_draws(250); draw++) {
            const MildMaterial mild = kit_material(&random), rival = rival_of(model, &mild);
            Kit kit;
            kit_open(&kit, 1, sole_of(model, 0), NULL, &rival, steps[kit_index(&random, 3)]);
            kit_random_state(&kit, &random);
            kit.inertia[0] = 3.0 * kit.mass[0];
            kit.input.position[0][2] += 0.15;
            kit_shake(&kit, 0.6, &random, draw, &all);
            kit_close(&kit);
        }
        kit_shaken(mild_model_names[model], &all, kit_draws(10));
    }
}

/* ---- symmetry ---- */

/* The same state seen in a world turned by `angle` about z, mirrored in y when `mirror`. */
static void turn_state(const Kit *from, Kit *to, double angle, int mirror) {
    double c = cos(angle), s = sin(angle), m = mirror ? -1.0 : 1.0;
    const double Q[9] = {c, -s * m, 0, s, c * m, 0, 0, 0, 1}; /* turn after mirror */
    const double *R = from->input.rotation[0], *p = from->input.position[0],
                 *V = from->input.velocity[0];
    for (int i = 0; i < 3; i++) {
        to->input.position[0][i] = Q[3 * i] * p[0] + Q[3 * i + 1] * p[1] + Q[3 * i + 2] * p[2];
        to->input.velocity[0][i] = Q[3 * i] * V[0] + Q[3 * i + 1] * V[1] + Q[3 * i + 2] * V[2];
        to->input.velocity[0][3 + i] =
            m * (Q[3 * i] * V[3] + Q[3 * i + 1] * V[4] + Q[3 * i + 2] * V[5]);
        for (int j = 0; j < 3; j++) { /* Q R M: the foot's own y is mirrored too */
            double sum = Q[3 * i] * R[j] + Q[3 * i + 1] * R[3 + j] + Q[3 * i + 2] * R[6 + j];
            to->input.rotation[0][3 * i + j] = j == 1 ? m * sum : sum;
        }
    }
    to->mass[0] = from->mass[0];
    to->inertia[0] = from->inertia[0];
    memcpy(to->center[0], from->center[0], sizeof to->center[0]);
    to->center[0][1] *= m;
}

TEST(test_symmetry) {
    double worst = 0.0;
    uint64_t random = 5;
    for (int draw = 0; draw < kit_draws(400); draw++) {
        int model = draw % SOFT_MODELS, mirror = draw % 2;
        MildMaterial mild = kit_material(&random), rival = rival_of(model, &mild);
        Kit one, other, back;
        kit_open(&one, 1, sole_of(model, 0), NULL, &rival, 1e-3);
        kit_open(&other, 1, sole_of(model, mirror), NULL, &rival, 1e-3);
        kit_random_state(&one, &random);
        one.input.tolerance = other.input.tolerance = 1e-12;
        double angle = kit_uniform(&random, -3.0, 3.0);
        turn_state(&one, &other, angle, mirror);
        for (int s = 0; s < 20; s++) {
            kit_step(&one, NULL);
            kit_step(&other, NULL);
        }
        back = other; /* its inputs are replaced by the turned ones of `one` */
        turn_state(&one, &back, angle, mirror);
        double miss = 0.0, scale = 1e-3;
        for (int k = 0; k < 6; k++) {
            miss = fmax(miss, fabs(back.input.velocity[0][k] - other.input.velocity[0][k]));
            scale = fmax(scale, fabs(other.input.velocity[0][k]));
        }
        worst = fmax(worst, miss / scale);
        kit_close(&one);
        kit_close(&other);
    }
    expect_below("a turned and mirrored world after 20 steps", worst, 1e-6);
}

/* ---- beside each other ---- */

/* A material that the foot does not stand on takes other loops and must change nothing: slopes and
 * level ground, every model alone and beside all others. */
TEST(test_bystanders) {
    MildMapDef def = mild_map_def_default();
    MildError error = {0};
    def.kind = MILD_MAP_WAVES;
    def.amplitude = 0.03;
    def.wavelength = 0.5;
    MildMap *map = mild_map_create(&def, &error);
    assert_non_null(map);
    double worst = 0.0;
    for (int model = 0; model < MILD_MODEL_RIGID; model++) {
        for (int uneven = 0; uneven < 2; uneven++) {
            Kit kit[2];
            const MildMaterial sand = mild_material_default();
            const MildMaterial material = model == MILD_MODEL_MILD ? sand : rival_of(model, &sand);
            for (int beside = 0; beside < 2; beside++) {
                uint64_t random = 9;
                Kit *k = &kit[beside];
                kit_open(k, 1, sole_of(model, 0), NULL, &material, 2.5e-3);
                kit_random_state(k, &random);
                k->terrain.map = uneven ? map : NULL;
                k->input.position[0][2] += mild_terrain_height_at(&k->terrain, 0.0, 0.1);
                for (int m = 0; m < MILD_MODEL_RIGID && beside; m++) {
                    k->terrain.materials[k->terrain.material_count] =
                        m == MILD_MODEL_MILD ? sand : rival_of(m, &sand);
                    k->terrain.material_count++;
                }
                for (int s = 0; s < 60; s++) {
                    kit_step(k, NULL);
                }
            }
            for (int i = 0; i < 3; i++) {
                worst =
                    fmax(worst, fabs(kit[0].input.position[0][i] - kit[1].input.position[0][i]));
            }
            kit_close(&kit[0]);
            kit_close(&kit[1]);
        }
    }
    expect_below("materials beside the foot move it by [m]", worst, 1e-9);
    mild_map_destroy(map);
}

TEST_MAIN(make_soles, drop_soles)
