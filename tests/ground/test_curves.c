/* The laws of bekker and hunt_crossley: the curve against libm and quadrature, published numbers,
 * and what the contact step makes of them. */
#include "ground_kit.h"

#include "ground/law/models.h"

TEST(test_pow) {
    uint64_t random = 3;
    double worst = 0.0;
    for (int i = 0; i < 200000; i++) {
        const double x = exp(kit_uniform(&random, -9.3, 25.0));
        const double y = kit_uniform(&random, -0.5, 0.5);
        worst = fmax(worst, fabs(real_pow(x, y) / pow(x, y) - 1.0));
        const double z = kit_uniform(&random, -200.0, 1.0);
        worst = fmax(worst, fabs(real_exp2(z) / exp2(z) - 1.0));
    }
    expect_below("x^y and 2^x against libm", worst, 1e-14);
}

/* Mean of F by Simpson's rule in many parts. */
static double quadrature(double n, double begin, double way) {
    enum { PARTS = 4000 };
    double sum = 0.0;
    for (int k = 0; k <= PARTS; k++) {
        const double weight = k == 0 || k == PARTS ? 1.0 : (k % 2 ? 4.0 : 2.0);
        sum += weight * power_force(2.0, n, begin + way * k / PARTS);
    }
    return sum / (3.0 * PARTS);
}

TEST(test_way) {
    uint64_t random = 5;
    double worst[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i < 3000; i++) {
        const double n = kit_uniform(&random, 0.1, 2.0);
        const double begin = exp(kit_uniform(&random, log(1e-5), log(0.1)));
        const double end = kit_index(&random, 2) ? exp(kit_uniform(&random, log(1e-5), log(0.1)))
                                                 : begin * kit_uniform(&random, 0.8, 1.2);
        const double way = end - begin;
        const double step = 1e-5 * end;
        const PowerWay over = power_way(2.0, n, begin, way);
        const double rise =
            power_way(2.0, n, begin, way + step).mean - power_way(2.0, n, begin, way - step).mean;
        const double slope =
            (power_force(2.0, n, end + step) - power_force(2.0, n, end - step)) / (2.0 * step);
        worst[0] = fmax(worst[0], fabs(over.mean / quadrature(n, begin, way) - 1.0));
        worst[1] = fmax(worst[1], fabs(over.slope / (rise / (2.0 * step)) - 1.0));
        worst[2] = fmax(worst[2], fabs(power_slope(2.0, n, end) / slope - 1.0));
    }
    expect_below("mean over a way against quadrature", worst[0], 1e-8);
    expect_below("its slope against differences", worst[1], 1e-5);
    expect_below("the curve's slope against differences", worst[2], 1e-7);
    /* the series and the closed form meet */
    double apart = 0.0;
    for (int i = 0; i < 3000; i++) {
        const double n = kit_uniform(&random, 0.1, 2.0);
        double low = 0.01, high = 0.02;
        for (int k = 0; k < 200; k++) { /* where rho is POWER_SERIES, from 10 mm on */
            const double u = (low + high) / 2;
            const double q0 = 1.0 + POWER_ROUND, q1 = u * u * 1e4 + POWER_ROUND;
            *((q1 - q0) / (q1 + q0) < POWER_SERIES ? &low : &high) = u;
        }
        const double a = power_way(2.0, n, 0.01, low - 0.01 - 1e-12).mean;
        const double b = power_way(2.0, n, 0.01, low - 0.01 + 1e-12).mean;
        apart = fmax(apart, fabs(b / a - 1.0));
    }
    expect_below("series against closed form where they meet", apart, 1e-9);
}

/* ---- bekker ---- */

/* Pressure [kPa] of one element at a depth. */
static double pressure(const MildMaterial *m, double depth) {
    return 1e-3 * mild_element_law(m, KIT_PITCH, depth).force / (KIT_PITCH * KIT_PITCH);
}

/* Wong 2008, table 2.3, and the Lunar Sourcebook: friction angle and cohesion, and (k_c/b + k_phi)
 * z^n with a calculator, b = 0.1 m. Friction is held by shear alone, over a bed that is out of
 * reach. */
