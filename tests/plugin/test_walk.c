/* Robots on the plugin as on our own step: `eval` with every physics step made by mj_step of the
 * robot's MJCF with the plugin. The linker puts the step below in the place
 * of robot_sim_step. With a number as argument, that many trials of each walk, at all steps. */
#include <math.h>

#include "plugin_kit.h"

#include "mild/batch.h"
#include "robot/sim.h"
#include "robots.h"
#include "run/config/experiment_keys.h"
#include "run/eval/eval.h"

/* The robot in MuJoCo. NULL: robot_sim_step makes our own step. */
static mjModel *model;
static mjData *data;

WRAPS(robot_sim_step);

/* ---- the model: MJCF, a motor for each joint, soles of robot.ini as attributes ---- */

static void add(char *text, size_t size, const char *format, ...) {
    va_list arguments;
    size_t length = strlen(text);
    va_start(arguments, format);
    vsnprintf(text + length, size - length, format, arguments);
    va_end(arguments);
    assert_true(strlen(text) + 1 < size);
}

/* <config> of the feet: outlines of flat soles, spheres of round ones. */
static void feet_config(const RobotDef *def, char *text, size_t size) {
    const RobotFootDef *first = &def->foot[0];
    add(text, size, "<config key='feet' value='");
    for (int f = 0; f < def->feet; f++) {
        add(text, size, "%s ", def->foot[f].body);
    }
    add(text, size, "'/>");
    add(text, size, "<config key='pitch' value='%.17g'/>", first->pitch);
    if (first->shape == ROBOT_SOLE_ROUND) {
        add(text, size, "<config key='sole' value='");
        for (int f = 0; f < def->feet; f++) {
            add(text, size, "ball%d ", f);
        }
        add(text, size, "'/>");
        return;
    }
    add(text, size, "<config key='sole_z' value='%.17g'/>", first->z);
    add(text, size, "<config key='elements' value='%d'/><config key='outline' value='",
        first->elements);
    for (int f = 0; f < def->feet; f++) {
        add(text, size, f ? ";" : "");
        for (int i = 0; i < 2 * def->foot[f].outline_points; i++) {
            add(text, size, " %.17g", def->foot[f].outline[i]);
        }
    }
    add(text, size, "'/>");
}

static void material_config(const MildMaterial *material, char *text, size_t size) {
    for (int i = 0; i < mild_material_field_count; i++) {
        char value[64];
        mild_field_print(&mild_material_fields[i], material, value, sizeof value);
        add(text, size, "<config key='ground.%s' value='%s'/>", mild_material_fields[i].name,
            value);
    }
}

/* The robot's own file with the plugin, motors, and spheres where round feet are. */
static mjModel *robot_in_mujoco(const Robot *robot, const MildMaterial *material, double dt,
                                const char *integrator) {
    static char text[40000], head[20000];
    const RobotDef *def = &robot->def;
    char error[500] = "";
    head[0] = text[0] = '\0';
    feet_config(def, head, sizeof head);
    material_config(material, head, sizeof head);
    add(text, sizeof text,
        "<mujoco><include file='%s'/><option timestep='%.17g' integrator='%s'/><extension><plugin "
        "plugin='mild.ground'><instance name='soft'>%s</instance></plugin></extension></mujoco>",
        robot->path, dt, integrator, head);
    mjVFS vfs;
    mj_defaultVFS(&vfs);
    mj_addBufferVFS(&vfs, "robot.xml", text, (int)strlen(text));
    mjSpec *spec = mj_parseXML("robot.xml", &vfs, error, (int)sizeof error);
    if (!spec) {
        fail_msg("%s", error);
    }
    for (mjsElement *e = mjs_firstElement(spec, mjOBJ_ACTUATOR), *next; e; e = next) {
        next = mjs_nextElement(spec, e);
        mjs_delete(spec, e);
    }
    for (int i = 0; i < def->joints; i++) {
        mjsActuator *motor = mjs_addActuator(spec, NULL);
        motor->trntype = mjTRN_JOINT;
        mjs_setString(motor->target, def->joint[i]);
    }
    for (int f = 0; f < def->feet && def->foot[f].shape == ROBOT_SOLE_ROUND; f++) {
        char name[16];
        snprintf(name, sizeof name, "ball%d", f);
        mjsGeom *ball = mjs_addGeom(mjs_findBody(spec, def->foot[f].body), NULL);
        mjs_setName(ball->element, name);
        ball->type = mjGEOM_SPHERE;
        ball->contype = ball->conaffinity = 0;
        ball->mass = 0;
        ball->size[0] = def->foot[f].radius;
        memcpy(ball->pos, def->foot[f].center, sizeof ball->pos);
    }
    mjModel *compiled = mj_compile(spec, &vfs);
    if (!compiled) {
        fail_msg("%s %s", mjs_getError(spec), kit_said);
    }
    mj_deleteSpec(spec);
    mj_deleteVFS(&vfs);
    return compiled;
}

