/* A collection of grounds that were drawn beforehand. Matching a material to a ground model and
 * finding how deep a robot stands in it take long and need the CPU; a device draws an index. */
#ifndef TASK_GROUND_H
#define TASK_GROUND_H

#include "base/pool.h"
#include "env/task/task_def.h"

typedef struct {
    MildMaterial material;
    double depth; /* [m] that the robot stands in it */
} TaskGround;

/* The grounds of randomize.presets. */
enum { TASK_SOILS_MAX = 16 };
typedef struct TaskSoils {
    int count;
    MildMaterial soil[TASK_SOILS_MAX];
} TaskSoils;

/* Reads the presets and files that randomize.presets names, if any, and sets def->soils to them. A
 * ground of another model than mild and mild_merged must be one of randomize.model, because only
 * theirs are matched to other models; and it must bear the robot's feet (ground/law/width.h). */
MildStatus task_soils_open(TaskDef *def, const Robot *robot, TaskSoils *soils, MildError *error);

struct TaskGrounds {
    int count;
    TaskGround *ground; /* [count] */
};

/* Draws `count` grounds as an episode would; a function of the def and the seed. */
TaskGrounds *task_grounds_create(const TaskDef *def, const Robot *robot, int count, uint64_t seed,
                                 Pool *pool, MildError *error);
void task_grounds_destroy(TaskGrounds *grounds); /* may be NULL */

/* The numbers of a material that the critic sees, each scaled to about one;
 * [TASK_GROUND_NUMBERS]. */
void task_ground_numbers(const Robot *robot, const MildMaterial *material, float *numbers);
/* [m] Depth of the soles of a robot that stands on a material. */
double task_standing_depth(const Robot *robot, const MildMaterial *material);

#endif
