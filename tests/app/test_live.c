/* The ground that keys change: what each key does to the terrain, and that a standing robot sinks
 * to the depth of the law of the changed material. */
#include "app/play.h"
#include "control/stand.h"
#include "robots.h"
#include "sa01.h"

#define DT 0.002

/* sand_loose | grass beyond x = 2, then rubber and foam25 for the keys 1 and 2. */
static MildTerrain course(void) {
    static const char *const names[] = {"sand_loose", "grass", "rubber", "foam25"};
    MildTerrain terrain = {.material_count = 4};
    for (int m = 0; m < 4; m++) {
        assert_true(mild_material_preset(names[m], &terrain.materials[m]));
    }
    const MildPatch patch = {2, INFINITY, -INFINITY, INFINITY, 1};
    assert_int_equal(mild_terrain_add_patch(&terrain, &patch, NULL), MILD_OK);
    return terrain;
}

/* patches: whether grass lies beyond x = 2. */
static void check_presets(int patches) {
    MildTerrain terrain = course();
    terrain.patch_count = patches;
    MildTerrain episode = terrain;
    episode.height = 0.25;
    Live live = live_begin(&terrain, 2);
    for (int key = 0; key <= 9; key++) {
        const int known = key == 1 || key == 2;
        assert_int_equal(live_take(&live, 0, &(WindowInput){.ground = key}), known);
        live_apply(&live, &episode);
        const int before = key == 0, now = key == 1 ? 2 : 3;
        assert_int_equal(mild_terrain_material_at(&episode, 0, 0), before ? 0 : now);
        assert_int_equal(mild_terrain_material_at(&episode, 1e5, -1e5), before ? patches : now);
    }
    assert_true(episode.height == 0.25);
}

TEST(presets_lie_everywhere) {
    check_presets(0);
    check_presets(1);
}

TEST(keys_scale) {
    const MildTerrain terrain = course();
    const MildMaterial *was = &terrain.materials[0], *is;
    Live live = live_begin(&terrain, 2);
    is = &live.terrain.materials[0];
    assert_false(live_take(&live, 0, &(WindowInput){.friction = 2}));
    assert_true(fabs(is->mu / was->mu - 1.21) < 1e-12 && is->k_pen == was->k_pen);
    assert_false(live_take(&live, 0, &(WindowInput){.stiffness = -1}));
    assert_true(fabs(is->k_pen * 1.1 / was->k_pen - 1) < 1e-12);
    assert_true(fabs(is->sigma_cone * 1.1 / was->sigma_cone - 1) < 1e-12);
    assert_memory_equal(&live.terrain.materials[1], &terrain.materials[1], sizeof *was);

    char text[96], wanted[96];
    snprintf(wanted, sizeof wanted, "friction %.2f (F V), k_pen %.4g (K M)", 1.21 * was->mu,
             was->k_pen / 1.1);
    assert_string_equal(live_describe(&live, 0, text, sizeof text), wanted);

    for (int i = 0; i < 200; i++) { /* never out of the range of a material */
        live_take(&live, 0, &(WindowInput){.friction = 3, .stiffness = 3});
    }
    assert_int_equal(mild_material_check(is, NULL), MILD_OK);
    assert_true(is->k_pen > was->k_pen && is->mu > 1.21 * was->mu);
    MildMaterial next = *is;
    next.k_pen *= 1.331, next.sigma_cone *= 1.331, next.mu *= 1.331;
    assert_int_not_equal(mild_material_check(&next, NULL), MILD_OK);

    live_take(&live, 0, &(WindowInput){.ground = 1}); /* a preset comes with its own numbers */
    live_take(&live, 2, &(WindowInput){.friction = -5});
    assert_true(live.terrain.materials[2].mu < terrain.materials[2].mu);
    live_take(&live, 2, &(WindowInput){.ground = 1});
    assert_memory_equal(&live.terrain.materials[2], &terrain.materials[2], sizeof *was);
}

