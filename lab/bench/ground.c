#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "bench/bench.h"
#include "bench/record.h"

/* ---- the ground alone ---- */

enum { GROUND_REPEATS = 60, BENCH_FEET = 2, ROWS = 6 * BENCH_FEET };
static const double ground_repeat = 0.003; /* [s] */

typedef struct {
    MildTerrain terrain;
    MildContactInput input;
    double inverse_inertia[ROWS * ROWS]; /* of the input */
    MildGround *ground;
    MildGround *kept; /* its memory, put back before each step; NULL: the steps go on from it */
    MildScratch *scratch;
    int derives; /* bool: each solve is followed by dW/dV_free and dV/dV_free */
} GroundBench;

/* Centre of the sole's elements from the ankle, x and y [m]. */
static void sole_center(const MildSole *sole, double center[2]) {
    int count = mild_sole_elements(sole);
    center[0] = center[1] = 0;
    for (int i = 0; i < count; i++) {
        center[0] += mild_sole_x(sole)[i] / count;
        center[1] += mild_sole_y(sole)[i] / count;
    }
}

/* Two level feet that stand: A couples them as a trunk would, and the smooth forces press each with
 * half of 33 kg at the centre of its sole, V_free = V + dt A w. The feet touch the surface
 * and rest. */
static void ground_input(GroundBench *bench, const MildSole *const *soles, double dt) {
    MildContactInput *input = &bench->input;
    const double linear = 1.0 / 20, angular = 1.0 / 0.3, coupling = 0.6, load = 33.0 / 2 * 9.81;
    double wrench[ROWS] = {0};
    *input =
        (MildContactInput){.feet = BENCH_FEET, .dt = dt, .inverse_inertia = bench->inverse_inertia};
    memset(bench->inverse_inertia, 0, sizeof bench->inverse_inertia);
    for (int foot = 0; foot < BENCH_FEET; foot++) {
        const MildSole *sole = soles[foot];
        double center[2];
        sole_center(sole, center);
        wrench[6 * foot + 2] = -load;
        wrench[6 * foot + 3] = -load * center[1];
        wrench[6 * foot + 4] = load * center[0];
        input->position[foot][1] = foot ? -0.1 : 0.1;
        input->position[foot][2] = -mild_sole_z(sole);
        for (int i = 0; i < 3; i++) {
            input->rotation[foot][4 * i] = 1;
        }
    }
    for (int i = 0; i < ROWS; i++) {
        double diagonal = i % 6 < 3 ? linear : angular;
        int other = (i + 6) % ROWS;
        input->inverse_inertia[i * ROWS + i] = diagonal;
        input->inverse_inertia[i * ROWS + other] = coupling * diagonal;
        input->free_velocity[i] += dt * diagonal * (wrench[i] + coupling * wrench[other]);
    }
}

/* Seconds that `steps` steps take. */
static double ground_run(GroundBench *bench, int steps, int advance) {
    MildContactResult result;
    double wrench[ROWS * ROWS], twist[ROWS * ROWS];
    const MildContactDerivative wanted = {.wrench_by_free = wrench, .velocity_by_free = twist};
    double start = clock_thread_seconds();
    for (int step = 0; step < steps; step++) {
        if (bench->kept) {
            memcpy(bench->ground, bench->kept, mild_ground_size(bench->ground));
        }
        mild_ground_solve(bench->ground, &bench->terrain, &bench->input, bench->scratch, &result);
        if (bench->derives) {
            mild_ground_derivative(bench->ground, &bench->terrain, &bench->input, bench->scratch,
                                   &result, &wanted, NULL);
        }
        if (advance) {
            mild_ground_advance(bench->ground, &bench->terrain, &bench->input, bench->scratch,
                                &result);
        }
    }
    return clock_thread_seconds() - start;
}

/* [ns] Time per step: the minimum of many short repeats, because other programs can only add
 * time. */
