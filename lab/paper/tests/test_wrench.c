/* The wrench's program against mechanics, and its solution against the conditions of Karush, Kuhn
 * and Tucker, on random feet and wrenches. */
#include "base/random.h"
#include "kit.h"
#include "paper/control/wrench.h"

#define WEIGHT 325.0 /* [N] */

static double drawn(Random *r, double low, double high) {
    return low + (high - low) * random_unit(r);
}

/* Yaw, then a small tilt. */
static void draw_rotation(Random *r, double m[9]) {
    const double yaw = drawn(r, -3, 3), tilt = drawn(r, -0.2, 0.2);
    const double c = cos(yaw), s = sin(yaw), a = cos(tilt), b = sin(tilt);
    const double turned[9] = {c, -s * a, s * b, s, c * a, -c * b, 0, b, a};
    memcpy(m, turned, sizeof turned);
}

static WrenchFoot draw_foot(Random *r, int f) {
    WrenchFoot foot = {.low = {drawn(r, -0.1, -0.03), -0.04},
                       .high = {drawn(r, 0.03, 0.15), drawn(r, 0.02, 0.05)},
                       .load = {0, drawn(r, 100, 600)},
                       .friction = drawn(r, 0.3, 0.9)};
    foot.point[0] = drawn(r, -0.2, 0.2);
    foot.point[1] = drawn(r, 0.05, 0.15) * (f ? -1 : 1);
    foot.point[2] = -drawn(r, 0.5, 0.65);
    draw_rotation(r, foot.rotation);
    for (int i = 0; i < WRENCH_MOTORS; i++) {
        foot.motor_rest[i] = drawn(r, -10, 10);
        foot.motor_limit[i] = drawn(r, 15, 60);
        for (int k = 0; k < WRENCH_SIZE; k++) {
            foot.motor_map[i][k] = k < 3 ? drawn(r, -0.3, 0.3) : drawn(r, -1, 1);
        }
    }
    return foot;
}

/* In the foot's axes. */
static void local(const WrenchFoot *foot, const double world[3], double l[3]) {
    for (int k = 0; k < 3; k++) {
        l[k] = foot->rotation[k] * world[0] + foot->rotation[3 + k] * world[1] +
               foot->rotation[6 + k] * world[2];
    }
}

/* By how much [N, N m] a foot's wrench breaks what the ground and the motors can. */
static double broken(const WrenchFoot *foot, const double *x) {
    double f[3], t[3], worst = 0;
    local(foot, x, f);
    local(foot, x + 3, t);
    const double side = foot->friction * f[2] / sqrt(2);
    worst = fmax(worst, fmax(foot->load[0] - f[2], f[2] - foot->load[1]));
    worst = fmax(worst, fmax(fabs(f[0]), fabs(f[1])) - side);
    /* the centre of pressure (-t_y, t_x) / f_z, times f_z */
    worst = fmax(worst, fmax(-t[1] - foot->high[0] * f[2], foot->low[0] * f[2] + t[1]));
    worst = fmax(worst, fmax(t[0] - foot->high[1] * f[2], foot->low[1] * f[2] - t[0]));
    worst = fmax(worst, fabs(t[2]) - foot->friction * f[2] * (foot->high[1] - foot->low[1]) / 2);
    for (int i = 0; i < WRENCH_MOTORS; i++) {
        double torque = foot->motor_rest[i];
        for (int k = 0; k < WRENCH_SIZE; k++) {
            torque -= foot->motor_map[i][k] * x[k];
        }
        worst = fmax(worst, fabs(torque) - foot->motor_limit[i]);
    }
    return worst;
}

/* |H x + f + sum of lambda a| at the best multipliers of the active rows, of the sign that belongs
 * to the side: nonnegative least squares, one multiplier after the other. The first-order condition
 * for a minimum of a convex program. */
