/* The benchmark of a step. */
#include <mujoco/mujoco.h>
#include <time.h>

#include "base/clock.h"
#include "bench/record.h"
#include "bench_kit.h"

/* ---- a clock that only steps move: 2 s by the engine's own, 3 s by ours ---- */

static double now, lowest_floor;
static int is_false; /* bool: this clock */
/* Of bench walk: what the steps of ours took on each ground, with each of both tolerances. */
enum { GROUNDS = 3 };
static struct { double steps, iterations, unconverged; } ours[GROUNDS][2];
static int recorded;   /* walks; the ground of the last one is replayed */
static int is_walking; /* bool: the walk is recorded */
static int is_loose;   /* bool: the tolerance that is set is a walk's, not the solver's own */
static double walks;   /* [s] that a step takes longer by the engine, in the walk now timed */
static int
    by_case; /* bool: the engine 0.5 s more in contact, ours 1 s by Newton and 4 s by sweeps */

static int reads =
    -1; /* of the clock in a step, each by as many seconds as before it; -1: outside */

double clock_seconds(void) {
    struct timespec time;
    now += reads < 0 ? 0 : reads++;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return is_false ? now : (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

double clock_thread_seconds(void) {
    return clock_seconds();
}

WRAPS(mj_step);
void __wrap_mj_step(const mjModel *m, mjData *d) {
    __real_mj_step(m, d);
    const int name = mj_name2id(m, mjOBJ_GEOM, "floor");
    lowest_floor = fmin(lowest_floor, name < 0 ? 0 : m->geom_pos[3 * name + 2]);
    now += 2;
    now += by_case && d->ncon > 0 ? 0.5 : 0;
    now += walks;
}

WRAPS(robot_sim_set_solver);
void __wrap_robot_sim_set_solver(RobotSim *sim, MildSolver solver, double tolerance,
                                 int iterations) {
    is_loose = tolerance > 0;
    __real_robot_sim_set_solver(sim, solver, tolerance, iterations);
}

/* Torques of the steps of the walk that is recorded. */
enum { JOINTS = 12, WALKED_MAX = 8192 };
static double walked_torque[WALKED_MAX][JOINTS];
static int walked;

/* The record has the torques of the last steps, each once. */
static void expect_torques(const Replay *replay) {
    assert_non_null(replay);
    const int recorded_steps = replay->periods * replay->steps;
    assert_in_range(walked, recorded_steps, WALKED_MAX - 1);
    for (int i = 0; i < recorded_steps; i++) {
        assert_memory_equal(replay->period[i / replay->steps].torque[i % replay->steps],
                            walked_torque[walked - recorded_steps + i], sizeof walked_torque[0]);
    }
}

WRAPS(robot_sim_step);
int __wrap_robot_sim_step(RobotSim *sim, const double *torque, const double *push,
                          const MildTerrain *terrain, MildGround *ground) {
    reads = 0;
    if (is_walking && walked < WALKED_MAX) {
        memcpy(walked_torque[walked++], torque, JOINTS * sizeof *torque);
    }
    const int bad = __real_robot_sim_step(sim, torque, push, terrain, ground);
    reads = -1;
    const int iterations = robot_sim_contact(sim)->iterations;
    now += 3;
    now += !by_case || iterations == 0 ? 0 : iterations < 20 ? 1 : 4;
    now += walks * iterations;
    if (!is_walking && recorded > 0 && recorded <= GROUNDS) {
        ours[recorded - 1][is_loose].steps++;
        ours[recorded - 1][is_loose].iterations += iterations;
        ours[recorded - 1][is_loose].unconverged += !robot_sim_contact(sim)->converged;
    }
    return bad;
}

WRAPS(bench_record_walk);
Replay *__wrap_bench_record_walk(const ExperimentDef *def, const Robot *robot, const char *ground,
                                 int model, int periods, MildError *error) {
    is_walking = 1;
    walked = 0;
    Replay *replay = __real_bench_record_walk(def, robot, ground, model, periods, error);
    is_walking = 0;
    recorded++;
    expect_torques(replay);
    return replay;
}

/* The rows of bench step, by this clock. */
static void expect_step(const BenchReport *report, double engine_free, double engine_rigid,
                        double newton, double gauss_seidel) {
    const struct {
        const char *name;
        double wanted;
    } rows[] = {{"engine_free", engine_free},
                {"engine_rigid", engine_rigid},
                {"newton", newton},
                {"gauss_seidel", gauss_seidel}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const double is = 1e-6 * value_of(report, rows[i].name);
        print_message("%-16s %g s\n", rows[i].name, is);
        expect_near(rows[i].name, is, rows[i].wanted, 1e-6);
    }
}

/* Each row has the time of the case that it names; the phases are the step of the soft ground. */
TEST(test_rows) {
    static BenchReport report;
    MildError error = {0};
    const ExperimentDef def = experiment_def_default();
    is_false = by_case = 1;
    assert_int_equal(bench_step(&def, &report, &error), MILD_OK);
    is_false = by_case = 0;
    static const char *const phases[] = {"smooth", "map", "ground", "finish"};
    expect_step(&report, 2, 2.5, 4, 7);
    expect_near("ratio_to_rigid", value_of(&report, "ratio_to_rigid"), 1.6, 1e-9);
    for (int i = 0; i < 4; i++) {
        char name[40];
        snprintf(name, sizeof name, "newton_%s", phases[i]);
        expect_near(name, 1e-6 * value_of(&report, name), i + 1, 1e-6);
    }
    assert_true(value_of(&report, "rigid") >= 3e6 && value_of(&report, "rigid") < 3.5e6);
    const double iterations = value_of(&report, "newton_iterations");
    assert_true(iterations >= 1 && iterations < 20);
    assert_int_equal(report.count, 11);
}

static double walk_value(const BenchReport *report, const char *ground, const char *what) {
    char name[64];
    snprintf(name, sizeof name, "%s_%s", ground, what);
    return value_of(report, name);
}

static void check_walk(const BenchReport *report, const char *ground, int g) {
    static const char *const rows[2][3] = {{"iterations_tight", "newton_tight", "ratio_tight"},
                                           {"iterations", "newton", "ratio_to_rigid"}};
    double iterations[2];
    for (int loose = 0; loose < 2; loose++) {
        iterations[loose] = ours[g][loose].iterations / ours[g][loose].steps;
        const double seconds = 3 + walks * iterations[loose];
        print_message("%s: %g iterations, %g s\n", ground, iterations[loose], seconds);
        expect_near("iterations", walk_value(report, ground, rows[loose][0]), iterations[loose],
                    1e-9);
        expect_near("time", 1e-6 * walk_value(report, ground, rows[loose][1]), seconds, 1e-9);
        expect_near("ratio", walk_value(report, ground, rows[loose][2]), seconds / (2 + walks),
                    1e-9);
    }
    expect_near("engine", 1e-6 * walk_value(report, ground, "engine_rigid"), 2 + walks, 1e-9);
    const double unconverged = ours[g][1].unconverged / ours[g][1].steps;
    expect_near("unconverged", walk_value(report, ground, "unconverged"), unconverged, 1e-9);
    assert_true(unconverged > 0 && fabs(iterations[1] - iterations[0]) > 0.01);
}

/* Each ground's rows are those of its own walk: iterations and times, by a clock that a step of
 * ours moves by its iterations, and the engine's by a share; the engine's floor lies as deep as the
 * soles on soft ground. */
TEST(test_walk_rows) {
    static const char *const grounds[GROUNDS] = {"sand_loose", "foam45", "grass"};
    static BenchReport report;
    MildError error = {0};
    ExperimentDef def = experiment_def_default();
    if (kit_short()) {
        return;
    }
    def.task.contact_iterations = 2; /* so that some do not converge */
    is_false = 1;
    recorded = 0;
    lowest_floor = 0;
    walks = 0.125;
    memset(ours, 0, sizeof ours);
    expect_good(bench_walk(&def, &report, &error) == MILD_OK, &error);
    for (int g = 0; g < GROUNDS; g++) {
        check_walk(&report, grounds[g], g);
    }
    expect_near("rigid", 1e-6 * value_of(&report, "rigid_engine_rigid"), 2 + walks, 1e-9);
    assert_int_equal(report.count, GROUNDS * 8 + 1);
    print_message("the floor at %.1f mm\n", 1e3 * lowest_floor);
    /* The bed lies at 150 mm, and yields by 8 mm where eight elements of 19 kN/m bear 1200 N. */
    assert_true(lowest_floor < -5e-3 && lowest_floor > -158e-3);
    is_false = 0;
    walks = 0;
}

TEST_MAIN(NULL, NULL)