static double ground_time(GroundBench *bench, int advance) {
    double least = INFINITY;
    int steps = 1;
    while (steps < (1 << 20) && ground_run(bench, steps, advance) < 0.5 * ground_repeat) {
        steps *= 2;
    }
    for (int repeat = 0; repeat < GROUND_REPEATS; repeat++) {
        least = fmin(least, ground_run(bench, steps, advance));
    }
    return least / steps * 1e9;
}

/* Lets the feet sink until they rest. */
static void ground_settle(GroundBench *bench, const MildSole *const *soles, double dt) {
    enum { SETTLE_STEPS = 2000 };
    double push[ROWS];
    MildContactResult result;
    mild_ground_reset(bench->ground);
    ground_input(bench, soles, dt);
    memcpy(push, bench->input.free_velocity, sizeof push);
    for (int step = 0; step < SETTLE_STEPS; step++) {
        mild_ground_solve(bench->ground, &bench->terrain, &bench->input, bench->scratch, &result);
        mild_ground_advance(bench->ground, &bench->terrain, &bench->input, bench->scratch, &result);
        for (int i = 0; i < ROWS; i++) {
            bench->input.velocity[i / 6][i % 6] = result.velocity[i];
            bench->input.free_velocity[i] = result.velocity[i] + push[i];
            if (i % 6 < 3) {
                bench->input.position[i / 6][i % 6] += dt * result.velocity[i];
            }
        }
    }
}

static void ground_slip(MildContactInput *input) {
    const double slip = 0.2; /* [m/s] */
    for (int foot = 0; foot < BENCH_FEET; foot++) {
        input->velocity[foot][0] += slip;
        input->free_velocity[6 * foot] += slip;
    }
}

static void ground_cases(GroundBench *bench, const Robot *robot, double dt, BenchReport *report) {
    static const char *const names[2][2] = {{"newton_stick", "newton_slip"},
                                            {"gauss_seidel_stick", "gauss_seidel_slip"}};
    ground_settle(bench, robot_soles(robot), dt);
    bench_add(report, "ground", "newton_stick_advance", ground_time(bench, 1), "ns");
    bench->derives = 1;
    bench_add(report, "ground", "newton_stick_derivative", ground_time(bench, 0), "ns");
    bench->derives = 0;
    MildContactInput *input = &bench->input, rest = *input;
    for (int solver = 0; solver < 2; solver++) {
        input->solver = solver ? MILD_SOLVER_GAUSS_SEIDEL : MILD_SOLVER_NEWTON;
        bench_add(report, "ground", names[solver][0], ground_time(bench, 0), "ns");
        ground_slip(input);
        bench_add(report, "ground", names[solver][1], ground_time(bench, 0), "ns");
        *input = rest;
    }
}

/* The first step of feet that fall into ground without prints: all elements sink. */
static void ground_falls(GroundBench *bench, const MildSole *const *soles, double dt,
                         BenchReport *report) {
    const double fall = 0.5; /* [m/s] */
    mild_ground_reset(bench->ground);
    ground_input(bench, soles, dt);
    for (int foot = 0; foot < BENCH_FEET; foot++) {
        bench->input.velocity[foot][2] -= fall;
        bench->input.free_velocity[6 * foot + 2] -= fall;
    }
    bench_add(report, "ground", "newton_fall", ground_time(bench, 0), "ns");
    bench->derives = 1;
    bench_add(report, "ground", "newton_fall_derivative", ground_time(bench, 0), "ns");
    bench->derives = 0;
}

/* A step of feet that slip, with its end. It begins with the same memory each time: where slip
 * takes the support away, a foot would soon carry nothing. */
static MildStatus ground_slips(GroundBench *bench, const char *name, BenchReport *report,
                               MildError *error) {
    const size_t bytes = mild_ground_size(bench->ground);
    const MildContactInput rest = bench->input;
    bench->kept = malloc(bytes);
    if (!bench->kept) {
        return mild_fail(error, MILD_ERROR_MEMORY, "bench: out of memory");
    }
    memcpy(bench->kept, bench->ground, bytes);
    ground_slip(&bench->input);
    bench_add(report, "ground", name, ground_time(bench, 1), "ns");
    memcpy(bench->ground, bench->kept, bytes);
    free(bench->kept);
    bench->kept = NULL;
    bench->input = rest;
    return MILD_OK;
}