TEST(test_published) {
    static const struct {
        const char *name;
        double angle, cohesion; /* [degrees], [N/m^2] */
        double depth, pressure; /* [m], [kPa] */
    } table[] = {
        {"dry_sand", 28.0, 1040.0, 0.01, 9.7061},   /* (9.9 + 1528.43) 0.01^1.1 */
        {"dry_sand", 28.0, 1040.0, 0.05, 57.007},   /* 1538.33 x 0.05 x 0.74113 */
        {"sandy_loam", 29.0, 1720.0, 0.02, 101.39}, /* (52.7 + 1515.04) x 0.0646745 */
        {"clay", 13.0, 4140.0, 0.01, 82.405},       /* (131.9 + 692.15) x 0.1 */
        {"snow", 19.7, 1030.0, 0.1, 6.0389},        /* (43.7 + 196.72) x 0.0251189 */
        {"lunar_soil", 35.0, 170.0, 0.02, 16.68},   /* (14 + 820) x 0.02 */
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        MildMaterial m;
        MildError error = {0};
        assert_true(mild_material_preset(table[i].name, &m));
        expect_good(mild_material_check(&m, &error) == MILD_OK, &error);
        assert_int_equal(m.model, MILD_MODEL_BEKKER);
        expect_near("angle", atan(m.mu) * 180.0 / acos(-1.0), table[i].angle, 1e-9);
        assert_true(m.cohesion == table[i].cohesion);
        assert_true(m.k_drift == 0.0 && m.b_drift == 0.0 && m.bed_depth >= 1.0);
        assert_true(m.shear_length >= 0.005 && m.shear_length <= 0.05);
        assert_true(m.plate_width == 0); /* that of the sole */
        m.plate_width = 0.1;
        expect_near(table[i].name, pressure(&m, table[i].depth), table[i].pressure,
                    2e-4 * table[i].pressure);
    }
}

/* Bekker's b is the shorter side of the sole, whichever way it lies, and of the one element in its
 * place, unless the material names another. */
TEST(test_width) {
    static const double sides[][2] = {{0.3, 0.2}, {0.2, 0.3}, {0.15, 0.1}, {0.1, 0.1}};
    MildError error = {0};
    MildMaterial clay = kit_preset("clay");
    for (size_t i = 0; i < sizeof sides / sizeof *sides; i++) {
        const double b = fmin(sides[i][0], sides[i][1]), load = 3000.0;
        MildSole *sole = kit_rectangle(sides[i][0], sides[i][1], KIT_PITCH, 0);
        MildSole *one = mild_sole_concentric(sole, &error);
        assert_true(fabs(mild_sole_width(sole) - b) < 1e-12);
        assert_true(mild_sole_width(one) == mild_sole_width(sole));
        const double area = mild_sole_elements(sole) * KIT_PITCH * KIT_PITCH;
        const double z = pow(load / (area * (clay.k_c / b + clay.k_phi)), 1.0 / clay.exponent);
        const double got = mild_sole_sinkage(sole, &clay, load);
        expect_near("sinkage", got, z, 1e-3 * z);
        MildMaterial given = clay;
        given.plate_width = 0.1;
        const double own = mild_sole_sinkage(sole, &given, load);
        assert_true(b == 0.1 ? fabs(own - got) < 1e-9 : own < 0.98 * got);
        mild_sole_destroy(one);
        mild_sole_destroy(sole);
    }
    clay.plate_width = 0.004;
    assert_refused(mild_material_check(&clay, &error), MILD_ERROR_RANGE, &error,
                   "ground.plate_width 0.004 0.005 0");
    clay.plate_width = 0.005;
    assert_int_equal(mild_material_check(&clay, &error), MILD_OK);
}

/* k_c below 0: pressure that grows with the plate, by hand (400 000 - 10 000/b) z; under a plate of
 * 25 mm and less it is 0, never less, and where the material names such a plate it is refused. */
