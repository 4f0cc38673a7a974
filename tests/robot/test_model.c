/* The model file against the published numbers: robots/sa01/sa01.json. */
#include <unistd.h>

#include <mujoco/mujoco.h>

#include "numbers.h"
#include "robots.h"
#include "sa01.h"

#define MODEL SA01
#define NUMBERS MILD_SOURCE_DIR "/robots/sa01/sa01.json"

static Robot *robot;
static RobotSim *sim;

static RobotState stand_state(void) {
    RobotState state = {.qpos = {0, 0, robot_stand_height(robot), 1, 0, 0, 0}};
    memcpy(state.qpos + 7, robot_default_pose(robot), SA01_JOINTS * sizeof(double));
    return state;
}

static int setup(void **unused) {
    (void)unused;
    MildError error = {0};
    robot = kit_robot(MODEL);
    sim = robot_sim_create(robot, 0.001, &error);
    numbers_open(NUMBERS);
    assert_non_null(sim);
    return 0;
}

static int teardown(void **unused) {
    (void)unused;
    robot_sim_destroy(sim);
    robot_destroy(robot);
    numbers_close();
    return 0;
}

TEST(test_limits_and_masses) {
    expect_near("total mass", robot_total_mass(robot), number(numbers, "total_mass_kg"), 1e-9);
    const mjModel *m = robot_sim_model(sim);
    const cJSON *joints = cJSON_GetObjectItem(numbers, "joints");
    for (int i = 0; i < SA01_JOINTS; i++) {
        const cJSON *joint = cJSON_GetArrayItem(joints, i),
                    *range = cJSON_GetObjectItem(joint, "mjcf_range");
        expect_near("low", robot_joint_low(robot)[i], cJSON_GetArrayItem(range, 0)->valuedouble,
                    1e-12);
        expect_near("high", robot_joint_high(robot)[i], cJSON_GetArrayItem(range, 1)->valuedouble,
                    1e-12);
        expect_near("effort", robot_effort(robot)[i], number(joint, "effort_Nm"), 1e-12);
        expect_near("pose", robot_default_pose(robot)[i], number(joint, "q_default_training"),
                    1e-12);
        expect_near("armature", m->dof_armature[6 + i], number(joint, "mjcf_armature"), 1e-12);
        expect_near("damping and friction", m->dof_damping[6 + i] + m->dof_frictionloss[6 + i], 0.0,
                    0.0);
        assert_string_equal(mj_id2name(m, mjOBJ_JOINT, 1 + i),
                            cJSON_GetObjectItem(joint, "name")->valuestring);
    }
}

/* R diag(inertia) R^T of a body. */
static void tensor(const mjModel *m, int body, double out[9]) {
    double turn[9], scaled[9];
    mju_quat2Mat(turn, m->body_iquat + 4 * body);
    for (int k = 0; k < 9; k++) {
        scaled[k] = turn[k] * m->body_inertia[3 * body + k % 3];
    }
    mju_mulMatMatT(out, scaled, turn, 3, 3, 3);
}

TEST(test_links) {
    static const char *const inertia[9] = {"ixx", "ixy", "ixz", "ixy", "iyy",
                                           "iyz", "ixz", "iyz", "izz"};
    const mjModel *m = robot_sim_model(sim);
    const cJSON *link;
    cJSON_ArrayForEach(link, item(numbers, "links")) {
        const int body = mj_name2id(m, mjOBJ_BODY, word(link, "name"));
        double com[3], turned[9];
        assert_true(body > 0);
        tensor(m, body, turned);
        vector(link, "com_xyz", 3, com);
        expect_near(word(link, "name"), m->body_mass[body], number(link, "mass"), 1e-12);
        for (int k = 0; k < 3; k++) {
            expect_entry("com", k, m->body_ipos[3 * body + k], com[k], 1e-9);
        }
        for (int k = 0; k < 9; k++) { /* MuJoCo's diagonalisation stops at 1e-6 rad */
            expect_entry("inertia", k, turned[k],
                         number(item(link, "inertia_about_com"), inertia[k]), 1e-7);
        }
    }
    const cJSON *joint;
    cJSON_ArrayForEach(joint, item(numbers, "joints")) {
        const int id = mj_name2id(m, mjOBJ_JOINT, word(joint, "name"));
        const int body = m->jnt_bodyid[id];
        double origin[3], axis[3];
        vector(joint, "origin_xyz", 3, origin);
        vector(joint, "axis", 3, axis);
        assert_string_equal(mj_id2name(m, mjOBJ_BODY, body), word(joint, "child"));
        assert_string_equal(mj_id2name(m, mjOBJ_BODY, m->body_parentid[body]),
                            word(joint, "parent"));
        for (int k = 0; k < 3; k++) {
            expect_entry("origin", k, m->body_pos[3 * body + k], origin[k], 1e-12);
            expect_entry("axis", k, m->jnt_axis[3 * id + k], axis[k], 1e-12);
        }
    }
}