static double stationarity(const WrenchProgram *p, const double *x, int *active) {
    double g[WRENCH_NUMBERS], lambda[WRENCH_ROWS] = {0}, norm = 0;
    int side[WRENCH_ROWS] = {0};
    for (int i = 0; i < WRENCH_NUMBERS; i++) {
        g[i] = p->f[i];
        for (int j = 0; j < WRENCH_NUMBERS; j++) {
            g[i] += p->h[i][j] * x[j];
        }
    }
    for (int row = 0; row < WRENCH_ROWS; row++) {
        double value = 0, scale = 0;
        for (int i = 0; i < WRENCH_NUMBERS; i++) {
            value += p->a[row][i] * x[i];
            scale += p->a[row][i] * p->a[row][i];
        }
        const double close = 1e-4 * sqrt(scale);
        side[row] = scale == 0                     ? 0
                    : value > p->high[row] - close ? 1
                    : value < p->low[row] + close  ? -1
                                                   : 0;
        *active += side[row] != 0;
    }
    for (int sweep = 0; sweep < 100000; sweep++) {
        for (int row = 0; row < WRENCH_ROWS; row++) {
            double along = 0, scale = 0;
            for (int i = 0; side[row] && i < WRENCH_NUMBERS; i++) {
                along += p->a[row][i] * g[i];
                scale += p->a[row][i] * p->a[row][i];
            }
            if (side[row]) {
                const double next = side[row] * fmax(side[row] * (lambda[row] - along / scale), 0);
                for (int i = 0; i < WRENCH_NUMBERS; i++) {
                    g[i] += (next - lambda[row]) * p->a[row][i];
                }
                lambda[row] = next;
            }
        }
    }
    for (int i = 0; i < WRENCH_NUMBERS; i++) {
        norm = fmax(norm, fabs(g[i]));
    }
    return norm;
}

TEST(solution_is_the_minimum) {
    WrenchSolver *solver = wrench_solver_create();
    assert_non_null(solver);
    double worst_gradient = 0, worst_limit = 0;
    int solved = 0, active = 0;
    for (uint32_t draw = 0; draw < 40; draw++) {
        Random r = random_at(3, draw, 0);
        const int feet = 1 + (int)(draw % 2);
        WrenchFoot foot[WRENCH_FEET];
        for (int f = 0; f < feet; f++) {
            foot[f] = draw_foot(&r, f);
        }
        const double wanted[WRENCH_SIZE] = {drawn(&r, -90, 90),  drawn(&r, -90, 90),
                                            drawn(&r, 100, 500), drawn(&r, -40, 40),
                                            drawn(&r, -40, 40),  drawn(&r, -10, 10)};
        static WrenchProgram program;
        double x[WRENCH_NUMBERS] = {0};
        wrench_program(foot, feet, wanted, &program);
        if (wrench_solve(solver, &program, x)) {
            continue; /* random levers can ask more of the motors than any force of the ground */
        }
        solved++;
        for (int f = 0; f < feet; f++) {
            worst_limit = fmax(worst_limit, broken(&foot[f], x + WRENCH_SIZE * f));
        }
        for (int i = feet * WRENCH_SIZE; i < WRENCH_NUMBERS; i++) {
            assert_true(fabs(x[i]) < 1e-9);
        }
        worst_gradient = fmax(worst_gradient, stationarity(&program, x, &active));
    }
    printf("%d solved, %d active rows: limits broken by %.1e, gradient left %.1e\n", solved, active,
           worst_limit, worst_gradient);
    assert_true(solved >= 25 && active > 2 * solved);
    assert_true(worst_limit < 1e-4);
    assert_true(worst_gradient < 1e-6); /* the gradient itself is some hundred */
    wrench_solver_destroy(solver);
}

