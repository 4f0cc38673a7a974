#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/random.h"
#include "control/stand.h"
#include "run/bench/bench.h"
#include "run/bench/record.h"

enum {
    SOLVERS = 2,
    TOLERANCES = 89 /* 1 .. 1e-11 */,
    TWIST_MAX = 6 * ROBOT_FEET_MAX,
    PROBLEMS_MAX = 400
};
static const double solver_error = 1e-6;              /* [-] error at which both stop */
static const int solver_limit[SOLVERS] = {100, 2048}; /* most iterations */
static const int solver_repeats[SOLVERS] = {20, 3};   /* repeats; the shortest time counts */
static const char *const solver_names[SOLVERS] = {"newton", "gauss_seidel"};

/* One contact problem and the times of both solvers. */
typedef struct {
    MildTerrain terrain;
    MildContactInput input;
    double inverse_inertia[TWIST_MAX * TWIST_MAX]; /* of the input */
    MildGround *ground;
    MildScratch *scratch;
    double exact[TWIST_MAX]; /* [N s, N m s] the feet's impulses, by Newton to the last digits */
    double times[SOLVERS][PROBLEMS_MAX]; /* [us] */
    int problems;                        /* number of problems */
    int without_exact;                   /* problems left out because Newton did not converge */
    int short_of[SOLVERS]; /* problems that missed solver_error, timed at the tightest */
} SolverBench;

static void impulses(const MildContactInput *input, const MildContactResult *result,
                     double impulse[TWIST_MAX]) {
    for (int i = 0; i < 6 * input->feet; i++) {
        const MildFootResult *foot = &result->foot[i / 6];
        impulse[i] = input->dt * (i % 6 < 3 ? foot->force[i % 6] : foot->torque[i % 6 - 3]);
    }
}

/* x^T A x, twice the kinetic energy that the impulses x give. */
static double energy(const MildContactInput *input, const double x[TWIST_MAX]) {
    double sum = 0;
    int rows = 6 * input->feet;
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j < rows; j++) {
            sum += x[i] * input->inverse_inertia[i * rows + j] * x[j];
        }
    }
    return fmax(sum, 0);
}

static void solve(SolverBench *bench, int solver, double tolerance, int iterations,
                  MildContactResult *result) {
    MildContactInput *input = &bench->input;
    input->solver = solver ? MILD_SOLVER_GAUSS_SEIDEL : MILD_SOLVER_NEWTON;
    input->tolerance = tolerance;
    input->max_iterations = iterations;
    mild_ground_solve(bench->ground, &bench->terrain, input, bench->scratch, result);
}

/* [-] Tolerance number k, from 1 on each an eighth of a decade below the one before. */
static double tolerance_of(int k) {
    return pow(10, -k / 8.0);
}

/* [-] Distance from the exact impulses in the metric of kinetic energy, with that tolerance. */
static double error_with(SolverBench *bench, int solver, int k) {
    MildContactResult result;
    double difference[TWIST_MAX];
    solve(bench, solver, tolerance_of(k), solver_limit[solver], &result);
    impulses(&bench->input, &result, difference);
    for (int i = 0; i < 6 * bench->input.feet; i++) {
        difference[i] -= bench->exact[i];
    }
    return sqrt(energy(&bench->input, difference) / energy(&bench->input, bench->exact));
}

/* Number of the loosest tolerance that reaches solver_error, by bisection; the tightest when none
 * does. A tolerance stops both solvers, because Newton's method does more work for a step that it
 * leaves unsolved at a limit of iterations. */
static int loosest_tolerance(SolverBench *bench, int solver) {
    int low = -1, high = TOLERANCES - 1;
    if (!(error_with(bench, solver, high) <= solver_error)) {
        bench->short_of[solver]++;
        return high;
    }
    while (high - low > 1) {
        int middle = (low + high) / 2;
        *(error_with(bench, solver, middle) <= solver_error ? &high : &low) = middle;
    }
    return high;
}

