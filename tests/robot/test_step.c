/* The step: against the engine's own step, against dense algebra, momentum, determinism. */
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

/* Our rigid step is the engine's step, joint limits and contacts included. */
TEST(test_rigid_is_the_engine) {
    RobotSim *sim = new_sim(0.001);
    RobotVariation rigid = robot_variation_nominal();
    rigid.rigid = 1;
    MildTerrain terrain = kit_terrain("sand_loose");
    mjModel *m = robot_sim_model(sim);
    mjData *engine = mj_makeData(m);
    double worst = 0.0;
    for (uint32_t draw = 0; draw < 20; draw++) {
        RobotState state = random_state(draw);
        mj_resetData(m, engine);
        robot_sim_load(sim, &state, &rigid);
        memcpy(engine->qpos, state.qpos, sizeof state.qpos);
        memcpy(engine->qvel, state.qvel, sizeof state.qvel);
        for (int i = 0; i < 300;
             i++) { /* with no torque the robot collapses into its joint limits */
            double torque[SA01_JOINTS] = {0};
            if (draw % 2 == 0) {
                stand_torque(stand, sim, 0, torque);
            }
            memcpy(engine->qfrc_applied + 6, torque, sizeof torque);
            mj_step(m, engine);
            assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, NULL), 0);
        }
        for (int i = 0; i < SA01_NQ; i++) {
            worst = fmax(worst, fabs(engine->qpos[i] - robot_sim_qpos(sim)[i]));
        }
    }
    print_message("rigid against mj_step: worst %.2e\n", worst);
    assert_true(worst < 1e-9);
    mj_deleteData(engine);
    robot_sim_destroy(sim);
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

/* x <- M^-1 x by Gaussian elimination on the full matrix. */
static void dense_solve(const double *mass, double *x) {
    double a[SA01_NV][SA01_NV + 1];
    for (int i = 0; i < SA01_NV; i++) {
        memcpy(a[i], mass + i * SA01_NV, SA01_NV * sizeof(double));
        a[i][SA01_NV] = x[i];
    }
    for (int p = 0; p < SA01_NV; p++) {
        for (int i = p + 1; i < SA01_NV; i++) {
            double factor = a[i][p] / a[p][p];
            for (int k = p; k <= SA01_NV; k++) {
                a[i][k] -= factor * a[p][k];
            }
        }
    }
    for (int i = SA01_NV - 1; i >= 0; i--) {
        double sum = a[i][SA01_NV];
        for (int k = i + 1; k < SA01_NV; k++) {
            sum -= a[i][k] * x[k];
        }
        x[i] = sum / a[i][i];
    }
}

/* What the ground is asked with, and what its wrenches do: A, V_free, J^T W and M^-1 J^T W. */
TEST(test_map_against_dense) {
    RobotSim *sim = new_sim(0.001);
    RobotVariation nominal = robot_variation_nominal();
    double worst_a = 0.0, worst_wrench = 0.0, worst_twist = 0.0;
    for (uint32_t draw = 0; draw < 50; draw++) {
        RobotState state = random_state(draw);
        robot_sim_load(sim, &state, &nominal);
        const mjModel *m = robot_sim_model(sim);
        mjData *d = robot_sim_data(sim);
        mj_makeM(m, d);
        double mass[SA01_NV * SA01_NV], j[ROWS * SA01_NV], solved[ROWS * SA01_NV];
        mj_fullM(m, d, mass);
        dense_jacobian(sim, j);
        memcpy(solved, j, sizeof solved);
        for (int r = 0; r < ROWS; r++) {
            dense_solve(mass, solved + r * SA01_NV);
            double twist = 0.0;
            for (int k = 0; k < SA01_NV; k++) {
                twist += j[r * SA01_NV + k] * state.qvel[k];
            }
            worst_twist =
                fmax(worst_twist, fabs(twist - robot_sim_foot(sim, r / 6)->velocity[r % 6]));
        }
        Given given = {.feet = 0};
        double rate[SA01_NV], force[SA01_NV];
        assert_int_equal(given_step(&given, sim, &state), 0);
        memcpy(rate, d->qvel, sizeof rate);
        memcpy(force, d->qfrc_smooth, sizeof force);
        for (int r = 0; r < ROWS; r++) {
            double twist = 0.0;
            for (int c = 0; c < ROWS; c++) {
                double sum = 0.0;
                for (int k = 0; k < SA01_NV; k++) {
                    sum += j[r * SA01_NV + k] * solved[c * SA01_NV + k];
                }
                worst_a = fmax(worst_a,
                               fabs(sum - given.inverse_inertia[r * ROWS + c]) / (1.0 + fabs(sum)));
            }
            for (int k = 0; k < SA01_NV; k++) {
                twist += j[r * SA01_NV + k] * rate[k];
            }
            worst_twist = fmax(worst_twist, fabs(twist - given.free_velocity[r]));
        }
        given_some(&given, SA01_FEET);
        assert_int_equal(given_step(&given, sim, &state), 0);
        for (int k = 0; k < SA01_NV; k++) {
            double f = 0.0, a = 0.0;
            for (int r = 0; r < ROWS; r++) {
                f += j[r * SA01_NV + k] * given.wrench[r / 6][r % 6];
                a += solved[r * SA01_NV + k] * given.wrench[r / 6][r % 6];
            }
            const double change = (d->qvel[k] - rate[k]) / 0.001;
            worst_wrench = fmax(worst_wrench, fabs(f - (d->qfrc_smooth[k] - force[k])));
            worst_wrench = fmax(worst_wrench, fabs(a - change) / (1.0 + fabs(a)));
        }
    }
    print_message("A %.2e, wrench %.2e, twist %.2e from dense\n", worst_a, worst_wrench,
                  worst_twist);
    assert_true(worst_a < 1e-10 && worst_wrench < 1e-10 && worst_twist < 1e-12);
    robot_sim_destroy(sim);
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

TEST(test_clearance_and_distances) {
    RobotSim *sim = new_sim(0.001);
    MildTerrain terrain = kit_terrain("sand_loose");
    RobotVariation nominal = robot_variation_nominal();
    RobotState state = stand_state(stand, 0, 0.0);
    robot_sim_load(sim, &state, &nominal);
    /* shank box: 0.32 below the knee axis of a shank leaning 0.24 rad, plus its corner */
    double ankle = 0.055,
           expected = ankle + 0.37 * cos(0.24) - (0.32 * cos(0.24) + 0.025 * sin(0.24));
    assert_true(fabs(robot_sim_body_clearance(sim, &terrain) - expected) < 1e-9);
    assert_true(fabs(robot_sim_foot_distance(sim) - 2 * (0.07513 + 0.0055)) < 3e-4);
    assert_true(fabs(robot_sim_knee_distance(sim) - 2 * 0.07506) < 1e-4);
    state.qpos[3] = cos(0.4);
    state.qpos[6] = sin(0.4); /* heading does not matter */
    robot_sim_load(sim, &state, &nominal);
    assert_true(fabs(robot_sim_knee_distance(sim) - 2 * 0.07506) < 1e-4);
    state.qpos[2] = 0.1;
    robot_sim_load(sim, &state, &nominal);
    assert_true(robot_sim_body_clearance(sim, &terrain) < 0.0);
    robot_sim_destroy(sim);
}

TEST_MAIN(setup, teardown)
