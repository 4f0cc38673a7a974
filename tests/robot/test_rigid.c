/* The engine's contact on uneven ground: against the engine itself on level and on tilted floors;
 * friction on a slope; standing on waves. */
#include <math.h>
#include <string.h>

#include <mujoco/mujoco.h>

#include "robot_kit.h"

#include "sa01.h"

static MildMap *make_map(const MildMapDef *def) {
    MildError error = {0};
    MildMap *map = mild_map_create(def, &error);
    expect_good(map != NULL, &error);
    return map;
}

static MildMap *slope_map(double slope) {
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_SLOPE;
    def.slope = slope;
    return make_map(&def);
}

static RobotVariation rigid_variation(double friction) {
    RobotVariation variation = robot_variation_nominal();
    variation.rigid = 1;
    variation.rigid_friction = friction;
    return variation;
}

/* Standing, a little off and in motion. */
static RobotState random_state(uint32_t draw) {
    RobotState state = stand_state(stand, 0, 0.0);
    Random random = random_at(6, draw, 0);
    kit_disturb(&state, &random);
    return state;
}

/* A map that happens to be level is the level floor, to the last bit. */
TEST(test_level) {
    const double heights[4] = {0.5, 0.5, 0.5, 0.5};
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_IMAGE;
    def.amplitude = 0.5;
    def.heights = heights;
    def.height_columns = def.height_rows = 2;
    MildMap *map = make_map(&def);
    assert_false(mild_map_is_level(map));
    RobotSim *sim = new_sim(0.001), *other = new_sim(0.001);
    RobotVariation rigid = rigid_variation(0.8);
    MildTerrain flat = kit_terrain("sand_loose"), mapped = flat;
    flat.height = 0.25;
    mapped.map = map;
    int contacts = 0;
    for (uint32_t draw = 0; draw < 20; draw++) {
        RobotState state = random_state(draw);
        state.qpos[2] += 0.25;
        robot_sim_load(sim, &state, &rigid);
        robot_sim_load(other, &state, &rigid);
        for (int i = 0; i < 300; i++) {
            double torque[SA01_JOINTS];
            stand_torque(stand, sim, 0, torque);
            assert_int_equal(robot_sim_step(sim, torque, NULL, &flat, NULL), 0);
            assert_int_equal(robot_sim_step(other, torque, NULL, &mapped, NULL), 0);
            contacts += robot_sim_foot(sim, 0)->result.contacts;
            assert_memory_equal(robot_sim_contact(sim), robot_sim_contact(other),
                                sizeof(MildContactResult));
            assert_memory_equal(robot_sim_qpos(sim), robot_sim_qpos(other), sizeof state.qpos);
        }
    }
    assert_true(contacts > 1000);
    robot_sim_destroy(sim);
    robot_sim_destroy(other);
    mild_map_destroy(map);
}

/* A plane of these rises per metre, whose heights a float holds exactly. */
static MildMap *plane_map(double along_x, double along_y) {
    enum { EDGE = 9 };
    double heights[EDGE * EDGE];
    for (int r = 0; r < EDGE; r++) {
        for (int c = 0; c < EDGE; c++) {
            heights[EDGE * r + c] = along_x * (c - EDGE / 2) + along_y * (EDGE / 2 - r);
        }
    }
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_IMAGE;
    def.amplitude = def.cell = 1;
    def.heights = heights;
    def.height_columns = def.height_rows = EDGE;
    return make_map(&def);
}

/* A slope is the engine's own floor, tilted, also where it is so steep that the engine takes other
 * tangents: robots dropped onto the plane, limp. */
TEST(test_any_plane_is_the_engine) {
    static const double planes[][2] = {{0, 0.25}, {0.25, -0.5}, {0, 0.75}, {-0.25, -1}, {0, 1.5}};
    double worst = 0.0;
    int contacts = 0;
    for (uint32_t draw = 0; draw < 10; draw++) {
        const double *rise = planes[draw % 5];
        double length = sqrt(1 + rise[0] * rise[0] + rise[1] * rise[1]);
        const double normal[3] = {-rise[0] / length, -rise[1] / length, 1 / length};
        MildMap *map = plane_map(rise[0], rise[1]);
        MildTerrain terrain = kit_terrain("sand_loose");
        terrain.map = map;
        RobotSim *sim = new_sim(0.001);
        mjModel *m = robot_sim_model(sim);
        mjData *engine = mj_makeData(m);
        RobotState state = random_state(draw);
        RobotVariation rigid = rigid_variation(0.6);
        int floor = mj_name2id(m, mjOBJ_GEOM, "floor");
        mju_quatZ2Vec(m->geom_quat + 4 * floor, normal);
        m->geom_sameframe[floor] = mjSAMEFRAME_NONE;
        robot_sim_load(sim, &state, &rigid);
        state.qpos[2] -= robot_sim_sole_clearance(sim, &terrain) - 0.001;
        robot_sim_load(sim, &state, &rigid);
        memcpy(engine->qpos, state.qpos, sizeof state.qpos);
        memcpy(engine->qvel, state.qvel, sizeof state.qvel);
        for (int i = 0; i < 150; i++) {
            double torque[SA01_JOINTS] = {0};
            mj_step(m, engine);
            assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, NULL), 0);
            contacts += robot_sim_contact(sim)->foot[0].contacts;
            contacts += robot_sim_contact(sim)->foot[1].contacts;
        }
        for (int i = 0; i < SA01_NQ; i++) {
            worst = fmax(worst, fabs(engine->qpos[i] - robot_sim_qpos(sim)[i]));
        }
        mj_deleteData(engine);
        robot_sim_destroy(sim);
        mild_map_destroy(map);
    }
    print_message("planes any way against mj_step: worst %.2e, %d contacts\n", worst, contacts);
    assert_true(worst < 1e-9 && contacts > 1000);
}