/* Times the present problem. Does nothing when the feet are in the air. */
static void solver_problem(SolverBench *bench) {
    MildContactResult result;
    solve(bench, 0, 1e-11, 0, &result);
    impulses(&bench->input, &result, bench->exact);
    if (energy(&bench->input, bench->exact) == 0) {
        return;
    }
    if (!result.converged) {
        bench->without_exact++;
        return;
    }
    for (int solver = 0; solver < SOLVERS; solver++) {
        const double tolerance = tolerance_of(loosest_tolerance(bench, solver));
        double least = INFINITY;
        for (int i = 0; i < solver_repeats[solver]; i++) {
            double start = clock_thread_seconds();
            solve(bench, solver, tolerance, solver_limit[solver], &result);
            least = fmin(least, clock_thread_seconds() - start);
        }
        bench->times[solver][bench->problems] = 1e6 * least;
    }
    bench->problems++;
}

/* ---- random problems: any ground of the paper's Table III, any posture, any history ---- */

static MildMaterial random_material(Random *r) {
    MildMaterial m = mild_material_default();
    m.k_pen = random_uniform(r, 8, 1400);
    m.sigma_cone = random_uniform(r, 0.01e6, 0.24e6);
    m.alpha = random_uniform(r, 0.698, 1.310);
    m.nu = random_uniform(r, 0.8, 2.4);
    m.c_g = random_uniform(r, -1.4, 4.6);
    m.c_d = random_uniform(r, -6, 28);
    m.phi = random_uniform(r, 0.50, 0.64);
    m.rho = random_uniform(r, 1000, 2600);
    m.mu = random_uniform(r, 0.2, 1.3);
    m.k_drift = random_uniform(r, 100, 1000);
    m.b_drift = random_uniform(r, 0.02, 0.1);
    m.recovery = fmin(fmax(random_uniform(r, -0.3, 1.3), 0), 1);
    m.bed_depth = random_uniform(r, 0.10, 0.15);
    return m;
}

/* A foot turned by yaw, then pitch and roll, with its sole's middle near the surface. */
static void random_foot(MildContactInput *input, int foot, const MildSole *sole, Random *r) {
    double tilt = random_unit(r) < 0.3 ? 0 : 0.25, fast = random_unit(r) < 0.3 ? 0.01 : 1,
           yaw = random_uniform(r, -3, 3);
    double pitch = random_uniform(r, -tilt, tilt), roll = random_uniform(r, -tilt, tilt);
    double cy = cos(yaw), sy = sin(yaw), cp = cos(pitch), sp = sin(pitch), cr = cos(roll),
           sr = sin(roll);
    const double R[9] = {cy * cp,
                         cy * sp * sr - sy * cr,
                         cy * sp * cr + sy * sr,
                         sy * cp,
                         sy * sp * sr + cy * cr,
                         sy * sp * cr - cy * sr,
                         -sp,
                         cp * sr,
                         cp * cr};
    memcpy(input->rotation[foot], R, sizeof R);
    input->position[foot][1] = foot ? -0.1 : 0.1;
    input->position[foot][2] =
        -R[6] * 0.06 - R[8] * mild_sole_z(sole) - random_uniform(r, -0.003, 0.025);
    for (int i = 0; i < 6; i++) {
        input->velocity[foot][i] = fast * (i < 3 ? 0.5 : 2.0) * random_uniform(r, -1, 1);
    }
}

/* Free bodies, and on top a random coupling of all twists. */
static void random_inertia(MildContactInput *input, Random *r) {
    double G[TWIST_MAX][TWIST_MAX];
    int rows = 6 * input->feet;
    memset(input->inverse_inertia, 0, (size_t)(rows * rows) * sizeof *input->inverse_inertia);
    for (int foot = 0; foot < input->feet; foot++) {
        double mass = exp(random_uniform(r, log(1), log(40))),
               inertia = mass * random_uniform(r, 0.002, 0.1);
        for (int i = 6 * foot; i < 6 * foot + 6; i++) {
            input->inverse_inertia[i * rows + i] = 1 / (i % 6 < 3 ? mass : inertia);
        }
    }
    for (int i = 0; i < rows; i++) {
        for (int k = 0; k < rows; k++) {
            G[i][k] = random_uniform(r, -0.3, 0.3) * (i % 6 < 3 ? 1 : 3);
        }
    }
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j < rows; j++) {
            for (int k = 0; k < rows; k++) {
                input->inverse_inertia[i * rows + j] += G[i][k] * G[j][k];
            }
        }
    }
}