TEST(pressure_grows_with_the_plate) {
    static const struct {
        double length, width, pressure; /* [m], [m], [Pa] at 10 mm */
    } table[] = {{0.2, 0.2, 3500}, {0.2, 0.1, 3000}, {0.1, 0.05, 2000}, {0.1, 0.02, 0}};
    MildError error = {0};
    MildMaterial m = kit_preset("dry_sand");
    m.exponent = 1.0;
    m.k_c = -10e3;
    m.k_phi = 400e3;
    assert_int_equal(mild_material_check(&m, &error), MILD_OK);
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        MildSole *sole = kit_rectangle(table[i].length, table[i].width, KIT_PITCH, 0);
        const double area = mild_sole_elements(sole) * KIT_PITCH * KIT_PITCH;
        const MildElementLaw law = mild_sole_law(&m, sole, 0.01);
        expect_near("pressure", law.force / area, table[i].pressure, 1e-3 * table[i].pressure);
        assert_true(law.force >= 0.0 && law.stiffness >= 0.0);
        mild_sole_destroy(sole);
    }
    m.plate_width = 0.0251;
    assert_int_equal(mild_material_check(&m, &error), MILD_OK);
    m.plate_width = 0.0249;
    assert_refused(mild_material_check(&m, &error), MILD_ERROR_RANGE, &error,
                   "ground.plate_width 0.0249 0.025 -k_c/k_phi 0");
    m.k_phi = 0.0;
    assert_int_equal(mild_material_check(&m, &error), MILD_ERROR_RANGE);
    m.plate_width = 0.0;
    m.k_phi = 400e3;
    m.k_c = -2e10;
    assert_int_equal(mild_material_check(&m, &error), MILD_ERROR_RANGE);
    m.k_c = NAN;
    assert_int_equal(mild_material_check(&m, &error), MILD_ERROR_RANGE);
}

/* A level plate 20 mm deep, dragged along x at a constant speed: friction by load against
 * (c A + mu N)(1 - exp(-j/K)). */
TEST(test_shear) {
    static const char *const names[3] = {"dry_sand", "snow", "lunar_soil"};
    const double speed = 0.05, dt = 1e-3;
    MildSole *plate = kit_plate(4, 3);
    const double area = 12.0 * KIT_PITCH * KIT_PITCH;
    double worst = 0.0;
    for (int g = 0; g < 3; g++) {
        MildMaterial m = kit_preset(names[g]);
        Kit kit;
        kit_open(&kit, 1, plate, NULL, &m, dt);
        kit.input.velocity[0][2] = kit.input.free_velocity[2] = -0.02;
        for (int s = 0; s < 1000; s++) {
            kit_solve(&kit);
            kit_advance(&kit);
        }
        kit.input.velocity[0][2] = kit.input.free_velocity[2] = 0.0;
        kit.input.velocity[0][0] = kit.input.free_velocity[0] = speed;
        for (int s = 0; s < 1500; s++) {
            kit_solve(&kit);
            const MildFootResult *foot = &kit.result.foot[0];
            const double slid = s * speed * dt;
            const double full = m.cohesion * area + m.mu * foot->force[2];
            const double wanted = full * (1.0 - exp(-slid / m.shear_length));
            worst = fmax(worst, fabs(-foot->force[0] - wanted) / full);
            kit_advance(&kit);
        }
        const MildFootResult *foot = &kit.result.foot[0];
        assert_true(foot->force[2] > 2.0 && -foot->force[0] > 1.0);
        kit_close(&kit);
    }
    mild_sole_destroy(plate);
    expect_below("shear strength against the closed form", worst, 2e-3);
}

/* ---- hunt_crossley ---- */

/* e of w dw/du = -(F/m)(1 + a w), a = 3/2 d: G(w) = w/a - ln(1 + a w)/a^2 is the same before and
 * after, whatever force and mass. */
static double restitution(double d, double speed) {
    const double a = 1.5 * d;
    const double wanted = speed / a - log(1.0 + a * speed) / (a * a);
    double low = 0.0, high = speed;
    for (int k = 0; k < 100; k++) {
        const double w = (low + high) / 2;
        const double got = -w / a - log(1.0 - a * w) / (a * a);
        *(a * w >= 1.0 || got > wanted ? &high : &low) = w;
    }
    return low / speed;
}