/* The same ground where slip takes the support away, as in grains (docs/model.md section 22). */
static MildStatus ground_sinks(GroundBench *bench, const MildSole *const *soles,
                               MildMaterial material, double dt, BenchReport *report,
                               MildError *error) {
    material.slip_length = 1.4e-3;
    material.regain_length = 0.68e-3;
    material.grip = 0.123;
    material.slip_growth = 0.07;
    bench->terrain = mild_terrain_uniform(&material);
    ground_settle(bench, soles, dt);
    bench_add(report, "ground", "newton_slip_sinkage", ground_time(bench, 0), "ns");
    bench_add(report, "ground", "newton_slip_sinkage_advance", ground_time(bench, 1), "ns");
    bench->derives = 1;
    bench_add(report, "ground", "newton_slip_sinkage_derivative", ground_time(bench, 0), "ns");
    bench->derives = 0;
    return ground_slips(bench, "newton_slip_sinkage_slip_advance", report, error);
}

/* The standing step on waves, and on ground that remembers imprints, to compare with
 * newton_stick_advance. */
static MildStatus ground_terrain(GroundBench *bench, const Robot *robot, double dt,
                                 BenchReport *report, MildError *error) {
    enum { TILES = 128 };
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_WAVES;
    MildMap *map = mild_map_create(&def, error);
    void *block =
        aligned_alloc(64, mild_ground_bytes_imprints(robot_soles(robot), BENCH_FEET, TILES));
    MildStatus status = map ? MILD_OK : error->status;
    if (status == MILD_OK && !block) {
        status = mild_fail(error, MILD_ERROR_MEMORY, "bench: out of memory");
    }
    if (status == MILD_OK) {
        MildGround *without = bench->ground;
        bench->terrain.map = map;
        ground_settle(bench, robot_soles(robot), dt);
        bench_add(report, "ground", "newton_uneven_advance", ground_time(bench, 1), "ns");
        bench->terrain.map = NULL;
        bench->ground = mild_ground_init_imprints(block, robot_soles(robot), BENCH_FEET, TILES);
        ground_settle(bench, robot_soles(robot), dt);
        bench_add(report, "ground", "newton_prints_advance", ground_time(bench, 1), "ns");
        bench->ground = without;
    }
    mild_map_destroy(map);
    free(block);
    return status;
}

/* Newton on each model; on rivals of mild at rest: one element for the concentric ones. */
static MildStatus ground_model(MildModel model, Robot *robot, double dt, BenchReport *report,
                               MildError *error) {
    const MildMaterial mild = mild_material_default();
    MildMaterial material;
    robot_set_model(robot, model);
    MildStatus status = robot_match_model(robot, model, &mild, &material, error);
    if (status != MILD_OK) {
        return status;
    }
    const MildSole *const *soles = robot_soles(robot);
    GroundBench bench = {.terrain = mild_terrain_uniform(&material)};
    void *block = aligned_alloc(64, mild_ground_bytes(soles, BENCH_FEET));
    bench.scratch = mild_scratch_create(soles, BENCH_FEET, error);
    if (block && bench.scratch) {
        bench.ground = mild_ground_init(block, soles, BENCH_FEET);
        if (model == MILD_MODEL_MILD) {
            ground_cases(&bench, robot, dt, report);
            status = ground_slips(&bench, "newton_slip_advance", report, error);
            ground_falls(&bench, soles, dt, report);
            status = status ? status : ground_terrain(&bench, robot, dt, report, error);
            bench_add(report, "ground", "elements",
                      mild_sole_elements(soles[0]) + mild_sole_elements(soles[1]), "-");
        } else {
            ground_settle(&bench, soles, dt);
            char name[sizeof report->rows->name];
            snprintf(name, sizeof name, "newton_%s", mild_model_names[model]);
            bench_add(report, "ground", name, ground_time(&bench, 0), "ns");
            snprintf(name, sizeof name, "newton_%s_advance", mild_model_names[model]);
            bench_add(report, "ground", name, ground_time(&bench, 1), "ns");
        }
        if (model == MILD_MODEL_MILD_MERGED) {
            status = ground_sinks(&bench, soles, material, dt, report, error);
        }
    } else {
        status = mild_fail(error, MILD_ERROR_MEMORY, "bench: out of memory");
    }
    mild_scratch_destroy(bench.scratch);
    free(block);
    return status;
}

