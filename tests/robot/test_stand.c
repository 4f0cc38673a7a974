/* Standing ten seconds with the stand gains on every ground, at every physics step from 0.5 to 5
 * ms. */
#include <math.h>
#include <string.h>

#include "robot_kit.h"

#include "sa01.h"

#define SECONDS 10.0
#define FALLEN 0.7 /* [m] base height */

typedef struct {
    int stands;
    double seconds; /* [s] until it fell, or all */
    double depth;   /* [m] mean over feet and the last two seconds */
    double creep;   /* [m] change of the mean depth in the last two seconds */
    double drift;   /* [m] of the soles' centres from where they first rested, horizontal */
    double tilt;    /* [rad] of the soles at the end, the larger */
    double height;  /* [m] of the base at the end */
    double torque;  /* [N m] largest in the last two seconds */
} Standing;

static double mean_depth(const RobotSim *sim) {
    return 0.5 *
           (robot_sim_foot(sim, 0)->result.depth_mean + robot_sim_foot(sim, 1)->result.depth_mean);
}

static double sole_drift(const RobotSim *sim, double start[SA01_FEET][3]) {
    double worst = 0.0;
    for (int f = 0; f < SA01_FEET; f++) {
        const double *now = robot_sim_foot(sim, f)->sole_center;
        worst = fmax(worst, hypot(now[0] - start[f][0], now[1] - start[f][1]));
    }
    return worst;
}

static double static_sinkage(const MildMaterial *material) {
    return mild_sole_sinkage(robot_soles(robot)[0], material, robot_foot_load(robot));
}

/* material: NULL for rigid ground. */
static Standing stand_still(const MildMaterial *material, double dt, double seconds, int balance,
                            MildSolver solver) {
    RobotSim *sim = new_sim(dt);
    robot_sim_set_solver(sim, solver, 0, 0);
    MildGround *ground = kit_ground(robot);
    MildMaterial any = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(material ? material : &any);
    RobotVariation variation = robot_variation_nominal();
    variation.rigid = material == NULL;
    RobotState state = stand_state(stand, balance, material ? static_sinkage(material) : 0.0);
    robot_sim_load(sim, &state, &variation);
    double start[SA01_FEET][3], late = 0.0;
    for (int f = 0; f < SA01_FEET; f++) {
        memcpy(start[f], robot_sim_foot(sim, f)->sole_center, sizeof start[f]);
    }
    Standing result = {.stands = 1};
    int steps = (int)(seconds / dt + 0.5), tail = (int)(0.2 * seconds / dt + 0.5);
    for (int i = 0; i < steps && result.stands; i++) {
        double torque[SA01_JOINTS];
        stand_torque(stand, sim, balance, torque);
        int bad = robot_sim_step(sim, torque, NULL, &terrain, ground);
        result.stands = !bad && robot_sim_qpos(sim)[2] > FALLEN;
        result.seconds = (i + 1) * dt;
        late = i == steps - tail ? mean_depth(sim) : late;
        if (i >= steps - tail) {
            result.depth += mean_depth(sim) / tail;
            for (int k = 0; k < SA01_JOINTS; k++) {
                result.torque = fmax(result.torque, fabs(torque[k]));
            }
        }
    }
    result.height = robot_sim_qpos(sim)[2];
    result.creep = mean_depth(sim) - late;
    result.drift = sole_drift(sim, start);
    for (int f = 0; f < SA01_FEET; f++) {
        result.tilt = fmax(result.tilt, acos(fmin(1.0, robot_sim_foot(sim, f)->rotation[8])));
    }
    free(ground);
    robot_sim_destroy(sim);
    return result;
}

static void check_balanced(const char *name, const MildMaterial *material, double dt) {
    Standing result = stand_still(material, dt, SECONDS, 1, MILD_SOLVER_NEWTON);
    double expected = material ? static_sinkage(material) : 0.0;
    print_message("%-11s %.1f ms %s %5.2f s depth %6.3f of %6.3f mm, creep %8.5f, drift %.4f mm, "
                  "tilt %.4f rad, %.1f N m\n",
                  name, 1e3 * dt, result.stands ? "stands" : "FELL  ", result.seconds,
                  1e3 * result.depth, 1e3 * expected, 1e3 * result.creep, 1e3 * result.drift,
                  result.tilt, result.torque);
    assert_true(result.stands);
    assert_true(fabs(result.creep) < 1e-4);
    assert_true(result.drift < 3e-3);
    if (material) {
        assert_true(fabs(result.depth - expected) < 0.15 * expected);
    }
}

TEST(test_stands_everywhere) {
    static const double steps[] = {0.0005, 0.001, 0.0025, 0.005};
    for (int s = kit_short() ? 2 : 0; s < 4; s++) {
        check_balanced("rigid", NULL, steps[s]);
        for (int p = 0; p < mild_material_preset_count(); p++) {
            MildMaterial material = kit_preset(mild_material_preset_name(p));
            check_balanced(mild_material_preset_name(p), &material, steps[s]);
        }
    }
}

/* The paper's sweeps take a step to where Newton's method takes it (few steps: sweeps are slow). */
TEST(test_papers_solver) {
    for (int p = 0; p < mild_material_preset_count(); p++) {
        MildMaterial material = kit_preset(mild_material_preset_name(p));
        double height[2];
        for (int s = 0; s < 2; s++) {
            Standing result = stand_still(&material, 0.0025, 0.0075, 1,
                                          s ? MILD_SOLVER_GAUSS_SEIDEL : MILD_SOLVER_NEWTON);
            assert_true(result.stands);
            height[s] = result.height;
        }
        print_message("%-11s base after 3 steps differs by %.1e m\n", mild_material_preset_name(p),
                      height[1] - height[0]);
        assert_true(fabs(height[1] - height[0]) < 1e-6);
    }
}

/* Joints held at the default pose without balance: rigid ground carries that, soft foam cannot (see
 * stand.c). */
TEST(test_plain_gains) {
    Standing rigid = stand_still(NULL, 0.001, SECONDS, 0, MILD_SOLVER_NEWTON);
    assert_true(rigid.stands);
    for (int p = 0; p < mild_material_preset_count(); p++) {
        MildMaterial material = kit_preset(mild_material_preset_name(p));
        Standing result = stand_still(&material, 0.001, SECONDS, 0, MILD_SOLVER_NEWTON);
        print_message("plain gains on %-11s %s after %.2f s\n", mild_material_preset_name(p),
                      result.stands ? "stand" : "fall", result.seconds);
        if (strcmp(mild_material_preset_name(p), "foam25") == 0) {
            assert_false(result.stands);
        }
    }
}

TEST_MAIN(setup, teardown)
