/* Shares a wrench among the feet that stand: the forces F that the ground should exert on them,
 *
 *     minimise  |W (sum of the feet's wrenches about the centre of mass - wanted)|^2 + |R F|^2
 *
 * where every foot's force is in the friction pyramid and within its least and greatest load, its
 * centre of pressure is in the sole, its twist is bounded by friction, and the torque of its ankles
 * is within the motors' limits. A quadratic program, solved by DAQP (Arnstrom, Bemporad and Axehill
 * 2022). */
#ifndef CONTROL_WRENCH_H
#define CONTROL_WRENCH_H

enum {
    WRENCH_FEET = 2,
    WRENCH_SIZE = 6, /* force and torque, world axes */
    WRENCH_NUMBERS = WRENCH_FEET * WRENCH_SIZE,
    WRENCH_MOTORS = 6,                     /* of a leg */
    WRENCH_FOOT_ROWS = 11 + WRENCH_MOTORS, /* limits of a foot, and of the motors of its leg */
    WRENCH_ROWS = WRENCH_FEET * WRENCH_FOOT_ROWS
};

/* A foot that stands. Its wrench refers to `point`. */
typedef struct {
    double point[3];    /* [m] from the centre of mass, world axes */
    double rotation[9]; /* [-] foot to world, row major */
    double low[2];      /* [m] sole behind and to the right of the point, foot axes; negative */
    double high[2];     /* [m] before and to the left */
    double load[2];     /* [N] least and greatest normal force */
    double friction;    /* [-] */
    /* Torques of the leg's motors, motor_rest - motor_map F, lie within +- motor_limit [N m]. */
    double motor_rest[WRENCH_MOTORS];
    double motor_map[WRENCH_MOTORS][WRENCH_SIZE];
    double motor_limit[WRENCH_MOTORS];
} WrenchFoot;

/* A quadratic program: minimise x^T H x / 2 + f^T x with low <= A x <= high. */
typedef struct {
    double h[WRENCH_NUMBERS][WRENCH_NUMBERS];
    double f[WRENCH_NUMBERS];
    double a[WRENCH_ROWS][WRENCH_NUMBERS];
    double low[WRENCH_ROWS];
    double high[WRENCH_ROWS];
} WrenchProgram;

/* One thread's workspace. */
typedef struct WrenchSolver WrenchSolver;

/* NULL when out of memory. */
WrenchSolver *wrench_solver_create(void);
void wrench_solver_destroy(WrenchSolver *solver); /* may be NULL */

/* The program of `feet` feet, 1 or 2, for a wanted wrench about the centre of mass [N, N m]. What
 * belongs to a foot that is not there is 0 with loose bounds. */
void wrench_program(const WrenchFoot *foot, int feet, const double wanted[WRENCH_SIZE],
                    WrenchProgram *program);
/* Solves it. Returns 0, or 1 when there is no solution; x is then unchanged. */
int wrench_solve(WrenchSolver *solver, const WrenchProgram *program, double x[WRENCH_NUMBERS]);

#endif
