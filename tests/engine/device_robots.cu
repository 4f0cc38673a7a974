#define MILD_REAL_FLOAT
#include "device_robots.h"

#include "ground/batch/contact.h"
#include "ground/batch/contact_shapes.h"
#include "robot/engine/step.h"

/* The ground's step for this number of feet, level and on a map; see contact.inc. */
#ifndef ENGINE_PER
#define ENGINE_PER 5 /* elements of a lane */
#endif
enum {
    CONTACT_FEET = ENGINE_FEET == 3 ? 4 : ENGINE_FEET,
    CONTACT_PER = ENGINE_PER,
    CONTACT_CURVES = LAW_CONE,
    CONTACT_POINTS = 0
};
namespace level {
enum { CONTACT_MAP = 0 };
#include "ground/batch/contact.inc"
} // namespace level
namespace map {
enum { CONTACT_MAP = 1 };
#include "ground/batch/contact.inc"
} // namespace map
#include "ground/batch/robot.inc"

#ifndef ENGINE_WARPS
#define ENGINE_WARPS (ENGINE_FIXED ? 4 : 1) /* robots of a block */
#endif
#ifndef ENGINE_BLOCKS
/* Blocks of a multiprocessor, at least. On soft ground spilled registers cost less than idle lanes:
 * 2, 3 and 4 make 13.7, 16.6 and 18.0 M steps/s. */
#define ENGINE_BLOCKS (ENGINE_FIXED ? 4 : 1)
#endif
enum { THREADS = LANES * ENGINE_WARPS };

/* What a warp has in shared memory. */
typedef struct {
    EngineWork work;
    Real torque[ENGINE_JOINTS]; /* [N m] in the order of robot.ini */
} Workplace;

/* The torques of a step within the joints' efforts. */
WARP_FN void motors(const EngineModel *model, const EngineRobots *robots, long robot,
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
    lanes_sync();
}

WARP_FN const Real *origin_of(const EngineRobots *robots, long robot) {
    return robots->map_origin ? robots->map_origin + 2 * robot : NULL;
}

/* In the air or on rigid ground. map: of that, or NULL. */
WARP_FN int step(const EngineModel *model, const EngineRobots *robots, const MapView *map,
                 long robot, Workplace *place) {
    EngineWork *work = &place->work;
    const EngineAction action = {&robots->variation[robot], place->torque,
                                 robots->push ? robots->push + 6 * robot : NULL, robots->rigid};
    motors(model, robots, robot, place);
    engine_begin(model, &action, work);
    if (robots->rigid) {
        const EngineGround ground = {map, origin_of(robots, robot), 0};
        engine_collide_on(model, action.variation->rigid, &ground, work);
    } else {
        EACH_LANE(l) {
            for (int n = LANE(l); n < 6 * engine_feet(&model->tree); n += LANES) {
                work->wrench[n / 6][n % 6] = 0;
            }
        }
        lanes_sync();
    }
    return engine_end(model, robots->rigid, work);
}

/* What a robot's ground is made of. */
WARP_FN void material_of(const EngineRobots *robots, const BatchShape *shape,
                         const BatchArrays *arrays, long robot, ContactProblem *problem) {
    const long labels = shape->map ? arrays->map.labels : 1;
    const int *materials = robots->material ? robots->material + robot * labels : NULL;
    problem->table = (const ContactMaterial *)arrays->materials;
    problem->material = problem->table + (materials ? materials[0] : 0) * shape->feet;
    problem->label_material = materials;
    problem->materials = shape->materials;
    problem->map_origin = origin_of(robots, robot);
    problem->height = 0;
}

/* On soft ground: from the feet's pose, A and V_free to the wrenches. problem: what stays the same
 * from step to step. */
template <int MAP>
WARP_FN int step_soft(const EngineModel *model, const EngineRobots *robots,
                      const ContactSetup *setup, ContactProblem problem, long robot,
                      ContactMemory memory, level::ContactShared *shared, Workplace *place) {
    EngineWork *work = &place->work;
    const EngineAction action = {&robots->variation[robot], place->torque,
                                 robots->push ? robots->push + 6 * robot : NULL, 0};
    motors(model, robots, robot, place);
    engine_begin(model, &action, work);
    problem.position = work->foot_position[0];
    problem.rotation = work->foot_rotation[0];
    problem.velocity = work->foot_velocity[0];
    problem.inverse_inertia = work->now.support.ground.inverse_inertia;
    problem.free_velocity = work->now.support.free_velocity[0];
    const ContactResult result = {
        work->wrench[0], work->now.support.free_velocity[0], NULL, NULL, NULL, NULL};
    if (MAP) {
        map::contact_robot(setup, &problem, (map::ContactShared *)shared, &memory, 1, &result);
    } else {
        level::contact_robot(setup, &problem, shared, &memory, 1, &result);
    }
    lanes_sync();
    return engine_end(model, 0, work);
}