TEST(other_models_scale) {
    MildMaterial clay = kit_preset("clay");
    const MildTerrain terrain = mild_terrain_uniform(&clay);
    Live live = live_begin(&terrain, 0);
    live_take(&live, 0, &(WindowInput){.stiffness = 1});
    assert_true(fabs(live.terrain.materials[0].k_phi / clay.k_phi - 1.1) < 1e-12);
    assert_true(fabs(live.terrain.materials[0].k_c / clay.k_c - 1.1) < 1e-12);
    assert_true(live.terrain.materials[0].k_pen == clay.k_pen);
}

/* Mean depth of the elements [m] after a second. */
static double sinkage_after(const Robot *robot, RobotSim *sim, const Stand *stand,
                            const MildTerrain *terrain, MildGround *ground) {
    double torque[SA01_JOINTS], depth = 0;
    for (int i = 0; i < (int)(1.0 / DT); i++) {
        stand_torque(stand, sim, 1, torque);
        assert_int_equal(robot_sim_step(sim, torque, NULL, terrain, ground), 0);
    }
    int count = 0;
    for (int f = 0; f < SA01_FEET; f++) {
        const MildElements elements = mild_scratch_elements(robot_sim_scratch(sim), f);
        for (int i = 0; i < mild_sole_elements(robot_soles(robot)[f]); i++, count++) {
            depth += elements.depth[i];
        }
    }
    return depth / count;
}

/* Keys pressed under a robot. */
static void press(Live *live, const WindowInput *input, RobotSim *sim, MildTerrain *terrain,
                  MildGround *ground) {
    const MildTerrain before = *terrain;
    live_take(live, 0, input);
    live_apply(live, terrain);
    robot_sim_change_ground(sim, &before, terrain, ground);
}

/* The robot stands on rubber, which becomes softer and softer under it: it sinks to the rest depth
 * of the law. Where it becomes stiff at once, the robot stays down. Another preset does not reach
 * it while it stands. */
TEST(a_standing_robot_sinks) {
    MildError error = {0};
    Robot *robot = kit_robot(SA01);
    Stand *stand = stand_create(robot, &error);
    RobotSim *sim = robot_sim_create(robot, DT, &error);
    MildGround *ground = kit_ground(robot);
    const RobotVariation nominal = robot_variation_nominal();
    MildTerrain terrain = course();
    terrain.materials[0] = terrain.materials[2]; /* rubber */
    terrain.patch_count = 0;
    const double load = robot_foot_load(robot);
    const RobotState start = stand_state(
        stand, 1, mild_sole_sinkage(robot_soles(robot)[0], &terrain.materials[0], load));
    robot_sim_load(sim, &start, &nominal);
    Live live = live_begin(&terrain, 2);
    double depth = 0;
    for (int presses = 0; presses <= 4; presses += 2) {
        depth = sinkage_after(robot, sim, stand, &terrain, ground);
        const double rest = mild_sole_sinkage(robot_soles(robot)[0], &terrain.materials[0], load);
        print_message("%d presses: %.2f mm, the law's %.2f mm\n", presses, 1e3 * depth, 1e3 * rest);
        assert_true(fabs(depth / rest - 1) < 0.02);
        press(&live, &(WindowInput){.stiffness = -2}, sim, &terrain, ground);
    }
    const double height = robot_sim_qpos(sim)[2];
    press(&live, &(WindowInput){.stiffness = 20}, sim, &terrain, ground);
    for (int i = 0; i < (int)(0.3 / DT); i++) {
        double torque[SA01_JOINTS];
        stand_torque(stand, sim, 1, torque);
        assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
        assert_true(robot_sim_qpos(sim)[2] < height + 0.5e-3);
    }
    robot_sim_load(sim, &start, &nominal);
    mild_ground_reset(ground);
    terrain.materials[0] = live.original[0];
    live = live_begin(&terrain, 2);
    depth = sinkage_after(robot, sim, stand, &terrain, ground);
    press(&live, &(WindowInput){.ground = 2}, sim, &terrain, ground);
    assert_true(fabs(sinkage_after(robot, sim, stand, &terrain, ground) - depth) < 0.05e-3);
    free(ground);
    robot_sim_destroy(sim);
    stand_destroy(stand);
    robot_destroy(robot);
}

TEST_MAIN(NULL, NULL)
