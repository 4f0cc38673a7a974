/* The widest robot that fits, four legs of ten hinges: every width is the greatest that the task
 * has room for, and it takes steps. */
#include "task_kit.h"
#include "widest.h"

enum { LEGS = WIDEST_LEGS, HINGES = WIDEST_HINGES };

static TaskShape shape;

static int widest_setup(void **unused) {
    (void)unused;
    MildError error = {0};
    robot = widest_open(&error);
    expect_good(robot != NULL, &error);
    const TaskDef def = task_def_default();
    shape = task_shape(&def, robot);
    mirror = task_mirror(&def, robot);
    return 0;
}

static int widest_teardown(void **unused) {
    (void)unused;
    return widest_close(robot);
}

/* Twice mirrored is the same, in every entry. */
TEST(mirror_twice) {
    for (int i = 0; i < shape.observation; i++) {
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
static int check_gait(const TaskDef *def) {
    const double ahead[TASK_COMMANDS] = {0.6}, still[TASK_COMMANDS] = {0};
    int swings = 0;
    for (double phase = 0.003; phase < 1; phase += 0.0137) {
        double q[ROBOT_JOINTS_MAX];
        for (int i = 0; i < robot_joints(robot); i++) {
            q[i] = task_gait_reference(def, robot_table(robot), phase, ahead, i);
            assert_true(task_gait_reference(def, robot_table(robot), phase, still, i) == 0);
        }
        for (int f = 0; f < LEGS; f++) {
            double since =
                phase - widest_offset[f] + (phase < widest_offset[f]); /* cycles since touchdown */
            int swing = since >= 0.5;
            double wave = sin(2 * KIT_PI * since);
            double height = swing ? def->swing_apex * sin(KIT_PI * (since - 0.5) / 0.5) : 0;
            double bend =
                -wave >= def->double_support ? -wave * def->reward.reference_amplitude : 0;
            swings += swing;
            const TaskFoot foot = task_gait_foot(def, robot_table(robot), phase, ahead, f);
            const TaskFoot standing = task_gait_foot(def, robot_table(robot), phase, still, f);
            assert_int_equal(foot.stance, !swing);
            expect_near("height", foot.height, height, 1e-12);
            assert_int_equal(foot.either, fabs(wave) < def->double_support);
            assert_true(standing.stance && standing.height == 0 && !standing.either);
            for (int i = 0; i < HINGES; i++) {
                expect_entry("reference", f * HINGES + i, q[f * HINGES + i], (i ? 0.5 : -1) * bend,
                             1e-12);
            }
        }
    }
    return swings;
}

TEST(gait_of_any_offset) {
    TaskDef def = task_def_default();
    assert_true(check_gait(&def) > 100);
    def.swing_apex = 0.06;
    def.double_support = 0.6;
    def.reward.reference_amplitude = 0.26;
    assert_true(check_gait(&def) > 100);
}

/* Rows written end where they should: what lies behind them stays. */
TEST(steps) {
    TaskDef def = kit_quiet_def();
    MildError error = {0};
    TaskEnv *env = aligned_alloc(64, task_env_bytes(&def, robot));
    RobotSim *sim = robot_sim_create(robot, def.physics_dt, &error);
    assert_non_null(env);
    assert_non_null(sim);
    static float rows[4][TASK_HISTORY_MAX + 1];
    const int width[4] = {shape.history, shape.critic, shape.estimates, shape.observation};
    for (int k = 0; k < 4; k++) {
        for (int i = 0; i <= TASK_HISTORY_MAX; i++) {
            rows[k][i] = NAN;
        }
    }
    EnvsView view = {rows[0], rows[1], rows[2], rows[3]};
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
    expect_near("load", load, 1, 0.3);
    robot_sim_destroy(sim);
    free(env);
}

TEST_MAIN(widest_setup, widest_teardown)
