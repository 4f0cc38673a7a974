/* Standing ten seconds with the stand gains on every ground, at every physics step from 0.5 to 5
 * ms. */
#include <math.h>
#include <string.h>

#include "stand_kit.h"

#include "sa01.h"

#define SECONDS 10.0
#define FALLEN 0.7 /* [m] base height */

static int is_up(const RobotSim *sim, const MildTerrain *terrain) {
    (void)terrain;
    return robot_sim_qpos(sim)[2] > FALLEN;
}

/* material: NULL for rigid ground. */
static Standing stand_still(const MildMaterial *material, double dt, double seconds, int balance,
                            MildSolver solver) {
    const KitStand how = {.material = material,
                          .dt = dt,
                          .seconds = seconds,
                          .tail = 0.2 * seconds,
                          .plain = !balance,
                          .solver = solver,
                          .up = is_up};
    return kit_stand(&how);
}

static void check_balanced(const char *name, const MildMaterial *material, double dt) {
    Standing result = stand_still(material, dt, SECONDS, 1, MILD_SOLVER_NEWTON);
    double expected = kit_sinkage(material);
    print_message("%-11s %.1f ms %s %5.2f s depth %6.3f of %6.3f mm, creep %8.5f, drift %.4f mm, "
                  "tilt %.4f rad, %.1f N m\n",
                  name, 1e3 * dt, result.stands ? "stands" : "FELL  ", result.seconds,
                  1e3 * result.depth, 1e3 * expected, 1e3 * result.creep, 1e3 * result.drift,
                  result.leaning, result.torque);
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

TEST_MAIN(setup, teardown)
