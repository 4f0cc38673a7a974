/* The rows of the bench of the ground in batches: steps by a clock that only they move, forces
 * against those that the recorded steps had. */
#include "base/clock.h"
#include "bench/record.h"
#include "bench_kit.h"
#include "ground/batch/batch.h"

enum { ROBOTS = 1024, FEET = 2, MOST = 4000 };
enum { APART = 1009 }; /* robots in a row are recorded steps so far apart */
static const double solve_time = 2, advance_time = 5; /* [s] of a step of all robots */

static double now;                   /* [s] of the clock */
static int is_walking, steps;        /* bool: the walk is recorded; steps of the batch */
static double force[MOST][3 * FEET]; /* [N] of the recorded steps, in double */
static int recorded;
static float wrench[ROBOTS][6 * FEET]; /* of the batch's last step */
static int32_t iterations[ROBOTS];
static size_t bytes;

WRAPS(clock_seconds);
double __wrap_clock_seconds(void) {
    return now;
}

WRAPS(bench_record_walk);
Replay *__wrap_bench_record_walk(const ExperimentDef *def, const Robot *robot, const char *ground,
                                 int model, int periods, MildError *error) {
    is_walking = 1;
    Replay *replay = __real_bench_record_walk(def, robot, ground, model, periods, error);
    is_walking = 0;
    return replay;
}

WRAPS(robot_sim_step);
int __wrap_robot_sim_step(RobotSim *sim, const double *torque, const double *push,
                          const MildTerrain *terrain, MildGround *ground) {
    const int bad = __real_robot_sim_step(sim, torque, push, terrain, ground);
    if (!is_walking && recorded < MOST) {
        for (int i = 0; i < 3 * FEET; i++) {
            force[recorded][i] = robot_sim_contact(sim)->foot[i / 3].force[i % 3];
        }
        recorded++;
    }
    return bad;
}

/* All but the second step of a case are disturbed. */
WRAPS(mild_batch_step);
MildStatus __wrap_mild_batch_step(MildBatch *batch, const MildBatchInput *input,
                                  const MildBatchOutput *output, int advance, MildStream stream,
                                  MildError *error) {
    const MildStatus status = __real_mild_batch_step(batch, input, output, advance, stream, error);
    now += (advance ? advance_time : solve_time) + (steps++ % 3 == 1 ? 0 : 50);
    memcpy(wrench, output->wrench, sizeof wrench);
    memcpy(iterations, output->iterations, sizeof iterations);
    bytes = mild_batch_robot_bytes(batch);
    return status;
}

static int rising(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void expect_row(const BenchReport *report, const char *name, double wanted) {
    const double is = value_of(report, name);
    print_message("%-16s %12g, wanted %12g\n", name, is, wanted);
    expect_near(name, is, wanted, 1e-9 * fabs(wanted));
}

TEST(batch_rows_are_of_the_steps) {
    static double errors[ROBOTS];
    static BenchReport report;
    MildError error = {0};
    double mean = 0;
    const ExperimentDef def = experiment_def_default();
    expect_good(bench_batch(&def, &report, &error) == MILD_OK, &error);
    assert_true(recorded > ROBOTS && recorded < MOST && steps == 6);
    for (int r = 0; r < ROBOTS; r++) {
        double apart = 0, size = 1; /* [N^2]: a newton, for feet in the air */
        for (int foot = 0; foot < FEET; foot++) {
            for (int k = 0; k < 3; k++) {
                const double wanted = force[r * APART % recorded][3 * foot + k];
                apart += pow((double)wrench[r][6 * foot + k] - wanted, 2);
                size += wanted * wanted;
            }
        }
        errors[r] = sqrt(apart / size);
        mean += (double)iterations[r] / ROBOTS;
    }
    qsort(errors, ROBOTS, sizeof *errors, rising);
    assert_true(mean > 1 && errors[ROBOTS - 1] > 0 && errors[ROBOTS - 1] < 0.01);
    expect_row(&report, "solve_1024", 1e-6 * ROBOTS / solve_time);
    expect_row(&report, "advance_1024", 1e-6 * ROBOTS / advance_time);
    expect_row(&report, "problems", ROBOTS);
    expect_row(&report, "force_median", errors[ROBOTS / 2]);
    expect_row(&report, "force_99", errors[ROBOTS * 99 / 100]);
    expect_row(&report, "force_worst", errors[ROBOTS - 1]);
    expect_row(&report, "iterations", mean);
    expect_row(&report, "bytes", (double)bytes);
    assert_int_equal(report.count, 8);
}

TEST_MAIN(NULL, NULL)
