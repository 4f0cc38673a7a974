/* The ground in batches (mild/batch.h): contact problems of a walk recorded on grounds of
 * randomize.model, as many robots as the device is asked for. */
#include "ground/batch/batch.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "bench/bench.h"
#include "bench/record.h"
#include "device/device.h"

enum { PERIODS = 300, GROUNDS = 2, PROBLEMS_MAX = 4000, ARRAYS_MAX = 12 };
enum { HOST_REPEATS = 3, REPEATS = 20 };
static const char *const grounds[GROUNDS] = {"sand_loose", "grass"};

/* One step of the walk: the problem, its solution in double, and the memory before it. */
typedef struct {
    MildContactInput input;
    double inverse_inertia[36 * ROBOT_FEET_MAX * ROBOT_FEET_MAX]; /* of the input */
    MildContactResult result;
    int material;
    float *memory; /* then its wear */
} Problem;

typedef struct {
    Robot *robot;
    int model; /* RandomizeDef.model */
    MildMaterial material[GROUNDS];
    Problem *problem; /* [PROBLEMS_MAX] */
    int problems;
    double dt;
    int device;
} BatchBench;

/* Arrays of a batch, on its device. */
typedef struct {
    MildBatch *batch;
    float *memory; /* as loaded */
    void *array[ARRAYS_MAX];
    int arrays;
    MildBatchInput input;
    MildBatchOutput output;
} BatchCase;

/* ---- the walk ---- */

static MildStatus record_problems(BatchBench *bench, const Replay *replay, int material,
                                  const BatchShape *shape, MildError *error) {
    RobotSim *sim = robot_sim_create(bench->robot, replay->dt, error);
    MildGround *ground = malloc(mild_ground_size(replay->period[0].ground));
    if (!sim || !ground) {
        robot_sim_destroy(sim);
        free(ground);
        return mild_fail(error, MILD_ERROR_MEMORY, "bench: out of memory");
    }
    for (int p = 0; p < replay->periods; p++) {
        const ReplayPeriod *period = &replay->period[p];
        memcpy(ground, period->ground, mild_ground_size(period->ground));
        robot_sim_load(sim, &period->state, &replay->variation);
        for (int s = 0; s < replay->steps && bench->problems < PROBLEMS_MAX; s++) {
            Problem *problem = &bench->problem[bench->problems++];
            problem->material = material;
            const size_t numbers = batch_memory_numbers(shape);
            problem->memory = malloc((numbers + batch_worn_numbers(shape)) * sizeof(float));
            if (problem->memory) {
                batch_memory_of(shape, ground, problem->memory, problem->memory + numbers);
            }
            robot_sim_step(sim, period->torque[s], NULL, &replay->terrain, ground);
            const int feet = robot_feet(bench->robot);
            problem->input = *robot_sim_contact_input(sim);
            memcpy(problem->inverse_inertia, problem->input.inverse_inertia,
                   36 * (size_t)(feet * feet) * sizeof(double));
            problem->input.inverse_inertia = problem->inverse_inertia;
            problem->result = *robot_sim_contact(sim);
        }
    }
    bench->material[material] = replay->terrain.materials[0];
    robot_sim_destroy(sim);
    free(ground);
    return MILD_OK;
}

static MildBatch *open_batch(const BatchBench *bench, int robots, MildError *error) {
    const MildBatchDef def = {.robots = robots,
                              .feet = robot_feet(bench->robot),
                              .soles = robot_soles(bench->robot),
                              .dt = bench->dt,
                              .device = bench->device,
                              .points = robot_points(bench->robot)};
    return mild_batch_create(&def, error);
}

static MildStatus record(BatchBench *bench, const ExperimentDef *def, MildError *error) {
    BatchBench host = *bench;
    host.device = MILD_BATCH_HOST;
    MildBatch *shape = open_batch(&host, 1, error);
    MildStatus status = shape ? MILD_OK : MILD_ERROR_MEMORY;
    for (int g = 0; g < GROUNDS && status == MILD_OK; g++) {
        Replay *replay =
            bench_record_walk(def, bench->robot, grounds[g], bench->model, PERIODS, error);
        status = replay ? record_problems(bench, replay, g, &shape->shape, error) : MILD_ERROR_IO;
        replay_destroy(replay);
    }
    mild_batch_destroy(shape);
    if (status == MILD_OK && bench->problems == 0) {
        return mild_fail(error, MILD_ERROR_RANGE, "bench: the walk has no steps");
    }
    return status;
}

/* ---- arrays on the device ---- */

/* An array of the device; from: on the host, or NULL. */
static void *device_array(BatchCase *c, int device, const void *from, size_t bytes,
                          MildError *error) {
    void *array = device_alloc(device, bytes, error);
    if (!array) {
        return NULL;
    }
    assert(c->arrays < ARRAYS_MAX);
    c->array[c->arrays++] = array;
    if (from && device_copy(device, array, from, bytes, error) != MILD_OK) {
        return NULL; /* freed with the case */
    }
    return array;
}

