/* The ground's step on a CPU in float, for training: sixteen elements to a vector of 512 bits in
 * place of eight (docs/performance.md).
 *
 * It is libmild's own text, compiled a second time with MILD_REAL_FLOAT; cmake/Float.cmake gives
 * its names a prefix. In float are the elements of a step: their law, impulses and derivatives.
 * In double stay the memory of the ground, so that a state can go on in either; the equations of
 * Newton's method, whose elimination cancels; the sums over a foot once they have left a block's
 * lanes; and places in the world, of which a step needs the depths alone.
 *
 * Residuals below FLOAT_GROUND_TOLERANCE may be rounding: a spring under a whole foot is so stiff
 * that 1e-5 is missed in two of five steps of a fall. */
#ifndef MILD_ROBOT_FLOAT_GROUND_H
#define MILD_ROBOT_FLOAT_GROUND_H

#include "robot/robot.h"

#define FLOAT_GROUND_TOLERANCE 1e-4 /* [-] least MildContactInput.tolerance */

/* For robot_sim_set_ground, one per thread. NULL: out of memory. */
RobotGround *float_ground_create(const Robot *robot, MildError *error);
void float_ground_destroy(RobotGround *ground);

#endif
