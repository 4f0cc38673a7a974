/* Differences of whole solves, and how far mild_ground_derivative is from them. */
#ifndef DERIVATIVE_KIT_H
#define DERIVATIVE_KIT_H

#include "problems.h"

#include "ground/step/scratch.h"

#define LEVER 0.1      /* [m] makes twists, poses and wrenches comparable */
#define TOLERANCE 1e-6 /* [-] of the largest number of a derivative */
/* Of what is differenced a few are off by more than TOLERANCE, and none by more than ROUGH: where
 * an element is at a kink, and under shells on mild_merged, whose rim rounds. */
#define ROUGH 1e-5
#define FEW 0.01    /* [-] of the problems */
#define BESIDE 1e-2 /* [-] what a derivative is compared to is at least so much of dW/dV_free */
#define NEAR 12     /* rows of two feet */

static int first_problem = 0, problem_count = 0;

/* [-] 1, or the lever for an angular row or column. */
static double length_of(int row) {
    return row % 6 < 3 ? 1.0 : LEVER;
}

/* ---- differences of solves ---- */

/* Moves coordinate `column` of a problem by h in units of its length. */
typedef void Move(Kit *kit, int column, double h);

static void move_free(Kit *kit, int column, double h) {
    kit->input.free_velocity[column] += h / length_of(column);
}

static void move_twist(Kit *kit, int column, double h) {
    kit->input.velocity[column / 6][column % 6] += h / length_of(column);
}

static void move_pose(Kit *kit, int column, double h) {
    double turn[3] = {0.0};
    if (column % 6 < 3) {
        kit->input.position[column / 6][column % 6] += h;
        return;
    }
    turn[column % 6 - 3] = h / LEVER;
    kit_rotate(kit->input.rotation[column / 6], turn);
}

/* A field of material 0, by a share of its value, or of 1. */
static void move_field(Kit *kit, int index, double h) {
    const MildField *field = &mild_material_fields[index];
    double value;
    char *at = (char *)&kit->terrain.materials[0] + field->offset;
    memcpy(&value, at, sizeof value);
    value += h * (value == 0.0 ? 1.0 : value);
    memcpy(at, &value, sizeof value);
}

/* Numbers of a derivative, in units of the lengths. */
typedef struct {
    double at[NEAR][NEAR];
    double most;   /* the largest */
    double unsure; /* by how much one of them still changed */
} Slopes;

/* What a derivative is compared with. */
typedef struct {
    int rows, columns;
    Slopes wrench, twist;
    int solved; /* bool: all of the solves converged */
} Differences;

/* Wrench and twist of the problem moved by h, in units of the lengths. */
static int solve_moved(Kit *kit, Move *move, int column, double h, double wrench[NEAR],
                       double twist[NEAR]) {
    const MildContactInput input = kit->input;
    const MildTerrain terrain = kit->terrain;
    move(kit, column, h);
    kit_solve(kit);
    kit->input = input;
    kit->terrain = terrain;
    for (int i = 0; i < 6 * kit->feet; i++) {
        const MildFootResult *foot = &kit->result.foot[i / 6];
        wrench[i] = (i % 6 < 3 ? foot->force[i % 6] : foot->torque[i % 6 - 3]) / length_of(i);
        twist[i] = kit->result.velocity[i] * length_of(i);
    }
    return kit->result.converged;
}

/* A slope from values over -h, -h/2, -h/4, 0 and so on, by Richardson's extrapolation of central
 * differences. It is unsure by its last change, and by what the second difference leaves of a kink:
 * without one that falls with the step. */
static void slope_of(double values[7][NEAR], int i, double h, int column, Slopes *slopes) {
    double slope[3], bend[3];
    for (int k = 0; k < 3; k++) {
        const double width = h / (1 << k);
        slope[k] = (values[6 - k][i] - values[k][i]) / (2.0 * width);
        bend[k] = (values[6 - k][i] + values[k][i] - 2.0 * values[3][i]) / width;
    }
    const double wide = (4.0 * slope[1] - slope[0]) / 3.0, own = (4.0 * slope[2] - slope[1]) / 3.0;
    slopes->at[i][column] = own;
    slopes->most = fmax(slopes->most, fabs(own));
    slopes->unsure = fmax(slopes->unsure, fmax(fabs(own - wide), fabs(2.0 * bend[2] - bend[1])));
}

