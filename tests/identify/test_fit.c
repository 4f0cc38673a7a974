/* Parameters from presses: they come back, the intervals of noisy ones are those of formulas and of
 * a search that knows nothing of the fit, and what the data leave open has no value. Every noise is
 * seeded. test_coverage.c counts how often the intervals hold the truth. */
#include <float.h>

#include "base/random.h"
#include "base/student.h"
#include "fit_kit.h"
#include "materials.h"

enum { ROWS = 1000 };
typedef enum {
    NOISE_OF_PEAK,
    NOISE_OF_ROW
} Noise; /* the same on every row, or in proportion to its force */

static FitPoint points[3 * ROWS], many[50 * ROWS];

static FitDef plate(const char *ground) {
    FitDef def = {.plate = {{.elements = 55, .pitch = 0.0195, .width = 0.1}}, .plates = 1};
    assert_true(mild_material_preset(ground, &def.material));
    def.material.bed_depth = 10;
    return def;
}

/* Holds "name name ..." at the numbers of the material. */
static void hold(FitDef *def, const char *names) {
    const MildField *fields[FIT_PARAMETERS_MAX];
    const int count = fit_parameters((MildModel)def->material.model, FIT_PRESS, fields);
    char padded[200], name[64];
    snprintf(padded, sizeof padded, " %s ", names);
    for (int i = 0; i < count; i++) {
        snprintf(name, sizeof name, " %s ", fields[i]->name);
        def->held[i] = strstr(padded, name) != NULL;
    }
}

/* A press of the true ground to `depth` at constant speed; with `brakes` it slows down from
 * `speed`, w^2 falling to a fifth on the way. */
static void press_exactly(const FitDef *truth, FitPoint *out, int rows, double depth, double speed,
                          int brakes) {
    const double fall = brakes ? 0.8 * speed * speed / depth : 0; /* of w^2 per depth */
    for (int i = 0; i < rows; i++) {
        const double u = depth * (i + 1) / rows;
        out[i] = (FitPoint){.time = NAN, .depth = u, .speed = sqrt(speed * speed - fall * u)};
        out[i].acceleration = -fall / 2;
        out[i].force = force_of(truth, &out[i]);
    }
}

/* The same at constant speed with noise of 2 %. */
static void press(const FitDef *truth, FitPoint *out, int rows, double depth, double speed,
                  Noise noise, uint64_t seed) {
    Random random = random_at(seed, (uint32_t)noise, 0);
    double peak = 0;
    press_exactly(truth, out, rows, depth, speed, 0);
    for (int i = 0; i < rows; i++) {
        peak = fmax(peak, out[i].force);
    }
    for (int i = 0; i < rows; i++) {
        out[i].force +=
            0.02 * (noise == NOISE_OF_PEAK ? peak : out[i].force) * random_normal(&random);
    }
}

static FitResult run(const FitDef *def, int count) {
    return fit_of(def, points, count);
}

static void refuse(const FitDef *def, int count, MildStatus status, const char *names) {
    FitResult result;
    MildError error = {0};
    assert_refused(fit_run(def, points, count, &result, &error), status, &error, names);
}

/* ---- values ---- */

#define SHAPE_AND_MASS "alpha nu c_g c_d phi rho"

static void is_near(FitResult *result, const char *name, double truth) {
    const FitValue *value = value_of(result, name);
    const double error = fabs(value->value / truth - 1);
    if (value->state != FIT_FITTED || !(error < 1e-4) || value->low > truth ||
        value->high < truth) {
        fail_msg("%s = %g in %g .. %g, state %d, not %g", name, value->value, value->low,
                 value->high, (int)value->state, truth);
    }
}

/* Without noise and with nothing held, the truth comes back as far as a slow press determines it:
 * the two combinations of the cone, and no value for its parts. */