static void close_case(BatchCase *c) {
    for (int i = 0; i < c->arrays; i++) {
        device_free(c->batch->device, c->array[i]);
    }
    mild_batch_destroy(c->batch);
}

/* The problem of a robot. Neighbours have moments of a walk that are far apart: in a training they
 * are not alike either, and two robots of a warp wait for each other. */
static const Problem *problem_of(const BatchBench *bench, int robot) {
    enum { APART = 1009 }; /* a prime */
    assert(bench->problems > 0);
    return &bench->problem[(size_t)robot * APART % (size_t)bench->problems];
}

/* count numbers of every robot, taken from its problem by their place in it. */
static float *numbers_of(const BatchBench *bench, int robots, size_t offset, int count) {
    float *all = malloc((size_t)robots * (size_t)count * sizeof *all);
    for (int r = 0; all && r < robots; r++) {
        const char *problem = (const char *)problem_of(bench, r);
        const double *from = (const double *)(problem + offset);
        for (int i = 0; i < count; i++) {
            all[(size_t)r * (size_t)count + (size_t)i] = (float)from[i];
        }
    }
    return all;
}

static const float *input_array(BatchCase *c, const BatchBench *bench, size_t offset, int count,
                                MildError *error) {
    const int robots = c->batch->shape.robots;
    float *host = numbers_of(bench, robots, offset, count);
    const size_t bytes = (size_t)robots * (size_t)count * sizeof(float);
    const float *array = host ? device_array(c, bench->device, host, bytes, error) : NULL;
    free(host);
    return array;
}

/* The memory of every robot, and which material it stands on. */
static MildStatus load_case(BatchCase *c, const BatchBench *bench, MildError *error) {
    const int robots = c->batch->shape.robots;
    const size_t numbers = batch_memory_numbers(&c->batch->shape), all = (size_t)robots * numbers;
    const size_t worn = c->batch->arrays.worn ? batch_worn_numbers(&c->batch->shape) : 0;
    const size_t bytes = (size_t)robots * mild_batch_robot_bytes(c->batch);
    float *memory = malloc(bytes);
    int32_t *material = malloc((size_t)robots * sizeof *material);
    for (int r = 0; memory && material && r < robots; r++) {
        const Problem *problem = problem_of(bench, r);
        memcpy(memory + (size_t)r * numbers, problem->memory, numbers * sizeof *memory);
        memcpy(memory + all + (size_t)r * worn, problem->memory + numbers, worn * sizeof *memory);
        material[r] = problem->material;
    }
    if (memory && material) {
        c->memory = device_array(c, bench->device, memory, bytes, error);
        c->input.material =
            device_array(c, bench->device, material, (size_t)robots * sizeof *material, error);
    }
    free(memory);
    free(material);
    return c->memory && c->input.material ? MILD_OK : MILD_ERROR_MEMORY;
}

#define PROBLEM_INPUT(field) offsetof(Problem, field)

static MildStatus open_case(BatchCase *c, const BatchBench *bench, int robots, MildError *error) {
    const int feet = robot_feet(bench->robot);
    c->batch = open_batch(bench, robots, error);
    if (!c->batch ||
        mild_batch_set_materials(c->batch, bench->material, GROUNDS, error) != MILD_OK) {
        return MILD_ERROR_MEMORY;
    }
    const size_t all = (size_t)robots * (size_t)feet * 6 * sizeof(float);
    MildBatchInput *in = &c->input;
    in->position = input_array(c, bench, PROBLEM_INPUT(input.position), 3 * feet, error);
    in->rotation = input_array(c, bench, PROBLEM_INPUT(input.rotation), 9 * feet, error);
    in->velocity = input_array(c, bench, PROBLEM_INPUT(input.velocity), 6 * feet, error);
    in->inverse_inertia =
        input_array(c, bench, PROBLEM_INPUT(inverse_inertia), 36 * feet * feet, error);
    in->free_velocity = input_array(c, bench, PROBLEM_INPUT(input.free_velocity), 6 * feet, error);
    c->output.wrench = device_array(c, bench->device, NULL, all, error);
    c->output.velocity = device_array(c, bench->device, NULL, all, error);
    c->output.iterations =
        device_array(c, bench->device, NULL, (size_t)robots * sizeof(int32_t), error);
    const int whole = in->position && in->rotation && in->velocity && in->inverse_inertia &&
                      in->free_velocity && c->output.wrench && c->output.velocity &&
                      c->output.iterations;
    return whole ? load_case(c, bench, error) : MILD_ERROR_MEMORY;
}

/* ---- measurements ---- */