static void difference_column(Kit *kit, Move *move, int of, double h, int column,
                              Differences *all) {
    static const double at[7] = {-1.0, -0.5, -0.25, 0.0, 0.25, 0.5, 1.0};
    double wrench[7][NEAR], twist[7][NEAR];
    for (int k = 0; k < 7; k++) {
        all->solved &= solve_moved(kit, move, of, at[k] * h, wrench[k], twist[k]);
    }
    for (int i = 0; i < all->rows; i++) {
        slope_of(wrench, i, h, column, &all->wrench);
        slope_of(twist, i, h, column, &all->twist);
    }
}

static Differences differences_over(Kit *kit, Move *move, double h) {
    Differences all = {.rows = 6 * kit->feet, .columns = 6 * kit->feet, .solved = 1};
    for (int c = 0; c < all.columns; c++) {
        difference_column(kit, move, c, h, c, &all);
    }
    return all;
}

/* Over h, or a tenth of it where a branch changes within h. */
static Differences differences(Kit *kit, Move *move, double h) {
    const Differences all = differences_over(kit, move, h);
    if (all.wrench.unsure <= TOLERANCE * all.wrench.most) {
        return all;
    }
    const Differences fine = differences_over(kit, move, 0.1 * h);
    return fine.wrench.unsure < all.wrench.unsure ? fine : all;
}

/* How well a kind of derivative agrees, over problems. */
typedef struct {
    int compared, skipped;
    int beyond; /* TOLERANCE */
    double worst;
    int at; /* number of the worst problem */
} Score;

/* [-] Largest difference of a derivative by coordinates of feet, over `size`. by: power of the
 * length in the unit of a row, -1 of a wrench, 1 of a twist. */
static double apart(const Differences *all, const Slopes *slopes, const double *got, int by,
                    double size) {
    double off = 0.0;
    for (int i = 0; i < all->rows; i++) {
        for (int c = 0; c < all->columns; c++) {
            const double unit = by > 0 ? length_of(i) : 1.0 / length_of(i);
            const double own = got[i * all->columns + c] * unit / length_of(c);
            off = fmax(off, fabs(own - slopes->at[i][c]));
        }
    }
    return off / size;
}

/* Adds a problem to a score unless its differences are no derivative. off: [-] */
static void score_add(Score *score, const Differences *all, const Slopes *slopes, double size,
                      double off, int number) {
    if (!all->solved || slopes->unsure > TOLERANCE * size) {
        score->skipped++;
        return;
    }
    score->compared++;
    score->beyond += !(off <= TOLERANCE);
    if (!(off <= score->worst)) {
        score->worst = off;
        score->at = number;
    }
}

/* ---- problems ---- */

typedef struct {
    MildContactDerivative asked;
    double law[6 * NEAR], wrench[NEAR * NEAR], velocity[NEAR * NEAR];
    double pose[NEAR * NEAR], twist[NEAR * NEAR];
} Derived;

static void derive(Kit *kit, MildScratch *work, Derived *derived) {
    MildError error = {0};
    derived->asked = (MildContactDerivative){.law = derived->law,
                                             .wrench_by_free = derived->wrench,
                                             .velocity_by_free = derived->velocity,
                                             .wrench_by_pose = derived->pose,
                                             .wrench_by_velocity = derived->twist,
                                             .work = work};
    expect_good(mild_ground_derivative(kit->ground, &kit->terrain, &kit->input, kit->scratch,
                                       &kit->result, &derived->asked, &error) == MILD_OK,
                &error);
}

/* What elements do in the problems that were compared. */
typedef struct {
    int sticks, slides, unloads, yields, lifted; /* problems with such an element */
} Seen;

