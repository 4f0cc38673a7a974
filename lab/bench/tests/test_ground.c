/* The rows of the ground benches, by a clock that only the ground's own calls move, each by a time
 * of its own: what a row measured can be read from it. */
#include "base/clock.h"
#include "bench/bench.h"
#include "ground/step/state.h"
#include "kit.h"

/* [s] of the calls */
enum {
    NEWTON = 2,
    SWEEPS = 5,
    SLIPS = 10,
    UNEVEN = 20,
    IMPRINTS = 40,
    OF_MODEL = 100,
    SINKS = 1000, /* slip takes the support away */
    DERIVES = 3,
    ADVANCE = 1
};

static double now;         /* [s] of the clock */
static size_t plain_bytes; /* of a ground without imprints; 0: not known yet */

WRAPS(clock_thread_seconds);
double __wrap_clock_thread_seconds(void) {
    return now;
}

static int slipping;        /* bool: the step before slipped where slip takes the support away */
static double slipped_from; /* [-] wear with which that one began */

/* Steps that slip begin with the same memory: an element's wear does not grow. */
static void expect_kept(const MildGround *ground, const MildContactInput *input, int sinks) {
    const int slips = sinks && input->velocity[0][0] > 0.1;
    const double worn = *ground_memory(ground, 0).worn;
    if (slips && slipping) {
        assert_true(worn == slipped_from);
    }
    slipping = slips;
    slipped_from = worn;
}

WRAPS(mild_ground_solve);
void __wrap_mild_ground_solve(const MildGround *ground, const MildTerrain *terrain,
                              const MildContactInput *input, MildScratch *scratch,
                              MildContactResult *result) {
    plain_bytes = plain_bytes ? plain_bytes : mild_ground_size(ground);
    now += input->solver == MILD_SOLVER_NEWTON ? NEWTON : SWEEPS;
    now += input->velocity[0][0] > 0.1 && input->velocity[1][0] > 0.1 ? SLIPS : 0;
    now += terrain->map ? UNEVEN : 0;
    now += 2 * mild_ground_size(ground) > 3 * plain_bytes ? IMPRINTS : 0;
    now += OF_MODEL * (double)terrain->materials[0].model;
    now += terrain->materials[0].slip_length > 0 ? SINKS : 0;
    expect_kept(ground, input, terrain->materials[0].slip_length > 0);
    __real_mild_ground_solve(ground, terrain, input, scratch, result);
}

WRAPS(mild_ground_derivative);
MildStatus __wrap_mild_ground_derivative(const MildGround *ground, const MildTerrain *terrain,
                                         const MildContactInput *input, MildScratch *scratch,
                                         const MildContactResult *result,
                                         const MildContactDerivative *derivative,
                                         MildError *error) {
    now += DERIVES;
    return __real_mild_ground_derivative(ground, terrain, input, scratch, result, derivative,
                                         error);
}

WRAPS(mild_ground_advance);
void __wrap_mild_ground_advance(MildGround *ground, const MildTerrain *terrain,
                                const MildContactInput *input, const MildScratch *scratch,
                                const MildContactResult *result) {
    now += ADVANCE;
    __real_mild_ground_advance(ground, terrain, input, scratch, result);
}

/* The row in seconds where its unit is ns. */
static void expect_row(const BenchReport *report, const char *name, double wanted) {
    for (int i = 0; i < report->count; i++) {
        const BenchRow *row = &report->rows[i];
        if (strcmp(row->name, name) == 0) {
            const double is = row->value * (strncmp(row->unit, "ns", 2) == 0 ? 1e-9 : 1);
            print_message("%-24s %10g, wanted %10g\n", name, is, wanted);
            assert_true(fabs(is - wanted) < 1e-9 * wanted);
            return;
        }
    }
    fail_msg("no row %s", name);
}

TEST(a_row_measures_what_it_names) {
    static BenchReport report;
    MildError error = {0};
    const ExperimentDef def = experiment_def_default();
    assert_int_equal(bench_ground(&def, &report, &error), MILD_OK);
    expect_row(&report, "newton_stick", NEWTON);
    expect_row(&report, "newton_stick_advance", NEWTON + ADVANCE);
    expect_row(&report, "newton_stick_derivative", NEWTON + DERIVES);
    expect_row(&report, "newton_fall", NEWTON);
    expect_row(&report, "newton_fall_derivative", NEWTON + DERIVES);
    expect_row(&report, "newton_slip", NEWTON + SLIPS);
    expect_row(&report, "gauss_seidel_stick", SWEEPS);
    expect_row(&report, "gauss_seidel_slip", SWEEPS + SLIPS);
    expect_row(&report, "newton_slip_advance", NEWTON + SLIPS + ADVANCE);
    expect_row(&report, "newton_uneven_advance", NEWTON + UNEVEN + ADVANCE);
    expect_row(&report, "newton_prints_advance", NEWTON + IMPRINTS + ADVANCE);
    expect_row(&report, "elements", 154);
    for (int model = MILD_MODEL_MILD + 1; model < MILD_MODEL_RIGID; model++) {
        char name[40];
        snprintf(name, sizeof name, "newton_%s", mild_model_names[model]);
        expect_row(&report, name, NEWTON + OF_MODEL * (double)model);
        snprintf(name, sizeof name, "newton_%s_advance", mild_model_names[model]);
        expect_row(&report, name, NEWTON + ADVANCE + OF_MODEL * (double)model);
    }
    const double sinks = NEWTON + OF_MODEL * (double)MILD_MODEL_MILD_MERGED + SINKS;
    expect_row(&report, "newton_slip_sinkage", sinks);
    expect_row(&report, "newton_slip_sinkage_advance", sinks + ADVANCE);
    expect_row(&report, "newton_slip_sinkage_derivative", sinks + DERIVES);
    expect_row(&report, "newton_slip_sinkage_slip_advance", sinks + SLIPS + ADVANCE);
    assert_int_equal(report.count, 16 + 2 * (MILD_MODEL_RIGID - MILD_MODEL_MILD - 1));
}

/* Per element of both plates. */
TEST(time_per_element) {
    static BenchReport report;
    MildError error = {0};
    const ExperimentDef def = experiment_def_default();
    plain_bytes = SIZE_MAX / 4; /* no imprints here */
    assert_int_equal(bench_elements(&def, &report, &error), MILD_OK);
    for (int i = 0; i < report.count; i++) {
        int elements;
        const int slips = sscanf(report.rows[i].name, "slip_%d", &elements) == 1;
        assert_true(slips || sscanf(report.rows[i].name, "stick_%d", &elements) == 1);
        expect_row(&report, report.rows[i].name,
                   (NEWTON + ADVANCE + (slips ? SLIPS : 0)) / (double)elements);
    }
    expect_row(&report, "stick_20", (NEWTON + ADVANCE) / 20.0);
    expect_row(&report, "slip_2000", (NEWTON + ADVANCE + SLIPS) / 2000.0);
}

TEST_MAIN(NULL, NULL)
