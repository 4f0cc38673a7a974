/* The batch engine on a GPU: one step of random states against the code in double and in float on
 * the processor, on level ground and on a map, then its speed. Usage: engine_device_engine
 * FOLDER_OF_ROBOT [STATES]; with STATES it compares so many and times nothing, as compute-sanitizer
 * wants it.
 *
 * Compiled for one robot (the definitions of engine_model_sizes) or for any. Errors of qacc are
 * relative to the largest acceleration of their kind (base, joints) of that state. Exit 1 when one
 * is above 1e-4 in the air or 1e-3 on rigid ground, where a state may lie on the edge of a contact.
 * In the air it may also be twice what float on the processor is off: where random poses put legs
 * deep into each other that is up to 3.2e-4. Errors of A are relative to its largest entry, 2e-5.
 */
#define MILD_REAL_FLOAT
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

extern "C" {
#include "device_cases.h"
#include "ground/batch/batch.h"
}

#include "device_robots.h"

static const double dt = 0.0025; /* [s] */

static void check(cudaError_t status, const char *what) {
    if (status != cudaSuccess) {
        fprintf(stderr, "%s: %s\n", what, cudaGetErrorString(status));
        exit(2);
    }
}

/* An array on the device, filled from doubles or with bytes. */
template <typename T> static T *on_device(const std::vector<T> &from) {
    T *to = nullptr;
    check(cudaMalloc(&to, from.size() * sizeof(T)), "memory");
    check(cudaMemcpy(to, from.data(), from.size() * sizeof(T), cudaMemcpyHostToDevice), "copy");
    return to;
}

template <typename T> static std::vector<T> from_device(const T *from, size_t count) {
    std::vector<T> to(count);
    check(cudaMemcpy(to.data(), from, count * sizeof(T), cudaMemcpyDeviceToHost), "copy");
    return to;
}

static EngineVariation variation_of(const RobotVariation *from) {
    EngineVariation to = {};
    to.base_mass_add = (float)from->base_mass_add;
    to.armature_scale = (float)from->armature_scale;
    to.rigid = {(float)from->rigid_friction, (float)from->rigid_time};
    for (int k = 0; k < 3; k++) {
        to.center_offset[k] = (float)from->com_offset[k];
    }
    for (int i = 0; i < ENGINE_LINKS_MAX; i++) {
        to.link_mass_scale[i] = (float)from->link_mass_scale[i];
    }
    return to;
}

/* Robots on the device in the states of these cases. `pd`: the torques are angles that a PD holds.
 */
static EngineRobots robots_of(const DeviceRobot &robot, const std::vector<EngineCase> &cases,
                              int rigid, int pd) {
    const int joints = robot.tree.joints;
    const int rows = 6 * robot.tree.feet;
    const size_t count = cases.size();
    std::vector<float> qpos, qvel, torque, target, push, origin, kp(joints), kd(joints);
    std::vector<EngineVariation> variation;
    for (const EngineCase &in : cases) {
        qpos.insert(qpos.end(), in.qpos, in.qpos + 7 + joints);
        qvel.insert(qvel.end(), in.qvel, in.qvel + 6 + joints);
        push.insert(push.end(), in.push, in.push + 6);
        origin.insert(origin.end(), in.map_origin, in.map_origin + 2);
        variation.push_back(variation_of(&in.variation));
        for (int j = 0; j < joints; j++) {
            torque.push_back(pd ? 0 : (float)in.torque[j]);
            target.push_back(pd ? (float)in.torque[j] : 0);
            kp[j] = pd ? (float)robot.kp[j] : 0;
            kd[j] = pd ? (float)robot.kd[j] : 0;
        }
    }
    EngineRobots robots = {};
    robots.count = (int)count;
    robots.rigid = rigid;
    robots.qpos = on_device(qpos);
    robots.qvel = on_device(qvel);
    robots.torque = on_device(torque);
    robots.target = on_device(target);
    robots.kp = on_device(kp);
    robots.kd = on_device(kd);
    robots.push = on_device(push);
    robots.map_origin = on_device(origin);
    robots.variation = on_device(variation);
    robots.acceleration = on_device(std::vector<float>(count * (6 + joints), NAN));
    robots.inverse_inertia =
        rigid ? nullptr : on_device(std::vector<float>(count * rows * rows, NAN));
    robots.bad = on_device(std::vector<int>(count, 0));
    return robots;
}

