/* The contact problem: both solvers against each other and against a dense slow reference;
 * symmetries; purity. `ground_test_solver COUNT [FIRST]` runs the reference alone, on problems
 * FIRST .. FIRST + COUNT - 1 of cones on level ground and of every other kind. */
#include "dense.h"
#include "problems.h"

#include "ground/step/scratch.h"

static int first_problem = 0, problem_count = 2000, kind_count = 100;

static double twist_difference(const Kit *kit, const double *a, const double *b) {
    double difference = 0.0, size = 1e-3;
    for (int i = 0; i < 6 * kit->feet; i++) {
        difference = fmax(difference, fabs(a[i] - b[i]));
        size = fmax(size, fmax(fabs(a[i]), fabs(kit->input.velocity[i / 6][i % 6])));
    }
    return difference / size;
}

TEST(test_newton_converges) {
    uint64_t random = 21;
    int problems = 0, failed = 0, most = 0;
    double total = 0.0, pull = 0.0, excess = 0.0;
    for (int t = 0; t < kit_draws(6000); t++) {
        Kit kit;
        if (random_problem(&kit, &random, t % 4 == 0)) {
            problems++;
            failed += !kit.result.converged;
            most = kit.result.iterations > most ? kit.result.iterations : most;
            total += kit.result.iterations;
            for (int f = 0; f < kit.feet; f++) {
                MildElements e = mild_scratch_elements(kit.scratch, f);
                for (int i = 0; i < mild_sole_elements(kit.soles[f]); i++) {
                    pull = fmin(pull, e.normal[i]);
                    if (e.depth[i] <= 0.0) { /* no drift resistance: Coulomb's bound alone */
                        excess = fmax(excess, hypot(e.tangent_x[i], e.tangent_y[i]) -
                                                  kit.terrain.materials[0].mu * e.normal[i]);
                    }
                }
            }
        }
        kit_close(&kit);
    }
    print_message("newton: %d problems, %d not converged, %.1f iterations in the mean, %d at most; "
                  "pull %.1e N, beyond the cone %.1e N\n",
                  problems, failed, total / problems, most, -pull, excess);
    assert_true(problems > kit_draws(4000));
    assert_int_equal(failed, 0);
    assert_true(pull >= 0.0);
    assert_true(excess < 1e-6);
}

TEST(test_solvers_agree) {
    uint64_t random = 22;
    int compared = 0, slow = 0;
    double worst = 0.0;
    for (int t = 0; t < kit_draws(250); t++) {
        Kit kit;
        if (random_problem(&kit, &random, t % 2) && kit.result.converged) {
            MildContactResult newton = kit.result;
            kit.input.solver = MILD_SOLVER_GAUSS_SEIDEL;
            kit.input.max_iterations = 2000;
            kit.input.tolerance = 1e-12;
            kit_solve(&kit);
            compared += kit.result.converged;
            slow += !kit.result.converged;
            if (kit.result.converged) {
                worst = fmax(worst, twist_difference(&kit, newton.velocity, kit.result.velocity));
            }
        }
        kit_close(&kit);
    }
    print_message("newton against sweeps: %d problems, worst twist difference %.1e; %d need more "
                  "than 2000 sweeps\n",
                  compared, worst, slow);
    assert_true(compared > kit_draws(150));
    assert_true(worst < 1e-6);
}

/* ---- the dense reference ---- */

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

static void print_compared(const char *what, const Compared *seen) {
    print_message("%s: %d problems, worst difference %.1e of the change by contact in kinetic "
                  "energy's metric (number %d), "
                  "%.1e in the twist (number %d)\n",
                  what, seen->problems, seen->energy.value, seen->energy.number, seen->twist.value,
                  seen->twist.number);
}

/* Sweeps get 500 each; where they need more they are left out. */
TEST(test_dense_reference) {
    static Dense dense;
    Compared newton = {0}, sweeps = {0};
    int touching = 0, unsolved = 0, unsettled = 0, long_way = 0, singular = 0;
    for (int number = first_problem; number < first_problem + problem_count; number++) {
        Kit kit;
        if (numbered_problem(&kit, number)) {
            MildContactResult answer = kit.result;
            dense_open(&dense, &kit);
            int settled = dense_solve(&dense);
            touching++;
            unsettled += !settled;
            unsolved += !answer.converged;
            long_way += answer.iterations > 12;
            singular += dense.rank < dense.n;
            if (settled) {
                compare(&newton, &dense, answer.velocity, dense.twist, number);
            }
            kit.input.solver = MILD_SOLVER_GAUSS_SEIDEL;
            kit.input.max_iterations = 500;
            kit.input.tolerance = 1e-12;
            kit_solve(&kit);
            if (kit.result.converged) {
                compare(&sweeps, &dense, kit.result.velocity, answer.velocity, number);
            }
        }
        kit_close(&kit);
    }
    print_message("dense reference: %d of %d problems touch, %d with a singular A, %d in more than "
                  "12 Newton steps; "
                  "not solved: %d by newton, %d by the reference\n",
                  touching, problem_count, singular, long_way, unsolved, unsettled);
    print_compared("newton against the reference", &newton);
    print_compared("sweeps against newton", &sweeps);
    assert_int_equal(unsolved + unsettled, 0);
    assert_true(newton.energy.value < 1e-6 && newton.twist.value < 1e-6);
    assert_true(sweeps.energy.value < 1e-6 && sweeps.twist.value < 1e-6);
}