/* A robot with held joints is put on a slope with its soles flat, for two seconds. [m] down the
 * slope: how far its centre of mass has come, and how far a foot has gone in the second second. */
static void slide(double slope, double friction, double *fallen, double *crept) {
    MildMap *map = slope_map(-slope);
    MildTerrain terrain = kit_terrain("sand_loose");
    terrain.map = map;
    RobotSim *sim = new_sim(0.001);
    RobotVariation rigid = rigid_variation(friction);
    RobotState state = stand_state(stand, 0, 0.0);
    const mjData *d = robot_sim_data(sim);
    double tilt = atan(slope), height = state.qpos[2], start, half = 0.0;
    state.qpos[0] = height * sin(tilt);
    state.qpos[2] = height * cos(tilt);
    state.qpos[3] = cos(0.5 * tilt);
    state.qpos[5] = sin(0.5 * tilt);
    robot_sim_load(sim, &state, &rigid);
    start = d->subtree_com[3];
    for (int i = 0; i < 2000; i++) {
        double torque[SA01_JOINTS];
        stand_torque(stand, sim, 0, torque);
        assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, NULL), 0);
        half = i == 1000 ? robot_sim_foot(sim, 0)->sole_center[0] : half;
    }
    *fallen = (d->subtree_com[3] - start) / cos(tilt);
    *crept = (robot_sim_foot(sim, 0)->sole_center[0] - half) / cos(tilt);
    robot_sim_destroy(sim);
    mild_map_destroy(map);
}

/* Above the angle of friction it slides as a block does, (sin - mu cos) g t^2/2 and the sway of its
 * joints; below it stays, but for the creep of the engine's friction. */
TEST(test_friction) {
    const double slope = 0.03, angle = atan(slope);
    double fallen, crept;
    slide(slope, 0.01, &fallen, &crept);
    double block = (sin(angle) - 0.01 * cos(angle)) * 9.81 * 2.0;
    print_message("slope of 0.03: friction 0.01 slides %.0f mm in 2 s, a block %.0f mm\n",
                  1e3 * fallen, 1e3 * block);
    assert_true(fabs(fallen - block) < 0.1 * block);
    slide(slope, 0.06, &fallen, &crept);
    print_message("slope of 0.03: friction 0.06 creeps %.2f mm/s\n", 1e3 * crept);
    assert_true(fabs(crept) < 0.002);
}

/* Wherever it stands on waves, the lowest corner of either foot is neither 2 mm in the ground nor
 * above it. */
TEST(test_waves) {
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_WAVES;
    MildMap *map = make_map(&def);
    RobotSim *sim = new_sim(0.0025);
    RobotVariation rigid = rigid_variation(0.8);
    const mjModel *m = robot_sim_model(sim);
    const mjData *d = robot_sim_data(sim);
    double deepest = 0.0, highest = 0.0;
    int stood = 0;
    for (uint32_t place = 0; place < 16; place++) {
        MildTerrain terrain = kit_terrain("sand_loose");
        Random random = random_at(7, place, 0);
        terrain.map = map;
        terrain.map_x = random_uniform(&random, -1.0, 1.0);
        terrain.map_y = random_uniform(&random, -1.0, 1.0);
        RobotState state = stand_state(stand, 1, 0.0);
        robot_sim_load(sim, &state, &rigid);
        state.qpos[2] -= robot_sim_sole_clearance(sim, &terrain);
        robot_sim_load(sim, &state, &rigid);
        for (int i = 0; i < 800; i++) {
            double torque[SA01_JOINTS];
            stand_torque(stand, sim, 1, torque);
            assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, NULL), 0);
            for (int f = 0; i >= 400 && f < SA01_FEET; f++) {
                double least = 1.0;
                for (int p = 4 * f; p < 4 * f + 4; p++) {
                    const double *c = d->geom_xpos + 3 * m->pair_geom2[p];
                    least = fmin(least, c[2] - m->geom_size[3 * m->pair_geom2[p]] -
                                            mild_terrain_height_at(&terrain, c[0], c[1]));
                }
                deepest = fmin(deepest, least);
                highest = fmax(highest, least);
            }
        }
        stood += robot_sim_qpos(sim)[2] > 0.7;
    }
    print_message("waves of 20 mm: %d of 16 stand; the lowest corner of a foot %.2f mm in to %.2f "
                  "mm above the ground\n",
                  stood, -1e3 * deepest, 1e3 * highest);
    robot_sim_destroy(sim);
    mild_map_destroy(map);
    assert_int_equal(stood, 16);
    assert_true(deepest > -0.002 && highest < 0.002);
}

TEST_MAIN(setup, teardown)
