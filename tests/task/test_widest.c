/* The widest robot that fits, four legs of ten hinges: every width is the greatest that the task
 * has room for, and it takes steps. */
#include <unistd.h>

#include "task_kit.h"

enum { LEGS = ROBOT_FEET_MAX, HINGES = ROBOT_JOINTS_MAX / ROBOT_FEET_MAX };

static const double offset_of[LEGS] = {0, 0.5, 0.25, 0.75}; /* [-] of the gait cycle */

static char folder[] = "/tmp/mild_widest_XXXXXX";
static char paths[2][64];

static void write_leg(FILE *file, int leg) {
    for (int i = 0; i < HINGES; i++) {
        fprintf(file,
                "<body name='b%d%d' pos='%g %g %g'><joint name='j%d%d' axis='%d %d 0'/>"
                "<geom type='capsule' size='0.02 0.02' mass='0.3' pos='0 0 -0.03'/>\n",
                leg, i, i ? 0.0 : leg / 2 - 0.5, i ? 0.0 : 0.2 - 0.4 * (leg % 2), i ? -0.06 : 0.0,
                leg, i, i == 0, i != 0);
    }
    for (int i = 0; i < HINGES; i++) {
        fputs("</body>", file);
    }
}

static void write_mjcf(const char *path) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs("<mujoco><default><joint range='-1 1' actuatorfrcrange='-40 40' armature='0.02'/>"
          "</default><worldbody><body name='torso' pos='0 0 1'><freejoint/>"
          "<geom name='trunk' type='box' size='0.5 0.2 0.1' mass='12'/>\n",
          file);
    for (int leg = 0; leg < LEGS; leg++) {
        write_leg(file, leg);
    }
    fputs("</body></worldbody></mujoco>\n", file);
    assert_int_equal(fclose(file), 0);
}

/* One value per joint, a leg a line. */
static void write_list(FILE *file, const char *key, const char *first, const char *others) {
    fprintf(file, "%s =", key);
    for (int i = 0; i < LEGS * HINGES; i++) {
        fprintf(file, "%s %s", i && i % HINGES == 0 ? "\n " : "", i % HINGES ? others : first);
    }
    fputc('\n', file);
}

static void write_names(FILE *file, const char *key, int other_side) {
    fprintf(file, "%s =", key);
    for (int i = 0; i < LEGS * HINGES; i++) {
        fprintf(file, "%s j%d%d", i && i % HINGES == 0 ? "\n " : "", (i / HINGES) ^ other_side,
                i % HINGES);
    }
    fputc('\n', file);
}

static void write_ini(const char *path) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs("[robot]\nname = widest\nmodel = widest.xml\nbase = torso\nshells = trunk\n"
          "height = 0.6\naction_scale = 0.1\nfeet_range = 0.2 0.5\nknee_range = 0.2 0.5\n"
          "feet_least = 0.1\nknee_least = 0.1\nfoot_force = 200\nassist = 100 10 50 20\n[joints]\n",
          file);
    write_names(file, "names", 0);
    write_names(file, "mirror", 1);
    write_list(file, "mirror_sign", "-1", "1");
    write_list(file, "pose", "0", "0");
    write_list(file, "swing", "-1", "0.5");
    write_list(file, "kp", "60", "60");
    write_list(file, "kd", "2", "2");
    for (int leg = 0; leg < LEGS; leg++) {
        fprintf(file,
                "[foot.f%d]\nbody = b%d9\nknee = b%d5\nmirror = f%d\noffset = %g\nshape = round\n"
                "center = 0 0 -0.06\nradius = 0.03\npitch = 0.01\n",
                leg, leg, leg, leg ^ 1, offset_of[leg]);
    }
    assert_int_equal(fclose(file), 0);
}

static int widest_setup(void **unused) {
    (void)unused;
    MildError error = {0};
    if (!mkdtemp(folder)) {
        return 1;
    }
    snprintf(paths[0], sizeof paths[0], "%s/widest.xml", folder);
    snprintf(paths[1], sizeof paths[1], "%s/robot.ini", folder);
    write_mjcf(paths[0]);
    write_ini(paths[1]);
    robot = robot_create(folder, &error);
    if (!robot) {
        fail_msg("%s", error.text);
    }
    mirror = task_mirror(robot);
    return 0;
}

static int widest_teardown(void **unused) {
    robot_destroy(robot);
    (void)unused;
    unlink(paths[0]);
    unlink(paths[1]);
    return rmdir(folder);
}