/* The same on every other kind of ground; a line for each. Where friction has two solutions the
 * reference starts again from Newton's and must stay there. */
TEST(test_dense_kinds) {
    static Dense dense;
    int wrong = 0;
    for (Kind kind = 0; kind < KINDS; kind++) {
        Compared newton = {0}, sweeps = {0};
        Worst residual = {0};
        int unsolved = 0, unsettled = 0, most = 0, several = 0;
        for (int number = first_problem; number < first_problem + kind_count; number++) {
            Kit kit;
            MildMap *map;
            if (kind_problem(&kit, &map, kind, number)) {
                MildContactResult answer = kit.result;
                dense_open(&dense, &kit);
                int settled = dense_solve(&dense);
                unsettled += !settled;
                unsolved += !answer.converged;
                most = answer.iterations > most ? answer.iterations : most;
                if (answer.converged) {
                    worst_of(&residual, answer.residual, number);
                } else {
                    print_message("%s: newton leaves number %d\n", kind_names[kind], number);
                }
                if (settled && answer.converged &&
                    dense_distance(&dense, answer.velocity, dense.twist) > 1e-6) {
                    dense_start(&dense,
                                answer.velocity); /* Newton's answer is another solution, or none */
                    settled = dense_solve(&dense);
                    several++;
                }
                if (settled && answer.converged) {
                    compare(&newton, &dense, answer.velocity, dense.twist, number);
                }
                kit.input.solver = MILD_SOLVER_GAUSS_SEIDEL;
                kit.input.max_iterations = 200;
                kit.input.tolerance = 1e-12;
                kit_solve(&kit);
                if (kit.result.converged && answer.converged) {
                    compare(&sweeps, &dense, kit.result.velocity, answer.velocity, number);
                }
            }
            kit_close(&kit);
            mild_map_destroy(map);
        }
        print_message("%s: %d problems, worst energy error %.1e (number %d), twist %.1e (number "
                      "%d), worst residual %.1e, "
                      "iterations at most %d; several solutions in %d; sweeps against newton in "
                      "%d, %.1e (number %d); "
                      "not solved: %d by newton, %d by the reference\n",
                      kind_names[kind], newton.problems, newton.energy.value, newton.energy.number,
                      newton.twist.value, newton.twist.number, residual.value, most, several,
                      sweeps.problems, sweeps.energy.value, sweeps.energy.number, unsolved,
                      unsettled);
        wrong +=
            unsolved + unsettled > 0 || !(newton.energy.value < 1e-8 && newton.twist.value < 1e-7 &&
                                          sweeps.energy.value < 1e-6);
    }
    assert_int_equal(wrong, 0);
}

/* Two whole feet, mu > 1: what an earlier Newton needed more than 100 steps for among 42 750
 * problems. And a foot that stops on sand blended with bekker's ground: its drag depends on both
 * curves. */
TEST(test_hard_problems) {
    static const int numbers[4] = {12229, 15949, 17844, 27024};
    static Dense dense;
    Compared newton = {0};
    for (int k = 0; k < 4; k++) {
        Kit kit;
        assert_true(numbered_problem(&kit, numbers[k]));
        dense_open(&dense, &kit);
        assert_true(dense_solve(&dense) && kit.result.converged);
        compare(&newton, &dense, kit.result.velocity, dense.twist, numbers[k]);
        kit_close(&kit);
    }
    Kit kit;
    MildMap *map;
    assert_true(kind_problem(&kit, &map, BLEND, 1404));
    dense_open(&dense, &kit);
    assert_true(dense_solve(&dense) && kit.result.converged);
    compare(&newton, &dense, kit.result.velocity, dense.twist, 1404);
    kit_close(&kit);
    mild_map_destroy(map);
    print_compared("hard problems", &newton);
    assert_true(newton.energy.value < 1e-6 && newton.twist.value < 1e-6);
}

/* ---- invariances ---- */

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

