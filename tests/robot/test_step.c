/* The step of SA01: the solver's twist, momentum, determinism, bad numbers. Against the engine's
 * step and dense algebra: test_walker.c. */
#include <math.h>
#include <string.h>

#include "robot_kit.h"

#include <mujoco/mujoco.h>

#include "given.h"
#include "sa01.h"

#define ROWS 12

/* A state near the ground with all joints inside their ranges. */
static RobotState random_state(uint32_t index) {
    Random random = random_at(11, index, 0);
    RobotState state = stand_state(stand, 0, 0.005);
    for (int i = 0; i < 4; i++) {
        state.qpos[3 + i] += random_uniform(&random, -0.1, 0.1);
    }
    double norm = 0.0;
    for (int i = 3; i < 7; i++) {
        norm += state.qpos[i] * state.qpos[i];
    }
    for (int i = 3; i < 7; i++) {
        state.qpos[i] /= sqrt(norm);
    }
    kit_disturb(&state, &random);
    return state;
}

/* Dense J of both feet from the engine. */
static void dense_jacobian(RobotSim *sim, double j[ROWS * SA01_NV]) {
    static const char *const names[SA01_FEET] = {"leg_l6_link", "leg_r6_link"};
    for (int f = 0; f < SA01_FEET; f++) {
        const mjModel *m = robot_sim_model(sim);
        double *rows = j + 6 * f * SA01_NV;
        mj_jacBody(m, robot_sim_data(sim), rows, rows + 3 * SA01_NV,
                   mj_name2id(m, mjOBJ_BODY, names[f]));
    }
}

/* Foot twist after a soft step = what the contact solver promised: the robot and the solver see the
 * same A and V_free. */
TEST(test_twist_is_the_solvers) {
    RobotSim *sim = new_sim(0.001);
    MildTerrain terrain = kit_terrain("sand_loose");
    MildGround *ground = kit_ground(robot);
    RobotVariation nominal = robot_variation_nominal();
    double worst = 0.0;
    for (uint32_t draw = 0; draw < 40; draw++) {
        RobotState state = random_state(draw);
        robot_sim_load(sim, &state, &nominal);
        mild_ground_reset(ground);
        double torque[SA01_JOINTS], j[ROWS * SA01_NV];
        stand_torque(stand, sim, 0, torque);
        dense_jacobian(sim, j);
        assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
        for (int r = 0; r < ROWS; r++) {
            double twist = 0.0;
            for (int k = 0; k < SA01_NV; k++) {
                twist += j[r * SA01_NV + k] * robot_sim_qvel(sim)[k];
            }
            worst = fmax(worst, fabs(twist - robot_sim_contact(sim)->velocity[r]));
        }
    }
    print_message("foot twist after the step against the solver's: worst %.2e\n", worst);
    assert_true(worst < 1e-6);
    free(ground);
    robot_sim_destroy(sim);
}

/* Momentum, and angular momentum about the centre of mass, of these speeds at this pose. */
static void momentum(RobotSim *sim, const double *qpos, const double *qvel, double out[6],
                     double center[3]) {
    const mjModel *m = robot_sim_model(sim);
    mjData *d = mj_makeData(m);
    memcpy(d->qpos, qpos, SA01_NQ * sizeof *qpos);
    memcpy(d->qvel, qvel, SA01_NV * sizeof *qvel);
    mj_fwdPosition(m, d);
    mj_fwdVelocity(m, d);
    mj_subtreeVel(m, d);
    for (int k = 0; k < 3; k++) {
        out[k] = m->body_subtreemass[1] * d->subtree_linvel[3 + k];
        out[3 + k] = d->subtree_angmom[3 + k];
        center[k] = d->subtree_com[3 + k];
    }
    mj_deleteData(d);
}

/* wrench += a force and a torque at `point`, about `center`. */
static void add_wrench(double wrench[6], const double *force, const double *torque,
                       const double *point, const double *center) {
    double arm[3], moment[3];
    mju_sub3(arm, point, center);
    mju_cross(moment, arm, force);
    for (int k = 0; k < 3; k++) {
        wrench[k] += force[k];
        wrench[3 + k] += torque[k] + moment[k];
    }
}

/* Change of both momenta = dt (weight, push, feet), in contact and in the air. Exact at the pose of
 * the step's start and from rest: a step from there has no other terms. */