static void widths(void **unused) {
    (void)unused;
    TaskShape shape = task_shape(robot);
    assert_int_equal(shape.joints, ROBOT_JOINTS_MAX);
    assert_int_equal(shape.feet, ROBOT_FEET_MAX);
    assert_int_equal(shape.actions, ROBOT_JOINTS_MAX);
    assert_int_equal(shape.observation, TASK_OBSERVATION_MAX);
    assert_int_equal(shape.history, TASK_HISTORY_MAX);
    assert_int_equal(shape.estimates, TASK_ESTIMATES_MAX);
    assert_int_equal(shape.critic, TASK_CRITIC_MAX);
}

/* Twice mirrored is the same, in every entry. */
static void mirror_twice(void **unused) {
    (void)unused;
    for (int i = 0; i < TASK_OBSERVATION_MAX; i++) {
        int j = mirror.observation_index[i];
        assert_int_equal(mirror.observation_index[j], i);
        assert_true(mirror.observation_sign[i] * mirror.observation_sign[j] == 1);
    }
    for (int i = 0; i < ROBOT_JOINTS_MAX; i++) {
        assert_int_equal(mirror.action_index[i], (i / HINGES ^ 1) * HINGES + i % HINGES);
        assert_true(mirror.action_sign[i] == (i % HINGES ? 1 : -1));
    }
}

/* Stance in the half of the cycle after the foot's offset, swing in the other: h = apex sin(pi s);
 * all joints of a swinging leg bend by amplitude |sin| times `swing`. */
static void gait_of_any_offset(void **unused) {
    (void)unused;
    TaskDef def = task_def_default();
    int swings = 0;
    for (double phase = 0.003; phase < 1; phase += 0.0137) {
        double q[ROBOT_JOINTS_MAX];
        task_gait_reference(&def, robot, phase, 0, q);
        for (int f = 0; f < LEGS; f++) {
            double since =
                phase - offset_of[f] + (phase < offset_of[f]); /* cycles since touchdown */
            int swing = since >= 0.5;
            double wave = sin(2 * KIT_PI * since);
            double height = swing ? def.swing_apex * sin(KIT_PI * (since - 0.5) / 0.5) : 0;
            double bend = -wave >= def.double_support ? -wave * def.reward.reference_amplitude : 0;
            swings += swing;
            assert_int_equal(task_gait_stance(robot, phase, 0, f), !swing);
            expect_near("height", task_gait_height(&def, robot, phase, 0, f), height, 1e-12);
            assert_int_equal(task_gait_either(&def, robot, phase, 0, f),
                             fabs(wave) < def.double_support);
            assert_false(task_gait_either(&def, robot, phase, 1, f));
            assert_true(task_gait_stance(robot, phase, 1, f));
            for (int i = 0; i < HINGES; i++) {
                expect_entry("reference", f * HINGES + i, q[f * HINGES + i], (i ? 0.5 : -1) * bend,
                             1e-12);
            }
        }
    }
    assert_true(swings > 100);
}

/* Rows written end where they should: what lies behind them stays. */
static void steps(void **unused) {
    (void)unused;
    TaskDef def = kit_quiet_def();
    MildError error = {0};
    TaskEnv *env = aligned_alloc(64, task_env_bytes(&def, robot));
    RobotSim *sim = robot_sim_create(robot, def.physics_dt, &error);
    assert_non_null(env);
    assert_non_null(sim);
    static float rows[4][TASK_HISTORY_MAX + 1];
    const int width[4] = {TASK_HISTORY_MAX, TASK_CRITIC_MAX, TASK_ESTIMATES_MAX,
                          TASK_OBSERVATION_MAX};
    for (int k = 0; k < 4; k++) {
        for (int i = 0; i <= TASK_HISTORY_MAX; i++) {
            rows[k][i] = NAN;
        }
    }
    TaskView view = {rows[0], rows[1], rows[2], rows[3]};
    task_env_init(env, &def, robot, 1, 0);
    task_env_reset(env, &def, robot, sim, &view);
    double load = 0;
    for (int t = 0; t < 40; t++) {
        const float action[ROBOT_JOINTS_MAX] = {0};
        TaskStep step = task_env_step(env, &def, robot, sim, action, 0, &view, NULL);
        assert_true(step.valid);
        for (int f = 0; f < LEGS && t >= 30; f++) {
            load += robot_sim_foot(sim, f)->force[2] / 10 / (4 * robot_foot_load(robot));
        }
    }
    for (int k = 0; k < 4; k++) {
        for (int i = 0; i < width[k]; i++) {
            assert_true(isfinite(rows[k][i]));
        }
        assert_true(isnan(rows[k][width[k]]));
    }
    print_message("four feet carry %.2f of the weight\n", load);
    expect_near("load", load, 1, 0.3);
    robot_sim_destroy(sim);
    free(env);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(widths),
        cmocka_unit_test(mirror_twice),
        cmocka_unit_test(gait_of_any_offset),
        cmocka_unit_test(steps),
    };
    return cmocka_run_group_tests(tests, widest_setup, widest_teardown);
}
