/* The ground in float (float_ground.h) against libmild's in double, step for step, on every model;
 * and what it gives on closed motions. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "kit.h"
#include "robot/float/float_ground.h"

#define DT 0.0025
#define FORCE_BOUND 1e-3 /* [-] of the load, ten tolerances: both stop at a residual of 1e-4 */
#define GAIN_BOUND 1e-4  /* [-] of the work on a closed motion that ground may give back */

static Robot *robot;

static MildMaterial matched(MildModel model, const char *preset) {
    MildMaterial mild, material;
    MildError error = {0};
    robot_set_model(robot, model);
    assert_true(mild_material_preset(preset, &mild));
    assert_int_equal(robot_match_model(robot, model, &mild, &material, &error), MILD_OK);
    if (model == MILD_MODEL_MILD_MERGED) { /* slip takes the support away */
        material.slip_length = 1.4e-3;
        material.regain_length = 0.68e-3;
        material.grip = 0.123;
        material.slip_growth = 0.07;
    }
    return material;
}

static MildGround *new_ground(void) {
    void *block = aligned_alloc(64, mild_ground_bytes(robot_soles(robot), robot_bodies(robot)));
    assert_non_null(block);
    return mild_ground_init(block, robot_soles(robot), robot_bodies(robot));
}

/* Computes a step twice, from one memory, and goes on with the double one. */
typedef struct {
    RobotGround *single;
    MildScratch *scratch;
    MildGround *other;  /* memory of the step in float */
    double load;        /* [N] the robot's weight */
    double apart, deep; /* [-] of the load, [m]: greatest differences of force and depth */
    int steps, touched, unsolved;
} Twice;

static int solve_twice(void *self, const MildTerrain *terrain, MildGround *ground,
                       const MildContactInput *given, MildContactResult *result) {
    Twice *twice = self;
    MildContactInput input = *given;
    MildContactResult single = {0};
    input.tolerance = FLOAT_GROUND_TOLERANCE;
    memcpy(twice->other, ground, mild_ground_size(ground));
    twice->single->solve(twice->single->self, terrain, twice->other, &input, &single);
    mild_ground_solve(ground, terrain, &input, twice->scratch, result);
    mild_ground_advance(ground, terrain, &input, twice->scratch, result);
    double load = twice->load;
    for (int f = 0; f < input.feet; f++) {
        load = fmax(load, fabs(result->foot[f].force[2]));
    }
    for (int f = 0; f < input.feet; f++) {
        for (int k = 0; k < 3; k++) {
            const double apart = fabs(single.foot[f].force[k] - result->foot[f].force[k]) / load;
            assert_true(isfinite(single.foot[f].force[k]) && isfinite(single.foot[f].torque[k]));
            twice->apart = fmax(twice->apart, apart);
        }
        const double *a = mild_ground_depth_max(ground, f);
        const double *b = mild_ground_depth_max(twice->other, f);
        for (int i = 0; i < mild_sole_elements(robot_soles(robot)[f]); i++) {
            twice->deep = fmax(twice->deep, fabs(a[i] - b[i]));
        }
        twice->touched += result->foot[f].contacts > 0;
    }
    twice->unsolved += result->converged && !single.converged;
    twice->steps++;
    return 0;
}

/* A robot lands on its feet from 30 mm, at 0.4 m/s along and at 0.3 rad/s, held by weak springs. */
static void fall(RobotSim *sim, const MildTerrain *terrain, MildGround *ground) {
    RobotState state = {.qpos = {0, 0, robot_stand_height(robot) + 0.03, 1, 0, 0, 0}};
    const int joints = robot_joints(robot);
    const RobotVariation nominal = robot_variation_nominal();
    memcpy(state.qpos + 7, robot_default_pose(robot), (size_t)joints * sizeof(double));
    state.qvel[0] = 0.4;
    state.qvel[4] = 0.3;
    robot_sim_load(sim, &state, &nominal);
    for (int s = 0; s < 240; s++) {
        double torque[ROBOT_JOINTS_MAX];
        for (int i = 0; i < joints; i++) {
            torque[i] = 150 * (state.qpos[7 + i] - robot_sim_qpos(sim)[7 + i]) -
                        4 * robot_sim_qvel(sim)[6 + i];
        }
        assert_int_equal(robot_sim_step(sim, torque, NULL, terrain, ground), 0);
    }
}

static void falls_alike(MildModel model, const MildMap *map) {
    MildError error = {0};
    const MildMaterial material = matched(model, "sand_loose");
    MildTerrain terrain = mild_terrain_uniform(&material);
    terrain.map = map;
    MildGround *ground = new_ground();
    RobotSim *sim = robot_sim_create(robot, DT, &error);
    Twice twice = {.single = float_ground_create(robot, &error),
                   .scratch = mild_scratch_create(robot_soles(robot), robot_bodies(robot), &error),
                   .other = new_ground(),
                   .load = 9.81 * robot_total_mass(robot)};
    assert_true(sim && twice.single && twice.scratch);
    const RobotGround both = {solve_twice, &twice};
    robot_sim_set_ground(sim, &both);
    fall(sim, &terrain, ground);
    print_message("%-14s %d steps, %d touched, force %.1e, depth %.1e m, unsolved %d\n",
                  mild_model_names[model], twice.steps, twice.touched, twice.apart, twice.deep,
                  twice.unsolved);
    assert_true(twice.touched > 100);
    assert_int_equal(twice.unsolved, 0);
    assert_true(twice.apart < FORCE_BOUND && twice.deep < 1e-6);
    robot_sim_destroy(sim);
    float_ground_destroy(twice.single);
    mild_scratch_destroy(twice.scratch);
    free(twice.other);
    free(ground);
}

