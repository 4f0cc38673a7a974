/* The model file against the published numbers: robots/sa01/sa01.json. */
#include <unistd.h>

#include <mujoco/mujoco.h>

#include "base/random.h"
#include "numbers.h"
#include "robots.h"
#include "sa01.h"

#define MODEL SA01
#define NUMBERS MILD_SOURCE_DIR "/robots/sa01/sa01.json"
#define LINKS (SA01_JOINTS + 1)

typedef struct {
    char name[LINKS][32];
    int parent[LINKS]; /* link */
    double mass[LINKS], com[LINKS][3], inertia[LINKS][9];
    double origin[LINKS][3], axis[LINKS][3],
        armature[LINKS]; /* of the joint above the link; 0 unused */
} Tree;

static Robot *robot;
static RobotSim *sim;
static Tree tree;

static int link_index(const char *name) {
    for (int i = 0; i < LINKS; i++) {
        if (strcmp(tree.name[i], name) == 0) {
            return i;
        }
    }
    fail_msg("unknown link %s", name);
    return -1;
}

static void read_tree(void) {
    const cJSON *links = cJSON_GetObjectItem(numbers, "links"),
                *joints = cJSON_GetObjectItem(numbers, "joints");
    for (int i = 0; i < LINKS; i++) {
        const cJSON *link = cJSON_GetArrayItem(links, i),
                    *about = cJSON_GetObjectItem(link, "inertia_about_com");
        snprintf(tree.name[i], sizeof tree.name[i], "%s",
                 cJSON_GetObjectItem(link, "name")->valuestring);
        tree.mass[i] = number(link, "mass");
        vector(link, "com_xyz", 3, tree.com[i]);
        double xx = number(about, "ixx"), yy = number(about, "iyy"), zz = number(about, "izz");
        double xy = number(about, "ixy"), xz = number(about, "ixz"), yz = number(about, "iyz");
        double full[9] = {xx, xy, xz, xy, yy, yz, xz, yz, zz};
        memcpy(tree.inertia[i], full, sizeof full);
    }
    for (int j = 0; j < SA01_JOINTS; j++) {
        const cJSON *joint = cJSON_GetArrayItem(joints, j);
        int child = link_index(cJSON_GetObjectItem(joint, "child")->valuestring);
        assert_int_equal(child, j + 1);
        tree.parent[child] = link_index(cJSON_GetObjectItem(joint, "parent")->valuestring);
        vector(joint, "origin_xyz", 3, tree.origin[child]);
        vector(joint, "axis", 3, tree.axis[child]);
        tree.armature[child] = number(joint, "mjcf_armature");
    }
}

static void multiply(const double *a, const double *b, double *out) {
    double product[9];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            product[3 * i + j] =
                a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
        }
    }
    memcpy(out, product, sizeof product);
}

static void rotate(const double *turn, const double *v, double *out) {
    for (int i = 0; i < 3; i++) {
        out[i] = turn[3 * i] * v[0] + turn[3 * i + 1] * v[1] + turn[3 * i + 2] * v[2];
    }
}

static void cross(const double *a, const double *b, double *out) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Rodrigues: rotation by `angle` about a unit axis. */
static void axis_rotation(const double *n, double angle, double *turn) {
    double c = cos(angle), s = sin(angle), k = 1.0 - c;
    double full[9] = {
        c + k * n[0] * n[0],        k * n[0] * n[1] - s * n[2], k * n[0] * n[2] + s * n[1],
        k * n[1] * n[0] + s * n[2], c + k * n[1] * n[1],        k * n[1] * n[2] - s * n[0],
        k * n[2] * n[0] - s * n[1], k * n[2] * n[1] + s * n[0], c + k * n[2] * n[2]};
    memcpy(turn, full, sizeof full);
}