static void free_robots(EngineRobots *robots) {
    const void *arrays[] = {robots->qpos,         robots->qvel,
                            robots->torque,       robots->target,
                            robots->kp,           robots->kd,
                            robots->push,         robots->variation,
                            robots->acceleration, robots->inverse_inertia,
                            robots->bad,          robots->map_origin,
                            robots->material};
    for (const void *array : arrays) {
        cudaFree((void *)array);
    }
}

/* ---- device against host ---- */

/* Worst of |got - want| against the largest of `want`, from `begin` to `end`. */
static double relative(const float *got, const double *want, int begin, int end) {
    double most = 1e-30, worst = 0;
    for (int i = begin; i < end; i++) {
        most = fmax(most, fabs(want[i]));
    }
    for (int i = begin; i < end; i++) {
        const double error = fabs((double)got[i] - want[i]) / most;
        worst = error <= worst ? worst : error; /* NaN included */
    }
    return worst;
}

struct Errors {
    double qacc, A, qvel, qpos;
};

static void note(double *worst, double error) {
    *worst = error <= *worst ? *worst : error;
}

/* What the device says of all robots. */
struct Answers {
    std::vector<float> qacc, qpos, qvel, A;
    std::vector<int> bad;
};

static Answers answers_of(const DeviceRobot &robot, const EngineRobots &robots) {
    const size_t count = (size_t)robots.count, joints = (size_t)robot.tree.joints;
    const size_t rows = 36 * (size_t)(robot.tree.feet * robot.tree.feet);
    Answers all;
    all.qacc = from_device(robots.acceleration, count * (6 + joints));
    all.qpos = from_device(robots.qpos, count * (7 + joints));
    all.qvel = from_device(robots.qvel, count * (6 + joints));
    all.bad = from_device(robots.bad, count);
    if (robots.inverse_inertia) {
        all.A = from_device(robots.inverse_inertia, count * rows);
    }
    return all;
}

static double qacc_error(const DeviceRobot &robot, const float *got, const EngineResult &want) {
    const double *a = want.acceleration;
    const double base = fmax(relative(got, a, 0, 3), relative(got, a, 3, 6));
    return fmax(base, relative(got, a, 6, 6 + robot.tree.joints));
}

/* Robot i against the host. Returns the error of qacc. */
static double note_robot(const DeviceRobot &robot, const Answers &got, const EngineResult &want,
                         int i, Errors *worst) {
    const int dofs = 6 + robot.tree.joints, rows = 36 * robot.tree.feet * robot.tree.feet;
    const double error = qacc_error(robot, &got.qacc[(size_t)i * dofs], want);
    note(&worst->qacc, error);
    note(&worst->qvel, relative(&got.qvel[(size_t)i * dofs], want.qvel, 0, dofs));
    note(&worst->qpos, relative(&got.qpos[(size_t)i * (1 + dofs)], want.qpos, 0, 1 + dofs));
    if (!got.A.empty()) {
        note(&worst->A, relative(&got.A[(size_t)i * rows], want.inverse_inertia, 0, rows));
    }
    return error;
}

/* A map on the device; nothing for none. */
static MapView view_of(const MildMap *map) {
    MapView view = {};
    MildError error = {MILD_OK, {0}};
    if (map && batch_map_open(&view, map, 0, &error) != MILD_OK) {
        fprintf(stderr, "%s\n", error.text);
        exit(2);
    }
    return view;
}

/* map: of rigid ground, or NULL. A state whose corner lies on the border of a cell may see the next
 * one's gradient. */