static void free_fall(MildContactInput *input) {
    for (int i = 0; i < 6 * input->feet; i++) {
        input->free_velocity[i] =
            input->velocity[i / 6][i % 6] - (i % 6 == 2 ? 9.81 * input->dt : 0);
    }
}

static void random_problem(SolverBench *bench, const Robot *robot, uint32_t number) {
    static const double steps[3] = {0.25e-3, 1e-3, 5e-3};
    Random r = random_at(1, number, 0);
    MildContactInput *input = &bench->input;
    MildMaterial material = random_material(&r);
    bench->terrain = mild_terrain_uniform(&material);
    *input = (MildContactInput){.feet = robot_feet(robot),
                                .dt = steps[random_index(&r, 3)],
                                .inverse_inertia = bench->inverse_inertia};
    for (int foot = 0; foot < input->feet; foot++) {
        random_foot(input, foot, robot_soles(robot)[foot], &r);
    }
    random_inertia(input, &r);
    mild_ground_reset(bench->ground);
    uint32_t history = random_index(&r, 10);
    for (uint32_t step = 0; step < history; step++) { /* the posture is held */
        MildContactResult result;
        free_fall(input);
        mild_ground_solve(bench->ground, &bench->terrain, input, bench->scratch, &result);
        mild_ground_advance(bench->ground, &bench->terrain, input, bench->scratch, &result);
        for (int i = 0; i < 6 * input->feet; i++) {
            input->velocity[i / 6][i % 6] = result.velocity[i];
            if (i % 6 < 3) {
                input->position[i / 6][i % 6] += input->dt * result.velocity[i];
            }
        }
    }
    free_fall(input);
    solver_problem(bench);
}

/* ---- the robot's problems ---- */

/* Steps the robot on `ground`, and takes the contact problem of that step. */
static void robot_problem(SolverBench *bench, RobotSim *sim, const double *torque,
                          const MildTerrain *terrain, MildGround *ground) {
    memcpy(bench->ground, ground, mild_ground_size(ground));
    robot_sim_step(sim, torque, NULL, terrain, ground);
    bench->terrain = *terrain;
    bench->input = *robot_sim_contact_input(sim);
    solver_problem(bench);
}

/* The robot sinks in from the surface under its stand torques until it rests. */
static MildStatus standing_problems(SolverBench *bench, const Robot *robot, double dt, int count,
                                    MildError *error) {
    const int feet = robot_feet(robot);
    RobotSim *sim = robot_sim_create(robot, dt, error);
    Stand *stand = stand_create(robot, error);
    void *block = aligned_alloc(64, mild_ground_bytes(robot_soles(robot), feet));
    MildStatus status = sim && stand && block
                            ? MILD_OK
                            : mild_fail(error, MILD_ERROR_MEMORY, "bench: out of memory");
    if (status == MILD_OK) {
        MildGround *ground = mild_ground_init(block, robot_soles(robot), feet);
        MildMaterial sand = mild_material_default();
        MildTerrain terrain = mild_terrain_uniform(&sand);
        RobotState state = stand_state(stand, 1, 0);
        RobotVariation nominal = robot_variation_nominal();
        robot_sim_load(sim, &state, &nominal);
        for (int i = 0; i < count; i++) {
            double torque[ROBOT_JOINTS_MAX];
            stand_torque(stand, sim, 1, torque);
            robot_problem(bench, sim, torque, &terrain, ground);
        }
    }
    stand_destroy(stand);
    robot_sim_destroy(sim);
    free(block);
    return status;
}