static void see(const Kit *kit, Seen *seen) {
    int stick = 0, slide = 0, unload = 0, yield = 0, lift = 0;
    for (int f = 0; f < kit->feet; f++) {
        const MildElements e = mild_scratch_elements(kit->scratch, f);
        for (int i = 0; i < mild_sole_elements(kit->soles[f]); i++) {
            const int loaded = e.state[i] != MILD_ELEMENT_FREE;
            stick += loaded && !e.slip[i];
            slide += e.slip[i];
            unload += e.state[i] == MILD_ELEMENT_UNLOADING;
            yield += e.state[i] == MILD_ELEMENT_VIRGIN;
            lift += !loaded && mild_ground_depth_max(kit->ground, f)[i] > 0.0;
        }
    }
    seen->sticks += stick > 0;
    seen->slides += slide > 0;
    seen->unloads += unload > 0;
    seen->yields += yield > 0;
    seen->lifted += lift > 0;
}

/* Scores by V_free, by the twists that follow from it, by the present twist and by pose. */
enum { BY_FREE, TWISTS, BY_TWIST, BY_POSE, SCORES };

/* Compares all derivatives of the problem that was solved. */
static void compare(Kit *kit, int number, Score scores[SCORES]) {
    MildError error = {0};
    MildScratch *work = mild_scratch_create(kit->soles, kit->feet, &error);
    expect_good(work != NULL, &error);
    Derived derived;
    kit->input.tolerance = 1e-12;
    kit_solve(kit);
    derive(kit, work, &derived);
    const Differences free = differences(kit, move_free, 1e-6);
    const Differences twist = differences_over(kit, move_twist, 1e-5);
    const Differences pose = differences(kit, move_pose, 1e-7);
    const double most = free.wrench.most, moved = fmax(free.twist.most, 1.0);
    const double by_twist = fmax(twist.wrench.most, BESIDE * most);
    const double by_pose = fmax(pose.wrench.most, BESIDE * most);
    const double off[SCORES] = {apart(&free, &free.wrench, derived.wrench, -1, most),
                                apart(&free, &free.twist, derived.velocity, 1, moved),
                                apart(&twist, &twist.wrench, derived.twist, -1, by_twist),
                                apart(&pose, &pose.wrench, derived.pose, -1, by_pose)};
    score_add(&scores[BY_FREE], &free, &free.wrench, most, off[BY_FREE], number);
    score_add(&scores[TWISTS], &free, &free.twist, moved, off[TWISTS], number);
    score_add(&scores[BY_TWIST], &twist, &twist.wrench, by_twist, off[BY_TWIST], number);
    score_add(&scores[BY_POSE], &pose, &pose.wrench, by_pose, off[BY_POSE], number);
    mild_scratch_destroy(work);
}

static const char *const by[SCORES] = {"dW/dV_free", "dV/dV_free", "dW/d(twist)", "dW/d(pose)"};

/* Prints scores, asserts them, and adds them to those of all grounds. */
static void expect_scores(const char *name, const Score scores[SCORES], int least,
                          Score all[SCORES]) {
    print_message("%-24s", name);
    for (int k = 0; k < SCORES; k++) {
        print_message(" %s %.0e (%d; %d of %d skipped)", by[k], scores[k].worst, scores[k].at,
                      scores[k].skipped, scores[k].skipped + scores[k].compared);
        all[k].skipped += scores[k].skipped;
        all[k].compared += scores[k].compared;
        all[k].beyond += scores[k].beyond;
    }
    print_message("\n");
    for (int k = 0; k < SCORES; k++) {
        assert_true(scores[k].compared >= least);
        if (k < BY_TWIST && !(scores[k].worst <= TOLERANCE)) {
            fail_msg("%s: %s is off by %.1e in problem %d", name, by[k], scores[k].worst,
                     scores[k].at);
        }
    }
}

/* Asserts which share `most` of the problems had differences that are no derivative, and that few
 * are beyond TOLERANCE. */
static void expect_skips(const Score all[SCORES], const double most[SCORES]) {
    for (int k = 0; k < SCORES; k++) {
        const int problems = all[k].skipped + all[k].compared;
        print_message("%s: %d problems, %d of them beyond %.0e, %d more skipped\n", by[k],
                      all[k].compared, all[k].beyond, TOLERANCE, all[k].skipped);
        assert_true(all[k].beyond <= FEW * all[k].compared);
        assert_true(all[k].skipped <= 2 + most[k] * problems); /* 2: of a small sample */
    }
}

#endif