/* Two level feet get what is wanted, to the small price of their own wrenches, when it is easy. */
TEST(easy_wrench_is_given) {
    WrenchSolver *solver = wrench_solver_create();
    WrenchFoot foot[WRENCH_FEET] = {0};
    for (int f = 0; f < WRENCH_FEET; f++) {
        foot[f] = (WrenchFoot){.point = {0.02, f ? -0.08 : 0.08, -0.6},
                               .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                               .low = {-0.06, -0.04},
                               .high = {0.15, 0.04},
                               .load = {0, 2 * WEIGHT},
                               .friction = 0.5};
        for (int i = 0; i < WRENCH_MOTORS; i++) {
            foot[f].motor_limit[i] = 100;
        }
    }
    const double wanted[WRENCH_SIZE] = {10, -8, WEIGHT, 3, -4, 1};
    static WrenchProgram program;
    double x[WRENCH_NUMBERS], worst = 0;
    wrench_program(foot, WRENCH_FEET, wanted, &program);
    assert_int_equal(wrench_solve(solver, &program, x), 0);
    for (int k = 0; k < WRENCH_SIZE; k++) {
        double sum = 0;
        for (int f = 0; f < WRENCH_FEET; f++) {
            const double *p = foot[f].point, *w = x + WRENCH_SIZE * f;
            const double moment[3] = {p[1] * w[2] - p[2] * w[1], p[2] * w[0] - p[0] * w[2],
                                      p[0] * w[1] - p[1] * w[0]};
            sum += k < 3 ? w[k] : w[k] + moment[k - 3];
        }
        worst = fmax(worst, fabs(sum - wanted[k]));
    }
    printf("wanted wrench missed by %.2f\n", worst);
    assert_true(worst < 0.2);
    wrench_solver_destroy(solver);
}

/* What was solved before leaves no trace: the same to the last bit. */
TEST(no_memory) {
    WrenchSolver *solver = wrench_solver_create();
    Random r = random_at(9, 1, 0);
    static WrenchProgram program[2];
    for (int p = 0; p < 2; p++) {
        WrenchFoot foot[WRENCH_FEET] = {draw_foot(&r, 0), draw_foot(&r, 1)};
        const double wanted[WRENCH_SIZE] = {60 - 120 * p, 40, 300 + 90 * p, 20, -30, 5};
        wrench_program(foot, WRENCH_FEET, wanted, &program[p]);
    }
    double first[WRENCH_NUMBERS], between[WRENCH_NUMBERS], again[WRENCH_NUMBERS];
    assert_int_equal(wrench_solve(solver, &program[0], first), 0);
    assert_int_equal(wrench_solve(solver, &program[1], between), 0);
    assert_int_equal(wrench_solve(solver, &program[0], again), 0);
    assert_memory_equal(first, again, sizeof first);
    assert_memory_not_equal(first, between, sizeof first);
    wrench_solver_destroy(solver);
}

/* A foot that may carry nothing gets nothing. */
TEST(unloaded_foot_is_free) {
    WrenchSolver *solver = wrench_solver_create();
    Random r = random_at(5, 1, 0);
    WrenchFoot foot[WRENCH_FEET] = {draw_foot(&r, 0), draw_foot(&r, 1)};
    for (int f = 0; f < WRENCH_FEET; f++) {
        for (int i = 0; i < WRENCH_MOTORS; i++) {
            foot[f].motor_limit[i] = 1e4;
        }
    }
    foot[1].load[1] = 0;
    const double wanted[WRENCH_SIZE] = {0, 0, WEIGHT};
    static WrenchProgram program;
    double x[WRENCH_NUMBERS] = {0};
    wrench_program(foot, WRENCH_FEET, wanted, &program);
    assert_int_equal(wrench_solve(solver, &program, x), 0);
    for (int k = 0; k < WRENCH_SIZE; k++) {
        assert_true(fabs(x[WRENCH_SIZE + k]) < 1e-5);
    }
    assert_true(x[2] > 50);
    wrench_solver_destroy(solver);
}

TEST_MAIN(NULL, NULL)
