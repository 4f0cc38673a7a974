/* The contact problem: both solvers against each other and against a dense slow reference; what a
 * solution reports. `ground_test_solver COUNT [FIRST]` runs the reference alone, on problems
 * FIRST .. FIRST + COUNT - 1 of cones on level ground and of every other kind. */
#include "dense.h"
#include "problems.h"

#include "ground/step/scratch.h"

static int first_problem = 0, problem_count = 2000, kind_count = 100;

/* The worst of what was seen, and in which problem. */
typedef struct {
    double value;
    int number;
} Worst;

/* Two answers compared: distance in the metric of kinetic energy, and the largest difference of
 * twist, radians on a lever of 0.1 m, by the largest that contact changed. */
typedef struct {
    int problems;
    Worst energy, twist;
} Compared;

static void worst_of(Worst *worst, double value, int number) {
    if (!(value <= worst->value)) {
        *worst = (Worst){value, number};
    }
}

/* A contact that changes next to nothing of the twist leaves nothing to compare: rounding of the
 * twist is more. */
#define COMPARE_LEAST 1e-8

static void compare(Compared *seen, const Dense *dense, const double *one, const double *other,
                    int number) {
    double difference = 0.0, changed = 0.0, size = 0.0;
    for (int i = 0; i < dense->n; i++) {
        double lever = i % 6 < 3 ? 1.0 : 0.1;
        difference = fmax(difference, lever * fabs(one[i] - other[i]));
        changed = fmax(changed, lever * fabs(dense->twist[i] - dense->free[i]));
        size = fmax(size, lever * fabs(dense->free[i]));
    }
    if (changed < COMPARE_LEAST * size) {
        return;
    }
    seen->problems++;
    worst_of(&seen->energy, dense_distance(dense, one, other), number);
    worst_of(&seen->twist, difference / changed, number);
}

/* What is seen of the problems of one kind. */
typedef struct {
    Compared newton, sweeps; /* against the reference, against newton */
    int unsolved, unsettled; /* by newton, by the reference */
    int several;             /* problems of friction with another solution */
} Seen;

/* Solves once more by the reference and by at most so many sweeps; where they need more they are
 * left out. The kit holds newton's answer. restarts: bool, where friction has two solutions the
 * reference starts again from newton's and must stay there. */
static void see(Seen *seen, Kit *kit, int number, int sweeps, int restarts) {
    static Dense dense;
    const MildContactResult answer = kit->result;
    dense_open(&dense, kit);
    int settled = dense_solve(&dense);
    if (!answer.converged) {
        print_message("newton leaves number %d\n", number);
    } else if (restarts && settled && dense_distance(&dense, answer.velocity, dense.twist) > 1e-6) {
        dense_start(&dense, answer.velocity);
        settled = dense_solve(&dense);
        seen->several++;
    }
    seen->unsettled += !settled;
    seen->unsolved += !answer.converged;
    if (settled && answer.converged) {
        compare(&seen->newton, &dense, answer.velocity, dense.twist, number);
    }
    kit->input.solver = MILD_SOLVER_GAUSS_SEIDEL;
    kit->input.max_iterations = sweeps;
    kit->input.tolerance = 1e-12;
    kit_solve(kit);
    if (kit->result.converged && answer.converged) {
        compare(&seen->sweeps, &dense, kit->result.velocity, answer.velocity, number);
    }
}

/* Bool: all are solved, and all answers are the same within these bounds. */
static int same_answers(const char *name, const Seen *seen, double energy, double twist) {
    print_message("%s: %d problems, newton off by %.1e in kinetic energy's metric (number %d) and "
                  "%.1e in the twist (number %d), %d with several solutions; sweeps by %.1e in %d "
                  "(number %d); not solved: %d by newton, %d by the reference\n",
                  name, seen->newton.problems, seen->newton.energy.value,
                  seen->newton.energy.number, seen->newton.twist.value, seen->newton.twist.number,
                  seen->several, seen->sweeps.energy.value, seen->sweeps.problems,
                  seen->sweeps.energy.number, seen->unsolved, seen->unsettled);
    return seen->unsolved + seen->unsettled == 0 && seen->newton.problems > 0 &&
           seen->newton.energy.value < energy && seen->newton.twist.value < twist &&
           seen->sweeps.energy.value < 1e-6;
}