TEST(exact) {
    static const char *const undetermined[] = {"sigma_cone", "alpha", "nu", "c_g",
                                               "c_d",        "phi",   "rho"};
    for (int g = 0; g < PAPER_PRESETS; g++) {
        const FitDef truth = plate(mild_material_preset_name(g));
        FitDef def = {.plate = {truth.plate[0]}, .plates = 1, .material = mild_material_default()};
        const MildMaterial *m = &truth.material;
        def.material.bed_depth = 10;
        press_exactly(&truth, points, ROWS, 0.04, 0.01, 0);
        FitResult result = run(&def, ROWS);
        is_near(&result, "k_pen", m->k_pen);
        is_near(&result, "sigma_cone/cos(alpha)", m->sigma_cone / cos(m->alpha));
        is_near(&result, "tan(alpha)/nu", tan(m->alpha) / m->nu);
        for (int i = 0; i < 7; i++) {
            const FitValue *value = value_of(&result, undetermined[i]);
            assert_int_equal(value->state, FIT_TIED);
            assert_true(isnan(value->value) && isnan(value->low) && isnan(value->high));
        }
    }
}

/* What is held turns the combinations into parameters: with alpha both parts of the cone, with phi
 * and rho the mass, of which a record that brakes determines c_d. */
TEST(held) {
    const FitDef truth = plate("sand_loose");
    const MildMaterial *m = &truth.material;
    press_exactly(&truth, points, ROWS, 0.04, 0.01, 0);
    press_exactly(&truth, points + ROWS, ROWS, 0.04, 1, 0);
    press_exactly(&truth, points + 2 * ROWS, ROWS, 0.04, 1, 1);
    FitDef def = truth;
    hold(&def, "alpha phi rho");
    FitResult two = run(&def, 2 * ROWS);
    is_near(&two, "sigma_cone", m->sigma_cone);
    is_near(&two, "nu", m->nu);
    is_near(&two, "c_g c_d phi rho nu", m->c_g * m->c_d * m->phi * m->rho * m->nu);
    assert_int_equal(value_of(&two, "c_g")->state, FIT_TIED);
    assert_int_equal(value_of(&two, "c_d")->state, FIT_TIED);
    assert_int_equal(value_of(&two, "alpha")->state, FIT_HELD);
    assert_true(value_of(&two, "alpha")->value == m->alpha);

    FitResult three = run(&def, 3 * ROWS);
    is_near(&three, "c_g", m->c_g);
    is_near(&three, "c_d", m->c_d);
    assert_int_equal(three.combinations, 0);

    hold(&def, "nu");
    FitResult shape = run(&def, 3 * ROWS);
    is_near(&shape, "alpha", m->alpha);
    is_near(&shape, "sigma_cone", m->sigma_cone);
    is_near(&shape, "c_d", m->c_d);

    /* at another value of what is held, another answer: nothing else is assumed */
    def.material.alpha = 1.2;
    hold(&def, "alpha phi rho");
    FitResult other = run(&def, 3 * ROWS);
    is_near(&other, "sigma_cone", m->sigma_cone * cos(1.2) / cos(m->alpha));
    is_near(&other, "nu", m->nu * tan(1.2) / tan(m->alpha));
    is_near(&other, "c_g", m->c_g * tan(m->alpha) / tan(1.2));
}

