/* The numbers of a model: each one spoilt is refused with its name, before anything is
 * simulated. */
#include "robot_kit.h"

#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "robot/description.h"

static void check_number(double *number, double bad, const char *what) {
    MildError error = {0};
    double kept = *number;
    *number = bad;
    MildStatus status = robot_check_model(robot->model, "robot.xml", &error);
    *number = kept;
    assert_names(error.text, "robot.xml");
    assert_refused(status, MILD_ERROR_RANGE, &error, what);
}

/* Each element of each array: refused, with the name of its joint, body or geom where it has one. A
 * negative number is refused where it has no sense. */
TEST(test_every_element) {
    mjModel *m = robot->model;
    const int bodies = (int)m->nbody, joints = (int)m->njnt, geoms = (int)m->ngeom;
    const struct {
        const char *what;
        double *array;
        int rows, width, object, is_dof;
        int positive; /* bool: a negative number has no sense */
    } arrays[] = {
        {"pos", m->body_pos, bodies, 3, mjOBJ_BODY, 0, 0},
        {"quat", m->body_quat, bodies, 4, mjOBJ_BODY, 0, 0},
        {"mass", m->body_mass, bodies, 1, mjOBJ_BODY, 0, 1},
        {"inertia", m->body_inertia, bodies, 3, mjOBJ_BODY, 0, 1},
        {"inertial pos", m->body_ipos, bodies, 3, mjOBJ_BODY, 0, 0},
        {"inertial quat", m->body_iquat, bodies, 4, mjOBJ_BODY, 0, 0},
        {"pos", m->jnt_pos, joints, 3, mjOBJ_JOINT, 0, 0},
        {"axis", m->jnt_axis, joints, 3, mjOBJ_JOINT, 0, 0},
        {"range", m->jnt_range, joints, 2, mjOBJ_JOINT, 0, 0},
        {"actuatorfrcrange", m->jnt_actfrcrange, joints, 2, mjOBJ_JOINT, 0, 0},
        {"stiffness", m->jnt_stiffness, joints, 1, mjOBJ_JOINT, 0, 1},
        {"joint coordinate", m->qpos_spring, (int)m->nq, 1, mjOBJ_UNKNOWN, 0, 0},
        {"armature", m->dof_armature, (int)m->nv, 1, mjOBJ_JOINT, 1, 1},
        {"damping", m->dof_damping, (int)m->nv, 1, mjOBJ_JOINT, 1, 1},
        {"frictionloss", m->dof_frictionloss, (int)m->nv, 1, mjOBJ_JOINT, 1, 1},
        {"pos", m->geom_pos, geoms, 3, mjOBJ_GEOM, 0, 0},
        {"quat", m->geom_quat, geoms, 4, mjOBJ_GEOM, 0, 0},
        {"size", m->geom_size, geoms, 3, mjOBJ_GEOM, 0, 0},
        {"friction", m->geom_friction, geoms, 3, mjOBJ_GEOM, 0, 0},
    };
    for (size_t a = 0; a < sizeof arrays / sizeof *arrays; a++) {
        for (int i = 0; i < arrays[a].rows * arrays[a].width; i++) {
            int row = i / arrays[a].width, id = arrays[a].is_dof ? m->dof_jntid[row] : row;
            const char *name = mj_id2name(m, arrays[a].object, id);
            char number[16], names[128];
            snprintf(number, sizeof number, "%d", id);
            snprintf(names, sizeof names, "%s %s nan", arrays[a].what, name ? name : number);
            check_number(&arrays[a].array[i], NAN, names);
            if (arrays[a].positive) {
                snprintf(names, sizeof names, "%s %s", arrays[a].what, name ? name : number);
                check_number(&arrays[a].array[i], -0.01, names);
            }
        }
    }
    assert_int_equal(robot_check_model(m, "robot.xml", NULL), MILD_OK);
}

