/* What differs from robot to robot: every number of the varied model against the nominal one's,
 * worked out apart; a variation replaces the one before it. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "robot_kit.h"

#include <mujoco/mujoco.h>

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