static int compare(const DeviceRobot &robot, const EngineModel *model, int rigid,
                   const MildMap *map, int count) {
    static const char *const name[2] = {"double", "float"};
    static EngineText *const text[2] = {engine_text_double, engine_text_float};
    std::vector<EngineCase> cases;
    for (int i = 0; i < count; i++) {
        cases.push_back(device_case(rigid, map, (uint32_t)i));
    }
    EngineRobots robots = robots_of(robot, cases, rigid, 0);
    const MapView view = view_of(map);
    robots.map = map ? &view : nullptr;
    check(engine_step_robots(model, &robots, 1, 0), "step");
    check(cudaDeviceSynchronize(), "step");
    const Answers got = answers_of(robot, robots);
    Errors worst[2] = {};
    double excess = 0; /* of qacc against double over what it may be */
    int bad = 0, off = 0;
    for (int i = 0; i < count; i++) {
        static EngineResult want[2];
        double error[2];
        bad += got.bad[i];
        for (int k = 0; k < 2; k++) {
            text[k](&robot.tree, robot.number, &cases[i], &want[k]);
            error[k] = note_robot(robot, got, want[k], i, &worst[k]);
        }
        const std::vector<float> host(want[1].acceleration,
                                      want[1].acceleration + 6 + robot.tree.joints);
        off += !(error[0] < 1e-4);
        note(&excess, error[0] / fmax(1e-4, 2 * qacc_error(robot, host.data(), want[0])));
    }
    for (int k = 0; k < 2; k++) {
        printf("%-13s %d states, device against %-6s: worst qacc %.1e  A %.1e  qvel after %.1e  "
               "qpos after %.1e\n",
               map     ? "rigid map,"
               : rigid ? "rigid ground,"
                       : "in the air,",
               count, name[k], worst[k].qacc, worst[k].A, worst[k].qvel, worst[k].qpos);
    }
    printf("              %d beyond 1e-4 of double, %d bad\n", off, bad);
    free_robots(&robots);
    batch_map_close(&view, 0);
    return bad == 0 && worst[0].A < 2e-5 &&
           (map     ? off <= count / 100
            : rigid ? worst[0].qacc < 1e-3
                    : excess < 1);
}

/* ---- soft ground ---- */

/* map: or NULL. */
static MildBatch *ground_of(int robots, const MildMap *map) {
    MildMaterial materials[DEVICE_LABELS];
    MildError error = {MILD_OK, {0}};
    MildBatchDef def = {robots, ROBOT_FEET_MAX, device_soles(), dt, 0, 0, 0};
    def.feet = ENGINE_FIXED ? ENGINE_FEET : 2;
    MildBatch *ground = mild_batch_create(&def, &error);
    device_materials(materials);
    if (!ground || mild_batch_set_materials(ground, materials, DEVICE_LABELS, &error) ||
        mild_batch_set_map(ground, map, &error)) {
        fprintf(stderr, "%s\n", error.text);
        exit(2);
    }
    return ground;
}

/* The materials of all robots' labels. */
static const int32_t *materials_of(int robots) {
    std::vector<int32_t> material((size_t)robots * DEVICE_LABELS);
    for (size_t i = 0; i < material.size(); i++) {
        material[i] = (int32_t)(i % DEVICE_LABELS);
    }
    return on_device(material);
}

/* Robots that come down on sand, or on a map, with different legs and speeds, their motors holding
 * a pose. */
