/* The walk's plan with feet and a centre of mass that follow it exactly: where the feet go, for how
 * long, and that the targets are each other's derivatives. */
#include "kit.h"

#include "base/random.h"
#include "paper/control/walk.h"
#include "paper/control/wrench.h"

#define DT 0.0025

/* A robot that follows its command, and what was seen of it. */
typedef struct {
    WalkDef def;
    Walk walk;
    WalkState state;
    WalkTarget target, before;
    double time;
    double apex;    /* [m] highest point of a swing over its start */
    double nearest; /* [m] smallest lateral distance of the feet */
    double slip;    /* [m/s, m/s^2] largest error of velocity and acceleration */
    int touches;    /* steps */
} Ideal;

static Ideal ideal_start(int left) {
    Ideal ideal = {.def = walk_def_default(), .nearest = 1e9, .target.swing = -1};
    ideal.state.support[left][1] = 0.08;
    ideal.state.support[1 - left][1] = -0.08;
    ideal.state.dcm[2] = ideal.def.height;
    walk_start(&ideal.walk, &ideal.def, &ideal.state);
    return ideal;
}

/* The swing's targets by differences, within one swing whose foothold does not move. */
static void check_rates(Ideal *ideal) {
    const WalkTarget *now = &ideal->target, *old = &ideal->before;
    const int late = ideal->walk.time > ideal->walk.duration; /* it feels for the ground */
    if (now->swing < 0 || old->swing != now->swing || late) {
        return;
    }
    for (int k = 0; k < 3; k++) {
        const double v = (now->position[k] - old->position[k]) / DT;
        const double a = (now->velocity[k] - old->velocity[k]) / DT;
        const double v_mean = 0.5 * (now->velocity[k] + old->velocity[k]);
        const double a_mean = 0.5 * (now->acceleration[k] + old->acceleration[k]);
        ideal->slip = fmax(ideal->slip, fmax(fabs(v - v_mean), 0.1 * fabs(a - a_mean)));
    }
}

/* For a time or for a number of steps, whichever ends first. */
static void ideal_run(Ideal *ideal, double vx, double vy, double wz, double seconds, int steps) {
    const double command[3] = {vx, vy, wz};
    const int last = ideal->touches + steps;
    for (double t = 0; t < seconds && ideal->touches < last; t += DT) {
        const int swung = ideal->target.swing;
        WalkState *state = &ideal->state;
        walk_advance(&ideal->walk, &ideal->def, state, command, DT);
        walk_target(&ideal->walk, &ideal->def, state, &ideal->target);
        check_rates(ideal);
        const int swing = ideal->target.swing;
        memset(state->force, 0, sizeof state->force);
        if (swing >= 0) {
            memcpy(state->support[swing], ideal->target.position, sizeof state->support[swing]);
            state->yaw[swing] = ideal->target.yaw;
            ideal->apex = fmax(ideal->apex, state->support[swing][2]);
            state->force[swing] = ideal->walk.time >= ideal->walk.duration - DT / 2 ? 100 : 0;
        }
        ideal->touches += swung >= 0 && swing < 0;
        memcpy(state->dcm, ideal->target.dcm, sizeof state->dcm);
        const double *a = state->support[0], *b = state->support[1];
        const double heading = ideal->walk.heading;
        const double apart = cos(heading) * (a[1] - b[1]) - sin(heading) * (a[0] - b[0]);
        ideal->nearest = fmin(ideal->nearest, fabs(apart));
        ideal->before = ideal->target;
        ideal->time += DT;
    }
}

static void middle(const Ideal *ideal, double point[2]) {
    for (int k = 0; k < 2; k++) {
        point[k] = 0.5 * (ideal->state.support[0][k] + ideal->state.support[1][k]);
    }
}

/* Ten steps at the full command move the middle of the feet by ten steps. */
TEST(speeds) {
    static const double commands[][2] = {{0.6, 0}, {-0.4, 0}, {0, 0.2}, {0.3, -0.3}};
    for (int c = 0; c < 4; c++) {
        for (int left = 0; left < 2; left++) {
            Ideal ideal = ideal_start(left);
            const double T = ideal.def.step_time;
            double from[2], to[2];
            ideal_run(&ideal, commands[c][0], commands[c][1], 0, 20, 10);
            const int steps = ideal.touches;
            middle(&ideal, from);
            ideal_run(&ideal, commands[c][0], commands[c][1], 0, 20, 10);
            middle(&ideal, to);
            printf("left %d, command %.1f %.1f: %.3f %.3f m in %d steps, feet %.3f m apart, apex "
                   "%.3f m\n",
                   left, commands[c][0], commands[c][1], to[0] - from[0], to[1] - from[1],
                   ideal.touches - steps, ideal.nearest, ideal.apex);
            assert_int_equal(ideal.touches, steps + 10);
            assert_true(fabs(to[0] - from[0] - 10 * T * commands[c][0]) < 0.01);
            assert_true(fabs(to[1] - from[1] - 10 * T * commands[c][1]) < 0.01);
            assert_true(ideal.nearest > ideal.def.width_least - 2e-3);
            assert_true(fabs(ideal.apex - ideal.def.clearance) < 1e-3);
            assert_true((ideal.state.support[left][1] > ideal.state.support[1 - left][1]));
        }
    }
}

