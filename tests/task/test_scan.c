/* The height scan against the ground read at points turned by hand: geometry, imprints, what is
 * old, noise, mirror image. */
#include "env/task/policy_keys.h"
#include "env/task/scan.h"
#include "task_kit.h"

/* 5 rows of 3 points: -0.2 .. 0.2 m along, -0.1 .. 0.1 m across. */
enum { COLUMNS = 3, POINTS = 15 };

static TaskDef scan_def(void) {
    TaskDef def = kit_quiet_def();
    def.scan = COLUMNS;
    def.scan_ahead[0] = -0.2;
    def.scan_ahead[1] = 0.2;
    def.scan_hold = 1;
    def.randomize.scan_delay[0] = def.randomize.scan_delay[1] = 0;
    return def;
}

static Rig rig;
static MildMap *map;

static void open_on_waves(TaskDef *def) {
    MildMapDef waves = mild_map_def_default();
    waves.kind = MILD_MAP_WAVES;
    waves.amplitude = 0.1;
    map = mild_map_create(&waves, NULL);
    assert_non_null(map);
    def->map = map;
    rig_open(&rig, def, 3, 0);
    rig_start(&rig, 0, 0, 0);
    task_env_rest(rig.env)->terrain.map = map;
    task_env_rest(rig.env)->terrain.map_x = 0.17;
}

static void close_all(void) {
    rig_close(&rig);
    mild_map_destroy(map);
    map = NULL;
}

static const float *seen(void) {
    return rig.history + rig.env->shape.history - POINTS;
}

static const float *truth(void) {
    return rig.critic + rig.env->shape.critic - POINTS;
}

/* Observes with the base at (x, y, z), turned by yaw, and leaning. */
static void look_from(double x, double y, double z, double yaw) {
    const TaskSensors none = {0};
    RobotState state = kit_state(z);
    state.qpos[0] = x;
    state.qpos[1] = y;
    kit_turn(state.qpos, yaw, 0.2, -0.1);
    kit_put(rig.env, state);
    task_env_load(rig.env, rig.sim);
    task_env_observe(rig.env, &rig.def, robot, rig.sim, &none, 0, &rig.view);
}

/* Of the surface at a point of the world, in the scan of a base at height z. */
static double number_at(double x, double y, double z) {
    const double height = mild_terrain_height_at(task_env_terrain(rig.env), x, y);
    return 5 * (height - (z - robot_nominal_height(robot)));
}

TEST(points_lie_ahead_and_left) {
    TaskDef def = scan_def();
    open_on_waves(&def);
    assert_int_equal(rig.env->shape.scan, POINTS);
    assert_int_equal(rig.env->shape.history, 6 * rig.env->shape.observation + POINTS);
    look_from(1.3, -0.7, 0.9, KIT_PI / 6); /* x axis (0.866025, 0.5), y axis (-0.5, 0.866025) */
    /* (0.2, 0.1): front left; (-0.2, -0.1): rear right; (0, 0.1) */
    const double x[3] = {1.3 + 0.1732051 - 0.05, 1.3 - 0.1732051 + 0.05, 1.3 - 0.05};
    const double y[3] = {-0.7 + 0.1 + 0.0866025, -0.7 - 0.1 - 0.0866025, -0.7 + 0.0866025};
    const int n[3] = {14, 0, 8};
    for (int i = 0; i < 3; i++) {
        expect_entry("critic", n[i], (double)truth()[n[i]], number_at(x[i], y[i], 0.9), 1e-5);
        expect_entry("policy", n[i], (double)seen()[n[i]], number_at(x[i], y[i], 0.9), 1e-5);
    }
    assert_true(fabs((double)(truth()[14] - truth()[8])) > 0.05);
    look_from(1.3, -0.7, 0.9 + 3, 0);
    assert_true(truth()[0] == -5); /* clipped */
    close_all();
}

/* A print of a foot: where it stood, the surface is lower by what does not spring back. */
TEST(prints_are_seen) {
    const TaskSensors none = {0};
    TaskDef def = scan_def();
    def.imprint_tiles = 128;
    def.scan_ahead[0] = -0.02;
    def.scan_ahead[1] = 0.02;
    def.scan_pitch = 0.02;
    def.scan = 21; /* to 0.2 m on either side */
    rig_open(&rig, &def, 3, 0);
    rig_start(&rig, 0, 0, 0);
    for (int t = 0; t < 12; t++) {
        rig_step(&rig, NULL);
    }
    const double *sole = robot_sim_foot(rig.sim, 0)->sole_center;
    const double left[2] = {sole[0], sole[1]};
    RobotState up = task_env_state(rig.env); /* it leaves the ground, and its prints */
    up.qvel[2] = 2;
    kit_put(rig.env, up);
    for (int t = 0; t < 10; t++) {
        rig_step(&rig, NULL);
    }
    const double print = mild_ground_imprint_at(task_env_ground(rig.env), left[0], left[1]);
    assert_true(print > 0.01);
    /* the middle of the rear row over the print */
    RobotState over = kit_state(1.2);
    over.qpos[0] = left[0] + 0.02;
    over.qpos[1] = left[1];
    kit_put(rig.env, over);
    task_env_load(rig.env, rig.sim);
    task_env_observe(rig.env, &rig.def, robot, rig.sim, &none, 0, &rig.view);
    const double level = 5 * (robot_nominal_height(robot) - 1.2);
    const double recovery = task_env_terrain(rig.env)->materials[0].recovery;
    const float *numbers = rig.critic + rig.env->shape.critic - rig.env->shape.scan;
    expect_near("over the print", (double)numbers[10], level - 5 * (1 - recovery) * print, 1e-5);
    expect_near("20 cm beside it", (double)numbers[20], level, 1e-5);
    rig.env->variation.rigid = 1; /* which keeps none */
    task_env_observe(rig.env, &rig.def, robot, rig.sim, &none, 0, &rig.view);
    expect_near("rigid", (double)numbers[10], level, 1e-5);
    rig_close(&rig);
}