static void quaternion_rotation(const double *q, double *turn) {
    double w = q[0], x = q[1], y = q[2], z = q[3];
    double full[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                      2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                      2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    memcpy(turn, full, sizeof full);
}

static void link_poses(const double *qpos, double position[LINKS][3], double turn[LINKS][9]) {
    memcpy(position[0], qpos, 3 * sizeof(double));
    quaternion_rotation(qpos + 3, turn[0]);
    for (int i = 1; i < LINKS; i++) {
        int p = tree.parent[i];
        double offset[3], about[9];
        rotate(turn[p], tree.origin[i], offset);
        for (int k = 0; k < 3; k++) {
            position[i][k] = position[p][k] + offset[k];
        }
        axis_rotation(tree.axis[i], qpos[6 + i], about);
        multiply(turn[p], about, turn[i]);
    }
}

/* M = sum over links of m Jv^T Jv + Jw^T I Jw, plus rotor armature on the diagonal. */
static void mass_matrix(const double *qpos, double *mass) {
    double position[LINKS][3], turn[LINKS][9];
    link_poses(qpos, position, turn);
    memset(mass, 0, SA01_NV * SA01_NV * sizeof *mass);
    for (int i = 0; i < LINKS; i++) {
        double jv[SA01_NV][3] = {{0}}, jw[SA01_NV][3] = {{0}}, com[3], arm[3], turned[9],
               transposed[9], world[9];
        rotate(turn[i], tree.com[i], com);
        for (int k = 0; k < 3; k++) {
            com[k] += position[i][k];
            jv[k][k] = 1.0;
        }
        for (int k = 0; k < 3; k++) {
            double axis[3] = {turn[0][k], turn[0][3 + k], turn[0][6 + k]};
            for (int r = 0; r < 3; r++) {
                arm[r] = com[r] - position[0][r];
            }
            memcpy(jw[3 + k], axis, sizeof axis);
            cross(axis, arm, jv[3 + k]);
        }
        for (int a = i; a > 0; a = tree.parent[a]) {
            rotate(turn[a], tree.axis[a], jw[5 + a]);
            for (int r = 0; r < 3; r++) {
                arm[r] = com[r] - position[a][r];
            }
            cross(jw[5 + a], arm, jv[5 + a]);
        }
        multiply(turn[i], tree.inertia[i], turned);
        for (int k = 0; k < 9; k++) {
            transposed[k] = turn[i][3 * (k % 3) + k / 3];
        }
        multiply(turned, transposed, world);
        for (int r = 0; r < SA01_NV; r++) {
            double spun[3];
            rotate(world, jw[r], spun);
            for (int c = 0; c < SA01_NV; c++) {
                for (int k = 0; k < 3; k++) {
                    mass[r * SA01_NV + c] +=
                        tree.mass[i] * jv[r][k] * jv[c][k] + spun[k] * jw[c][k];
                }
            }
        }
    }
    for (int i = 1; i < LINKS; i++) {
        mass[(5 + i) * (SA01_NV + 1)] += tree.armature[i];
    }
}

static RobotState random_state(uint32_t index) {
    Random random = random_at(5, index, 0);
    RobotState state = {0};
    double norm = 0.0;
    for (int i = 0; i < 3; i++) {
        state.qpos[i] = random_uniform(&random, -1, 1);
    }
    for (int i = 3; i < 7; i++) {
        state.qpos[i] = random_normal(&random);
        norm += state.qpos[i] * state.qpos[i];
    }
    for (int i = 3; i < 7; i++) {
        state.qpos[i] /= sqrt(norm);
    }
    for (int i = 0; i < SA01_JOINTS; i++) {
        state.qpos[7 + i] =
            random_uniform(&random, robot_joint_low(robot)[i], robot_joint_high(robot)[i]);
    }
    return state;
}

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
    read_tree();
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

/* JSON's derived_standing.training_default was computed by its authors from the same links. */
TEST(test_standing) {
    const cJSON *expected =
        cJSON_GetObjectItem(cJSON_GetObjectItem(numbers, "derived_standing"), "training_default");
    double ankle[3], com[3], inertia[9] = {0}, position[LINKS][3], turn[LINKS][9];
    vector(expected, "ankle_xyz_left", 3, ankle);
    vector(expected, "com_in_base", 3, com);
    RobotState state = stand_state();
    RobotVariation nominal = robot_variation_nominal();
    robot_sim_load(sim, &state, &nominal);
    const mjModel *m = robot_sim_model(sim);
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
    link_poses(state.qpos, position, turn);
    for (int b = 1; b < m->nbody;
         b++) { /* composite inertia about the common centre of mass, from MuJoCo's own bodies */
        double arm[3], local[9] = {0}, turned[9], transposed[9], world[9];
        for (int k = 0; k < 3; k++) {
            arm[k] = d->xipos[3 * b + k] - d->subtree_com[3 + k];
            local[4 * k] = m->body_inertia[3 * b + k];
        }
        double square = arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2];
        multiply(d->ximat + 9 * b, local, turned);
        for (int k = 0; k < 9; k++) {
            transposed[k] = d->ximat[9 * b + 3 * (k % 3) + k / 3];
        }
        multiply(turned, transposed, world);
        for (int k = 0; k < 9; k++) {
            inertia[k] += world[k] +
                          m->body_mass[b] * ((k % 4 == 0 ? square : 0.0) - arm[k / 3] * arm[k % 3]);
        }
    }
    const cJSON *rows = cJSON_GetObjectItem(expected, "composite_inertia_about_com");
    for (int k = 0; k < 9; k++) {
        expect_near("composite inertia", inertia[k],
                    cJSON_GetArrayItem(cJSON_GetArrayItem(rows, k / 3), k % 3)->valuedouble, 2e-6);
    }
}