static void turn_vector(double *v, double c, double s) {
    double x = c * v[0] - s * v[1], y = s * v[0] + c * v[1];
    v[0] = x;
    v[1] = y;
}

static void solve_freely(Kit *kit) {
    kit_inverse_inertia(kit);
    kit_free(kit, NULL);
    kit_solve(kit);
}

/* How far the answer of the problem turned by an angle about z is from the turned answer. */
static double turned_difference(const Kit *a, const MildMaterial *m, double angle) {
    const double c = cos(angle), s = sin(angle), turn[3] = {0, 0, angle};
    double difference = 0.0;
    Kit b;
    kit_open(&b, 2, soles[0], soles[1], m, 1e-3);
    kit_copy_input(&b, a);
    memcpy(b.mass, a->mass, sizeof a->mass);
    memcpy(b.inertia, a->inertia, sizeof a->inertia);
    memcpy(b.center, a->center, sizeof a->center);
    for (int f = 0; f < 2; f++) {
        turn_vector(b.input.position[f], c, s);
        kit_rotate(b.input.rotation[f], turn);
        turn_vector(b.input.velocity[f], c, s);
        turn_vector(b.input.velocity[f] + 3, c, s);
    }
    solve_freely(&b);
    if (a->result.converged && b.result.converged) {
        double expected[12];
        memcpy(expected, a->result.velocity, sizeof expected);
        for (int k = 0; k < 4; k++) {
            turn_vector(expected + 3 * k, c, s);
        }
        difference = twist_difference(&b, expected, b.result.velocity);
    }
    kit_close(&b);
    return difference;
}

/* The same for its mirror image: foot 0 takes foot 1's place; the right sole is the left one's
 * image. */
static double mirrored_difference(const Kit *a, const MildMaterial *m) {
    double expected[12], difference = 0.0;
    Kit b;
    kit_open(&b, 2, soles[0], soles[1], m, 1e-3);
    for (int f = 0; f < 2; f++) {
        int g = 1 - f;
        b.mass[f] = a->mass[g];
        b.inertia[f] = a->inertia[g];
        for (int k = 0; k < 3; k++) {
            double sign = k == 1 ? -1.0 : 1.0;
            b.center[f][k] = sign * a->center[g][k];
            b.input.position[f][k] = sign * a->input.position[g][k];
            b.input.velocity[f][k] = sign * a->input.velocity[g][k];
            b.input.velocity[f][3 + k] = -sign * a->input.velocity[g][3 + k];
            for (int j = 0; j < 3; j++) {
                b.input.rotation[f][3 * k + j] =
                    sign * (j == 1 ? -1.0 : 1.0) * a->input.rotation[g][3 * k + j];
            }
            expected[6 * f + k] = sign * a->result.velocity[6 * g + k];
            expected[6 * f + 3 + k] = -sign * a->result.velocity[6 * g + 3 + k];
        }
    }
    solve_freely(&b);
    if (a->result.converged && b.result.converged) {
        difference = twist_difference(&b, expected, b.result.velocity);
    }
    kit_close(&b);
    return difference;
}

/* The same problem seen from axes turned about z (or mirrored in y) must give the turned answer. */
TEST(test_symmetry) {
    uint64_t random = 24;
    double worst_turn = 0.0, worst_mirror = 0.0;
    for (int t = 0; t < kit_draws(300); t++) {
        MildMaterial m = kit_material(&random);
        Kit a;
        kit_open(&a, 2, soles[0], soles[1], &m, 1e-3);
        kit_random_state(&a, &random);
        solve_freely(&a);
        const double angle = kit_uniform(&random, -3.0, 3.0);
        worst_turn = fmax(worst_turn, turned_difference(&a, &m, angle));
        worst_mirror = fmax(worst_mirror, mirrored_difference(&a, &m));
        kit_close(&a);
    }
    print_message("symmetry: worst twist difference turned %.1e, mirrored %.1e\n", worst_turn,
                  worst_mirror);
    assert_true(worst_turn < 1e-6 && worst_mirror < 1e-6);
}

/* The outline drawn the other way round and mirrored columns change the order of the elements, not
 * the answer: a plate turned by half a turn in its own frame is the same plate with its elements in
 * reverse order. */
TEST(test_element_order) {
    uint64_t random = 25;
    double worst = 0.0;
    MildSole *plate = kit_plate(11, 7);
    for (int t = 0; t < 200; t++) {
        MildMaterial m = kit_material(&random);
        Kit a, b;
        kit_open(&a, 1, plate, NULL, &m, 1e-3);
        kit_random_state(&a, &random);
        kit_inverse_inertia(&a);
        kit_free(&a, NULL);
        kit_open(&b, 1, plate, NULL, &m, 1e-3);
        kit_copy_input(&b, &a);
        for (int k = 0; k < 3; k++) {
            b.input.rotation[0][3 * k] *= -1.0;
            b.input.rotation[0][3 * k + 1] *= -1.0;
        }
        kit_solve(&a);
        kit_solve(&b);
        if (a.result.converged && b.result.converged) {
            worst = fmax(worst, twist_difference(&a, a.result.velocity, b.result.velocity));
        }
        kit_close(&a);
        kit_close(&b);
    }
    print_message("element order reversed: worst twist difference %.1e\n", worst);
    mild_sole_destroy(plate);
    assert_true(worst < 1e-6);
}