TEST(test_momentum) {
    RobotSim *sim = new_sim(0.0005);
    MildTerrain terrain = kit_terrain("foam60");
    MildGround *ground = kit_ground(robot);
    RobotVariation nominal = robot_variation_nominal();
    const double push[6] = {30, -20, 10, 4, -5, 6}, at_rest[SA01_NV] = {0};
    double worst[6] = {0}, largest[6] = {0};
    int loaded = 0;
    for (uint32_t draw = 0; draw < 20; draw++) {
        RobotState state = random_state(draw);
        state.qpos[2] += draw % 2 ? 0.5 : 0.0;
        memset(state.qvel, 0, sizeof state.qvel);
        robot_sim_load(sim, &state, &nominal);
        mild_ground_reset(ground);
        double torque[SA01_JOINTS], before[6], after[6], center[3], wrench[6] = {0}, base[3];
        stand_torque(stand, sim, 0, torque);
        memcpy(base, ((const mjData *)robot_sim_data(sim))->xipos + 3, sizeof base);
        momentum(sim, state.qpos, at_rest, before, center);
        add_wrench(wrench, push, push + 3, base, center);
        wrench[2] -= 9.81 * robot_total_mass(robot);
        double ankle[SA01_FEET][3];
        for (int f = 0; f < SA01_FEET; f++) {
            memcpy(ankle[f], robot_sim_foot(sim, f)->position, sizeof ankle[f]);
        }
        assert_int_equal(robot_sim_step(sim, torque, push, &terrain, ground), 0);
        for (int f = 0; f < SA01_FEET; f++) {
            const RobotFoot *foot = robot_sim_foot(sim, f);
            loaded += foot->force[2] > 1;
            add_wrench(wrench, foot->force, foot->torque, ankle[f], center);
        }
        momentum(sim, state.qpos, robot_sim_qvel(sim), after, center);
        for (int k = 0; k < 6; k++) {
            double change = after[k] - before[k];
            largest[k] = fmax(largest[k], fabs(change));
            worst[k] = fmax(worst[k], fabs(change - robot_sim_dt(sim) * wrench[k]));
        }
    }
    for (int k = 0; k < 6; k++) {
        print_message("momentum %d of a step: off by %.1e, changes by %.1e\n", k, worst[k],
                      largest[k]);
        assert_true(worst[k] < 1e-12);
    }
    assert_true(loaded >= 10);
    free(ground);
    robot_sim_destroy(sim);
}

typedef struct {
    RobotState state;
    RobotVariation variation;
    MildTerrain terrain;
    MildGround *ground;
} Case;

static void advance_case(RobotSim *sim, Case *one) {
    double torque[SA01_JOINTS];
    robot_sim_load(sim, &one->state, &one->variation);
    stand_torque(stand, sim, 0, torque);
    assert_int_equal(robot_sim_step(sim, torque, NULL, &one->terrain, one->ground), 0);
    robot_sim_store(sim, &one->state);
}

/* A step depends on (state, variation, terrain, ground) only, not on what the workspace did before.
 */
TEST(test_determinism) {
    static const char *const names[4] = {"sand_loose", "foam45", "grass", "rubber"};
    Case shared[4], alone[4];
    RobotSim *sim = new_sim(0.001);
    for (int i = 0; i < 4; i++) {
        shared[i] = (Case){random_state((uint32_t)i), robot_variation_nominal(),
                           kit_terrain(names[i]), kit_ground(robot)};
        shared[i].variation.rigid = i == 2;
        shared[i].variation.base_mass_add = i;
        alone[i] = shared[i];
        alone[i].ground = kit_ground(robot);
    }
    for (int step = 0; step < 300; step++) {
        for (int i = 0; i < 4; i++) {
            advance_case(sim, &shared[i]);
        }
    }
    for (int i = 0; i < 4; i++) {
        RobotSim *own = new_sim(0.001);
        robot_sim_load(own, &alone[i].state, &alone[i].variation);
        for (int step = 0; step < 300;
             step++) { /* without a load in between: storing and loading changes nothing */
            double torque[SA01_JOINTS];
            stand_torque(stand, own, 0, torque);
            assert_int_equal(robot_sim_step(own, torque, NULL, &alone[i].terrain, alone[i].ground),
                             0);
        }
        robot_sim_store(own, &alone[i].state);
        assert_memory_equal(&alone[i].state, &shared[i].state, sizeof shared[i].state);
        assert_memory_equal(alone[i].ground, shared[i].ground,
                            mild_ground_bytes(robot_soles(robot), SA01_FEET));
        robot_sim_destroy(own);
        free(alone[i].ground);
        free(shared[i].ground);
    }
    robot_sim_destroy(sim);
}

TEST(test_bad_numbers) {
    RobotSim *sim = new_sim(0.001);
    MildTerrain terrain = kit_terrain("sand_loose");
    MildGround *ground = kit_ground(robot);
    RobotVariation nominal = robot_variation_nominal();
    RobotState state = stand_state(stand, 0, 0.0);
    double torque[SA01_JOINTS] = {0};
    torque[3] = NAN;
    robot_sim_load(sim, &state, &nominal);
    assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 1);
    mild_ground_reset(ground);
    torque[3] = 1e9;
    robot_sim_load(sim, &state, &nominal);
    assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 1);
    mild_ground_reset(ground);
    torque[3] = 0.0;
    robot_sim_load(sim, &state, &nominal);
    assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
    free(ground);
    robot_sim_destroy(sim);
}

TEST_MAIN(setup, teardown)
