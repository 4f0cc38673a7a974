/* A crowd on the CPU: the text of the GPU, environment after environment. */
#define MILD_REAL_FLOAT

#include "batch/host.h"

typedef struct {
    ContactSetup setup;
    const ContactMaterial *material;
    const BatchShape *shape;
    const BatchArrays *arrays;
    HostRobot step;
} CrowdGround;

static void crowd_ground(const CrowdGround *ground, long robot, const ContactProblem *problem,
                         const ContactResult *result) {
    ground->step(&ground->setup, problem, batch_memory(ground->shape, ground->arrays, robot), 1,
                 result);
}

#define CROWD_ALIGN()

#include "crowd/crowd.inc"
#include "crowd/text.h"

size_t crowd_sim_bytes(void) {
    return sizeof(RobotSim);
}

size_t crowd_reading_bytes(void) {
    return sizeof(TaskReading);
}

void crowd_host_begin(const CrowdArrays *all, long robot) {
    crowd_begin(all, robot);
}

void crowd_host_first(const CrowdArrays *all, const CrowdStep *call, long robot) {
    const TaskLane alone = {0, 1};
    CrowdPlace place;
    crowd_pose(all, robot, &place);
    crowd_observe(all, call, robot, alone);
}

void crowd_host_physics(const CrowdArrays *all, const CrowdStep *call, const MildBatch *batch,
                        long robot) {
    CrowdPlace place;
    CrowdGround ground = {.material = (const ContactMaterial *)(void *)batch->arrays.materials,
                          .shape = &batch->shape,
                          .arrays = &batch->arrays,
                          .step = host_robot(&batch->shape)};
    batch_setup(&batch->shape, &batch->arrays, &ground.setup);
    crowd_physics(all, call, &ground, robot, &place);
    crowd_end(all, call, robot);
}

void crowd_host_tally(const CrowdArrays *all) {
    for (int n = 0; n < TALLY_NUMBERS; n++) {
        all->tally[n] = 0;
        for (long robot = 0; robot < all->envs; robot++) {
            all->tally[n] += crowd_take(all, robot, n);
        }
    }
}

void crowd_model_fill(const EngineTree *tree, const double *number, EngineModel *model) {
    Real *to = (Real *)(void *)&model->number;
    model->tree = *tree;
    for (int i = 0; i < CROWD_MODEL_NUMBERS; i++) {
        to[i] = (Real)number[i];
    }
}