/* Every model in its own parameters. */
TEST(models) {
    static const struct {
        MildModel model;
        const char *names;
    } rows[] = {
        {MILD_MODEL_MILD, "k_pen sigma_cone alpha nu c_g c_d phi rho "},
        {MILD_MODEL_CON_CONE, "k_pen sigma_cone alpha nu c_g c_d phi rho "},
        {MILD_MODEL_CON_SPRING, "k_pen "},
        {MILD_MODEL_ECC_SPRING, "k_pen "},
        {MILD_MODEL_ECC_QUASI, "zeta "},
        {MILD_MODEL_ECC_QUASI_3D, "zeta "},
        {MILD_MODEL_BEKKER, "k_c k_phi exponent "},
        {MILD_MODEL_HUNT_CROSSLEY, "k_pen exponent dissipation "},
        {MILD_MODEL_MILD_MERGED, "k_pen sigma_cone alpha nu c_g c_d phi rho "},
        {MILD_MODEL_RIGID, ""},
    };
    assert_int_equal(sizeof rows / sizeof *rows, MILD_MODELS);
    for (int r = 0; r < MILD_MODELS; r++) {
        const MildField *fields[FIT_PARAMETERS_MAX];
        const int count = fit_parameters(rows[r].model, FIT_PRESS, fields);
        char names[200] = "";
        for (int i = 0; i < count; i++) {
            snprintf(names + strlen(names), sizeof names - strlen(names), "%s ", fields[i]->name);
        }
        assert_string_equal(names, rows[r].names);
        if (rows[r].model == MILD_MODEL_RIGID) {
            continue;
        }
        FitDef truth = plate("grass"), def;
        truth.material.model = (int)rows[r].model;
        truth.material.k_c = 13190; /* clay */
        truth.material.k_phi = 692150;
        truth.material.exponent = 0.7;
        truth.material.zeta = 0.4;
        truth.material.dissipation = 0.8;
        press_exactly(&truth, points, ROWS, 0.04, 0.01, 0);
        press_exactly(&truth, points + ROWS, ROWS, 0.04, 1, 0);
        def = truth;
        hold(&def, "k_c nu c_g phi rho");
        FitResult result = run(&def, 2 * ROWS);
        for (int i = 0; i < count; i++) {
            if (!def.held[i]) {
                is_near(&result, fields[i]->name, *fit_number(&truth.material, fields[i]));
            }
        }
    }
    FitDef clay = plate("clay");
    press_exactly(&clay, points, ROWS, 0.04, 0.01, 0);
    FitResult result = run(&clay, ROWS);
    is_near(&result, "exponent", 0.5);
    is_near(&result, "k_c/plate_width + k_phi", 13190 / 0.1 + 692150);
    assert_int_equal(value_of(&result, "k_phi")->state, FIT_TIED);
}

/* A record on each of two plates, one twice as long and wide as the other: the second's rows stand
 * behind the first's. Every number comes back, and of bekker k_c and k_phi each by itself, because
 * b differs. With one plate for both nothing fits. */
TEST(plates) {
    static const char *const grounds[] = {"foam45", "clay", "sandy_loam"};
    for (size_t g = 0; g < sizeof grounds / sizeof *grounds; g++) {
        FitDef truth = plate(grounds[g]);
        truth.plate[0] = (FitPlate){.elements = 40, .pitch = 0.0195, .width = 0.1};
        truth.plate[1] = (FitPlate){.elements = 160, .pitch = 0.0195, .width = 0.2};
        truth.plates = 2;
        for (int i = 0; i < 2 * ROWS; i++) {
            points[i] =
                (FitPoint){.time = NAN, .depth = 0.04 * (i % ROWS + 1) / ROWS, .speed = 0.01};
            points[i].plate = i / ROWS;
            points[i].force = force_of(&truth, &points[i]);
        }
        FitResult result = run(&truth, 2 * ROWS);
        if (truth.material.model == MILD_MODEL_BEKKER) {
            is_near(&result, "k_c", truth.material.k_c);
            is_near(&result, "k_phi", truth.material.k_phi);
            is_near(&result, "exponent", truth.material.exponent);
            assert_true(result.curve.plate_width ==
                        0); /* the sole's, because there is no single one */
        } else {
            is_near(&result, "k_pen", truth.material.k_pen);
        }
        assert_true(result.residual_share < 1e-4);
        for (int i = 0; i < 2 * ROWS; i++) {
            points[i].plate = 1;
        }
        result = run(&truth, 2 * ROWS);
        assert_true(result.residual_share > 0.1);
    }
}

/* Rows on plates of these widths by Bekker's formula, in doubles: area (k_c/b + k_phi) u^n. */
static FitDef bekker_rows(int plates, const double *width, double k_c, double k_phi, double n) {
    FitDef def = plate("clay");
    def.plates = plates;
    for (int p = 0; p < plates; p++) {
        def.plate[p] = (FitPlate){.elements = 10, .pitch = 0.02, .width = width[p]};
        for (int i = 0; i < ROWS / 4; i++) {
            const double depth = 0.002 + 0.018 * i / (ROWS / 4); /* shallower it is a line */
            points[p * ROWS / 4 + i] =
                (FitPoint){.time = NAN,
                           .depth = depth,
                           .speed = 0.01,
                           .plate = p,
                           .force = 10 * 4e-4 * (k_c / width[p] + k_phi) * pow(depth, n)};
        }
    }
    return def;
}

