/* The rows of the bench of whole episodes, from rewards and ends that the test writes in the place
 * of the environments': each side's returns are known, and so is the distance between the two. */
#include "bench_kit.h"
#include "env/envs.h"

enum { EPISODES = 40, LAST = 12 }; /* LAST: [steps] of the longest episode */

static int side; /* 1: MuJoCo's environments step; 2: the batch engine's */
static int step_of[3];

/* The episode i of a side: its steps, whether it fell, and the reward of a step. */
static int steps_of(int of, int i) {
    return 3 + (i * 7 + of) % (LAST - 2);
}

static int falls_of(int of, int i) {
    return of == 1 ? i % 5 == 0 : i % 3 == 0;
}

static double reward_of(int of, int i) {
    return (of == 1 ? 1.0 : 1.25) + 0.25 * (i % 8);
}

WRAPS(envs_create);
Envs *__wrap_envs_create(const EnvsDef *def, MildError *error) {
    assert_true(def->count == EPISODES && def->task->assist == 0);
    side = def->batch ? 2 : 1;
    return __real_envs_create(def, error);
}

/* After its first episode an environment goes on, and says other things. */
WRAPS(envs_step);
MildStatus __wrap_envs_step(Envs *envs, const EnvsStep *step, MildStream stream, MildError *error) {
    const MildStatus status = __real_envs_step(envs, step, stream, error);
    const int t = ++step_of[side];
    assert_true(t <= LAST); /* all have ended then */
    for (int i = 0; i < EPISODES; i++) {
        const int last = steps_of(side, i);
        step->reward[i] = t <= last ? (float)reward_of(side, i) : 1e3F;
        step->done[i] = t >= last;
        step->timeout[i] = t == last && !falls_of(side, i);
    }
    return status;
}

static int rising(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void check_side(const BenchReport *report, int of, const char *prefix,
                       double returns[EPISODES]) {
    double sum = 0;
    int falls = 0;
    char name[40];
    for (int i = 0; i < EPISODES; i++) {
        returns[i] = steps_of(of, i) * reward_of(of, i);
        sum += returns[i];
        falls += falls_of(of, i);
    }
    qsort(returns, EPISODES, sizeof *returns, rising);
    const struct {
        const char *what;
        double wanted;
    } rows[] = {{"return_mean", sum / EPISODES},
                {"return_tenth", returns[4]},
                {"return_median", returns[20]},
                {"falls", falls}};
    for (int i = 0; i < 4; i++) {
        snprintf(name, sizeof name, "%s_%s", prefix, rows[i].what);
        print_message("%-24s %8g\n", name, value_of(report, name));
        expect_near(name, value_of(report, name), rows[i].wanted, 1e-9);
    }
}

/* The share of the returns that are not above x. */
static double share(const double returns[EPISODES], double x) {
    int count = 0;
    for (int i = 0; i < EPISODES; i++) {
        count += returns[i] <= x;
    }
    return (double)count / EPISODES;
}

TEST(returns_are_of_the_first_episodes) {
    static BenchReport report;
    MildError error = {0};
    ExperimentDef def = experiment_def_default();
    def.train.threads = 1;
    def.task.assist = 1; /* the bench is without */
    expect_good(bench_episodes(&def, &report, &error) == MILD_OK, &error);
    assert_true(step_of[1] == LAST && step_of[2] == LAST);

    double a[EPISODES], b[EPISODES], largest = 0;
    check_side(&report, 1, "mujoco", a);
    check_side(&report, 2, "batch", b);
    for (int i = 0; i < EPISODES; i++) {
        largest = fmax(largest, fabs(share(a, a[i]) - share(b, a[i])));
        largest = fmax(largest, fabs(share(a, b[i]) - share(b, b[i])));
    }
    assert_true(largest > 0.1 && largest < 0.9);
    print_message("distance %g\n", value_of(&report, "distance"));
    expect_near("distance", value_of(&report, "distance"), largest * sqrt(EPISODES / 2.0), 1e-9);
    assert_true(value_of(&report, "episodes") == EPISODES);
    assert_int_equal(report.count, 10);
}

TEST_MAIN(NULL, NULL)
