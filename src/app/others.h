/* Others beside the robot of `mild play`: its like, on the same course, by the same controller.
 * They stand in a square, of which it is a corner, and walk as it does, each from random numbers of
 * its own. They do not touch each other, and each presses ground of its own: nobody walks in the
 * imprints of another. */
#ifndef MILD_OTHERS_H
#define MILD_OTHERS_H

#include "base/pool.h"
#include "control/controller.h"
#include "run/eval/scene.h"
#include "view/view.h"

typedef struct Others Others;

/* Borrowed until others_destroy. */
typedef struct {
    int count; /* of the others */
    const TaskDef *task;
    const Robot *robot;
    const Scene *scene;
    Controller *controller; /* for as many rows */
    Pool *pool;
    double seconds, speed; /* [s] of the walk, [m/s] */
    uint64_t seed;
} OthersDef;

/* [m] Edge of the square. */
double others_side(int count);
Others *others_create(const OthersDef *def, MildError *error);
void others_destroy(Others *others); /* may be NULL */
int others_count(const Others *others);
/* A policy step of all. */
void others_step(Others *others);
/* [count] Where they are, the nearest to the robot at the start first. */
const ViewOther *others_shown(const Others *others);
/* How many have not fallen. */
int others_upright(const Others *others);

/* Those that are on a ground of the course, where they are drawn. */
typedef struct {
    int robots, upright;
    double sinkage; /* [m] mean of their deeper feet in the last step; 0 of none */
} OthersRow;
OthersRow others_on(const Others *others, int material);

#endif