/* solve reads the memory and may be repeated; scratch carries nothing from one problem to the next.
 */
TEST(test_pure) {
    uint64_t random = 26;
    for (int t = 0; t < 200; t++) {
        Kit kit;
        random_problem(&kit, &random, 0);
        kit.input.solver = t % 5 ? MILD_SOLVER_NEWTON : MILD_SOLVER_GAUSS_SEIDEL;
        kit.input.max_iterations = 50;
        void *before = malloc(kit.bytes);
        memcpy(before, kit.ground, kit.bytes);
        kit_solve(&kit);
        MildContactResult first = kit.result;
        MildContactInput input = kit.input;
        kit.input.velocity[0][0] += 0.3; /* another problem in between */
        kit_solve(&kit);
        kit.input = input;
        kit_solve(&kit);
        assert_memory_equal(before, kit.ground, kit.bytes);
        assert_memory_equal(&first, &kit.result, sizeof first);
        MildError error;
        MildScratch *fresh = mild_scratch_create(kit.soles, kit.feet, &error);
        mild_ground_solve(kit.ground, &kit.terrain, &kit.input, fresh, &kit.result);
        assert_memory_equal(&first, &kit.result, sizeof first);
        mild_scratch_destroy(fresh);
        free(before);
        kit_close(&kit);
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

/* Wrench, zero moment points, pressure centre and element arrays fit together. */
TEST(test_outputs) {
    uint64_t random = 27;
    double worst = 0.0, worst_zmp = 0.0;
    for (int t = 0; t < kit_draws(500); t++) {
        Kit kit;
        if (random_problem(&kit, &random, 0)) {
            for (int f = 0; f < kit.feet; f++) {
                const MildFootResult *r = &kit.result.foot[f];
                MildElements e = mild_scratch_elements(kit.scratch, f);
                double sum[6] = {0}, size = 1e-9;
                for (int i = 0; i < mild_sole_elements(kit.soles[f]); i++) {
                    double force[3] = {e.tangent_x[i], e.tangent_y[i], e.normal[i]}, torque[3];
                    double p[3] = {e.point_x[i] - kit.input.position[f][0],
                                   e.point_y[i] - kit.input.position[f][1],
                                   e.point_z[i] - kit.input.position[f][2]};
                    kit_cross(p, force, torque);
                    for (int k = 0; k < 3; k++) {
                        sum[k] += force[k];
                        sum[3 + k] += torque[k];
                        size += fabs(force[k]);
                    }
                }
                for (int k = 0; k < 3; k++) {
                    worst = fmax(worst, fabs(sum[k] - r->force[k]) / size);
                    worst = fmax(worst, fabs(sum[3 + k] - r->torque[k]) / size);
                }
                assert_true(check_states(&kit, f, &e));
                if (r->contacts == 0) {
                    continue;
                }
                double center[3] = {0};
                for (int i = 0; i < mild_sole_elements(kit.soles[f]); i++) {
                    center[0] += e.point_x[i] * e.normal[i];
                    center[1] += e.point_y[i] * e.normal[i];
                    center[2] += e.point_z[i] * e.normal[i];
                }
                for (int k = 0; k < 3; k++) {
                    worst_zmp =
                        fmax(worst_zmp, fabs(center[k] / r->force[2] - r->pressure_center[k]));
                }
                double along[3], F = sqrt(r->force[0] * r->force[0] + r->force[1] * r->force[1] +
                                          r->force[2] * r->force[2]);
                kit_cross(r->zmp_axis, r->force,
                          along); /* what is left of the torque is parallel to the force */
                double left[3] = {r->torque[0] - along[0], r->torque[1] - along[1],
                                  r->torque[2] - along[2]},
                       cross[3];
                kit_cross(left, r->force, cross);
                for (int k = 0; k < 3; k++) {
                    worst_zmp = fmax(worst_zmp, fabs(cross[k]) / (F * F));
                }
            }
        }
        kit_close(&kit);
    }
    print_message("outputs: elements against wrench %.1e, central axis %.1e m\n", worst, worst_zmp);
    assert_true(worst < 1e-12);
    assert_true(worst_zmp < 1e-12);
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