static std::vector<EngineCase> landings(const DeviceRobot &robot, const MildMap *map, int count) {
    std::vector<EngineCase> cases((size_t)count, robot.stand);
    for (int i = 0; i < count; i++) {
        cases[i].map = map;
        cases[i].qpos[0] += map ? i % 64 / 8 : 0;
        cases[i].qpos[1] += map ? i % 8 : 0;
        cases[i].qpos[2] +=
            0.01 + (map ? device_height(map, cases[i].qpos[0], cases[i].qpos[1]) : 0);
        cases[i].qvel[0] = 0.3 * sin(1.7 * i);
        cases[i].qvel[1] = 0.1 * sin(2.3 * i);
        for (int j = 0; j < robot.tree.joints; j++) {
            cases[i].qpos[7 + j] += 0.05 * sin(i + 3 * j);
        }
        for (double &x : cases[i].qpos) {
            x = (float)x;
        }
        for (double &x : cases[i].qvel) {
            x = (float)x;
        }
    }
    return cases;
}

/* A while on sand, or on a map of sand and grass, against MuJoCo with mild/ground.h. */
static int compare_soft(const DeviceRobot &robot, const EngineModel *model, const MildMap *map,
                        int count, int steps) {
    const std::vector<EngineCase> cases = landings(robot, map, count);
    MildBatch *ground = ground_of(count, map);
    EngineRobots robots = robots_of(robot, cases, 0, 1);
    robots.ground = ground;
    robots.material = map ? materials_of(count) : nullptr;
    robots.push = nullptr;
    check(engine_step_robots(model, &robots, steps, 0), "step");
    check(cudaDeviceSynchronize(), "step");
    const Answers got = answers_of(robot, robots);
    double height = 0, joint = 0, speed = 0;
    int bad = 0;
    for (int i = 0; i < count; i++) {
        double qpos[ROBOT_NQ_MAX], qvel[ROBOT_NV_MAX];
        bad += !device_soft_reference(&robot, &cases[i], steps, qpos, qvel) || got.bad[i];
        const size_t q = (size_t)i * (7 + robot.tree.joints),
                     v = (size_t)i * (6 + robot.tree.joints);
        for (int k = 0; k < 3; k++) {
            note(&height, fabs(got.qpos[q + k] - qpos[k]));
            note(&speed, fabs(got.qvel[v + k] - qvel[k]));
        }
        for (int j = 0; j < robot.tree.joints; j++) {
            note(&joint, fabs(got.qpos[q + 7 + j] - qpos[7 + j]));
        }
    }
    printf("%-13s %d robots, %d steps, device against MuJoCo and mild/ground.h in double: "
           "base %.1e m, its speed %.1e m/s, joints %.1e rad, %d bad\n",
           map ? "on a map," : "on sand,", count, steps, height, speed, joint, bad);
    free_robots(&robots);
    mild_batch_destroy(ground);
    return height < 1e-3 && joint < 1e-2 && bad == 0;
}

/* ---- speed ---- */

enum Kind { AIR, RIGID, RIGID_MAP, SAND, SAND_MAP, KINDS };
static const char *const names[KINDS] = {"in the air,", "rigid ground,", "rigid map,", "on sand,",
                                         "on a map,"};

