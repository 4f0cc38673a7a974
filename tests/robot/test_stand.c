/* Robots that stand on their own gains on every ground: SA01 for ten seconds at physics steps from
 * 0.5 to 5 ms, G1 and Go1 for four, the Go1 pushed. */
#include "robots.h"

#include "control/stand.h"

typedef struct {
    const char *robot;
    double dt, seconds; /* [s] */
    double push[6];     /* [N, N m] for 0.1 s after the first second */
} Trial;

static const Trial trials[] = {
    {"sa01", 0.0025, 10, {0}}, {"sa01", 0.005, 10, {0}}, {"g1", 0.0025, 4, {0}},
    {"go1", 0.0025, 4, {0}},   {"go1", 0.001, 4, {40}},  {"go1", 0.001, 4, {0, 25}},
    {"sa01", 0.0005, 10, {0}}, {"sa01", 0.001, 10, {0}},
};
enum { TRIALS = sizeof trials / sizeof *trials, SHORT_TRIALS = TRIALS - 2 };

/* Means are taken over the last fifth. */
typedef struct {
    double load;   /* [-] of the weight */
    double share;  /* [-] least load of a foot over an equal share of the weight */
    double depth;  /* [m] mean over the feet */
    double rest;   /* [m] mean over the feet of a sole's sinkage under the foot's load */
    double creep;  /* [m] change of the mean depth in the last fifth */
    double drift;  /* [m] of the soles' centres from where they first rested, horizontal */
    double moved;  /* [m] the base during the push */
    double height; /* [m] of the base above the soles' depth at the end */
    double tilt;   /* [rad] of the base at the end */
    double speed;  /* [m/s, rad/s] of the base at the end, the largest component */
} Standing;

/* [m] Mean over the feet. */
static double depth_of(const Robot *robot, const RobotSim *sim) {
    double sum = 0;
    for (int f = 0; f < robot_feet(robot); f++) {
        sum += robot_sim_foot(sim, f)->result.depth_mean / robot_feet(robot);
    }
    return sum;
}

/* What is known at the end. material: NULL for rigid ground; start: [feet] of the soles' centres;
 * loads: [feet] [N] */
static void conclude(const Robot *robot, const RobotSim *sim, const MildMaterial *material,
                     double (*start)[3], const double *loads, Standing *result) {
    const int feet = robot_feet(robot);
    const double weight = 9.81 * robot_total_mass(robot);
    result->share = INFINITY;
    for (int f = 0; f < feet; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        result->load += loads[f] / weight;
        result->share = fmin(result->share, loads[f] / (weight / feet));
        result->rest +=
            material ? mild_sole_sinkage(robot_soles(robot)[f], material, loads[f]) / feet : 0;
        result->drift = fmax(result->drift, hypot(foot->sole_center[0] - start[f][0],
                                                  foot->sole_center[1] - start[f][1]));
    }
    for (int k = 0; k < 6; k++) {
        result->speed = fmax(result->speed, fabs(robot_sim_qvel(sim)[k]));
    }
    result->height = robot_sim_qpos(sim)[2] + result->depth;
    result->tilt = acos(fmin(1.0, robot_sim_base_rotation(sim)[8]));
}

static Standing stand_through(const Robot *robot, const Trial *trial,
                              const MildMaterial *material) {
    MildError error = {0};
    Stand *stand = stand_create(robot, &error);
    RobotSim *sim = robot_sim_create(robot, trial->dt, &error);
    expect_good(stand && sim, &error);
    MildGround *ground = kit_ground(robot);
    const MildMaterial any = mild_material_default();
    const MildTerrain terrain = mild_terrain_uniform(material ? material : &any);
    RobotVariation variation = robot_variation_nominal();
    variation.rigid = material == NULL;
    const double sinks =
        material ? mild_sole_sinkage(robot_soles(robot)[0], material, robot_foot_load(robot)) : 0;
    const RobotState state = stand_state(stand, 1, sinks);
    robot_sim_load(sim, &state, &variation);
    Standing result = {.moved = 0};
    double start[ROBOT_FEET_MAX][3], loads[ROBOT_FEET_MAX] = {0}, late = 0, from[2] = {0};
    for (int f = 0; f < robot_feet(robot); f++) {
        memcpy(start[f], robot_sim_foot(sim, f)->sole_center, sizeof start[f]);
    }
    const int steps = (int)(trial->seconds / trial->dt + 0.5);
    const int second = (int)(1 / trial->dt + 0.5), tail = steps / 5;
    for (int i = 0; i < steps; i++) {
        double torque[ROBOT_JOINTS_MAX];
        const double *at = robot_sim_qpos(sim);
        const int pushed = i >= second && i < second + second / 10;
        if (i == second) {
            memcpy(from, at, sizeof from);
        }
        result.moved = pushed ? hypot(at[0] - from[0], at[1] - from[1]) : result.moved;
        stand_torque(stand, sim, 1, torque);
        assert_int_equal(robot_sim_step(sim, torque, pushed ? trial->push : NULL, &terrain, ground),
                         0);
        assert_true(robot_sim_base_clearance(sim, &terrain) > 0);
        late = i == steps - tail ? depth_of(robot, sim) : late;
        for (int f = 0; i >= steps - tail && f < robot_feet(robot); f++) {
            loads[f] += robot_sim_foot(sim, f)->force[2] / tail;
            result.depth += robot_sim_foot(sim, f)->result.depth_mean / robot_feet(robot) / tail;
        }
    }
    result.creep = depth_of(robot, sim) - late;
    conclude(robot, sim, material, start, loads, &result);
    free(ground);
    robot_sim_destroy(sim);
    stand_destroy(stand);
    return result;
}

/* material: NULL for rigid ground. A robot that was pushed may still sway at the end. */
static void check(const Robot *robot, const Trial *trial, const char *name,
                  const MildMaterial *material) {
    const Standing r = stand_through(robot, trial, material);
    const int pushed = trial->push[0] != 0 || trial->push[1] != 0;
    print_message("%-4s %.1f ms, push %2.0f %2.0f N, %-15s load %.5f, least foot %.2f, depth %7.3f "
                  "of %7.3f mm, creep %8.5f, drift %.3f, moved %.1f mm, tilt %.4f rad, speed "
                  "%.1e\n",
                  trial->robot, 1e3 * trial->dt, trial->push[0], trial->push[1], name, r.load,
                  r.share, 1e3 * r.depth, 1e3 * r.rest, 1e3 * r.creep, 1e3 * r.drift, 1e3 * r.moved,
                  r.tilt, r.speed);
    expect_near("load", r.load, 1, 0.01);
    expect_near("height", r.height, robot_stand_height(robot), 0.01);
    assert_true(r.share > 0.5 && r.tilt < 0.1);
    if (pushed) {
        assert_true(r.moved > 2e-3 && r.speed < 0.3);
        return;
    }
    assert_true(fabs(r.creep) < 1e-4 && r.drift < 3e-3 && r.speed < 0.02);
    if (material) {
        expect_near("depth", r.depth, r.rest, 0.15 * r.rest);
    }
}

TEST(robots_stand_everywhere) {
    for (int t = 0; t < (kit_short() ? SHORT_TRIALS : TRIALS); t++) {
        Robot *robot = kit_robot_named(trials[t].robot);
        check(robot, &trials[t], "rigid", NULL);
        for (int p = 0; p < mild_material_preset_count(); p++) {
            const MildMaterial material = kit_preset(mild_material_preset_name(p));
            check(robot, &trials[t], mild_material_preset_name(p), &material);
        }
        robot_destroy(robot);
    }
}

TEST_MAIN(NULL, NULL)