/* The limits themselves: 0 is fine where a negative number is not, an empty range is none. */
TEST(test_limits) {
    mjModel *m = robot->model;
    const int joint = 1 + 3, dof = 6 + 3, body = robot_foot_body(robot, 0);
    double armature = m->dof_armature[dof], low = m->jnt_range[2 * joint];
    double force = m->jnt_actfrcrange[2 * joint];
    m->dof_armature[dof] = 0;
    assert_int_equal(robot_check_model(m, "robot.xml", NULL), MILD_OK);
    m->dof_armature[dof] = armature;
    for (int k = 0; k < 3; k++) {
        check_number(m->body_inertia + 3 * body + k, 0, "leg_l6_link mass inertia");
    }
    check_number(m->geom_size, -0.01, "size");
    check_number(m->body_mass + robot->base_body, 0, "base_link mass inertia");
    check_number(m->body_mass + body, 0, "leg_l6_link mass inertia");
    check_number(m->jnt_range + 2 * joint, m->jnt_range[2 * joint + 1], "leg_l4_joint range");
    check_number(m->jnt_actfrcrange + 2 * joint, m->jnt_actfrcrange[2 * joint + 1],
                 "leg_l4_joint actuatorfrcrange");
    m->jnt_limited[joint] = m->jnt_actfrclimited[joint] = 0; /* then nobody reads the numbers */
    m->jnt_range[2 * joint] = m->jnt_actfrcrange[2 * joint] = 1e3;
    assert_int_equal(robot_check_model(m, "robot.xml", NULL), MILD_OK);
    m->jnt_range[2 * joint] = low;
    m->jnt_actfrcrange[2 * joint] = force;
    m->jnt_limited[joint] = m->jnt_actfrclimited[joint] = 1;
}

/* The same from a file; and a file that would never end. */
TEST(test_files) {
    static const char *const bad[] = {"nan", "inf", "-0.04"};
    char folder[] = "/tmp/mild_test_check_XXXXXX", path[64], ini[64], to[32];
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        MildError error = {0};
        snprintf(to, sizeof to, "armature=\"%s\"", bad[i]);
        assert_null(
            kit_robot_changed(SA01, "sa01.xml", "sa01.xml", "armature=\"0.042\"", to, &error));
        assert_error(&error, MILD_ERROR_RANGE, "leg_l1_joint armature");
    }
    MildError error = {0};
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/sa01.xml", folder);
    snprintf(ini, sizeof ini, "%s/robot.ini", folder);
    assert_int_equal(symlink(SA01 "/robot.ini", ini), 0);
    assert_int_equal(mkfifo(path, 0600), 0);
    alarm(20); /* a reader that waits at the pipe ends the test */
    assert_null(robot_create(folder, &error));
    alarm(0);
    assert_error(&error, MILD_ERROR_IO, path);
    unlink(path);
    unlink(ini);
    rmdir(folder);
}

/* What differs from robot to robot: every number of the varied model against the nominal one's,
 * worked out apart; a variation replaces the one before it. */

static const char *const links[1 + SA01_JOINTS] = {
    "base_link",   "leg_l1_link", "leg_l2_link", "leg_l3_link", "leg_l4_link",
    "leg_l5_link", "leg_l6_link", "leg_r1_link", "leg_r2_link", "leg_r3_link",
    "leg_r4_link", "leg_r5_link", "leg_r6_link"};

/* All numbers different; draw 0 is nominal. */
static RobotVariation draw_variation(uint32_t draw) {
    RobotVariation v = robot_variation_nominal();
    Random r = random_at(31, draw, 0);
    if (draw == 0) {
        return v;
    }
    v.base_mass_add = random_uniform(&r, -4, 4);
    v.armature_scale = random_uniform(&r, 0.5, 2);
    v.rigid_friction = random_uniform(&r, 0.1, 1.5);
    for (int k = 0; k < 3; k++) {
        v.com_offset[k] = random_uniform(&r, -0.05, 0.05);
    }
    for (int i = 0; i <= SA01_JOINTS; i++) {
        v.link_mass_scale[i] = random_uniform(&r, 0.7, 1.4);
    }
    v.rigid_time = draw % 2 ? random_uniform(&r, 0.02, 0.4) : 0;
    return v;
}