TEST(test_dense_reference) {
    Seen seen = {0};
    for (int number = first_problem; number < first_problem + problem_count; number++) {
        Kit kit;
        if (numbered_problem(&kit, number)) {
            see(&seen, &kit, number, 500, 0);
        }
        kit_close(&kit);
    }
    assert_true(same_answers("cones on level ground", &seen, 1e-6, 1e-6));
    assert_true(seen.sweeps.twist.value < 1e-6);
}

/* The same on every other kind of ground. */
TEST(test_dense_kinds) {
    int good = 1;
    for (Kind kind = 0; kind < KINDS; kind++) {
        Seen seen = {0};
        for (int number = first_problem; number < first_problem + kind_count; number++) {
            Kit kit;
            MildMap *map;
            if (kind_problem(&kit, &map, kind, number)) {
                see(&seen, &kit, number, 200, 1);
            }
            kit_close(&kit);
            mild_map_destroy(map);
        }
        good &= same_answers(kind_names[kind], &seen, 1e-8, 1e-7);
    }
    assert_true(good);
}

/* Two whole feet, mu > 1: what an earlier Newton needed more than 100 steps for among 42 750
 * problems. And a foot that stops on sand blended with bekker's ground: its drag depends on both
 * curves. */
TEST(test_hard_problems) {
    static const int numbers[5] = {12229, 15949, 17844, 27024, 1404};
    Seen seen = {0};
    for (int k = 0; k < 5; k++) {
        Kit kit;
        MildMap *map = NULL;
        assert_true(k < 4 ? numbered_problem(&kit, numbers[k])
                          : kind_problem(&kit, &map, BLEND, numbers[k]));
        see(&seen, &kit, numbers[k], 200, 0);
        kit_close(&kit);
        mild_map_destroy(map);
    }
    assert_true(same_answers("hard problems", &seen, 1e-6, 1e-6));
}

/* ---- work and outputs ---- */

/* How hard the solvers work: a wrong diagonal, derivative or start finds the same answer later. The
 * numbers are what the solvers needed when they were last right, and a fiftieth. */
TEST(test_effort) {
    enum { PROBLEMS = 150, SWEEPS_MAX = 500 };
    static const double newton_most[2] = {4.333, 4.519}, sweeps_most[2] = {102.3, 93.4};
    for (int uneven = 0; uneven < 2; uneven++) {
        double newton = 0.0, sweeps = 0.0;
        int problems = 0;
        for (int number = 0; number < PROBLEMS; number++) {
            Kit kit;
            MildMap *map = NULL;
            if (uneven ? kind_problem(&kit, &map, UNEVEN, number)
                       : numbered_problem(&kit, number)) {
                problems++;
                newton += kit.result.iterations;
                kit.input.solver = MILD_SOLVER_GAUSS_SEIDEL;
                kit.input.max_iterations = SWEEPS_MAX;
                kit_solve(&kit);
                sweeps += kit.result.iterations;
            }
            kit_close(&kit);
            mild_map_destroy(map);
        }
        newton /= problems;
        sweeps /= problems;
        print_message("effort on %s ground: %.3f Newton steps, %.2f sweeps in the mean of %d\n",
                      uneven ? "uneven" : "level", newton, sweeps, problems);
        assert_true(newton < 1.02 * newton_most[uneven] && sweeps < 1.02 * sweeps_most[uneven]);
    }
}