/* The first step of every recorded period of the walk. */
static MildStatus walking_problems(SolverBench *bench, const ExperimentDef *def, const Robot *robot,
                                   int count, MildError *error) {
    Replay *replay = bench_record_walk(def, robot, "sand_loose", MILD_MODEL_MILD, count, error);
    RobotSim *sim = replay ? robot_sim_create(robot, replay->dt, error) : NULL;
    for (int p = 0; sim && p < replay->periods; p++) {
        const ReplayPeriod *period = &replay->period[p];
        robot_sim_load(sim, &period->state, &replay->variation);
        robot_problem(bench, sim, period->torque[0], &replay->terrain, period->ground);
    }
    MildStatus status = sim ? MILD_OK : error->status;
    robot_sim_destroy(sim);
    replay_destroy(replay);
    return status;
}

/* ---- rows ---- */

static void solver_row(BenchReport *report, const char *set, const char *solver, const char *what,
                       double value, const char *unit) {
    char name[40];
    snprintf(name, sizeof name, "%s_%s_%s", set, solver, what);
    bench_add(report, "solver", name, value, unit);
}

static int compare_doubles(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Rows of the problems so far, at least one; forgets them. */
static void solver_rows(SolverBench *bench, const char *set, BenchReport *report) {
    static const char *const what[3] = {"median", "99", "worst"};
    double of[SOLVERS][3];
    int n = bench->problems;
    for (int solver = 0; solver < SOLVERS; solver++) {
        double *times = bench->times[solver];
        qsort(times, (size_t)n, sizeof *times, compare_doubles);
        of[solver][0] = times[n / 2];
        of[solver][1] = times[(int)ceil(0.99 * n) - 1];
        of[solver][2] = times[n - 1];
        for (int i = 0; i < 3; i++) {
            solver_row(report, set, solver_names[solver], what[i], of[solver][i], "us");
        }
        solver_row(report, set, solver_names[solver], "short", bench->short_of[solver], "-");
    }
    for (int i = 0; i < 3; i++) {
        solver_row(report, set, "ratio", what[i], of[1][i] / of[0][i], "-");
    }
    solver_row(report, set, "problems", "compared", n, "-");
    solver_row(report, set, "problems", "without_exact", bench->without_exact, "-");
    bench->problems = bench->without_exact = bench->short_of[0] = bench->short_of[1] = 0;
}

MildStatus bench_solver(const ExperimentDef *def, BenchReport *report, MildError *error) {
    enum { RANDOM = 250, STANDING = 50, WALKING = 100 };
    Robot *robot = bench_robot(def, error);
    if (!robot) {
        return MILD_ERROR_IO;
    }
    const MildSole *const *soles = robot_soles(robot);
    const int feet = robot_feet(robot);
    SolverBench *bench = calloc(1, sizeof *bench);
    void *block = aligned_alloc(64, mild_ground_bytes(soles, feet));
    MildScratch *scratch = mild_scratch_create(soles, feet, error);
    MildStatus status = MILD_OK;
    if (!bench || !block || !scratch) {
        status = mild_fail(error, MILD_ERROR_MEMORY, "bench: out of memory");
    } else {
        bench->scratch = scratch;
        bench->ground = mild_ground_init(block, soles, feet);
        for (uint32_t i = 0; i < RANDOM; i++) {
            random_problem(bench, robot, i);
        }
        solver_rows(bench, "random", report);
        status = standing_problems(bench, robot, def->task.physics_dt, STANDING, error);
        if (status == MILD_OK) {
            solver_rows(bench, "standing", report);
        }
        if (status == MILD_OK) {
            status = walking_problems(bench, def, robot, WALKING, error);
        }
        if (status == MILD_OK) {
            solver_rows(bench, "walking", report);
        }
    }
    mild_scratch_destroy(scratch);
    free(block);
    free(bench);
    robot_destroy(robot);
    return status;
}