/* Mass and inertia of a link; returns the mass. */
static double check_link(const mjModel *m, const mjModel *plain, int i, const RobotVariation *v) {
    int body = mj_name2id(m, mjOBJ_BODY, links[i]);
    assert_true(body > 0 && mj_name2id(plain, mjOBJ_BODY, links[i]) == body);
    double mass = plain->body_mass[body] * v->link_mass_scale[i] + (i == 0 ? v->base_mass_add : 0);
    expect_entry("mass of link", i, m->body_mass[body], mass, 1e-12);
    for (int k = 0; k < 3; k++) {
        double inertia = plain->body_inertia[3 * body + k] * mass / plain->body_mass[body];
        expect_entry("inertia of link", i, m->body_inertia[3 * body + k], inertia, 1e-12);
        double at = plain->body_ipos[3 * body + k] + (i == 0 ? v->com_offset[k] : 0);
        expect_entry("centre of mass of link", i, m->body_ipos[3 * body + k], at, 1e-15);
    }
    return mass;
}

/* A leg is a chain: the mass below a link is the sum of those after it. */
static void check_subtrees(const mjModel *m, const double *mass) {
    double total = mass[0];
    for (int leg = 0; leg < 2; leg++) {
        double below = 0;
        for (int i = 6 * (leg + 1); i > 6 * leg; i--) {
            below += mass[i];
            int body = mj_name2id(m, mjOBJ_BODY, links[i]);
            expect_entry("mass from link", i, m->body_subtreemass[body], below, 1e-12);
        }
        total += below;
    }
    expect_entry("mass of all", 0, m->body_subtreemass[mj_name2id(m, mjOBJ_BODY, links[0])], total,
                 1e-12);
    expect_entry("mass of the world", 0, m->body_subtreemass[0], total, 1e-12);
}

TEST(test_numbers) {
    RobotSim *sim = new_sim(0.001);
    RobotSim *fresh = new_sim(0.001); /* is never varied */
    const mjModel *m = robot_sim_model(sim);
    const mjModel *plain = robot_sim_model(fresh);
    RobotState state;
    robot_sim_store(sim, &state);
    static const uint32_t order[] = {1, 2, 0, 3, 3, 4, 0};
    for (size_t k = 0; k < sizeof order / sizeof *order; k++) {
        RobotVariation v = draw_variation(order[k]);
        double mass[1 + SA01_JOINTS];
        robot_sim_load(sim, &state, &v);
        for (int i = 0; i <= SA01_JOINTS; i++) {
            mass[i] = check_link(m, plain, i, &v);
        }
        check_subtrees(m, mass);
        for (int i = 0; i < SA01_NV; i++) {
            double scale = i < 6 ? 1 : v.armature_scale;
            expect_entry("armature", i, m->dof_armature[i], scale * plain->dof_armature[i], 1e-15);
        }
        assert_int_equal(m->npair, 8 + 3); /* corners, and the bodies with shells */
        for (int p = 0; p < m->npair; p++) {
            const double *solref = m->pair_solref + mjNREF * p;
            const double *own = plain->pair_solref + mjNREF * p;
            expect_entry("time constant", p, solref[0], v.rigid_time > 0 ? v.rigid_time : own[0],
                         0);
            expect_entry("damping ratio", p, solref[1], v.rigid_time > 0 ? 1 : own[1], 0);
            for (int c = 0; c < 5; c++) {
                double wanted = c < 2 ? v.rigid_friction : plain->pair_friction[5 * p + c];
                expect_entry("friction", 5 * p + c, m->pair_friction[5 * p + c], wanted, 0);
            }
        }
    }
    robot_sim_destroy(sim);
    robot_sim_destroy(fresh);
}

TEST_MAIN(setup, teardown)
