/* How often a 95 % interval holds the truth: noisy presses of every preset of every model, with
 * everything fitted that they determine. Usage: identify_test_coverage [DRAWS [GROUND]]; 200 draws
 * take 90 s and have a standard deviation of 1.5 %. Prints a table: for each kind of noise the
 * share of intervals that hold the truth and, in brackets, that are bounded on both sides. */
#include "base/random.h"
#include "fit_kit.h"

enum { ROWS = 300, RECORDS = 3, NOISES = 3 };
typedef enum { NOISE_PEAK, NOISE_ROW, NOISE_SLOW } Noise;

static int draws = 6;
static const char *only;                  /* NULL: all grounds */
static int tried[NOISES], inside[NOISES]; /* of all cases */
static FitPoint points[RECORDS * ROWS];

/* What is pressed: one record at 10 mm/s; or three, at 10 mm/s, at 0.5 m/s, and braking. */
typedef struct {
    const char *name;
    MildMaterial material;
    int records;
    int number; /* of its noise */
} Case;

/* The draws whose interval of one quantity holds the truth. */
typedef struct {
    const char *name;
    int inside[NOISES], fitted[NOISES];
} Count;

/* The speed of a row, and the acceleration of the record that brakes from 1 m/s, which would stop
 * at 50 mm: w^2 = 1 - u/(50 mm). */
static FitPoint row_at(int record, double depth) {
    static const double speeds[] = {0.01, 0.5};
    FitPoint row = {.time = NAN, .depth = depth};
    row.speed = record == 2 ? sqrt(1 - depth / 0.05) : speeds[record];
    row.acceleration = record == 2 ? -0.5 / 0.05 : 0;
    return row;
}

/* 2 %: of the largest force on every row, of each row's own force, or of the largest force with a
 * correlation of 0.8 between neighbours. */
static void noise_add(FitPoint *rows, Noise noise, Random *random) {
    double peak = 0, drift = random_normal(random);
    for (int i = 0; i < ROWS; i++) {
        peak = fmax(peak, rows[i].force);
    }
    for (int i = 0; i < ROWS; i++) {
        const double normal = random_normal(random);
        drift = 0.8 * drift + 0.6 * normal;
        rows[i].force += 0.02 * (noise == NOISE_ROW ? rows[i].force : peak) *
                         (noise == NOISE_SLOW ? drift : normal);
    }
}

static FitResult press_and_fit(const Case *c, Noise noise, int draw) {
    FitDef def = {.plate = {{.elements = 55, .pitch = 0.0195, .width = 0.1}},
                  .plates = 1,
                  .material = c->material};
    Random random = random_at((uint64_t)(1000 + draw), (uint32_t)noise, (uint32_t)c->number);
    if (mild_model_is_concentric((MildModel)c->material.model)) {
        def.plate[0] = (FitPlate){.elements = 1, .pitch = sqrt(55) * 0.0195, .width = 0.1};
    }
    for (int r = 0; r < c->records; r++) {
        for (int i = 0; i < ROWS; i++) {
            FitPoint *row = &points[r * ROWS + i];
            *row = row_at(r, 0.04 * (i + 1) / ROWS);
            row->force = force_of(&def, row);
        }
        noise_add(points + r * ROWS, noise, &random);
    }
    return fit_of(&def, points, c->records * ROWS);
}

/* Combinations by their names. */
static double truth_of(const Case *c, const FitValue *value) {
    const MildMaterial *m = &c->material;
    const double width = 0.1; /* [m] of the plate of press_and_fit */
    const struct {
        const char *name;
        double truth;
    } combinations[] = {
        {"tan(alpha)/nu", tan(m->alpha) / m->nu},
        {"sigma_cone/cos(alpha)", m->sigma_cone / cos(m->alpha)},
        {"c_g c_d phi rho nu", m->c_g * m->c_d * m->phi * m->rho * m->nu},
        {"k_c/plate_width + k_phi", m->k_c / width + m->k_phi},
    };
    if (value->field) {
        MildMaterial material = *m;
        return *fit_number(&material, value->field);
    }
    for (size_t i = 0; i < sizeof combinations / sizeof *combinations; i++) {
        if (strcmp(combinations[i].name, value->name) == 0) {
            return combinations[i].truth;
        }
    }
    return NAN;
}