/* JSON's derived_standing.training_default was computed by its authors from the same links. */
TEST(test_standing) {
    const cJSON *expected =
        cJSON_GetObjectItem(cJSON_GetObjectItem(numbers, "derived_standing"), "training_default");
    double ankle[3], com[3];
    vector(expected, "ankle_xyz_left", 3, ankle);
    vector(expected, "com_in_base", 3, com);
    RobotState state = stand_state();
    RobotVariation nominal = robot_variation_nominal();
    robot_sim_load(sim, &state, &nominal);
    const mjData *d = robot_sim_data(sim);
    expect_near("base above sole", robot_stand_height(robot), number(expected, "base_above_sole"),
                1e-6);
    expect_near("com above sole", d->subtree_com[3 + 2], number(expected, "com_above_sole"), 1e-6);
    expect_near("left sole", robot_sim_foot(sim, 0)->sole_height, 0.0, 1e-12);
    expect_near("right sole", robot_sim_foot(sim, 1)->sole_height, 0.0, 1e-12);
    for (int k = 0; k < 3; k++) {
        expect_near("left ankle", robot_sim_foot(sim, 0)->position[k] - state.qpos[k], ankle[k],
                    1e-6);
        expect_near("com in base", d->subtree_com[3 + k] - state.qpos[k], com[k], 1e-6);
    }
}

/* A hinge's numbers show the unit only together: one that turns by 5 degrees is no mistake where
 * another turns by 130, nor one without an end among radians. */
TEST(test_angles) {
    static const struct {
        const char *unit, *one, *other, *names; /* names: NULL where the file is taken */
    } cases[] = {
        {"degree", "-1.5 1.5", "0 6.2", "two.xml knee 6.2 angle"},
        {"degree", "-5 5", "0 6.4", NULL},
        {"degree", "-5 5", "-130 0", NULL},
        {"radian", "-130 0", "-20 20", "two.xml hip 130 angle"},
        {"radian", "-130 0", "-12.5 12.5", NULL},
        {"radian", "-1.5 1.5", "-100 100", NULL},
        {"radian", "-0.1 0.1", "0 0.1", NULL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        MildError error = {0};
        char mjcf[1000];
        snprintf(mjcf, sizeof mjcf,
                 "<mujoco><compiler angle='%s' autolimits='true'/><worldbody><body name='base'>"
                 "<freejoint/><geom size='0.1'/><body name='leg' pos='0 0 -0.3'><joint name='hip' "
                 "axis='0 1 0' range='%s' armature='0.01'/><geom size='0.05'/><body name='foot' "
                 "pos='0 0 -0.3'><joint name='knee' axis='0 1 0' range='%s' armature='0.01'/>"
                 "<geom size='0.05'/></body></body></body></worldbody></mujoco>",
                 cases[i].unit, cases[i].one, cases[i].other);
        Robot *two = kit_robot_of(
            "two.xml", mjcf,
            "[robot]\nname = two\nmodel = two.xml\nbase = base\nheight = 0.6\naction_scale = 0.2\n"
            "feet_range = 0 1\nknee_range = 0 1\nfeet_least = 0\nknee_least = 0\nfoot_force = 50\n"
            "assist = 10 1 1 1\nshells =\n[joints]\nnames = hip knee\nmirror = hip knee\n"
            "mirror_sign = 1 1\npose = 0 0\nkp = 10 10\nkd = 1 1\neffort = 5 5\n[foot.one]\n"
            "body = foot\nknee = leg\nmirror = one\noffset = 0\nshape = round\n"
            "center = 0 0 -0.05\nradius = 0.02\n",
            &error);
        assert_int_equal(!two, cases[i].names != NULL);
        if (!two) {
            assert_error(&error, MILD_ERROR_RANGE, cases[i].names);
        }
        robot_destroy(two);
    }
}

TEST_MAIN(setup, teardown)