static int is_about(FitResult *result, const char *name, double truth) {
    return fabs(value_of(result, name)->value / truth - 1) < 2e-3;
}

/* Of any such ground, down to a modulus of 1/1000 of k_phi under the smallest of two or three
 * plates. The search passes through moduli below 0; from a law that is 0 there it finds no way
 * back. */
TEST(pressure_of_small_plates) {
    Random random = random_at(7, 0, 0);
    for (int run_index = 0; run_index < 400; run_index++) {
        const double least = 0.02 + 0.06 * random_unit(&random);
        const double width[] = {least, least * (1.2 + random_unit(&random)), 4 * least};
        const double n = 0.3 + 1.6 * random_unit(&random);
        const double k_phi = pow(10, 4.8 + 2.7 * random_unit(&random));
        const double k_c = -(1 - pow(10, -3 * random_unit(&random))) * least * k_phi;
        FitDef def = bekker_rows(run_index % 2 + 2, width, k_c, k_phi, n);
        FitResult result = run(&def, (run_index % 2 + 2) * (ROWS / 4));
        if (!is_about(&result, "k_phi", k_phi) ||
            fabs(value_of(&result, "k_c")->value - k_c) > 2e-3 * least * k_phi) {
            fail_msg("%d: k_c %g of %g, k_phi %g of %g, n %g", run_index,
                     value_of(&result, "k_c")->value, k_c, value_of(&result, "k_phi")->value, k_phi,
                     n);
        }
    }
}

/* Held, k_c = -500 moves k_phi alone; numbers of a modulus below 0 are refused, and so is a record
 * that asks for them: 1 Pa under a small plate, where the others say less. */
TEST(modulus_below_zero) {
    const double width[] = {0.05, 0.1, 0.4};
    FitDef def = bekker_rows(1, width, 0, 1e5, 0.9);
    def.material.k_c = -500;
    hold(&def, "k_c");
    FitResult result = run(&def, ROWS / 4);
    assert_true(is_about(&result, "k_phi", 1e5 + 500 / 0.05));
    hold(&def, "k_c k_phi");
    def.material.k_phi = 9900;
    refuse(&def, ROWS / 4, MILD_ERROR_RANGE, "k_c -500 k_phi 9900 0.05");
    def.material.k_phi = 10100;
    run(&def, ROWS / 4);
    def = bekker_rows(3, width, -2e4, 3e5, 0.9); /* -1e5 under the smallest */
    for (int i = 0; i < ROWS / 4; i++) {
        points[i].force = 1e-3;
    }
    refuse(&def, 3 * (ROWS / 4), MILD_ERROR_RANGE, "k_c k_phi 0.05 hold");
}

/* Cones of one sole merge: records that the ground itself wrote on two plates come back, and the
 * wider plate bears more than the same number of discs. */
TEST(merged_plates) {
    FitDef truth = plate("grass");
    MildSole *soles[2];
    truth.material.model = MILD_MODEL_MILD_MERGED;
    truth.plates = 2;
    for (int i = 0; i < 2; i++) {
        const double x = i ? 0.1 : 0.05, y = i ? 0.06 : 0.04;
        const double outline[] = {-x, -y, x, -y, x, y, -x, y};
        const MildSoleDef def = {outline, 4, 0.0195, 0, 0};
        soles[i] = mild_sole_create(&def, NULL);
        assert_non_null(soles[i]);
        truth.plate[i] = (FitPlate){.elements = mild_sole_elements(soles[i]),
                                    .pitch = mild_sole_pitch(soles[i]),
                                    .width = mild_sole_width(soles[i]),
                                    .sole = soles[i]};
    }
    for (int i = 0; i < 2 * ROWS; i++) {
        points[i] =
            (FitPoint){.time = NAN, .depth = 0.04 * (i % ROWS + 1) / ROWS, .plate = i / ROWS};
        points[i].force =
            mild_sole_law(&truth.material, soles[points[i].plate], points[i].depth).force;
    }
    FitDef def = truth;
    hold(&def, "alpha nu c_g c_d phi rho");
    FitResult result = run(&def, 2 * ROWS);
    is_near(&result, "k_pen", truth.material.k_pen);
    is_near(&result, "sigma_cone", truth.material.sigma_cone);
    assert_true(result.residual_share < 1e-6);
    def.material.model = MILD_MODEL_MILD;
    result = run(&def, 2 * ROWS);
    assert_true(result.residual_share > 0.01);
    mild_sole_destroy(soles[0]);
    mild_sole_destroy(soles[1]);
}

