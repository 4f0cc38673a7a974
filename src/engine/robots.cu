#define MILD_REAL_FLOAT
#include "engine/robots.h"

#include "engine/step.h"

#ifndef ENGINE_WARPS
#define ENGINE_WARPS (ENGINE_FIXED ? 4 : 1) /* robots of a block */
#endif
#ifndef ENGINE_BLOCKS
#define ENGINE_BLOCKS (ENGINE_FIXED ? 4 : 1) /* blocks of a multiprocessor, at least */
#endif
enum { THREADS = LANES * ENGINE_WARPS };

/* What a warp has in shared memory. */
typedef struct {
    EngineWork work;
    Real torque[ENGINE_JOINTS]; /* [N m] in the order of robot.ini */
} Workplace;

/* The torques of a step within the joints' efforts. */
LANE_FN void motors(const EngineModel *model, const EngineRobots *robots, long robot,
                    Workplace *place) {
    const EngineTree *tree = &model->tree;
    EACH_LANE(l) {
        for (int i = 1 + LANE(l); i < engine_links(tree); i += LANES) {
            const int j = tree->joint[i];
            const long at = robot * tree->joints + j;
            const Real effort = model->number.link[i].effort;
            const Real wanted = robots->torque[at] +
                                robots->kp[j] * (robots->target[at] - place->work.angle[i]) -
                                robots->kd[j] * place->work.rate[5 + i];
            place->torque[j] = real_max(-effort, real_min(effort, wanted));
        }
    }
    lanes_meet();
}

LANE_FN int step(const EngineModel *model, const EngineRobots *robots, long robot,
                 Workplace *place) {
    EngineWork *work = &place->work;
    const EngineVariation *variation = &robots->variation[robot];
    const Real *push = robots->push ? robots->push + 6 * robot : NULL;
    motors(model, robots, robot, place);
    if (robots->rigid) {
        const EngineSurface level = {0, {0, 0}};
        engine_begin_rigid(model, variation, place->torque, push, work);
        engine_collide(model, variation->friction, &level, 1, work);
        return engine_end_rigid(model, work);
    }
    engine_begin(model, variation, place->torque, push, work);
    EACH_LANE(l) {
        for (int n = LANE(l); n < 6 * engine_feet(&model->tree); n += LANES) {
            work->wrench[n / 6][n % 6] = 0;
        }
    }
    lanes_meet();
    return engine_end(model, work);
}

/* What a comparison wants of the last step. */
LANE_FN void report(const EngineModel *model, const EngineRobots *robots, long robot,
                    const EngineWork *work) {
    const int dofs = engine_dofs(&model->tree);
    const int rows = 6 * engine_feet(&model->tree);
    EACH_LANE(l) {
        for (int d = LANE(l); d < dofs; d += LANES) {
            robots->acceleration[robot * dofs + d] = work->acceleration[d];
        }
        for (int n = LANE(l); robots->inverse_inertia && n < rows * rows; n += LANES) {
            robots->inverse_inertia[robot * rows * rows + n] =
                work->now.support.ground.inverse_inertia[n];
        }
    }
}

static __global__ void __launch_bounds__(THREADS, ENGINE_BLOCKS)
    step_robots(const EngineModel *__restrict__ model, const __grid_constant__ EngineRobots robots,
                int steps) {
    extern __shared__ Real shared[];
    Workplace *place = (Workplace *)shared + threadIdx.x / LANES;
    const long robot = (long)blockIdx.x * ENGINE_WARPS + threadIdx.x / LANES;
    const EngineTree *tree = &model->tree;
    if (robot >= robots.count) {
        return;
    }
    Real *qpos = robots.qpos + robot * (7 + tree->joints);
    Real *qvel = robots.qvel + robot * (6 + tree->joints);
    int bad = 0;
    engine_load(model, qpos, qvel, &place->work);
    for (int k = 0; k < steps && !bad; k++) {
        bad = step(model, &robots, robot, place);
    }
    engine_store(model, &place->work, qpos, qvel);
    report(model, &robots, robot, &place->work);
    if (bad && threadIdx.x % LANES == 0) {
        robots.bad[robot] = 1;
    }
}

size_t engine_shared_bytes(void) {
    return sizeof(Workplace);
}

cudaError_t engine_kernel_facts(cudaFuncAttributes *facts, int *robots_at_once) {
    const size_t bytes = ENGINE_WARPS * sizeof(Workplace);
    int blocks = 0;
    cudaError_t status =
        cudaFuncSetAttribute(step_robots, cudaFuncAttributeMaxDynamicSharedMemorySize, (int)bytes);
    if (status == cudaSuccess) {
        status =
            cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, step_robots, THREADS, bytes);
    }
    *robots_at_once = blocks * ENGINE_WARPS;
    return status == cudaSuccess ? cudaFuncGetAttributes(facts, step_robots) : status;
}

cudaError_t engine_step_robots(const EngineModel *model, const EngineRobots *robots, int steps,
                               cudaStream_t stream) {
    const size_t bytes = ENGINE_WARPS * sizeof(Workplace);
    const int blocks = (robots->count + ENGINE_WARPS - 1) / ENGINE_WARPS;
    cudaError_t status =
        cudaFuncSetAttribute(step_robots, cudaFuncAttributeMaxDynamicSharedMemorySize, (int)bytes);
    if (status != cudaSuccess) {
        return status;
    }
    step_robots<<<blocks, THREADS, bytes, stream>>>(model, *robots, steps);
    return cudaGetLastError();
}
