#include "paper/control/wrench.h"

#include <math.h>
#include <stdalign.h>
#include <stdlib.h>
#include <string.h>

#include <api.h>
#include <utils.h>

#define LOOSE 1e6 /* [N, N m] bound of what has none */
/* Squared weights of the errors: [1/N^2, 1/(N m)^2]. */
static const double error_weight[WRENCH_SIZE] = {1, 1, 1, 0.5, 0.5, 0.5};
/* Squared weights of the feet's wrenches themselves, which make the solution unique and share the
 * load so that each foot's centre of pressure is near its point. */
static const double own_weight[WRENCH_SIZE] = {1e-4, 1e-4, 1e-5, 1e-2, 1e-2, 1e-2};

/* [B] DAQP takes 7 kB of it for a program of this size. */
#define MEMORY_SIZE 16384
#define MEMORY_ALIGNMENT 16

struct WrenchSolver {
    size_t used; /* [B] of memory */
    alignas(MEMORY_ALIGNMENT) unsigned char memory[MEMORY_SIZE];
    DAQPWorkspace work;
    DAQPProblem problem;
    WrenchProgram program;
    double x[WRENCH_NUMBERS];
    double multiplier[WRENCH_ROWS];
};

/* ---- memory of DAQP ---- */

/* DAQP does not look at what malloc returns, and allocates only while a solver is set up. So its
 * sources are compiled with these in the place of malloc, calloc and free (build.cmake), and
 * its blocks lie within the solver, whose own allocation is checked. */
void *wrench_take(size_t size);
void *wrench_take_zeros(size_t count, size_t size);
void wrench_give(void *block);

static _Thread_local WrenchSolver *made; /* the solver that is being set up */

void *wrench_take(size_t size) {
    const size_t whole = (size + MEMORY_ALIGNMENT - 1) / MEMORY_ALIGNMENT * MEMORY_ALIGNMENT;
    if (!made || size > MEMORY_SIZE || whole > MEMORY_SIZE - made->used) {
        abort(); /* another DAQP, or a setting that needs memory while it solves */
    }
    void *block = made->memory + made->used;
    made->used += whole;
    return block;
}

/* Nothing is taken twice, so it is still 0. */
void *wrench_take_zeros(size_t count, size_t size) {
    return wrench_take(count * size);
}

void wrench_give(void *block) {
    (void)block;
}

/* ---- the program ---- */

/* Wrench about the centre of mass of a wrench at `point`: [6][6]. */
static void shift_map(const double point[3], double map[WRENCH_SIZE][WRENCH_SIZE]) {
    memset(map, 0, sizeof(double[WRENCH_SIZE][WRENCH_SIZE]));
    for (int k = 0; k < WRENCH_SIZE; k++) {
        map[k][k] = 1;
    }
    map[3][1] = -point[2];
    map[3][2] = point[1];
    map[4][0] = point[2];
    map[4][2] = -point[0];
    map[5][0] = -point[1];
    map[5][1] = point[0];
}

static void add_objective(const WrenchFoot *foot, int feet, const double *wanted,
                          WrenchProgram *program) {
    double map[WRENCH_FEET][WRENCH_SIZE][WRENCH_SIZE] = {0};
    for (int f = 0; f < feet; f++) {
        shift_map(foot[f].point, map[f]);
    }
    for (int i = 0; i < feet * WRENCH_SIZE; i++) {
        const double(*left)[WRENCH_SIZE] = map[i / WRENCH_SIZE];
        for (int j = 0; j < feet * WRENCH_SIZE; j++) {
            const double(*right)[WRENCH_SIZE] = map[j / WRENCH_SIZE];
            for (int k = 0; k < WRENCH_SIZE; k++) {
                program->h[i][j] +=
                    error_weight[k] * left[k][i % WRENCH_SIZE] * right[k][j % WRENCH_SIZE];
            }
        }
        for (int k = 0; k < WRENCH_SIZE; k++) {
            program->f[i] -= error_weight[k] * left[k][i % WRENCH_SIZE] * wanted[k];
        }
    }
    for (int i = 0; i < WRENCH_NUMBERS; i++) {
        program->h[i][i] += own_weight[i % WRENCH_SIZE];
    }
}

/* A row in foot axes: sum of force . f + torque . t within low .. high. */
static void add_row(const WrenchFoot *foot, const double force[3], const double torque[3],
                    double low, double high, WrenchProgram *program, int row, int column) {
    for (int k = 0; k < 3; k++) {
        const double *turn = foot->rotation + 3 * k;
        program->a[row][column + k] = turn[0] * force[0] + turn[1] * force[1] + turn[2] * force[2];
        program->a[row][column + 3 + k] =
            turn[0] * torque[0] + turn[1] * torque[1] + turn[2] * torque[2];
    }
    program->low[row] = low;
    program->high[row] = high;
}