TEST(test_restitution) {
    static const double speeds[3] = {0.02, 0.1, 0.5};
    MildSole *plate = kit_plate(4, 3);
    MildMaterial m = mild_material_default();
    m.model = MILD_MODEL_HUNT_CROSSLEY;
    double worst = 0.0, first = 0.0;
    for (int i = 0; i < 27; i++) {
        m.exponent = 0.5 + 0.5 * (i % 3);
        m.dissipation = 0.1 + 0.5 * (i / 3 % 3);
        const double speed = speeds[i / 9];
        Kit kit;
        kit_open(&kit, 1, plate, NULL, &m, 2e-5);
        kit.inertia[0] = 1e12;
        kit.input.velocity[0][2] = -speed;
        kit.input.position[0][2] += 1e-6;
        const double float_up[1][3] = {{0.0, 0.0, kit.mass[0] * KIT_GRAVITY}};
        int touched = 0;
        for (int s = 0; s < 100000 && !(touched && kit.result.foot[0].force[2] == 0.0); s++) {
            kit_step(&kit, float_up);
            touched |= kit.result.foot[0].force[2] > 0.0;
        }
        assert_true(touched);
        const double e = kit.input.velocity[0][2] / speed;
        worst = fmax(worst, fabs(e - restitution(m.dissipation, speed)));
        if (speed < 0.05) {
            first = fmax(first, fabs(e - (1.0 - m.dissipation * speed)));
        }
        kit_close(&kit);
    }
    mild_sole_destroy(plate);
    expect_below("restitution against the closed form", worst, 2e-3);
    expect_below("at 20 mm/s against 1 - d v", first, 2e-3);
}

/* The table of ground models: every row is whole, and a model reads the fields that its row names,
 * those and no others. */

#define SOFT_MODELS MILD_MODEL_RIGID

static const MildField *field_of(const char *key) {
    return mild_field_find(mild_material_fields, mild_material_field_count, key, NULL);
}

/* Bool: the key is in a row's list. */
static int listed(const char *const *keys, int most, const char *key) {
    for (int k = 0; k < most && keys[k]; k++) {
        if (strcmp(keys[k], key) == 0) {
            return 1;
        }
    }
    return 0;
}

TEST(test_rows) {
    for (int m = 0; m < MILD_MODELS; m++) {
        const MildModelInfo *info = mild_model_info((MildModel)m);
        MildModel found = MILD_MODEL_RIGID;
        assert_true(mild_model_find(mild_model_names[m], &found) && (int)found == m);
        assert_true(info->summary && *info->summary && info->source && *info->source);
        assert_int_equal(info->concentric, mild_model_is_concentric((MildModel)m));
        for (int k = 0; k < MILD_MODEL_FIELDS && info->fields[k]; k++) {
            if (!field_of(info->fields[k])) {
                fail_msg("%s: no field is called %s", mild_model_names[m], info->fields[k]);
            }
        }
        for (int k = 0; k < MILD_MODEL_SCALED && info->scaled[k]; k++) {
            assert_true(listed(info->fields, MILD_MODEL_FIELDS, info->scaled[k]));
            assert_int_equal(field_of(info->scaled[k])->type, MILD_FIELD_DOUBLE);
        }
        for (int k = 0; k < MILD_MODEL_PRESETS && info->presets[k]; k++) {
            MildMaterial material;
            MildError error = {0};
            assert_true(mild_material_preset(info->presets[k], &material));
            assert_int_equal(material.model, m);
            assert_int_equal(mild_material_check(&material, &error), MILD_OK);
        }
        assert_true(m == MILD_MODEL_RIGID || info->fields[0]);
        /* what depends on the motion says how: the batch has no other way to know */
        const ModelRow *row = model_row(m);
        assert_int_equal(row->motion != 0, row->direction != NULL);
        assert_int_equal(row->motion & LAW_ALL, 0);
        assert_true(m == MILD_MODEL_MILD || m == MILD_MODEL_RIGID || info->scaled[0]);
    }
    assert_false(mild_model_find("ecc_sprin", &(MildModel){0}));
}

