/* A step of a batch with shells on the CPU, robot after robot. */
#define MILD_REAL_FLOAT
#include "ground/batch/bodies_robot.h"

#include "ground/batch/bodies_batch.h"

void host_bodies_begin(const BodiesCall *call) {
    for (long robot = 0; robot < call->shape.robots; robot++) {
        bodies_find(call, robot);
    }
}

void host_bodies_end(const BodiesCall *call) {
    BodiesWork work;
    for (long robot = 0; robot < call->shape.robots; robot++) {
        if (call->bodies.near[robot]) {
            bodies_solve(call, robot, &work, LAW_ANY);
        } else {
            bodies_rest(call, robot);
        }
    }
}