/* Feet and base turn with the command. */
TEST(turns) {
    Ideal ideal = ideal_start(0);
    ideal_run(&ideal, 0.2, 0, 0.5, 20, 10);
    const double from = ideal.walk.heading;
    ideal_run(&ideal, 0.2, 0, 0.5, 20, 10);
    const double turned = ideal.walk.heading - from;
    assert_true(fabs(turned - 0.5 * 10 * ideal.def.step_time) < 1e-9);
    for (int f = 0; f < WALK_FEET; f++) {
        const double behind = remainder(ideal.walk.heading - ideal.state.yaw[f], 6.283185307179586);
        assert_true(fabs(behind) < 2 * 0.5 * ideal.def.step_time);
    }
}

/* Out of a stand and back: the last steps bring the feet side by side, and p goes between them. */
TEST(stops) {
    Ideal ideal = ideal_start(0);
    double point[2];
    ideal_run(&ideal, 0, 0, 0, 2, 99);
    assert_true(ideal.walk.phase == WALK_STAND && ideal.touches == 0);
    ideal_run(&ideal, 0.5, 0, 0, 4, 99);
    assert_true(ideal.walk.phase != WALK_STAND && ideal.touches >= 6);
    ideal_run(&ideal, 0, 0, 0, 6, 99);
    assert_true(ideal.walk.phase == WALK_STAND);
    assert_true(fabs(ideal.state.support[0][0] - ideal.state.support[1][0]) < 0.02);
    middle(&ideal, point);
    assert_true(fabs(ideal.target.point[0] - point[0]) < 1e-3);
    assert_true(fabs(ideal.target.point[1] - point[1]) < 1e-3);
    assert_true(ideal.target.still && ideal.target.swing < 0);
}

/* The targets of a swing are each other's derivatives, to the order of the differences. */
TEST(rates) {
    Ideal ideal = ideal_start(0);
    ideal.def.acceleration = 1e9; /* a command that changes moves the foothold */
    ideal_run(&ideal, 0.6, 0.1, 0, 4, 99);
    printf("rates off by %.1e\n", ideal.slip);
    assert_true(ideal.slip < 0.05);
}

/* The plan of the DCM against its differential equation b xi' = xi - p, integrated step by step. */

static double point_at(const DcmSegment *s, int k, double t) {
    return s->from[k] + (s->to[k] - s->from[k]) * t / s->duration +
           s->sway[k] * cos(s->angle + s->rate * t);
}

/* Runge and Kutta's fourth order over one segment. */
static double integrate(const DcmSegment *s, int k, double b, double xi) {
    const int steps = 2000;
    const double h = s->duration / steps;
    for (int i = 0; i < steps; i++) {
        const double t = i * h;
        const double p0 = point_at(s, k, t), p1 = point_at(s, k, t + h / 2),
                     p2 = point_at(s, k, t + h);
        const double k1 = (xi - p0) / b, k2 = (xi + h / 2 * k1 - p1) / b;
        const double k3 = (xi + h / 2 * k2 - p1) / b, k4 = (xi + h * k3 - p2) / b;
        xi += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
    return xi;
}

/* From where the plan says, xi arrives at rest at the end of the last segment. Errors grow with
 * exp(t / b), here 2e4. */
TEST(plan_ends_at_rest) {
    const double b = 0.24;
    double worst = 0;
    for (uint32_t draw = 0; draw < 20; draw++) {
        enum { COUNT = 6 };
        Random r = random_at(7, draw, 0);
        DcmSegment segments[COUNT] = {0};
        double xi[3];
        for (int s = 0; s < COUNT; s++) {
            segments[s].duration = 0.3 + 0.2 * random_unit(&r);
            segments[s].angle = 3 * random_unit(&r);
            segments[s].rate = 9 * random_unit(&r);
            for (int k = 0; k < 3; k++) {
                segments[s].from[k] = s ? segments[s - 1].to[k] : random_unit(&r);
                segments[s].to[k] = random_unit(&r);
                segments[s].sway[k] = s + 1 < COUNT ? 0.1 * random_unit(&r) : 0;
            }
        }
        segments[2].duration = 0; /* is nothing; the next one begins where it does */
        dcm_plan(segments, COUNT, b, xi);
        for (int k = 0; k < 3; k++) {
            double at = xi[k];
            for (int s = 0; s < COUNT; s++) {
                at = s == 2 ? at : integrate(&segments[s], k, b, at);
            }
            worst = fmax(worst, fabs(at - segments[COUNT - 1].to[k]));
        }
        double point[3];
        dcm_point(&segments[0], point);
        assert_true(fabs(point[1] - point_at(&segments[0], 1, 0)) < 1e-15);
    }
    printf("end of the plan missed by %.1e m\n", worst);
    assert_true(worst < 1e-6);
}

/* Where p rests, so does xi; after a step of p it was there before by exp(-T / b). */
TEST(rest_and_step) {
    const double b = 0.25, step = 0.1, wait = 0.4;
    DcmSegment segments[2] = {{.duration = wait}, {.from = {step}, .to = {step}, .duration = 1}};
    double xi[3];
    dcm_plan(segments + 1, 1, b, xi);
    assert_true(xi[0] == step && xi[1] == 0);
    dcm_plan(segments, 2, b, xi);
    assert_true(fabs(xi[0] - step * exp(-wait / b)) < 1e-15);
}

/* The wrench's program against mechanics, and its solution against the conditions of Karush, Kuhn
 * and Tucker, on random feet and wrenches. */

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
