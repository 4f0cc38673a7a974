#include "device_cases.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "cases.h"

static Robot *robot;
static RobotSim *sim;

int device_robot_open(const char *folder, double dt, DeviceRobot *device) {
    MildError error = {0};
    robot = robot_create(folder, &error);
    sim = robot ? robot_sim_create(robot, dt, &error) : NULL;
    if (!sim || engine_model_read(robot, dt, &device->tree, device->number, &error) != MILD_OK) {
        fprintf(stderr, "%s\n", error.text);
        return 0;
    }
    device->kp = robot->def.kp;
    device->kd = robot->def.kd;
    device->stand = (EngineCase){.variation = robot_variation_nominal()};
    device->stand.qpos[2] = robot->stand_height;
    device->stand.qpos[3] = 1;
    memcpy(device->stand.qpos + 7, robot->def.pose, sizeof robot->def.pose);
    memcpy(device->stand.torque, robot->def.pose, sizeof robot->def.pose);
    return 1;
}

MildMap *device_map(void) {
    MildMapDef def = mild_map_def_default();
    MildError error = {0};
    def.kind = MILD_MAP_ROUGH;
    def.patches = MILD_PATTERN_CHECKER;
    def.patch_size = 0.07;
    def.patch_count = DEVICE_LABELS;
    MildMap *map = mild_map_create(&def, &error);
    if (!map) {
        fprintf(stderr, "%s\n", error.text);
    }
    return map;
}

void device_materials(MildMaterial materials[DEVICE_LABELS]) {
    materials[0] = mild_material_default();
    mild_material_preset("grass", &materials[1]);
}

double device_height(const MildMap *map, double x, double y) {
    const MildTerrain terrain = {.material_count = 1, .map = map};
    return mild_terrain_height_at(&terrain, x, y);
}

const MildSole *const *device_soles(void) {
    return robot_soles(robot);
}

int device_soft_reference(const DeviceRobot *device, const EngineCase *in, int steps, double *qpos,
                          double *qvel) {
    const int joints = device->tree.joints;
    MildTerrain terrain = {.material_count = DEVICE_LABELS, .map = in->map};
    device_materials(terrain.materials);
    void *block = aligned_alloc(64, mild_ground_bytes(robot_soles(robot), robot_feet(robot)));
    if (!block) {
        return 0;
    }
    MildGround *ground = mild_ground_init(block, robot_soles(robot), robot_feet(robot));
    RobotState state = {{0}, {0}, {0}};
    memcpy(state.qpos, in->qpos, (size_t)(7 + joints) * sizeof(double));
    memcpy(state.qvel, in->qvel, (size_t)(6 + joints) * sizeof(double));
    robot_sim_load(sim, &state, &in->variation);
    int bad = 0;
    for (int s = 0; s < steps && !bad; s++) {
        double torque[ROBOT_JOINTS_MAX];
        for (int j = 0; j < joints; j++) {
            const double effort = robot_effort(robot)[j];
            const double wanted = device->kp[j] * (in->torque[j] - robot_sim_qpos(sim)[7 + j]) -
                                  device->kd[j] * robot_sim_qvel(sim)[6 + j];
            torque[j] = fmax(-effort, fmin(effort, wanted));
        }
        bad = robot_sim_step(sim, torque, NULL, &terrain, ground);
    }
    memcpy(qpos, robot_sim_qpos(sim), (size_t)(7 + joints) * sizeof(double));
    memcpy(qvel, robot_sim_qvel(sim), (size_t)(6 + joints) * sizeof(double));
    free(block);
    return !bad;
}

EngineCase device_case(int rigid, const MildMap *map, uint32_t draw) {
    EngineCase in;
    if (!rigid) {
        in = random_case(robot, draw);
        memset(in.wrench, 0, sizeof in.wrench);
        memset(in.qacc, 0, sizeof in.qacc); /* engine_load begins without one */
        return in;
    }
    in = rigid_case(sim, map, draw % 4 < 2 ? draw : draw - 2); /* others are on a slope */
    in.qpos[2] -= in.height;
    in.height = 0;
    round_case(&in);
    return in;
}