/* What each element says of itself follows from the forces, the memory and the motion. */
static int check_states(const Kit *kit, int f, const MildElements *e) {
    const double *V = kit->result.velocity + 6 * f,
                 *deepest = mild_ground_depth_max(kit->ground, f);
    double full = KIT_PITCH / sqrt(acos(-1.0)) * tan(kit->terrain.materials[0].alpha) /
                  kit->terrain.materials[0].nu;
    const MildMaterial *m = &kit->terrain.materials[0];
    Memory memory = ground_memory(kit->ground, f);
    int good = 1;
    for (int i = 0; i < mild_sole_elements(kit->soles[f]); i++) {
        double p[3], turn[3], v[3];
        const double point[3] = {e->point_x[i], e->point_y[i], e->point_z[i]};
        for (int k = 0; k < 3; k++) {
            p[k] = point[k] - kit->input.position[f][k];
        }
        kit_cross(V + 3, p, turn);
        for (int k = 0; k < 3; k++) {
            v[k] = V[k] + turn[k];
        }
        double now[3], w0;
        kit_cross(kit->input.velocity[f] + 3, p, now);
        w0 = -(kit->input.velocity[f][2] + now[2]);
        double before = fmax(deepest[i] > 0.0 ? deepest[i] : e->depth[i] - 0.5 * kit->input.dt * w0,
                             0.0),
               after = e->depth[i] - 0.5 * kit->input.dt * v[2];
        double deep = fmax(before, after), flat = deep < full ? pow(1.0 - deep / full, 2.0) : 0.0;
        int loaded = e->normal[i] > 0.0, virgin = loaded && after > before;
        good &= e->normal[i] >= 0.0; /* soil never pulls */
        good &= e->state[i] == (virgin   ? MILD_ELEMENT_VIRGIN
                                : loaded ? MILD_ELEMENT_UNLOADING
                                         : MILD_ELEMENT_FREE);
        good &= fabs(e->flat[i] - flat) < 1e-9;
        /* slipping: friction, what is tangential without the drift's damping, has reached its bound
         */
        double damping = e->depth[i] > 0.0 ? m->b_drift : 0.0,
               drift = m->k_drift * memory.drift[i] * fmax(e->depth[i], 0.0);
        double friction = hypot(e->tangent_x[i] + damping * v[0], e->tangent_y[i] + damping * v[1]),
               bound = m->mu * e->normal[i] + drift;
        good &= friction <= bound * (1.0 + 1e-6) + 1e-9;
        good &= e->slip[i] == (loaded && friction >= bound * (1.0 - 1e-6)) ||
                fabs(friction - bound) < 1e-5 * bound + 1e-12; /* [N] */
    }
    return good;
}

/* Wrench, pressure centre and element arrays fit together; test_step.c has the zero moment
 * points. */
TEST(test_outputs) {
    double worst = 0.0, worst_center = 0.0;
    for (int number = 0; number < kit_draws(500); number++) {
        Kit kit;
        numbered_problem(&kit, number);
        for (int f = 0; f < kit.feet; f++) {
            const MildFootResult *r = &kit.result.foot[f];
            const MildElements e = mild_scratch_elements(kit.scratch, f);
            double sum[6] = {0}, center[3] = {0}, size = 1e-9;
            for (int i = 0; i < mild_sole_elements(kit.soles[f]); i++) {
                const double force[3] = {e.tangent_x[i], e.tangent_y[i], e.normal[i]};
                const double point[3] = {e.point_x[i], e.point_y[i], e.point_z[i]};
                double p[3], torque[3];
                for (int k = 0; k < 3; k++) {
                    p[k] = point[k] - kit.input.position[f][k];
                }
                kit_cross(p, force, torque);
                for (int k = 0; k < 3; k++) {
                    sum[k] += force[k];
                    sum[3 + k] += torque[k];
                    center[k] += point[k] * force[2];
                    size += fabs(force[k]);
                }
            }
            assert_true(check_states(&kit, f, &e));
            for (int k = 0; k < 3; k++) {
                worst = fmax(worst, fabs(sum[k] - r->force[k]) / size);
                worst = fmax(worst, fabs(sum[3 + k] - r->torque[k]) / size);
                if (r->contacts > 0) {
                    const double off = center[k] / r->force[2] - r->pressure_center[k];
                    worst_center = fmax(worst_center, fabs(off));
                }
            }
        }
        kit_close(&kit);
    }
    expect_below("elements against the wrench", worst, 1e-12);
    expect_below("pressure centre [m]", worst_center, 1e-12);
}

int main(int count, char **arguments) {
    if (count < 2) {
        problem_count = kit_draws(problem_count);
        kind_count = kit_draws(kind_count);
    } else { /* ground_test_solver COUNT FIRST */
        problem_count = kind_count = atoi(arguments[1]);
        first_problem = count > 2 ? atoi(arguments[2]) : first_problem;
        cmocka_set_test_filter("test_dense*");
    }
    return run_cases(open_soles, close_soles);
}