static void use_plugin(const Robot *robot, const MildMaterial *material, double dt,
                       const char *integrator) {
    model = robot_in_mujoco(robot, material, dt, integrator);
    data = mj_makeData(model);
    assert_non_null(data);
}

static void use_own_step(void) {
    mj_deleteData(data);
    mj_deleteModel(model);
    data = NULL;
    model = NULL;
}

/* ---- the step ---- */

/* Brings the robot's workspace to where MuJoCo is, with the forces of the plugin. */
static void show(RobotSim *sim) {
    const Soft *soft = plugin_soft(model, data);
    const size_t nq = (size_t)model->nq, nv = (size_t)model->nv;
    RobotState state;
    memcpy(sim->data->qpos, data->qpos, nq * sizeof(double));
    memcpy(sim->data->qvel, data->qvel, nv * sizeof(double));
    memcpy(sim->data->qacc_warmstart, data->qacc_warmstart, nv * sizeof(double));
    robot_sim_store(sim, &state);
    const RobotVariation variation = sim->variation;
    robot_sim_load(sim, &state, &variation);
    sim->contact = soft->contact;
    for (int f = 0; f < sim->robot->def.feet; f++) {
        sim->feet[f].result = soft->contact.foot[f];
        memcpy(sim->feet[f].force, soft->contact.foot[f].force, sizeof sim->feet[f].force);
        memcpy(sim->feet[f].torque, soft->contact.foot[f].torque, sizeof sim->feet[f].torque);
    }
}

int __wrap_robot_sim_step(RobotSim *sim, const double *torque, const double *push,
                          const MildTerrain *terrain, MildGround *ground) {
    if (!model || sim->variation.rigid) {
        return __real_robot_sim_step(sim, torque, push, terrain, ground);
    }
    assert_null(push);
    const size_t nq = (size_t)model->nq, nv = (size_t)model->nv;
    assert_int_equal((size_t)model->npluginstate * sizeof(double), mild_ground_size(ground));
    memcpy(data->qpos, sim->data->qpos, nq * sizeof(double));
    memcpy(data->qvel, sim->data->qvel, nv * sizeof(double));
    memcpy(data->qacc_warmstart, sim->data->qacc_warmstart, nv * sizeof(double));
    memcpy(data->plugin_state, ground, mild_ground_size(ground));
    memcpy(data->ctrl, torque, (size_t)model->nu * sizeof(double));
    mj_step(model, data);
    memcpy(ground, data->plugin_state, mild_ground_size(ground));
    show(sim);
    for (int i = 0; i < model->nv; i++) {
        if (!(fabs(data->qvel[i]) < 1e3)) {
            return 1;
        }
    }
    return data->warning[mjWARN_BADQACC].number + data->warning[mjWARN_BADQVEL].number > 0;
}

/* ---- walking ---- */

/* A robot and the policy that is shipped for it, with the configuration of its training. */
typedef struct {
    const char *robot, *policy, *config;
} Walker;

/* `trials` walks of ten seconds at 0.5 m/s, as `mild eval` makes them; only begun where kit_short
 * says so. */