TEST(test_models) {
    for (int model = 0; model < MILD_MODEL_RIGID; model++) {
        falls_alike((MildModel)model, NULL);
    }
}

/* Rows of a whole block of floats and of half a block; some elements listed and all; slopes. */
TEST(test_soles) {
    static const int elements[] = {9, 16, 25, 40, 66};
    MildError error = {0};
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_WAVES;
    MildMap *map = mild_map_create(&def, &error);
    assert_non_null(map);
    for (size_t i = 0; i < sizeof elements / sizeof *elements; i++) {
        robot_set_model(robot, MILD_MODEL_MILD);
        assert_int_equal(robot_set_elements(robot, elements[i], &error), MILD_OK);
        falls_alike(MILD_MODEL_MILD, NULL);
        falls_alike(MILD_MODEL_MILD, map);
    }
    assert_int_equal(robot_set_elements(robot, 0, &error), MILD_OK);
    mild_map_destroy(map);
}

/* Half of the ways of a cycle: [m] along, across, up, [rad] pitch. */
typedef struct {
    double along, across, up, pitch;
} Cycle;

/* A foot that is pressed in by 6 mm and led round in the ground, whatever the ground does. Returns
 * the least work that a cycle has taken, over all that went to and fro in it. */
static double led(const MildTerrain *terrain, double turn, const Cycle *cycle) {
    MildError error = {0};
    MildGround *ground = new_ground();
    RobotGround *single = float_ground_create(robot, &error);
    static double held[36 * MILD_FEET_MAX * MILD_FEET_MAX]; /* A = 0 */
    MildContactInput input = {.feet = robot_bodies(robot), .dt = DT, .inverse_inertia = held};
    MildContactResult result;
    const double z = -mild_sole_z(robot_soles(robot)[0]);
    double least = INFINITY;
    assert_non_null(single);
    input.tolerance = FLOAT_GROUND_TOLERANCE;
    for (int f = 0; f < input.feet; f++) {
        memcpy(input.rotation[f], (const double[9]){1, 0, 0, 0, 1, 0, 0, 0, 1},
               sizeof input.rotation[f]);
        input.position[f][2] = f == 0 ? z : 1;
    }
    for (int n = 0; n < 10; n++) {
        double work = 0, size = 0;
        for (int s = 0; s < 80; s++) {
            const double angle = 2 * 3.14159265358979 * (s + 0.5) / 80, rate = 2 * 3.14159265 / 0.2;
            double *v = input.free_velocity;
            v[0] = cycle->along * rate * cos(angle + turn);
            v[1] = cycle->across * rate * sin(angle);
            v[2] = -cycle->up * rate * sin(angle) - (n == 0 ? 0.03 : 0);
            v[4] = 2 * cycle->pitch * rate * cos(2 * angle);
            single->solve(single->self, terrain, ground, &input, &result);
            const MildFootResult *foot = &result.foot[0];
            double power = 0;
            for (int k = 0; k < 3; k++) {
                power += foot->force[k] * (v[k] + input.velocity[0][k]) / 2 +
                         foot->torque[k] * (v[3 + k] + input.velocity[0][3 + k]) / 2;
                input.position[0][k] += DT * v[k];
            }
            assert_true(isfinite(power));
            work -= DT * power;
            size += DT * fabs(power);
            const double c = cos(DT * v[4]), d = sin(DT * v[4]), *R = input.rotation[0];
            const double next[9] = {
                c * R[0] + d * R[6], c * R[1] + d * R[7], c * R[2] + d * R[8], R[3], R[4], R[5],
                c * R[6] - d * R[0], c * R[7] - d * R[1], c * R[8] - d * R[2]};
            memcpy(input.rotation[0], next, sizeof next);
            memcpy(input.velocity[0], v, 6 * sizeof *v);
        }
        assert_true(size > 0);
        least = fmin(least, work / size);
    }
    float_ground_destroy(single);
    free(ground);
    return least;
}

TEST(test_passive) {
    for (int model = 0; model < MILD_MODEL_RIGID; model++) {
        for (int k = 0; k < 4; k++) {
            const MildMaterial material =
                matched((MildModel)model, k % 2 ? "foam45" : "sand_loose");
            const MildTerrain terrain = mild_terrain_uniform(&material);
            const Cycle wide = {2e-3, 1e-3, 4e-3, 0.0125}, small = {0, 0, 3e-5, 0};
            const double taken = led(&terrain, 1.57 * k, &wide);
            const double still = led(&terrain, 1.57 * k, &small);
            print_message("%-14s turn %d: takes %.2f of a wide cycle, %.1e of a small one\n",
                          mild_model_names[model], k, taken, still);
            assert_true(taken > 0.1);
            assert_true(still > -GAIN_BOUND);
        }
    }
}

static int setup(void **unused) {
    (void)unused;
    MildError error = {0};
    robot = robot_open("sa01", &error);
    assert_non_null(robot);
    return 0;
}

static int teardown(void **unused) {
    (void)unused;
    robot_destroy(robot);
    return 0;
}

TEST_MAIN(setup, teardown)