static void count_value(const Case *c, const FitValue *value, Noise noise, Count *counts) {
    const double truth = truth_of(c, value);
    Count *count = counts;
    if (value->state == FIT_TIED || value->state == FIT_NO_EFFECT) {
        return;
    }
    while (count->name && strcmp(count->name, value->name) != 0) {
        count++;
    }
    count->name = value->name;
    count->inside[noise] += !(truth < value->low) && !(truth > value->high);
    count->fitted[noise] += value->state == FIT_FITTED;
}

/* The share that 95 % may fall to by chance, three and a half standard deviations; 0 for so few
 * draws that only the mean over all cases says something. */
static double least_share(void) {
    return draws < 100 ? 0 : 0.95 - 3.5 * sqrt(0.95 * 0.05 / draws);
}

static void count_report(const Case *c, const Count *count) {
    printf("%-13s %d  %-23s", c->name, c->records, count->name);
    for (int noise = 0; noise < NOISES; noise++) {
        const double share = (double)count->inside[noise] / draws;
        printf(" %6.1f (%5.1f)", 100 * share, 100.0 * count->fitted[noise] / draws);
        tried[noise] += draws;
        inside[noise] += count->inside[noise];
        if (noise != NOISE_SLOW) {
            assert_true(share >= least_share());
        }
    }
    printf("\n");
}

static void cover(Case *c) {
    static int number;
    Count counts[FIT_PARAMETERS_MAX + FIT_COMBINATIONS_MAX + 1] = {0};
    c->number = number++;
    if (only && strcmp(only, c->name) != 0) {
        return;
    }
    for (int noise = 0; noise < NOISES; noise++) {
        for (int draw = 0; draw < draws; draw++) {
            const FitResult result = press_and_fit(c, (Noise)noise, draw);
            for (int i = 0; i < result.parameters; i++) {
                count_value(c, &result.parameter[i], (Noise)noise, counts);
            }
            for (int i = 0; i < result.combinations; i++) {
                count_value(c, &result.combination[i], (Noise)noise, counts);
            }
        }
    }
    for (const Count *count = counts; count->name; count++) {
        count_report(c, count);
    }
}

static void cover_preset(const char *name, int records) {
    Case c = {.name = name, .records = records};
    assert_true(mild_material_preset(name, &c.material));
    cover(&c);
}

TEST(coverage) {
    printf("%-13s %s  %-23s %14s %14s %14s\n", "ground", "n", "", "of the peak", "of the row",
           "slow");
    for (int p = 0; p < mild_material_preset_count(); p++) {
        cover_preset(mild_material_preset_name(p), 1);
        cover_preset(mild_material_preset_name(p), 3);
    }
    for (int m = 1; m < MILD_MODEL_RIGID; m++) {
        const MildModelInfo *info = mild_model_info((MildModel)m);
        for (int p = 0; p < MILD_MODEL_PRESETS && info->presets[p]; p++) {
            cover_preset(info->presets[p], 1);
        }
        if (!info->presets[0]) {
            Case c = {.name = mild_model_names[m], .records = 3};
            c.material = mild_material_default();
            c.material.model = m;
            cover(&c);
        }
    }
    for (int noise = 0; noise < NOISES; noise++) {
        assert_true(tried[noise] > 0);
        const double share = (double)inside[noise] / tried[noise];
        printf("all: %.2f %% of %d\n", 100 * share, tried[noise]);
        assert_true(share < 0.98 && share > (draws < 100 ? 0.9 : 0.92));
    }
}

int main(int argc, char **argv) {
    draws = argc > 1 ? atoi(argv[1]) : draws;
    only = argc > 2 ? argv[2] : NULL;
    return run_cases(NULL, NULL);
}