/* Sum of the wrench's numbers, each with a weight of its own, over a foot led by hand: down to 16
 * mm and sideways, up, down again to where the bed is, out, and into its imprint. */
static double led(const MildMaterial *m, const MildSole *plate, const MildSole *one) {
    const MildSole *sole = mild_model_is_concentric((MildModel)m->model) ? one : plate;
    enum { STEPS = 40, WAYS = 5, TILES = 8 };
    static const double depths[WAYS + 1] = {-0.002, 0.016, 0.013, 0.019, -0.005, 0.016};
    Kit kit;
    double sum = 0.0;
    kit_open(&kit, 1, (MildSole *)(uintptr_t)sole, NULL, m, 1e-3);
    free(kit.ground);
    kit.bytes = mild_ground_bytes_imprints(kit.soles, 1, TILES);
    kit.ground = mild_ground_init_imprints(aligned_alloc(64, (kit.bytes + 63) / 64 * 64), kit.soles,
                                           1, TILES);
    kit.input.position[0][2] -= depths[0];
    for (int s = 0; s < WAYS * STEPS; s++) {
        const double down = (depths[s / STEPS + 1] - depths[s / STEPS]) / (STEPS * kit.input.dt);
        kit.input.free_velocity[0] = 0.03;
        kit.input.free_velocity[2] = -down;
        kit_solve(&kit);
        kit_advance(&kit);
        const MildFootResult *foot = &kit.result.foot[0];
        for (int k = 0; k < 3; k++) {
            sum += (1.0 + k + 0.01 * s) * foot->force[k] + (5.0 + k) * foot->torque[k];
        }
    }
    kit_close(&kit);
    return sum;
}

/* Another number of the field, within its range. */
static void change(MildMaterial *m, const MildField *field) {
    void *at = (char *)m + field->offset;
    if (field->type == MILD_FIELD_BOOL) {
        m->passive = !m->passive;
        return;
    }
    double value;
    memcpy(&value, at, sizeof value);
    value = value == 0 ? 0.5 * field->max : 1.1 * value <= field->max ? 1.1 * value : 0.9 * value;
    memcpy(at, &value, sizeof value);
}

TEST(test_fields) {
    MildError error = {0};
    MildSole *plate = kit_plate(4, 3);
    MildSole *one = mild_sole_concentric(plate, &error);
    for (int model = 0; model < SOFT_MODELS; model++) {
        const MildModelInfo *info = mild_model_info((MildModel)model);
        for (int f = 0; f < mild_material_field_count; f++) {
            const MildField *field = &mild_material_fields[f];
            if (field->type == MILD_FIELD_NAME) {
                continue; /* the model itself */
            }
            MildMaterial base = mild_material_default(), other;
            base.model = model;
            base.recovery = 0.3;
            base.bed_depth = 0.017;
            const int regains = strcmp(field->name, "regain_length") == 0;
            if (regains || strcmp(field->name, "grip") == 0 ||
                strcmp(field->name, "slip_growth") == 0) { /* of ground that slip weakens */
                base.slip_length = 0.002;
                base.recovery = 0.0;
                base.regain_length = 0.05;
                base.grip = 0.1;
            }
            if (field->type == MILD_FIELD_BOOL) {
                base.c_d = 0.3; /* the clamp acts */
            }
            other = base;
            change(&other, field);
            const double a = led(&base, plate, one), b = led(&other, plate, one);
            const int reads = fabs(a - b) > 1e-9 * fabs(a);
            if (reads != listed(info->fields, MILD_MODEL_FIELDS, field->name)) {
                fail_msg("%s %s %s, its row says otherwise", mild_model_names[model],
                         reads ? "reads" : "does not read", field->name);
            }
        }
    }
    mild_sole_destroy(one);
    mild_sole_destroy(plate);
}

TEST_MAIN(NULL, NULL)