MildStatus bench_ground(const ExperimentDef *def, BenchReport *report, MildError *error) {
    Robot *robot = bench_robot(def, error);
    if (!robot) {
        return MILD_ERROR_IO;
    }
    MildStatus status = MILD_OK;
    for (int model = 0; model < MILD_MODEL_RIGID && status == MILD_OK; model++) {
        status = ground_model((MildModel)model, robot, def->task.physics_dt, report, error);
    }
    robot_destroy(robot);
    return status;
}

/* ---- how the cost grows with the number of elements ---- */

/* A plate of fixed size, weight and ground with finer elements. The material's numbers for one
 * element of the paper's raster are scaled by area. */
static MildSole *elements_plate(int columns, int rows, MildMaterial *material, MildError *error) {
    const double paper_pitch = 0.0195, paper_elements = 77;
    double share = paper_elements / (columns * rows), pitch = paper_pitch * sqrt(share);
    double x = 0.5 * columns * pitch, y = 0.5 * rows * pitch,
           outline[8] = {-x, -y, x, -y, x, y, -x, y};
    material->k_pen *= share;
    material->k_drift *= share;
    material->b_drift *= share;
    MildSoleDef def = {.outline = outline,
                       .points = 4,
                       .pitch = pitch,
                       .sole_z = -0.055,
                       .target_elements = columns * rows};
    return mild_sole_create(&def, error);
}

/* Standing, then slipping: [ns] per element of a solve and an advance. */
static void elements_times(GroundBench *bench, const MildSole *const *soles, double dt,
                           BenchReport *report) {
    static const char *const names[2] = {"stick", "slip"};
    int elements = mild_sole_elements(soles[0]) + mild_sole_elements(soles[1]);
    ground_settle(bench, soles, dt);
    for (int slips = 0; slips < 2; slips++) {
        char name[40];
        if (slips) {
            ground_slip(&bench->input);
        }
        snprintf(name, sizeof name, "%s_%d", names[slips], elements);
        bench_add(report, "elements", name, ground_time(bench, 1) / elements, "ns/element");
    }
}

static MildStatus elements_case(int columns, int rows, double dt, BenchReport *report,
                                MildError *error) {
    MildMaterial material = mild_material_default();
    MildSole *sole = elements_plate(columns, rows, &material, error);
    if (!sole) {
        return error->status;
    }
    const MildSole *const soles[BENCH_FEET] = {sole, sole};
    GroundBench bench = {.terrain = mild_terrain_uniform(&material)};
    void *block = aligned_alloc(64, mild_ground_bytes(soles, BENCH_FEET));
    bench.scratch = mild_scratch_create(soles, BENCH_FEET, error);
    MildStatus status = block && bench.scratch
                            ? MILD_OK
                            : mild_fail(error, MILD_ERROR_MEMORY, "bench: out of memory");
    if (status == MILD_OK) {
        bench.ground = mild_ground_init(block, soles, BENCH_FEET);
        elements_times(&bench, soles, dt, report);
    }
    mild_scratch_destroy(bench.scratch);
    free(block);
    mild_sole_destroy(sole);
    return status;
}

MildStatus bench_elements(const ExperimentDef *def, BenchReport *report, MildError *error) {
    static const int plates[][2] = {{5, 2}, {5, 5}, {10, 5}, {11, 7}, {15, 10}, {25, 14}, {40, 25}};
    MildStatus status = MILD_OK;
    for (size_t i = 0; i < sizeof plates / sizeof *plates && status == MILD_OK; i++) {
        status = elements_case(plates[i][0], plates[i][1], def->task.physics_dt, report, error);
    }
    return status;
}
