#include "robot/float/float_ground.h"

#include <stdlib.h>

/* Functions of mild/ground.h, of the text in float. */
MildScratch *float_mild_scratch_create(const MildSole *const *soles, int feet, MildError *error);
void float_mild_scratch_destroy(MildScratch *scratch);
void float_mild_ground_solve(const MildGround *ground, const MildTerrain *terrain,
                             const MildContactInput *input, MildScratch *scratch,
                             MildContactResult *result);
void float_mild_ground_advance(MildGround *ground, const MildTerrain *terrain,
                               const MildContactInput *input, const MildScratch *scratch,
                               const MildContactResult *result);

static int solve(void *self, const MildTerrain *terrain, MildGround *ground,
                 const MildContactInput *input, MildContactResult *result) {
    float_mild_ground_solve(ground, terrain, input, self, result);
    float_mild_ground_advance(ground, terrain, input, self, result);
    return 0;
}

RobotGround *float_ground_create(const Robot *robot, MildError *error) {
    RobotGround *ground = malloc(sizeof *ground);
    if (!ground) {
        mild_fail(error, MILD_ERROR_MEMORY, "ground in float: out of memory");
        return NULL;
    }
    *ground = (RobotGround){
        solve, float_mild_scratch_create(robot_soles(robot), robot_bodies(robot), error)};
    if (!ground->self) {
        free(ground);
        return NULL;
    }
    return ground;
}

void float_ground_destroy(RobotGround *ground) {
    if (ground) {
        float_mild_scratch_destroy(ground->self);
        free(ground);
    }
}