/* ---- intervals ---- */

/* A spring is linear: F = n k u. Its interval is that of a regression through the origin with the
 * variance HC3, b -+ t sqrt(sum (x r/(1 - h))^2)/sum x^2, h = x^2/sum x^2. */
TEST(interval_linear) {
    for (int noise = 0; noise < 2; noise++) {
        FitDef truth = plate("grass");
        double xx = 0, xy = 0, spread = 0;
        truth.material.model = MILD_MODEL_ECC_SPRING;
        press(&truth, points, 10, 0.04, 0.01, (Noise)noise, 3);
        for (int i = 0; i < 10; i++) {
            const double x = 55 * points[i].depth;
            xx += x * x;
            xy += x * points[i].force;
        }
        for (int i = 0; i < 10; i++) {
            const double x = 55 * points[i].depth, miss = points[i].force - x * xy / xx;
            const double share = x * miss / (1 - x * x / xx);
            spread += share * share;
        }
        const double half = student_95(9) * sqrt(spread) / xx;
        FitResult result = run(&truth, 10);
        const FitValue *k_pen = value_of(&result, "k_pen");
        const double low = (k_pen->value - k_pen->low) / half,
                     high = (k_pen->high - k_pen->value) / half;
        expect_near("value", k_pen->value / (xy / xx), 1, 1e-9);
        expect_near("half width below", low, 1, 5e-3);
        expect_near("half width above", high, 1, 5e-3);
    }
}

/* Of 50 000 rows the means of three are fitted, to the same end: the interval of a spring is that
 * of the formula for all rows. Two records, of which the first ends within a group. */