TEST(test_mass_matrix) {
    double worst = 0.0;
    for (uint32_t draw = 0; draw < 50; draw++) {
        RobotState state = random_state(draw);
        RobotVariation nominal = robot_variation_nominal();
        robot_sim_load(sim, &state, &nominal);
        double expected[SA01_NV * SA01_NV], engine[SA01_NV * SA01_NV];
        mass_matrix(state.qpos, expected);
        const mjModel *m = robot_sim_model(sim);
        mjData *d = robot_sim_data(sim);
        mj_makeM(m, d);
        mj_fullM(m, d, engine);
        for (int i = 0; i < SA01_NV * SA01_NV; i++) {
            worst = fmax(worst, fabs(engine[i] - expected[i]));
        }
    }
    print_message("mass matrix: worst difference %.2e\n", worst);
    assert_true(worst < 1e-7); /* MuJoCo's diagonalisation of an inertia stops at 1e-6 rad */
}

TEST(test_variation) {
    RobotVariation varied = robot_variation_nominal(), nominal = varied;
    varied.base_mass_add = 2.5;
    varied.com_offset[0] = 0.01;
    varied.link_mass_scale[4] = 1.2;
    varied.armature_scale = 0.5;
    varied.rigid_friction = 0.33;
    RobotState state = stand_state();
    robot_sim_load(sim, &state, &varied);
    const mjModel *m = robot_sim_model(sim);
    expect_near("varied mass", m->body_subtreemass[1],
                robot_total_mass(robot) + 2.5 + 0.2 * tree.mass[4], 1e-9);
    expect_near("varied com", m->body_ipos[3], tree.com[0][0] + 0.01, 1e-12);
    expect_near("varied armature", m->dof_armature[6], 0.021, 1e-12);
    expect_near("varied friction", m->pair_friction[0], 0.33, 1e-12);
    robot_sim_load(sim, &state, &nominal);
    expect_near("mass back", m->body_subtreemass[1], robot_total_mass(robot), 1e-12);
    expect_near("friction back", m->pair_friction[0], 0.8, 1e-12);
}

/* The robot with `from` written as `to` in one of its files must be refused. */
static void refuse(const char *name, const char *from, const char *to, MildStatus status,
                   const char *names) {
    MildError error = {0};
    Robot *accepted = kit_robot_changed(SA01, "sa01.xml", name, from, to, &error);
    print_message("%s\n", error.text);
    assert_null(accepted);
    assert_error(&error, status, names);
}

TEST(test_refusals) {
    refuse("sa01.xml", "leg_r6_link", "xeg_r6_link", MILD_ERROR_FORMAT,
           "sa01.xml leg_r6_link [foot.right]");
    refuse("sa01.xml", "leg_l4_joint", "xeg_l4_joint", MILD_ERROR_FORMAT,
           "sa01.xml leg_l4_joint [joints]");
    refuse("sa01.xml", "base_link_box", "xase_link_box", MILD_ERROR_FORMAT,
           "sa01.xml [robot] shells");
    refuse("sa01.xml", "class=\"ankle\" axis=\"0 1 0\"", "damping=\"1\" axis=\"0 1 0\"",
           MILD_ERROR_FORMAT, "sa01.xml damping");
    refuse("sa01.xml", "<joint name=\"leg_l1_joint\"",
           "<joint name=\"leg_l1_joint\" type=\"slide\"", MILD_ERROR_FORMAT,
           "sa01.xml leg_l1_joint");
    refuse("sa01.xml", "range=\"-0.15 2.268\"", "range=\"0.5 2.268\"", MILD_ERROR_RANGE,
           "[joints] pose leg_l4_joint");
    refuse("sa01.xml", "angle=\"radian\" ", "", MILD_ERROR_RANGE, "sa01.xml angle");
    /* what robot.ini alone is refused for is in test_def.c */
    refuse("robot.ini", "height =", "heigth =", MILD_ERROR_FORMAT,
           "robot.ini [robot] heigth height");
    refuse("robot.ini", "elements = 77", "elements = 5000", MILD_ERROR_RANGE,
           "robot.ini [foot.left] sole.target_elements 5000");
    refuse("robot.ini", "sa01.xml", "none.xml", MILD_ERROR_FORMAT, "none.xml");
    refuse("robot.ini", "base = base_link", "base = torso", MILD_ERROR_FORMAT,
           "sa01.xml torso [robot] base");
    MildError error = {0};
    assert_null(robot_create("no_such_robot", &error));
    print_message("%s\n", error.text);
    assert_error(&error, MILD_ERROR_IO, "no_such_robot/robot.ini");
    assert_null(robot_open("sa02", &error));
    print_message("%s\n", error.text);
    assert_error(&error, MILD_ERROR_ARGUMENT, "sa02 sa01");
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
        print_message("%s, %s and %s: %s\n", cases[i].unit, cases[i].one, cases[i].other,
                      two ? "taken" : error.text);
        assert_int_equal(!two, cases[i].names != NULL);
        if (!two) {
            assert_error(&error, MILD_ERROR_RANGE, cases[i].names);
        }
        robot_destroy(two);
    }
}

TEST_MAIN(setup, teardown)