/* In foot axes with the normal z: friction pyramid |f_x|, |f_y| <= mu f_z / sqrt(2); centre of
 * pressure (-t_y, t_x) / f_z in the sole; |t_z| <= mu f_z times half of the sole's width. */
static void add_limits(const WrenchFoot *foot, WrenchProgram *program, int row, int column) {
    static const double none[3], up[3] = {0, 0, 1};
    const double side = foot->friction / sqrt(2.0);
    const double twist = foot->friction * 0.5 * (foot->high[1] - foot->low[1]);
    add_row(foot, up, none, foot->load[0], foot->load[1], program, row++, column);
    for (int sign = -1; sign <= 1; sign += 2) {
        const double s = sign;
        const double fx[3] = {s, 0, side}, fy[3] = {0, s, side}, fz[3] = {0, 0, twist};
        const double tz[3] = {0, 0, s};
        const double front[3] = {0, 0, sign > 0 ? foot->high[0] : -foot->low[0]};
        const double left[3] = {0, 0, sign > 0 ? foot->high[1] : -foot->low[1]};
        const double pitch[3] = {0, s, 0}, roll[3] = {-s, 0, 0};
        add_row(foot, fx, none, 0, LOOSE, program, row++, column);
        add_row(foot, fy, none, 0, LOOSE, program, row++, column);
        add_row(foot, fz, tz, 0, LOOSE, program, row++, column);
        add_row(foot, front, pitch, 0, LOOSE, program, row++, column);
        add_row(foot, left, roll, 0, LOOSE, program, row++, column);
    }
    for (int i = 0; i < WRENCH_MOTORS; i++) {
        memcpy(program->a[row] + column, foot->motor_map[i], sizeof foot->motor_map[i]);
        program->low[row] = foot->motor_rest[i] - foot->motor_limit[i];
        program->high[row++] = foot->motor_rest[i] + foot->motor_limit[i];
    }
}

void wrench_program(const WrenchFoot *foot, int feet, const double wanted[WRENCH_SIZE],
                    WrenchProgram *program) {
    memset(program, 0, sizeof *program);
    for (int i = 0; i < WRENCH_ROWS; i++) {
        program->low[i] = -LOOSE;
        program->high[i] = LOOSE;
    }
    add_objective(foot, feet, wanted, program);
    for (int f = 0; f < feet; f++) {
        add_limits(&foot[f], program, f * WRENCH_FOOT_ROWS, f * WRENCH_SIZE);
    }
}

WrenchSolver *wrench_solver_create(void) {
    WrenchSolver *solver = calloc(1, sizeof *solver);
    if (!solver) {
        return NULL;
    }
    WrenchProgram *program = &solver->program;
    for (int i = 0; i < WRENCH_NUMBERS; i++) {
        program->h[i][i] = program->a[i][i] = 1;
    }
    for (int i = 0; i < WRENCH_ROWS; i++) {
        program->low[i] = -LOOSE;
        program->high[i] = LOOSE;
    }
    solver->problem = (DAQPProblem){.n = WRENCH_NUMBERS,
                                    .m = WRENCH_ROWS,
                                    .H = program->h[0],
                                    .f = program->f,
                                    .A = program->a[0],
                                    .bupper = program->high,
                                    .blower = program->low};
    made = solver;
    const int status = setup_daqp(&solver->problem, &solver->work, NULL);
    made = NULL;
    if (status < 0) {
        free(solver);
        return NULL;
    }
    return solver;
}

void wrench_solver_destroy(WrenchSolver *solver) {
    free(solver);
}

int wrench_solve(WrenchSolver *solver, const WrenchProgram *program, double x[WRENCH_NUMBERS]) {
    const int all =
        DAQP_UPDATE_Rinv | DAQP_UPDATE_M | DAQP_UPDATE_v | DAQP_UPDATE_d | DAQP_UPDATE_sense;
    DAQPResult result = {.x = solver->x, .lam = solver->multiplier};
    solver->program = *program;
    if (daqp_update_ldp(all, &solver->work, &solver->problem) < 0) {
        return 1;
    }
    daqp_solve(&result, &solver->work);
    if (result.exitflag <= 0) {
        return 1;
    }
    memcpy(x, solver->x, sizeof solver->x);
    return 0;
}
