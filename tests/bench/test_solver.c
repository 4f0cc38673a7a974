/* The rows of the solver bench, by a clock that only solutions move, by their iterations: which
 * problems were compared, how many iterations each solver took at the error asked, and the
 * quotients. */
#include "base/clock.h"
#include "bench_kit.h"

enum { TWISTS = 6 * MILD_FEET_MAX, SETS = 3, PROBLEMS = 250, TIGHTEST = 88 };
static const double solved = 1e-6;                   /* [-] the error at which both stop */
static const int limit[2] = {100, 2048};             /* [iterations] */
static const double seconds[2] = {2, 5};             /* [s] of an iteration */
static const int problems_of[SETS] = {250, 50, 100}; /* that are made, feet in the air among them */

static double now; /* [s] of the clock */

/* What the bench asked about one problem. */
typedef struct {
    double exact[TWISTS];       /* [N s, N m s] */
    int converged;              /* bool: exact is */
    int last[2], iterations[2]; /* the last solution's tolerance 10^(-k/8), and what it took */
    uint8_t is_near[2][TIGHTEST + 1], is_far[2][TIGHTEST + 1]; /* bool: tried, and that near */
} Problem;

static Problem problem[SETS][PROBLEMS];
static int set, number; /* of the problem now; number counts from 1 */
static int calls;       /* of the solvers, to disturb all but every third */

WRAPS(clock_thread_seconds);
double __wrap_clock_thread_seconds(void) {
    return now;
}

/* The square root of x^T A x, and in *impulse what the feet got from the ground less `from`. */
static double size_of(const MildContactInput *input, const MildContactResult *result,
                      const double *from, double impulse[TWISTS]) {
    const int rows = 6 * input->feet;
    double sum = 0;
    for (int i = 0; i < rows; i++) {
        const MildFootResult *foot = &result->foot[i / 6];
        impulse[i] = input->dt * (i % 6 < 3 ? foot->force[i % 6] : foot->torque[i % 6 - 3]);
        impulse[i] -= from ? from[i] : 0;
    }
    for (int i = 0; i < rows * rows; i++) {
        sum += impulse[i / rows] * input->inverse_inertia[i] * impulse[i % rows];
    }
    return sqrt(fmax(sum, 0));
}

static int is_sweeps(const MildContactInput *input) {
    return input->solver == MILD_SOLVER_GAUSS_SEIDEL;
}

WRAPS(mild_ground_solve);
void __wrap_mild_ground_solve(const MildGround *ground, const MildTerrain *terrain,
                              const MildContactInput *input, MildScratch *scratch,
                              MildContactResult *result) {
    static double exact_size;
    double impulse[TWISTS];
    __real_mild_ground_solve(ground, terrain, input, scratch, result);
    if (input->tolerance == 1e-11 && input->max_iterations == 0) { /* the exact impulses */
        if (number == problems_of[set]) {
            set++;
            number = 0;
        }
        assert_true(set < SETS);
        Problem *p = &problem[set][number++];
        exact_size = size_of(input, result, NULL, p->exact);
        result->converged &= set != 0 || number != 3; /* so that one is without */
        p->converged = result->converged || exact_size == 0;
    } else if (number > 0 && input->max_iterations == limit[is_sweeps(input)]) {
        Problem *p = &problem[set][number - 1];
        const int which = is_sweeps(input);
        const int k = (int)lround(-8 * log10(input->tolerance));
        if (which == 1 && set == 1 && number == 3) {
            result->foot[0].force[2] += 100; /* so that one does not come near */
        }
        const double error = size_of(input, result, p->exact, impulse) / exact_size;
        assert_true(exact_size > 0 && k >= 0 && k <= TIGHTEST);
        (error <= solved ? p->is_near : p->is_far)[which][k] = 1;
        p->last[which] = k;
        p->iterations[which] = result->iterations;
        now += result->iterations * seconds[which] + (calls++ % 3 ? 1e3 : 0);
    }
}

/* The row is a time of the problems, and no less than this share of them, but no smaller one, takes
 * as long at most. */
static double expect_quantile(const BenchReport *report, const char *name, const double *times,
                              int count, double share) {
    const double row = 1e-6 * value_of(report, name);
    int below = 0, equal = 0;
    for (int i = 0; i < count; i++) {
        equal += fabs(times[i] - row) < 1e-6;
        below += times[i] < row - 1e-6;
    }
    print_message("%-32s %8.0f s\n", name, row);
    if (!equal || below + equal < share * count || below >= share * count + 1) {
        fail_msg("%s: %g s, %d of %d below it, %d as long", name, row, below, count, equal);
    }
    return row;
}

static void check_solver(const BenchReport *report, const char *set_name, int of, int which,
                         double quantiles[3]) {
    static const char *const solvers[2] = {"newton", "gauss_seidel"};
    static const struct {
        const char *name;
        double share;
    } rows[3] = {{"median", 0.5}, {"99", 0.99}, {"worst", 1}};
    double times[PROBLEMS];
    char name[64];
    int count = 0, missed = 0;
    for (int i = 0; i < problems_of[of]; i++) {
        const Problem *p = &problem[of][i];
        const int k = p->last[which];
        if (p->iterations[which] == 0) {
            continue; /* in the air, or without an exact solution */
        }
        const int loosest = p->is_near[which][k] && (k == 0 || p->is_far[which][k - 1]);
        assert_true(loosest || (k == TIGHTEST && !p->is_near[which][k]));
        missed += !loosest;
        times[count++] = p->iterations[which] * seconds[which];
    }
    snprintf(name, sizeof name, "%s_%s_short", set_name, solvers[which]);
    assert_int_equal((int)value_of(report, name), missed);
    assert_true(of != 1 || which == 0 || missed > 0);
    for (int i = 0; i < 3; i++) {
        snprintf(name, sizeof name, "%s_%s_%s", set_name, solvers[which], rows[i].name);
        quantiles[i] = expect_quantile(report, name, times, count, rows[i].share);
    }
    snprintf(name, sizeof name, "%s_problems_compared", set_name);
    assert_int_equal((int)value_of(report, name), count);
}

TEST(solver_rows_are_of_the_problems) {
    static const char *const sets[SETS] = {"random", "standing", "walking"};
    static const char *const ratios[3] = {"median", "99", "worst"};
    static BenchReport report;
    MildError error = {0};
    const ExperimentDef def = experiment_def_default();
    if (kit_short()) {
        return;
    }
    expect_good(bench_solver(&def, &report, &error) == MILD_OK, &error);
    assert_true(set == SETS - 1 && number == problems_of[set]);
    for (int s = 0; s < SETS; s++) {
        double of[2][3];
        char name[64];
        int inexact = 0;
        for (int i = 0; i < problems_of[s]; i++) {
            inexact += !problem[s][i].converged;
        }
        check_solver(&report, sets[s], s, 0, of[0]);
        check_solver(&report, sets[s], s, 1, of[1]);
        for (int i = 0; i < 3; i++) {
            snprintf(name, sizeof name, "%s_ratio_%s", sets[s], ratios[i]);
            expect_near(name, value_of(&report, name), of[1][i] / of[0][i], 1e-9);
        }
        snprintf(name, sizeof name, "%s_problems_without_exact", sets[s]);
        assert_int_equal((int)value_of(&report, name), inexact);
        assert_true(s != 0 || inexact > 0);
    }
    assert_int_equal(report.count, SETS * 13);
}

TEST_MAIN(NULL, NULL)