static int ascending(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* [s] Least time of a step of all robots from the memory as loaded. Negative: it failed. */
static double time_step(BatchCase *c, int advance, MildError *error) {
    const int device = c->batch->device;
    const size_t bytes = (size_t)c->batch->shape.robots * mild_batch_robot_bytes(c->batch);
    double least = INFINITY;
    const int repeats = device == MILD_BATCH_HOST ? HOST_REPEATS : REPEATS;
    for (int r = 0; r < repeats; r++) {
        if (device_copy(device, c->batch->arrays.memory, c->memory, bytes, error) != MILD_OK ||
            device_wait(device, error) != MILD_OK) {
            return -1.0;
        }
        const double start = clock_seconds();
        if (mild_batch_step(c->batch, &c->input, &c->output, advance, NULL, error) != MILD_OK ||
            device_wait(device, error) != MILD_OK) {
            return -1.0;
        }
        least = fmin(least, clock_seconds() - start);
    }
    return least;
}

/* Forces of the last step against those in double: relative errors, ascending. */
static MildStatus force_errors(const BatchCase *c, const BatchBench *bench, size_t count,
                               double *errors, double *iterations, MildError *error) {
    enum { FEET6 = 6 * MILD_FEET_MAX };
    const int feet = robot_feet(bench->robot);
    float *wrench = malloc(count * FEET6 * sizeof *wrench);
    int32_t *steps = malloc(count * sizeof *steps);
    MildStatus status = wrench && steps ? MILD_OK : MILD_ERROR_MEMORY;
    if (status == MILD_OK) {
        status = device_copy(bench->device, wrench, c->output.wrench,
                             count * 6 * (size_t)feet * sizeof *wrench, error);
    }
    if (status == MILD_OK) {
        status =
            device_copy(bench->device, steps, c->output.iterations, count * sizeof *steps, error);
    }
    *iterations = 0.0;
    for (size_t p = 0; status == MILD_OK && p < count; p++) {
        double apart = 0.0, size = 0.0;
        for (int i = 0; i < 3 * feet; i++) {
            const double force = problem_of(bench, (int)p)->result.foot[i / 3].force[i % 3];
            const double found = wrench[p * 6 * (size_t)feet + (size_t)(i / 3 * 6 + i % 3)];
            apart += (found - force) * (found - force);
            size += force * force;
        }
        errors[p] = sqrt(apart / (size + 1.0));
        *iterations += steps[p] / (double)count;
    }
    free(wrench);
    free(steps);
    if (status == MILD_OK) {
        qsort(errors, count, sizeof *errors, ascending);
    }
    return status;
}

static MildStatus report_errors(const BatchCase *c, const BatchBench *bench, BenchReport *report,
                                MildError *error) {
    static double errors[PROBLEMS_MAX];
    double iterations;
    const int robots = c->batch->shape.robots;
    const int count = bench->problems < robots ? bench->problems : robots;
    MildStatus status = force_errors(c, bench, (size_t)count, errors, &iterations, error);
    if (status == MILD_OK) {
        bench_add(report, "batch", "problems", count, "-");
        bench_add(report, "batch", "force_median", errors[count / 2], "-");
        bench_add(report, "batch", "force_99", errors[count * 99 / 100], "-");
        bench_add(report, "batch", "force_worst", errors[count - 1], "-");
        bench_add(report, "batch", "iterations", iterations, "-");
        bench_add(report, "batch", "bytes", (double)mild_batch_robot_bytes(c->batch), "B");
    }
    return status;
}

static MildStatus measure(const BatchBench *bench, int robots, int errors, BenchReport *report,
                          MildError *error) {
    BatchCase c = {0};
    MildStatus status = open_case(&c, bench, robots, error);
    for (int advance = 0; advance < 2 && status == MILD_OK; advance++) {
        const double seconds = time_step(&c, advance, error);
        char name[40];
        snprintf(name, sizeof name, "%s_%d", advance ? "advance" : "solve", robots);
        status = seconds > 0.0 ? MILD_OK : MILD_ERROR_IO;
        if (status == MILD_OK) {
            bench_add(report, "batch", name, 1e-6 * robots / seconds, "M/s");
        }
    }
    if (status == MILD_OK && errors) {
        status = report_errors(&c, bench, report, error);
    }
    close_case(&c);
    return status;
}

MildStatus bench_batch(const ExperimentDef *def, BenchReport *report, MildError *error) {
    static const int sizes[2][4] = {{1024, 0}, {4096, 16384, 65536, 0}};
    const int device = strncmp(def->train.device, "cuda", 4) == 0 ? 0 : MILD_BATCH_HOST;
    BatchBench bench = {.robot = bench_robot(def, error),
                        .model = def->task.randomize.model,
                        .problem = calloc(PROBLEMS_MAX, sizeof(Problem)),
                        .dt = def->task.physics_dt,
                        .device = device};
    if (bench.robot) {
        robot_set_model(bench.robot, task_model_soles(bench.model));
    }
    MildStatus status = bench.robot && bench.problem ? record(&bench, def, error) : MILD_ERROR_IO;
    for (int i = 0; status == MILD_OK && sizes[device >= 0][i] > 0; i++) {
        status = measure(&bench, sizes[device >= 0][i], i == 0, report, error);
    }
    for (int p = 0; p < bench.problems; p++) {
        free(bench.problem[p].memory);
    }
    free(bench.problem);
    robot_destroy(bench.robot);
    return status;
}
