/* The contact problem: both solvers against each other and against a dense slow reference; what a
 * solution reports; and MILD_SOLVER_EXPLICIT, the paper's Algorithm 1 to the letter, against its
 * equations. `ground_test_solver COUNT [FIRST]` runs the reference alone, on problems
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

/* ---- the explicit solver ---- */

static MildSole *plate;

static int open_plate(void **state) {
    (void)state;
    plate = kit_plate(5, 3);
    return 0;
}

static int close_plate(void **state) {
    (void)state;
    mild_sole_destroy(plate);
    return 0;
}

/* A level plate of 15 elements at a depth, on sand. */
static void open_kit(Kit *kit, double depth, double dt) {
    const MildMaterial sand = mild_material_default();
    kit_open(kit, 1, plate, plate, &sand, dt);
    kit->mass[0] = 8.0;
    kit->inertia[0] = 0.05;
    kit->input.solver = MILD_SOLVER_EXPLICIT;
    kit->input.position[0][2] = -depth - mild_sole_z(plate);
    kit_inverse_inertia(kit);
}

/* The free motion of a step under a force [N]. */
static void push(Kit *kit, double x, double y, double z) {
    const double force[1][3] = {{x, y, z}};
    kit_free(kit, force);
}

/* Eqs 1 to 5 of one element, at the depth u and the speed w. */
static double printed_force(const MildMaterial *m, double pitch, double u, double w) {
    const double s = pitch * pitch, R = sqrt(s / 3.14159265358979323846);
    const double kappa = m->sigma_cone * s / cos(m->alpha);
    const double end = R * tan(m->alpha) / m->nu, t = fmin(u / end, 1.0);
    const double recruited = end * (t - t * t + t * t * t / 3.0);
    const double mass_rate = m->c_g * m->phi * m->rho * m->nu * s;
    const double drag = m->c_d * mass_rate * (1.0 - t) * (1.0 - t) * w * w;
    return (m->k_pen - kappa) * recruited + kappa * u + drag;
}

/* The force of the state before the step, on the way up too and in an imprint, whatever the step
 * does. */
TEST_WITH(normals_are_printed, open_plate, close_plate) {
    const double speeds[] = {0.0, 0.3, -0.3};
    for (int i = 0; i < 9; i++) {
        const double depth = 0.004 + 0.01 * (i / 3), w = speeds[i % 3];
        Kit kit;
        open_kit(&kit, depth + 0.02, 5e-3);
        push(&kit, 0, 0, -500);
        kit_solve(&kit);
        kit_advance(&kit); /* it has been deeper */
        kit.input.position[0][2] = -depth - mild_sole_z(plate);
        memset(kit.input.velocity[0], 0, sizeof kit.input.velocity[0]);
        kit.input.velocity[0][2] = -w;
        push(&kit, 0, 0, -2000);
        kit_solve(&kit);
        const MildElements e = mild_scratch_elements(kit.scratch, 0);
        const double wanted =
            printed_force(&kit.terrain.materials[0], mild_sole_pitch(plate), depth, w);
        for (int k = 0; k < mild_sole_elements(plate); k++) {
            assert_true(fabs(e.normal[k] - wanted) < 1e-9 * wanted);
        }
        assert_true(kit.result.converged);
        kit_close(&kit);
    }
}

/* [m/s] Speed of an element along the ground after the step. */
static void slid(const Kit *kit, int k, double v[2]) {
    const MildElements e = mild_scratch_elements(kit->scratch, 0);
    const double *V = kit->result.velocity;
    const double p[3] = {e.point_x[k], e.point_y[k], e.point_z[k]};
    const double *at = kit->input.position[0];
    v[0] = V[0] + V[4] * (p[2] - at[2]) - V[5] * (p[1] - at[1]);
    v[1] = V[1] + V[5] * (p[0] - at[0]) - V[3] * (p[2] - at[2]);
}

/* Eq 13 at its fixed point: an element is at rest, or at its bound against its motion. */
TEST_WITH(friction_is_a_cone, open_plate, close_plate) {
    int stuck = 0, sliding = 0;
    for (int i = 0; i < 12; i++) {
        Kit kit;
        open_kit(&kit, 0.01, 5e-3);
        kit.terrain.materials[0].k_drift = kit.terrain.materials[0].b_drift = 0.0;
        kit.input.tolerance = 1e-13;
        kit.input.max_iterations = 20000;
        push(&kit, 6.0 * i, -2.5 * i, 0);
        kit_solve(&kit);
        assert_true(kit.result.converged);
        const MildElements e = mild_scratch_elements(kit.scratch, 0);
        for (int k = 0; k < mild_sole_elements(plate); k++) {
            double v[2];
            slid(&kit, k, v);
            const double bound = kit.terrain.materials[0].mu * e.normal[k];
            const double size = hypot(e.tangent_x[k], e.tangent_y[k]), speed = hypot(v[0], v[1]);
            assert_true(size <= bound * (1 + 1e-9));
            if (size < bound * (1 - 1e-6)) {
                assert_true(speed < 1e-6);
                stuck++;
            } else if (speed > 1e-4) {
                const double along = (e.tangent_x[k] * v[0] + e.tangent_y[k] * v[1]) / speed;
                assert_true(fabs(along + size) < 1e-4 * size);
                sliding++;
            }
        }
        kit_close(&kit);
    }
    print_message("%d elements stuck, %d slid\n", stuck, sliding);
    assert_true(stuck > 30 && sliding > 30);
}

/* Eq 14 against the velocity before the step: without friction it is all that is left. */
TEST_WITH(drift_is_printed, open_plate, close_plate) {
    Kit kit;
    open_kit(&kit, 0.02, 1e-3);
    MildMaterial *m = &kit.terrain.materials[0];
    m->mu = 0.0;
    m->k_drift = 4000.0;
    m->b_drift = 7.0;
    double path = 0.0;
    for (int step = 0; step < 20; step++) {
        kit.input.velocity[0][0] = 0.3;
        kit.input.velocity[0][1] = -0.4;
        kit.input.velocity[0][2] = 0.0;
        push(&kit, 0, 0, 0);
        kit.input.free_velocity[2] = 0.0;
        kit_solve(&kit);
        const MildElements e = mild_scratch_elements(kit.scratch, 0);
        const double size = 4000.0 * path * 0.02 + 7.0 * 0.5;
        assert_true(fabs(e.tangent_x[7] + 0.6 * size) < 1e-6 * size);
        assert_true(fabs(e.tangent_y[7] - 0.8 * size) < 1e-6 * size);
        double v[2];
        slid(&kit, 7, v);
        path += 1e-3 * hypot(v[0], v[1]);
        mild_ground_advance(kit.ground, &kit.terrain, &kit.input, kit.scratch, &kit.result);
    }
    kit_close(&kit);
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