/* With a delay of two steps and a scan in three, step n sees floor((n - 2)/3) 3, at first 0. */
TEST(scans_are_held_and_late) {
    static const int shown[10] = {0, 0, 0, 0, 0, 3, 3, 3, 6, 6};
    TaskDef def = scan_def();
    def.scan_hold = 3;
    open_on_waves(&def);
    rig.env->lag_scan = 2;
    float kept[10][POINTS];
    for (int t = 0; t < 10; t++) {
        look_from(0.11 * t, 0.05 * t, 0.9, 0.1 * t);
        memcpy(kept[t], truth(), sizeof kept[t]);
        for (int n = 0; n < POINTS; n++) {
            expect_entry("seen", n, (double)seen()[n], (double)kept[shown[t]][n], 1e-6);
        }
        assert_true(t == shown[t] || memcmp(kept[t], kept[shown[t]], sizeof kept[t]) != 0);
        rig.env->step++;
        rig.env->tick++;
    }
    close_all();
}

/* Bounds of the noise, one error of an episode, numbers that read 0; the critic sees the truth. */
TEST(noise_of_the_scan) {
    enum { LOOKS = 400 };
    TaskDef def = scan_def();
    def.observe_noise = 1;
    def.noise_q = def.noise_qd = def.noise_omega = def.noise_gravity = 0;
    def.randomize.scan_noise = 0.03;
    def.randomize.scan_drop = 0.2;
    open_on_waves(&def);
    rig.env->scan_offset = 0.04;
    int lost = 0, same = 0;
    double sum = 0, most = 0;
    float last[POINTS] = {0};
    for (int t = 0; t < LOOKS; t++) {
        look_from(0.3, 0.2, 1.2, 0.4); /* so high that no true number is 0 */
        for (int n = 0; n < POINTS; n++) {
            const double error = ((double)seen()[n] - (double)truth()[n]) / 5 - 0.04;
            assert_true(truth()[n] < -0.5f);
            same += seen()[n] == last[n] && seen()[n] != 0;
            last[n] = seen()[n];
            if (seen()[n] == 0) {
                lost++;
                continue;
            }
            sum += error;
            most = fmax(most, fabs(error));
        }
        rig.env->step++;
        rig.env->tick++;
    }
    const int kept = LOOKS * POINTS - lost;
    assert_true(most < 0.03 + 1e-6 && most > 0.0295);
    assert_true(fabs(sum / kept) < 4 * 0.03 / sqrt(3.0 * kept));
    assert_true(fabs(lost - 0.2 * LOOKS * POINTS) < 4 * sqrt(0.16 * LOOKS * POINTS));
    assert_true(same < 5); /* anew at every step */
    close_all();
}

/* What an episode draws. */
TEST(errors_of_an_episode) {
    TaskDef def = scan_def();
    def.randomize.scan_delay[0] = 0.02;
    def.randomize.scan_delay[1] = 0.06;
    def.randomize.scan_offset = 0.05;
    rig_open(&rig, &def, 3, 0);
    double most = 0;
    int count[7] = {0};
    for (uint32_t t = 0; t < 200; t++) {
        rig.env->tick = t;
        task_env_draw(rig.env, &rig.def, robot);
        assert_true(rig.env->lag_scan >= 2 && rig.env->lag_scan <= 6);
        count[rig.env->lag_scan]++;
        most = fmax(most, fabs(rig.env->scan_offset));
    }
    assert_true(most < 0.05 && most > 0.048);
    assert_true(count[2] > 0 && count[4] > 0 && count[6] > 0);
    rig_close(&rig);
}

/* The mirror image of a scan is the scan of the mirrored ground: left and right change places. */
TEST(mirror_of_the_scan) {
    const TaskDef def = scan_def();
    const TaskMirror sides = task_mirror(&def, robot);
    const int frame = task_shape(&def, robot).observation;
    static const int other[POINTS] = {2, 1, 0, 5, 4, 3, 8, 7, 6, 11, 10, 9, 14, 13, 12};
    for (int n = 0; n < POINTS; n++) {
        assert_int_equal(sides.observation_index[frame + n], frame + other[n]);
        assert_true(sides.observation_sign[frame + n] == 1);
    }
}

TEST(scans_that_are_too_large) {
    TaskDef def = scan_def();
    MildError error = {0};
    def.scan = 64;
    assert_refused(task_def_check(&def, &error), MILD_ERROR_RANGE, &error, "task.scan_pitch");
    assert_refused(task_def_check_plain(&def, "drive", &error), MILD_ERROR_ARGUMENT, &error,
                   "task.scan");
    def.scan = 0;
    assert_int_equal(task_def_check_plain(&def, "drive", &error), MILD_OK);
}

/* A policy's file brings its scan along. */
TEST(keys_of_the_scan) {
    const TaskDef def = scan_def();
    TaskDef other = task_def_default();
    char text[1024];
    MildError error = {0};
    task_policy_keys_print(&def, text, sizeof text);
    assert_int_equal(task_policy_keys_read(&other, text, &error), MILD_OK);
    assert_int_equal(task_shape(&other, robot).scan, POINTS);
    assert_true(other.scan_hold == 1 && other.scan_ahead[0] == -0.2);
}

TEST_MAIN(kit_setup, kit_teardown)