TEST(interval_many) {
    enum { FIRST = 20 * ROWS + 1, COUNT = 50 * ROWS };
    FitDef truth = plate("grass");
    double xx = 0, xy = 0, yy = 0;
    truth.material.model = MILD_MODEL_ECC_SPRING;
    press(&truth, many, FIRST, 0.04, 0.01, NOISE_OF_PEAK, 5);
    press(&truth, many + FIRST, COUNT - FIRST, 0.04, 0.01, NOISE_OF_PEAK, 6);
    for (int i = 0; i < COUNT; i++) {
        const double x = 55 * many[i].depth, y = many[i].force;
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    FitResult result = fit_of(&truth, many, COUNT);
    const FitValue *k_pen = value_of(&result, "k_pen");
    const double half = 1.95996 * sqrt((yy - xy * xy / xx) / COUNT / xx);
    expect_near("value", k_pen->value / (xy / xx), 1, 1e-6);
    expect_near("width", (k_pen->high - k_pen->low) / (2 * half), 1, 0.03);
    assert_true(result.points == COUNT && fabs(result.rows / COUNT - 1) < 1e-9);

    /* fifty records of a curve: no mean is of the end of one and the start of the next */
    truth = plate("grass");
    for (int record = 0; record < 50; record++) {
        press_exactly(&truth, many + record * ROWS, ROWS, 0.04, 0.01, 0);
    }
    result = fit_of(&truth, many, COUNT);
    expect_near("residual of fifty records", result.residual_share, 0, 1e-6);
}

/* Least sum of squares of a slow press for a given u_f, and the coefficients: the force is linear
 * in k_pen and kappa, F = n (k_pen P + kappa (u - P)), P = u_f (t - t^2 + t^3/3). */
static double sum_at(double u_f, int count) {
    double aa = 0, ab = 0, bb = 0, ay = 0, by = 0, yy = 0;
    for (int i = 0; i < count; i++) {
        const double u = points[i].depth, t = fmin(u / u_f, 1), y = points[i].force;
        const double a = 55 * u_f * (t - t * t + t * t * t / 3), b = 55 * u - a;
        aa += a * a;
        ab += a * b;
        bb += b * b;
        ay += a * y;
        by += b * y;
        yy += y * y;
    }
    const double determinant = aa * bb - ab * ab;
    const double k = (bb * ay - ab * by) / determinant, kappa = (aa * by - ab * ay) / determinant;
    return yy - k * ay - kappa * by;
}

/* The interval of tan(alpha)/nu = u_f/R, against a search over u_f with the rest solved exactly.
 * The noise is the same on all rows, so that the variance is S/(n - 3). Shallow enough to be far
 * from linear: the interval reaches further up than down. */
TEST(interval_profile) {
    const double R = 0.0195 / sqrt(acos(-1.0));
    FitDef truth = plate("foam60");
    double best = 0, least = INFINITY, end[2];
    hold(&truth, "c_g c_d phi rho");
    press(&truth, points, ROWS, 0.02, 0.01, NOISE_OF_PEAK, 4);
    for (double u_f = 0.005; u_f < 0.2; u_f *= 1.0005) {
        const double sum = sum_at(u_f, ROWS);
        best = sum < least ? u_f : best;
        least = fmin(sum, least);
    }
    const double t = student_95(ROWS - 3), allowed = least * (1 + t * t / (ROWS - 3));
    for (int side = 0; side < 2; side++) {
        end[side] = best;
        while (sum_at(end[side], ROWS) < allowed) {
            end[side] *= side ? 1.0005 : 1 / 1.0005;
        }
    }
    FitResult result = run(&truth, ROWS);
    const FitValue *shape = value_of(&result, "tan(alpha)/nu");
    assert_int_equal(shape->state, FIT_FITTED);
    expect_near("value", shape->value / (best / R), 1, 1e-3);
    expect_near("below", (shape->value - shape->low) / (best - end[0]) * R, 1, 0.05);
    expect_near("above", (shape->high - shape->value) / (end[1] - best) * R, 1, 0.05);
    assert_true(shape->high - shape->value > 1.05 * (shape->value - shape->low));
}

/* ---- what the data do not determine ---- */

TEST(undetermined) {
    /* a ground without added mass: the drag has a limit and no value */
    FitDef def = plate("foam45");
    press(&def, points, ROWS, 0.04, 0.01, NOISE_OF_ROW, 7);
    press(&def, points + ROWS, ROWS, 0.04, 1, NOISE_OF_ROW, 10);
    FitResult result = run(&def, 2 * ROWS);
    const FitValue *drag = value_of(&result, "c_g c_d phi rho nu");
    assert_int_equal(drag->state, FIT_LIMIT);
    assert_true(isnan(drag->value) && isnan(drag->low) && drag->high > 0 && drag->high < 500);

    /* without speeds nothing of it is said */
    for (int i = 0; i < ROWS; i++) {
        points[i].speed = 0;
    }
    result = run(&def, ROWS);
    assert_int_equal(value_of(&result, "c_g")->state, FIT_NO_EFFECT);
    assert_int_equal(value_of(&result, "rho")->state, FIT_NO_EFFECT);
    assert_int_equal(result.combinations, 2);

    /* a shallow press sees one stiffness, and does not say whose */
    int fitted = 0;
    def = plate("rubber");
    hold(&def, "c_g c_d phi rho");
    for (uint64_t seed = 1; seed <= 20; seed++) {
        press(&def, points, 50, 0.002, 0.01, NOISE_OF_PEAK, seed);
        result = run(&def, 50);
        assert_int_equal(value_of(&result, "alpha")->state, FIT_TIED);
        fitted += value_of(&result, "tan(alpha)/nu")->state == FIT_FITTED;
    }
    assert_true(fitted <= 4);
}

/* Filled are those that the data do not determine, and only those. */
TEST(filled) {
    FitDef def = plate("sand_loose");
    const MildMaterial fill = def.material;
    def.fill = &fill;
    press_exactly(&def, points, ROWS, 0.04, 0.01, 0);
    press_exactly(&def, points + ROWS, ROWS, 0.04, 1, 0);
    def.material.alpha = 0.7; /* not held, so not read */
    FitResult result = run(&def, 2 * ROWS);
    is_near(&result, "k_pen", fill.k_pen);
    is_near(&result, "sigma_cone", fill.sigma_cone);
    is_near(&result, "nu", fill.nu);
    is_near(&result, "c_g", fill.c_g);
    assert_int_equal(value_of(&result, "alpha")->state, FIT_FILLED);
    assert_true(value_of(&result, "alpha")->value == fill.alpha);
    assert_int_equal(value_of(&result, "c_d")->state, FIT_FILLED);

    def = plate("rubber"); /* shallow: all but one stiffness */
    const MildMaterial rubber = def.material;
    def.fill = &rubber;
    press(&def, points, 50, 0.002, 0.01, NOISE_OF_PEAK, 8);
    result = run(&def, 50);
    assert_int_equal(value_of(&result, "k_pen")->state, FIT_FITTED);
    assert_true(fabs(value_of(&result, "k_pen")->value / 1400 - 1) < 0.05);
    for (int i = 1; i < result.parameters; i++) {
        assert_int_equal(result.parameter[i].state, FIT_FILLED);
    }

    /* a limit that contradicts the filling stays a limit: foam is not given the mass of sand */
    def = plate("foam45");
    const MildMaterial sand = kit_preset("sand_loose");
    def.fill = &sand;
    press_exactly(&def, points, ROWS, 0.04, 0.01, 0);
    press_exactly(&def, points + ROWS, ROWS, 0.04, 1, 0);
    result = run(&def, 2 * ROWS);
    const FitValue *c_g = value_of(&result, "c_g");
    assert_int_equal(c_g->state, FIT_LIMIT);
    assert_true(isnan(c_g->value) && c_g->high < 0.01);
    is_near(&result, "k_pen", 480);
    assert_int_equal(value_of(&result, "alpha")->state, FIT_FILLED);
}

/* Noise with a correlation of 0.8 between neighbours, and a law that misses the curve: the rows
 * count for less, and the interval is wider. */
TEST(neighbours) {
    Random random = random_at(5, 0, 0);
    FitDef def = plate("grass");
    double drift = random_normal(&random);
    hold(&def, SHAPE_AND_MASS);
    press_exactly(&def, points, ROWS, 0.04, 0.01, 0);
    for (int i = 0; i < ROWS; i++) {
        drift = 0.8 * drift + 0.6 * random_normal(&random);
        points[i].force += 5 * drift;
    }
    FitResult slow = run(&def, ROWS);
    press(&def, points, ROWS, 0.04, 0.01, NOISE_OF_PEAK, 5);
    FitResult white = run(&def, ROWS);
    expect_near("correlation", slow.neighbours, 0.8, 0.06);
    expect_near("rows", slow.rows / (ROWS / 9.0), 1, 0.35);
    assert_true(white.neighbours == 0 && white.rows == ROWS);

    def.material.model = MILD_MODEL_ECC_SPRING; /* concave data */
    assert_true(run(&def, ROWS).neighbours > 0.5);
}

/* Down, up, down deeper: what counts is the way down on virgin ground; the speed comes from the
 * times. */
TEST(loading) {
    static const double depths[] = {-0.001, 0,     0.001, 0.002, 0.003, 0.002,
                                    0.001,  0.002, 0.003, 0.004, 0.005, 0.004};
    enum { COUNT = sizeof depths / sizeof *depths };
    for (int i = 0; i < COUNT; i++) {
        points[i] = (FitPoint){.time = i, .depth = depths[i], .speed = NAN};
    }
    assert_int_equal(fit_loading(points, COUNT), 6); /* 3 mm counts both times */
    assert_true(points[3].time == 8 && points[5].depth == 0.005);
    for (int i = 0; i < ROWS; i++) {
        points[i] = (FitPoint){.time = 0.01 * i, .depth = 0.002 * i, .speed = NAN};
    }
    points[3].speed = 7;
    fit_speeds(points, ROWS);
    for (int i = 0; i < ROWS; i++) {
        assert_true(fabs(points[i].speed - (i == 3 ? 7 : 0.2)) < 1e-9);
    }
    points[0].speed = points[0].time = NAN;
    fit_speeds(points, 1);
    assert_true(points[0].speed == 0);
}

/* The way turns between two rows, and the deepest row is one of the way back: its force is less
 * than that of the one before, and no virgin ground's. A record that ends there has no way back. */
TEST(the_turn_is_no_loading) {
    enum { DOWN = 20, UP = 10 };
    for (int ends = 0; ends < 2; ends++) {
        for (int i = 0; i < DOWN + UP; i++) {
            const double depth = 1e-3 * (i <= DOWN ? i + 1 : 2 * DOWN - i);
            points[i] = (FitPoint){.depth = depth, .force = i < DOWN ? 1e4 * depth : 0};
        }
        assert_true(points[DOWN].depth > points[DOWN - 1].depth);
        const int kept = fit_loading(points, ends ? DOWN + 1 : DOWN + UP);
        assert_int_equal(kept, ends ? DOWN + 1 : DOWN);
        assert_true(points[DOWN - 1].force == 1e4 * points[DOWN - 1].depth);
    }
}

/* Whatever a combination comes to, the material that carries it is one: what one number may not
 * take another takes. */
TEST(what_is_fitted_is_a_material) {
    static const double drags[] = {1, 30, 90}, slopes[] = {0.12, 3, 9};
    for (int t = 0; t < 9; t++) {
        MildError error = {0};
        FitDef def = plate("sand_dense");
        def.material.c_g = 45;
        def.material.c_d = drags[t % 3];
        def.material.nu = slopes[t / 3];
        press_exactly(&def, points, ROWS, 0.04, 0.3, 0);
        FitResult result = run(&def, ROWS);
        expect_good(mild_material_check(&result.curve, &error) == MILD_OK, &error);
        assert_true(result.residual_share < 1e-3);
        expect_near("k_pen", value_of(&result, "k_pen")->value / def.material.k_pen, 1, 0.05);
    }
}

TEST(refused) {
    const FitDef plain = plate("grass");
    FitDef def = plain;
    MildMaterial fill = plain.material;
    press(&plain, points, ROWS, 0.04, 0.01, NOISE_OF_ROW, 1);
    refuse(&plain, FIT_POINTS_MIN - 1, MILD_ERROR_ARGUMENT, "rows");
    refuse(&plain, 8, MILD_ERROR_ARGUMENT, "8 rows parameters");
    def.material.alpha = -1;
    refuse(&def, ROWS, MILD_ERROR_RANGE, "ground.alpha -1");
    def = plain;
    fill.nu = 0;
    def.fill = &fill;
    refuse(&def, ROWS, MILD_ERROR_RANGE, "ground.nu 0");
    def = plain;
    def.material.model = MILD_MODEL_RIGID;
    refuse(&def, ROWS, MILD_ERROR_ARGUMENT, "rigid");
    def = plain;
    def.plate[0].elements = 0;
    refuse(&def, ROWS, MILD_ERROR_RANGE, "plate 1 element");
    def = plain;
    def.plates = 0;
    refuse(&def, ROWS, MILD_ERROR_RANGE, "plates 0 1 16");
    def.plates = 17;
    refuse(&def, ROWS, MILD_ERROR_RANGE, "plates 17 1 16");
    points[7].plate = -1;
    refuse(&plain, ROWS, MILD_ERROR_RANGE, "row 8 plate 0 1");
    points[7].plate = 1;
    refuse(&plain, ROWS, MILD_ERROR_RANGE, "row 8 plate 2 1");
    points[7].plate = 0;
    points[5].force = NAN;
    refuse(&plain, ROWS, MILD_ERROR_RANGE, "row 6");
}

TEST_MAIN(NULL, NULL)