/* Fastest and slowest of a few runs. */
static void time_robots(const DeviceRobot &robot, const EngineModel *model, Kind kind,
                        const MildMap *all, int count, int steps) {
    enum { RUNS = 5, LAUNCHES = 20 };
    const MildMap *map = kind == RIGID_MAP || kind == SAND_MAP ? all : nullptr;
    const std::vector<EngineCase> cases = landings(robot, map, count);
    const MapView view = view_of(kind == RIGID_MAP ? map : nullptr);
    EngineRobots robots = robots_of(robot, cases, kind == RIGID || kind == RIGID_MAP, 1);
    const std::vector<float> qpos =
        from_device(robots.qpos, (size_t)count * (7 + robot.tree.joints));
    const std::vector<float> qvel =
        from_device(robots.qvel, (size_t)count * (6 + robot.tree.joints));
    MildBatch *ground = kind >= SAND ? ground_of(count, map) : nullptr;
    MildError error = {MILD_OK, {0}};
    robots.ground = ground;
    robots.map = kind == RIGID_MAP ? &view : nullptr;
    robots.material = kind == SAND_MAP ? materials_of(count) : nullptr;
    robots.push = nullptr;
    cudaEvent_t begin, end;
    check(cudaEventCreate(&begin), "event");
    check(cudaEventCreate(&end), "event");
    float best = 1e30f, worst = 0;
    for (int run = 0; run < RUNS; run++) {
        float ms = 0;
        if (ground) { /* every run is the same landing */
            check(cudaMemcpy(robots.qpos, qpos.data(), qpos.size() * sizeof(float),
                             cudaMemcpyHostToDevice),
                  "copy");
            check(cudaMemcpy(robots.qvel, qvel.data(), qvel.size() * sizeof(float),
                             cudaMemcpyHostToDevice),
                  "copy");
            mild_batch_reset(ground, nullptr, nullptr, &error);
        }
        check(cudaEventRecord(begin), "event");
        for (int launch = 0; launch < LAUNCHES; launch++) {
            check(engine_step_robots(model, &robots, steps, 0), "step");
        }
        check(cudaEventRecord(end), "event");
        check(cudaEventSynchronize(end), "step");
        check(cudaEventElapsedTime(&ms, begin, end), "event");
        best = ms < best ? ms : best;
        worst = ms > worst && run > 0 ? ms : worst; /* the first run warms up */
    }
    const double total = 1e-3 * (double)count * steps * LAUNCHES; /* [1000 steps] */
    printf("%-13s %6d robots, %2d steps a launch: %7.1f M steps/s (slowest run %.1f)\n",
           names[kind], count, steps, total / best, total / worst);
    cudaEventDestroy(begin);
    cudaEventDestroy(end);
    free_robots(&robots);
    batch_map_close(&view, 0);
    mild_batch_destroy(ground);
}

int main(int argc, char **argv) {
    static DeviceRobot robot;
    static EngineModel model;
    const int states = argc > 2 ? atoi(argv[2]) : 10000;
    if (argc < 2 || !device_robot_open(argv[1], dt, &robot)) {
        fprintf(stderr, "usage: %s FOLDER_OF_ROBOT [STATES]\n", argv[0]);
        return 2;
    }
    if (ENGINE_FIXED &&
        (robot.tree.joints != ENGINE_JOINTS || robot.tree.entries != ENGINE_ENTRIES)) {
        fprintf(stderr, "compiled for another robot\n");
        return 2;
    }
    model.tree = robot.tree;
    for (size_t i = 0; i < ENGINE_NUMBERS; i++) {
        ((float *)&model.number)[i] = (float)robot.number[i];
    }
    const EngineModel *there = on_device(std::vector<EngineModel>(1, model));
    cudaFuncAttributes facts;
    int at_once = 0;
    MildMap *map = device_map();
    if (!map) {
        return 2;
    }
    for (int k = 0; k < 4; k++) {
        check(engine_kernel_facts(k / 2, k % 2, &facts, &at_once), "kernel");
        printf("%s%s: %d registers, %zu bytes of local memory, %zu bytes of shared memory a robot, "
               "%d robots a multiprocessor\n",
               k / 2 ? "soft ground" : "without", k % 2 ? ", map" : "", facts.numRegs,
               facts.localSizeBytes, engine_shared_bytes(), at_once);
    }
    const int good =
        compare(robot, there, 0, nullptr, states) & compare(robot, there, 1, nullptr, states) &
        compare(robot, there, 1, map, states) & compare_soft(robot, there, nullptr, 64, 1) &
        compare_soft(robot, there, nullptr, 64, 100) & compare_soft(robot, there, map, 64, 1) &
        compare_soft(robot, there, map, 64, 100);
    static const int counts[] = {4096, 16384, 65536};
    for (int kind = 0; kind < KINDS && argc == 2; kind++) {
        for (int count : counts) {
            time_robots(robot, there, (Kind)kind, map, count, 1);
            time_robots(robot, there, (Kind)kind, map, count, 4);
        }
    }
    mild_map_destroy(map);
    printf("%s\n", good ? "ok" : "FAILED");
    return !good;
}
