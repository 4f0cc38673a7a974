/* A robot made up here: two legs behind a waist joint that both feet share. */
#include <unistd.h>

#include <mujoco/mujoco.h>

#include "robots.h"

enum { FEET = 2, JOINTS = 3, NV = 9 };

#define LEG(name, y)                                                                               \
    "<body name='" name "' pos='0 " y " -0.1'><inertial pos='0 0 -0.1' mass='1' "                  \
    "diaginertia='0.01 0.01 0.01'/><joint name='" name "_joint' axis='0 1 0' range='-1 1' "        \
    "actuatorfrcrange='-50 50'/></body>"
static const char model[] =
    "<mujoco><compiler angle='radian'/><worldbody><body name='base' pos='0 0 1'><freejoint/>"
    "<inertial pos='0 0 0' mass='5' diaginertia='0.1 0.1 0.1'/><body name='pelvis' pos='0 0 -0.1'>"
    "<inertial pos='0 0 0' mass='2' diaginertia='0.02 0.02 0.02'/><joint name='waist' axis='0 0 1' "
    "range='-1 1' actuatorfrcrange='-50 50'/>" LEG("left", "0.1")
        LEG("right", "-0.1") "</body></body></worldbody></mujoco>";

#define FOOT(name, other, offset)                                                                  \
    "[foot." name "]\nbody = " name "\nknee = " name "\nmirror = " other "\noffset = " offset      \
    "\nshape = round\ncenter = 0 0 -0.3\nradius = 0.05\n"
static const char ini[] =
    "[robot]\nname = waist\nmodel = waist.xml\nbase = base\nshells =\nheight = 0.5\n"
    "action_scale = 0.5\nfeet_range = 0 1\nknee_range = 0 1\nfeet_least = 0\nknee_least = 0\n"
    "foot_force = 100\nassist = 0 0 0 0\n[joints]\nnames = left_joint waist right_joint\n"
    "mirror = right_joint waist left_joint\nmirror_sign = 1 -1 1\npose = 0 0 0\n"
    "kp = 50 50 50\nkd = 1 1 1\n" FOOT("left", "right", "0") FOOT("right", "left", "0.5");

static Robot *robot;

static int setup(void **unused) {
    (void)unused;
    MildError error = {0};
    robot = kit_robot_of("waist.xml", model, ini, &error);
    expect_good(robot != NULL, &error);
    return 0;
}

static int teardown(void **unused) {
    (void)unused;
    robot_destroy(robot);
    return 0;
}

/* The order is that of robot.ini, not of the file; the waist is nobody's leg. */
TEST(joints_and_feet) {
    static const int foot[JOINTS] = {0, -1, 1}, dof[JOINTS] = {7, 6, 8}, mirror[JOINTS] = {2, 1, 0};
    assert_int_equal(robot_joints(robot), JOINTS);
    for (int i = 0; i < JOINTS; i++) {
        assert_int_equal(robot_joint_foot(robot)[i], foot[i]);
        assert_int_equal(robot_joint_dof(robot)[i], dof[i]);
        assert_int_equal(robot_mirror_joint(robot)[i], mirror[i]);
    }
}

/* The feet's velocities after a step are those that the solver promised, at the pose before it:
 * both chains hold the waist. */
TEST(twist_is_the_solvers) {
    MildError error = {0};
    RobotSim *sim = robot_sim_create(robot, 0.001, &error);
    MildGround *ground = kit_ground(robot);
    MildMaterial sand = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&sand);
    RobotVariation nominal = robot_variation_nominal();
    RobotState state = {.qpos = {0, 0, 0.52, 1, 0, 0, 0, 0.2, 0.3, -0.1},
                        .qvel = {0.1, 0.2, -0.3, 0.1, -0.2, 0.3, 0.4, -0.5, 0.6}};
    const double torque[JOINTS] = {1, -2, 3};
    double jacobian[FEET][3 * NV], engine[NV], worst = 0, load = 0;
    robot_sim_load(sim, &state, &nominal);
    const mjModel *m = robot_sim_model(sim);
    mjData *d = robot_sim_data(sim);
    for (int f = 0; f < FEET; f++) {
        mj_jac(m, d, jacobian[f], NULL, robot_sim_foot(sim, f)->position,
               mj_name2id(m, mjOBJ_BODY, f ? "right" : "left"));
    }
    assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
    memcpy(engine, d->qvel, sizeof engine);
    for (int f = 0; f < FEET; f++) {
        double velocity[3];
        mju_mulMatVec(velocity, jacobian[f], engine, 3, NV);
        for (int k = 0; k < 3; k++) {
            worst = fmax(worst, fabs(velocity[k] - robot_sim_contact(sim)->velocity[6 * f + k]));
        }
        load += robot_sim_foot(sim, f)->force[2];
    }
    print_message("velocities off by %.1e m/s under %.0f N\n", worst, load);
    assert_true(worst < 1e-9 && load > 1);
    free(ground);
    robot_sim_destroy(sim);
}

TEST_MAIN(setup, teardown)
