/* From a robot folder's compiled MJCF to the batch engine's model. */
#ifndef MILD_ENGINE_READ_H
#define MILD_ENGINE_READ_H

#include "robot/engine/tree.h"
#include "robot/robot.h"

/* Numbers of EngineNumbers. */
enum {
    ENGINE_FOOT_NUMBERS = 21 + 2 * ROBOT_OUTLINE_MAX,
    ENGINE_NUMBERS = 21 + 76 * ENGINE_LINKS_MAX + ENGINE_FOOT_NUMBERS * ROBOT_FEET_MAX +
                     3 * ENGINE_CORNERS_MAX + 16 * ROBOT_SHELLS_MAX + 13 * ENGINE_BODIES_MAX +
                     7 * ROBOT_CAPSULES_MAX + 1
};

#ifdef __cplusplus
extern "C" {
#endif

/* Fills the tree, and `number` [ENGINE_NUMBERS] in the order of EngineNumbers, which a program
 * converts to its scalar type one by one. dt: physics step [s]. Fails, with one line that names
 * file and joint, when a joint is not behind the base or the margin of its limit is wider than half
 * its range. */
MildStatus engine_model_read(const Robot *robot, double dt, EngineTree *tree, double *number,
                             MildError *error);

/* The sizes of a robot as lines "#define ENGINE_JOINTS 12", for the text compiled for it alone. */
void engine_model_sizes(const EngineTree *tree, char *text, size_t size);

#ifdef __cplusplus
}
#endif

#endif