static EvalRow walk(const Walker *walker, const Robot *robot, const char *ground, double dt,
                    int trials) {
    char file[300], name[TRAIN_ROBOT_SIZE];
    MildError error = {0};
    TaskDef def;
    expect_good(experiment_task(&def, 0, name, walker->config, NULL, &error) == MILD_OK, &error);
    def.physics_dt = dt;
    Pool *pool = pool_create(1);
    Controller controller;
    snprintf(file, sizeof file, MILD_SOURCE_DIR "/policies/%s.safetensors", walker->policy);
    expect_good(controller_learned(file, robot, pool, trials, &controller, &error) == MILD_OK,
                &error);
    Scene scene;
    assert_int_equal(scene_make(&scene, ground, 3, &error), MILD_OK);
    EvalDef eval = {.speed = 0.5, .trials = trials, .seconds = kit_short() ? 1 : 10, .seed = 1};
    EvalRow row;
    const EvalRun run = {.task = &def,
                         .robot = robot,
                         .pool = pool,
                         .controller = &controller,
                         .device = MILD_BATCH_HOST,
                         .scenes = &scene,
                         .scene_count = 1,
                         .speeds = &eval.speed,
                         .speed_count = 1,
                         .eval = eval};
    expect_good(eval_run(&run, &row, &error) == MILD_OK, &error);
    controller_destroy(&controller);
    pool_destroy(pool);
    return row;
}

static void check_walk(const Walker *walker, const Robot *robot, const char *ground, double dt,
                       const char *integrator, int trials) {
    MildMaterial material;
    assert_true(mild_material_preset(ground, &material));
    const EvalRow own = walk(walker, robot, ground, dt, trials);
    use_plugin(robot, &material, dt, integrator);
    const EvalRow mujoco = walk(walker, robot, ground, dt, trials);
    use_own_step();
    print_message("%-4s %-10s %g ms %-12s %d of %d, %.4f m/s, %.2f mm; by our own step %d, %.4f "
                  "m/s, %.2f mm\n",
                  walker->robot, ground, 1e3 * dt, integrator, mujoco.success, trials,
                  mujoco.velocity, 1e3 * mujoco.penetration, own.success, own.velocity,
                  1e3 * own.penetration);
    assert_int_equal(mujoco.success, trials);
    if (kit_short()) {
        return;
    }
    assert_true(fabs(mujoco.velocity - own.velocity) < 0.004 * own.velocity);
    assert_true(fabs(mujoco.penetration - own.penetration) < 0.004 * own.penetration);
}

/* Trials of each walk on each ground at each step. 0: two, ten on sand, each ground at one step. */
static int thorough;

TEST(policies_walk) {
    static const Walker walkers[] = {{"sa01", "mild", NULL},
                                     {"go1", "go1", MILD_SOURCE_DIR "/configs/go1.ini"},
                                     {"g1", "g1", MILD_SOURCE_DIR "/configs/g1.ini"}};
    static const char *const grounds[] = {"rubber", "foam45", "grass", "sand_loose"};
    static const char *const integrators[] = {"implicitfast", "Euler", "discrete"};
    static const double steps[] = {0.001, 0.005, 0.002};
    for (int w = 0; w < 3; w++) {
        char folder[200];
        snprintf(folder, sizeof folder, MILD_SOURCE_DIR "/robots/%s", walkers[w].robot);
        Robot *robot = kit_robot(folder);
        robot->leg_pairs = 0; /* the MJCF's legs do not touch each other */
        for (int n = 0; n < 12; n++) {
            const int g = n / 3, k = n % 3;
            const int walks = w == 0 || g < 3; /* Go1 and G1 may fall in loose sand */
            const int trials = g == 3 ? 10 : 2;
            if (walks && (thorough || k == (g + w) % 3)) {
                check_walk(&walkers[w], robot, grounds[g], steps[k], integrators[(g + k) % 3],
                           thorough ? thorough : trials);
            }
        }
        robot_destroy(robot);
    }
}

int main(int argc, char **argv) {
    thorough = argc > 1 ? atoi(argv[1]) : 0;
    return run_cases(kit_setup, NULL);
}
