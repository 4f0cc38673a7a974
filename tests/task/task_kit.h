/* What the tests of the task layer share: the robot, one environment with its workspace, states and
 * terrains made by hand, comparisons that name what differs. */
#ifndef TASK_KIT_H
#define TASK_KIT_H

#include "base/random.h"
#include "env/task/task.h"
#include "kit.h"
#include "robot/robot.h"
#include "sa01.h"

#define KIT_MODEL SA01
#define KIT_PI 3.141592653589793

/* Joints of one leg. */
enum { HIP_ROLL, HIP_YAW, HIP_PITCH, KNEE, ANKLE_PITCH, ANKLE_ROLL, LEG_JOINTS };

static Robot *robot;
static TaskMirror mirror;

static inline int kit_setup(void **unused) {
    (void)unused;
    MildError error = {0};
    robot = robot_create(KIT_MODEL, &error);
    if (!robot) {
        fprintf(stderr, "%s\n", error.text);
        return 1;
    }
    const TaskDef def = task_def_default();
    mirror = task_mirror(&def, robot);
    return 0;
}

static inline int kit_teardown(void **unused) {
    (void)unused;
    robot_destroy(robot);
    return 0;
}

/* ---- one environment ---- */

typedef struct {
    TaskDef def;
    TaskEnv *env;
    RobotSim *sim;
    float history[TASK_HISTORY_MAX];
    float critic[TASK_CRITIC_MAX];
    float estimate[TASK_ESTIMATES_MAX];
    float frame[TASK_OBSERVATION_MAX];
    EnvsView view;
} Rig;

/* Nominal robot, no noise, no latency, no push, no help, starts at rest in the default pose. */
static inline TaskDef kit_quiet_def(void) {
    TaskDef def = task_def_default();
    task_def_make_nominal(&def);
    def.observe_noise = 0;
    def.randomize.latency[0] = def.randomize.latency[1] = 0;
    def.randomize.initial_joint = def.randomize.initial_velocity = 0;
    return def;
}

static inline void rig_open(Rig *rig, const TaskDef *def, uint64_t seed, uint32_t index) {
    MildError error = {0};
    rig->def = *def;
    rig->env = aligned_alloc(64, task_env_bytes(def, robot));
    rig->sim = robot_sim_create(robot, def->physics_dt, &error);
    assert_non_null(rig->env);
    assert_non_null(rig->sim);
    rig->view = (EnvsView){rig->history, rig->critic, rig->estimate, rig->frame};
    task_env_init(rig->env, &rig->def, robot, seed, index);
}

static inline void rig_close(Rig *rig) {
    robot_sim_destroy(rig->sim);
    free(rig->env);
}

static inline MildTerrain kit_sand(void) {
    MildMaterial sand = mild_material_default();
    return mild_terrain_uniform(&sand);
}

/* An episode on level loose sand under a command that stays. */
static inline void rig_start(Rig *rig, double vx, double vy, double wz) {
    MildTerrain terrain = kit_sand();
    rig->env->command_frozen = 1;
    rig->env->command[0] = vx;
    rig->env->command[1] = vy;
    rig->env->command[2] = wz;
    task_env_reset_on(rig->env, &rig->def, robot, rig->sim, &terrain, 0, &rig->view);
}

static inline void rig_open_quiet(Rig *rig, double vx) {
    TaskDef def = kit_quiet_def();
    rig_open(rig, &def, 3, 0);
    rig_start(rig, vx, 0, 0);
}

/* One policy step that draws no new episode. */
static inline TaskStep rig_step(Rig *rig, const float *action) {
    static const float zero[SA01_JOINTS];
    return task_env_step(rig->env, &rig->def, robot, rig->sim, action ? action : zero, 0,
                         &rig->view, NULL);
}

/* Joints without torque: in the air the robot then falls without turning or bending. */
static inline void rig_go_limp(Rig *rig) {
    memset(task_env_rest(rig->env)->gains.kp, 0, sizeof task_env_rest(rig->env)->gains.kp);
    memset(task_env_rest(rig->env)->gains.kd, 0, sizeof task_env_rest(rig->env)->gains.kd);
}

/* ---- states ---- */

/* Quaternion w x y z of yaw, then pitch, then roll. */
static inline void kit_turn(double *qpos, double yaw, double pitch, double roll) {
    double cy = cos(0.5 * yaw), sy = sin(0.5 * yaw);
    double cp = cos(0.5 * pitch), sp = sin(0.5 * pitch);
    double cr = cos(0.5 * roll), sr = sin(0.5 * roll);
    qpos[3] = cy * cp * cr + sy * sp * sr;
    qpos[4] = cy * cp * sr - sy * sp * cr;
    qpos[5] = cy * sp * cr + sy * cp * sr;
    qpos[6] = sy * cp * cr - cy * sp * sr;
}

/* Default pose at rest, base `height` above z = 0. */
static inline RobotState kit_state(double height) {
    RobotState state = {.qpos = {0, 0, height, 1, 0, 0, 0}};
    memcpy(state.qpos + 7, robot_default_pose(robot), sizeof(double) * SA01_JOINTS);
    return state;
}

static inline void kit_put(TaskEnv *env, RobotState state) {
    task_env_set_state(env, &state);
}

/* robot_sim_load with what was drawn for the environment. */
static inline void kit_load(RobotSim *sim, const RobotState *state, const TaskEnv *env) {
    const RobotVariation variation = task_env_variation(env);
    robot_sim_load(sim, state, &variation);
}

/* Turned, bent and in motion; all of it different from draw to draw. Joints inside their ranges. */
static inline RobotState kit_moving_state(double height, uint32_t draw) {
    Random r = random_at(77, draw, 0);
    RobotState state = kit_state(height);
    state.qpos[0] = random_uniform(&r, -2, 2);
    state.qpos[1] = random_uniform(&r, -2, 2);
    kit_turn(state.qpos, random_uniform(&r, -3, 3), random_uniform(&r, -0.3, 0.3),
             random_uniform(&r, -0.3, 0.3));
    for (int i = 0; i < SA01_JOINTS; i++) {
        state.qpos[7 + i] += random_uniform(&r, -0.2, 0.2);
    }
    for (int i = 0; i < SA01_NV; i++) {
        state.qvel[i] = random_uniform(&r, -1, 1);
    }
    return state;
}

#endif
