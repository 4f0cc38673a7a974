/* Others beside the robot of `mild play`: its like, on the same course, by the same controller.
 * They stand in a square, of which it is a corner, and walk as it does, each from random numbers of
 * its own. They do not touch each other, and each presses ground of its own: nobody walks in the
 * imprints of another. */
#ifndef MILD_CROWD_H
#define MILD_CROWD_H

#include "base/pool.h"
#include "control/controller.h"
#include "run/eval/scene.h"
#include "view/view.h"

typedef struct Crowd Crowd;

/* Borrowed until crowd_destroy. */
typedef struct {
    int count; /* of the others */
    const TaskDef *task;
    const Robot *robot;
    const Scene *scene;
    Controller *controller; /* for as many rows */
    Pool *pool;
    double seconds, speed; /* [s] of the walk, [m/s] */
    uint64_t seed;
} CrowdDef;

/* [m] Edge of the square. */
double crowd_side(int count);
Crowd *crowd_create(const CrowdDef *def, MildError *error);
void crowd_destroy(Crowd *crowd); /* may be NULL */
int crowd_count(const Crowd *crowd);
/* A policy step of all. */
void crowd_step(Crowd *crowd);
/* [count] Where they are, the nearest to the robot at the start first. */
const ViewOther *crowd_others(const Crowd *crowd);
/* How many have not fallen. */
int crowd_upright(const Crowd *crowd);

/* Those that are on a ground of the course, where they are drawn. */
typedef struct {
    int robots, upright;
    double sinkage; /* [m] mean of their deeper feet in the last step; 0 of none */
} CrowdRow;
CrowdRow crowd_on(const Crowd *crowd, int material);

#endif