/* What a comparison wants of the last step. */
WARP_FN void report(const EngineModel *model, const EngineRobots *robots, long robot,
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

/* SOFT: bool, on the ground of setup, shape and arrays. MAP: bool, that or rigid ground has the
 * shape setup.map. */
template <int SOFT, int MAP>
static __global__ void __launch_bounds__(THREADS, ENGINE_BLOCKS)
    step_robots(const EngineModel *__restrict__ model, const __grid_constant__ EngineRobots robots,
                const __grid_constant__ ContactSetup setup,
                const __grid_constant__ BatchShape shape,
                const __grid_constant__ BatchArrays arrays, int steps) {
    extern __shared__ __align__(16) Real shared[];
    const int warp = threadIdx.x / LANES;
    map::ContactShared *contact = (map::ContactShared *)shared; /* the larger one; on soft ground */
    Workplace *place = (Workplace *)(contact + (SOFT ? ENGINE_WARPS : 0)) + warp;
    const long robot = (long)blockIdx.x * ENGINE_WARPS + warp;
    const EngineTree *tree = &model->tree;
    if (robot >= robots.count) {
        return;
    }
    Real *qpos = robots.qpos + robot * (7 + tree->joints);
    Real *qvel = robots.qvel + robot * (6 + tree->joints);
    ContactProblem problem = {};
    int bad = 0;
    if (SOFT) {
        material_of(&robots, &shape, &arrays, robot, &problem);
    }
    engine_load(model, qpos, qvel, &place->work);
    for (int k = 0; k < steps && !bad; k++) {
        if (SOFT) {
            bad = step_soft<MAP>(model, &robots, &setup, problem, robot,
                                 batch_memory(&shape, &arrays, robot),
                                 (level::ContactShared *)(contact + warp), place);
        } else {
            bad = step(model, &robots, MAP ? &setup.map : NULL, robot, place);
        }
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

static size_t block_bytes(int soft) {
    return ENGINE_WARPS * (sizeof(Workplace) + (soft ? sizeof(map::ContactShared) : 0));
}

typedef void (*Kernel)(const EngineModel *model, EngineRobots robots, ContactSetup setup,
                       BatchShape shape, BatchArrays arrays, int steps);

/* The kernel of a ground, which may take the shared memory that it needs. */
static cudaError_t kernel_of(int soft, int map, Kernel *kernel) {
    static const Kernel kernels[2][2] = {{step_robots<0, 0>, step_robots<0, 1>},
                                         {step_robots<1, 0>, step_robots<1, 1>}};
    *kernel = kernels[soft != 0][map != 0];
    return cudaFuncSetAttribute(*kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                (int)block_bytes(soft));
}

cudaError_t engine_kernel_facts(int soft, int map, cudaFuncAttributes *facts, int *robots_at_once) {
    Kernel kernel;
    int blocks = 0;
    cudaError_t status = kernel_of(soft, map, &kernel);
    if (status == cudaSuccess) {
        status = cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, THREADS,
                                                               block_bytes(soft));
    }
    *robots_at_once = blocks * ENGINE_WARPS;
    return status == cudaSuccess ? cudaFuncGetAttributes(facts, kernel) : status;
}

cudaError_t engine_step_robots(const EngineModel *model, const EngineRobots *robots, int steps,
                               cudaStream_t stream) {
    const int blocks = (robots->count + ENGINE_WARPS - 1) / ENGINE_WARPS;
    ContactSetup setup = {};
    BatchShape shape = {};
    BatchArrays arrays = {};
    if (robots->ground) {
        shape = robots->ground->shape;
        arrays = robots->ground->arrays;
        if (shape.per != ENGINE_PER || (robots->ground->curves & ~LAW_CONE)) {
            return cudaErrorInvalidValue;
        }
        batch_setup(&shape, &arrays, &setup);
    } else if (robots->map) {
        setup.map = *robots->map;
    }
    const int map = robots->ground ? shape.map : robots->rigid && robots->map;
    Kernel kernel;
    const cudaError_t status = kernel_of(robots->ground != NULL, map, &kernel);
    if (status != cudaSuccess) {
        return status;
    }
    kernel<<<blocks, THREADS, block_bytes(robots->ground != NULL), stream>>>(model, *robots, setup,
                                                                             shape, arrays, steps);
    return cudaGetLastError();
}
