/* What one trial does, watched at every physics step. */
#ifndef MILD_MEASURE_H
#define MILD_MEASURE_H

#include "task/task.h"

#define MEASURE_STEADY 2.0 /* [s] start of the steady part */

typedef struct {
    double time, dt;
    double work;       /* [J] integral sum |tau qd| over the steady part */
    double energy;     /* [J] integral |tau . qd| */
    double torque_max; /* [N m] */
    double steady_end; /* [s] end of the steady part; 0: the trial's end */
    double start_x, end_x, steady_time;
    double start_y, end_y;
    double base_low, base_high;
    int in_stance[ROBOT_FEET];
    double touchdown[ROBOT_FEET][2],
        last[ROBOT_FEET][2]; /* [m] sole centre at the first and the latest contact */
    double apex[ROBOT_FEET], air_time[ROBOT_FEET], deepest[ROBOT_FEET];
    double apex_sum, deepest_sum, drift_sum;
    int swings, stances;
} Measure;

void measure_start(Measure *measure, double dt);
void measure_step(void *measure, const TaskEnv *env, const RobotSim *sim,
                  const double *torque); /* a TaskProbe */
/* Who never lifted a foot still sank and crept: the open stances count then. */
void measure_finish(Measure *measure);

#endif
