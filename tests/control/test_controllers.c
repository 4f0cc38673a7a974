/* The table of controllers, and those that need no policy, on the biped and on the quadruped. */
#include "control/controller.h"
#include "control/stand.h"
#include "robots.h"

/* A robot in an environment of its own, on loose sand. */
typedef struct {
    Robot *robot;
    TaskDef def;
    TaskEnv *env;
    RobotSim *sim;
    Controller controller;
} Scene;

static void scene_open(Scene *scene, const char *robot, const char *controller) {
    MildError error = {0};
    memset(scene, 0, sizeof *scene);
    scene->robot = kit_robot_named(robot);
    scene->def = task_def_default();
    task_def_make_nominal(&scene->def);
    scene->def.randomize.latency[0] = scene->def.randomize.latency[1] = 0;
    scene->def.randomize.initial_joint = scene->def.randomize.initial_velocity = 0;
    scene->sim = robot_sim_create(scene->robot, scene->def.physics_dt, &error);
    scene->env = aligned_alloc(64, task_env_bytes(&scene->def, scene->robot));
    assert_non_null(scene->sim);
    assert_non_null(scene->env);
    const ControllerDef def = {NULL, &scene->def, scene->robot, NULL, 1};
    assert_int_equal(controller_make(controller, &def, &scene->controller, &error), MILD_OK);
    assert_string_equal(scene->controller.name, controller);
    MildMaterial sand = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&sand);
    EnvsView none = {0};
    task_env_init(scene->env, &scene->def, scene->robot, 1, 0);
    scene->env->command_frozen = 1;
    memset(scene->env->command, 0, sizeof scene->env->command);
    task_env_reset_on(scene->env, &scene->def, scene->robot, scene->sim, &terrain, 0, &none);
}

static void scene_close(Scene *scene) {
    controller_destroy(&scene->controller);
    assert_null(scene->controller.self);
    robot_sim_destroy(scene->sim);
    free(scene->env);
    robot_destroy(scene->robot);
}

TEST(names) {
    static const char *const wanted[] = {"learned", "stand", "zero"};
    for (int i = 0; i < 3; i++) {
        MildError error = {0};
        assert_int_equal(controller_check(wanted[i], &error), MILD_OK);
    }
    const int follows = CONTROLLER_FOLLOWS;
    assert_true(controller_has("learned", follows));
    assert_false(controller_has("stand", follows) || controller_has("nobody", follows));
    for (int i = 0; i < controller_count(); i++) { /* the only one whose file says its task */
        const char *name = controller_name(i);
        assert_int_equal(controller_has(name, CONTROLLER_POLICY), strcmp(name, "learned") == 0);
    }
    for (int i = 0; i < controller_count(); i++) {
        MildError error = {0};
        assert_true(strlen(controller_summary(i)) > 5);
        assert_int_equal(controller_check(controller_name(i), &error), MILD_OK);
    }
    MildError error = {0};
    const ControllerDef def = {0};
    Controller controller = {0};
    assert_refused(controller_check("stnad", &error), MILD_ERROR_ARGUMENT, &error,
                   "controller stnad stand");
    assert_refused(controller_make("zeros", &def, &controller, &error), MILD_ERROR_ARGUMENT, &error,
                   "controller zeros zero");
    assert_null(controller.self);
}

/* No action, for every row and no further. */
TEST(zero_does_nothing) {
    Scene scene;
    scene_open(&scene, "go1", "zero");
    float actions[2 * 12 + 1];
    for (int i = 0; i < 25; i++) {
        actions[i] = 7;
    }
    TaskEnv *envs[2] = {scene.env, scene.env};
    scene.controller.act(scene.controller.self, 2, envs, actions);
    for (int i = 0; i < 24; i++) {
        assert_true(actions[i] == 0);
    }
    assert_true(actions[24] == 7);
    scene_close(&scene);
}

/* The joints' PD on the actions of `stand` is the balanced stand's torque. */
TEST(stand_acts_as_the_stand) {
    static const char *const robots[] = {"sa01", "go1", "g1"};
    for (int r = 0; r < 3; r++) {
        Scene scene;
        MildError error = {0};
        float action[ROBOT_JOINTS_MAX];
        double wanted[ROBOT_JOINTS_MAX], worst = 0, largest = 0;
        scene_open(&scene, robots[r], "stand");
        int joints = robot_joints(scene.robot);
        for (int i = 0; i < joints; i++) {
            scene.env->robot.qpos[7 + i] += 0.01 * (i - 5);
            scene.env->robot.qvel[6 + i] = 0.05 * (i - 3);
        }
        scene.env->robot.qvel[0] = 0.1;
        scene.env->robot.qvel[1] = -0.1;
        Stand *stand = stand_create(scene.robot, &error);
        task_env_load(scene.env, scene.sim);
        stand_torque(stand, scene.sim, 1, wanted);
        scene.controller.act(scene.controller.self, 1, &scene.env, action);
        for (int i = 0; i < joints; i++) {
            double target = robot_default_pose(scene.robot)[i] +
                            robot_table(scene.robot)->action_scale * (double)action[i];
            double torque =
                task_env_rest(scene.env)->gains.kp[i] * (target - scene.env->robot.qpos[7 + i]) -
                task_env_rest(scene.env)->gains.kd[i] * scene.env->robot.qvel[6 + i];
            double effort = robot_effort(scene.robot)[i];
            torque = fmax(-effort, fmin(effort, torque));
            worst = fmax(worst, fabs(torque - wanted[i]));
            largest = fmax(largest, fabs(wanted[i]));
        }
        print_message("%s: torques off by %.1e of %.1f N m\n", robots[r], worst, largest);
        assert_true(worst < 1e-4 && largest > 1); /* actions are floats */
        stand_destroy(stand);
        scene_close(&scene);
    }
}

TEST_MAIN(NULL, NULL)
