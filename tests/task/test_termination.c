/* What ends an episode, each cause alone and from both sides of its limit, and that nothing else
 * does. The robot falls limp through the air: it then neither turns nor bends. */
#include "sa01.h"
#include "task_oracle.h"

static int open_limp(void **state) {
    (void)state;
    TaskDef def = kit_quiet_def();
    rig_open(&rig, &def, 3, 0);
    rig_go_limp(&rig);
    rig_start(&rig, 0.5, 0, 0);
    return 0;
}

/* One step from this state at the given step of the episode. */
static TaskStep step_from(const RobotState *state, uint32_t step) {
    task_env_set_state(rig.env, state);
    rig.env->step = step;
    mild_ground_reset(task_env_ground(rig.env));
    return rig_step(&rig, NULL);
}

static void expect_end(const char *what, TaskStep step, int done, int timeout) {
    if (step.done != done || step.timeout != timeout || !step.valid) {
        fail_msg("%s: done %d timeout %d valid %d", what, step.done, step.timeout, step.valid);
    }
}

/* Both sides of a limit whose other side ends by `cause`. */
static void expect_cause(const char *what, TaskStep step, int done, TaskEnd cause) {
    expect_end(what, step, done, 0);
    if (step.cause != (done ? cause : TASK_END_time)) {
        fail_msg("%s: ended by %s instead of %s", what, task_end_names[step.cause],
                 task_end_names[cause]);
    }
}

static void expect_alive(const char *what, TaskStep step) {
    expect_end(what, step, 0, 0);
}

static void expect_fall(const char *what, TaskStep step) {
    expect_end(what, step, 1, 0);
}

/* Past the limit in every direction it is the end, short of it in none; heading does not matter. */
TEST_WITH(tilt, open_limp, close_rig) {
    rig.def.crossing_limit = -1; /* upside down the left foot is on the right */
    const double limits[] = {1.0, 0.4, 2.0};
    for (int l = 0; l < 3; l++) {
        rig.def.tilt_limit = limits[l];
        for (int k = 0; k < 4; k++) {
            int sign = k % 2 ? -1 : 1;
            for (int past = 0; past < 2; past++) {
                double angle = sign * (limits[l] + (past ? 0.01 : -0.01));
                RobotState state = kit_state(2);
                kit_turn(state.qpos, 0.7, k < 2 ? angle : 0, k < 2 ? 0 : angle);
                expect_cause(past ? "past the tilt limit" : "below the tilt limit",
                             step_from(&state, 10), past, TASK_END_tilt);
            }
        }
    }
}

/* [m] lowest point of a box geom above z = 0, from the file's shapes. */
static double lowest_of_box(const RobotState *state, const char *name) {
    const mjModel *m = robot_visual_model(robot);
    mjData *d = mj_makeData(m);
    memcpy(d->qpos, state->qpos, sizeof state->qpos);
    mj_kinematics(m, d);
    int geom = mj_name2id(m, mjOBJ_GEOM, name);
    assert_true(geom >= 0);
    double lowest = d->geom_xpos[3 * geom + 2];
    for (int k = 0; k < 3; k++) {
        lowest -= fabs(d->geom_xmat[9 * geom + 6 + k]) * m->geom_size[3 * geom + k];
    }
    mj_deleteData(d);
    return lowest;
}

/* Free fall: 10 ms at 0.1 m/s downward and gravity's share of 4 steps of 2.5 ms. */
#define FALL (0.01 * 0.1 + 9.81 * 0.0025 * 0.0025 * 10)

/* The box ends the step 1 mm above, or below, the ground at `height`. Legs that would reach the
 * ground earlier are folded up. */
static void touch(const RobotState *from, const char *box, double height, const char *what,
                  TaskEnd cause) {
    for (int past = 0; past < 2; past++) {
        RobotState state = *from;
        state.qvel[2] = -0.1;
        state.qpos[2] += height + FALL + (past ? -1e-3 : 1e-3) - lowest_of_box(&state, box);
        task_env_rest(rig.env)->terrain.height = height;
        expect_cause(what, step_from(&state, 10), past, cause);
    }
}

/* Hips and knees folded so that both feet are above the base. */
static RobotState folded(void) {
    RobotState state = kit_state(0);
    for (int leg = 0; leg < 2; leg++) {
        double *q = state.qpos + 7 + LEG_JOINTS * leg;
        q[HIP_PITCH] = -1.15;
        q[KNEE] = 0.02;
        q[ANKLE_PITCH] = 0;
    }
    return state;
}

TEST_WITH(base_touches, open_limp, close_rig) {
    rig.def.tilt_limit = 3.1;
    RobotState state = folded();
    kit_turn(state.qpos, 0.3, -1.0, 0.1); /* on its back, legs up */
    const char *others[] = {"leg_l4_link_box", "leg_r4_link_box"};
    for (int i = 0; i < 2; i++) {
        assert_true(lowest_of_box(&state, others[i]) > lowest_of_box(&state, "base_link_box"));
    }
    touch(&state, "base_link_box", 0, "base", TASK_END_base);
    touch(&state, "base_link_box", 0.3, "base on higher ground", TASK_END_base);
    for (int k = 0; k < 4; k++) {
        rig.def.shells_stand = k & 1;
        rig.env->variation.rigid = k >> 1;
        touch(&state, "base_link_box", 0, "base on either ground", TASK_END_base);
    }
}

/* One knee on the ground, the other leg stretched up and forward. */
static void shank_touches(int leg, const char *box) {
    open_limp(NULL);
    rig.def.crossing_limit = -1;
    RobotState state = kit_state(0);
    double *down = state.qpos + 7 + LEG_JOINTS * leg;
    double *up = state.qpos + 7 + LEG_JOINTS * (1 - leg);
    down[HIP_PITCH] = 0.3;
    down[KNEE] = 1.9; /* the shank points backward and up */
    down[ANKLE_PITCH] = 0;
    up[HIP_PITCH] = -1.15;
    up[KNEE] = 0.02;
    up[ANKLE_PITCH] = 0;
    kit_turn(state.qpos, -0.8, -0.2, 0.05);
    assert_true(lowest_of_box(&state, "base_link_box") > lowest_of_box(&state, box) + 0.1);
    rig.env->variation.rigid = 1;
    touch(&state, box, 0, box, TASK_END_shell);
    touch(&state, box, -0.2, box, TASK_END_shell);
    robot_set_shells(robot, 1);
    for (int depth = 0; depth < 2; depth++) { /* one that stands goes on, but the base does not */
        RobotState down = state;
        down.qvel[2] = -0.1;
        down.qpos[2] += FALL - 0.02 * depth - 1e-3 - lowest_of_box(&down, box);
        task_env_rest(rig.env)->terrain.height = 0;
        expect_cause("a shank that stands on rigid ground", step_from(&down, 10), 0,
                     TASK_END_shell);
    }
    robot_set_model(robot, MILD_MODEL_CON_CONE); /* has no shells that stand */
    touch(&state, box, 0, box, TASK_END_shell);
    robot_set_model(robot, MILD_MODEL_MILD);
    rig.env->variation.shells_stand = 0; /* they do not in this episode */
    touch(&state, box, 0, box, TASK_END_shell);
    rig.env->variation.shells_stand = 1;
    robot_set_shells(robot, 0);
    rig.env->variation.rigid = 0;
    for (int stand = 0; stand < 4;
         stand++) { /* soft ground it may be in, whether it stands or not */
        RobotState deep = state;
        robot_set_shells(robot, stand & 1);
        rig.env->variation.shells_stand = stand >> 1;
        deep.qvel[2] = -0.1;
        deep.qpos[2] += FALL - 0.1 - lowest_of_box(&deep, box);
        task_env_rest(rig.env)->terrain.height = 0;
        expect_cause("a shank in soft ground", step_from(&deep, 10), 0, TASK_END_shell);
    }
    robot_set_shells(robot, 0);
    rig_close(&rig);
}

TEST(shanks_touch) {
    shank_touches(0, "leg_l4_link_box");
    shank_touches(1, "leg_r4_link_box");
}

/* Feet on the wrong side of each other, or nearer than asked; knees do not count. */
TEST_WITH(crossing, open_limp, close_rig) {
    RobotState state = kit_state(2);
    kit_turn(state.qpos, 2.2, 0, 0);
    expect_alive("feet apart", step_from(&state, 10));
    kit_load(rig.sim, &state, rig.env);
    double apart = oracle_of(rig.sim).foot_distance;
    expect_near("distance of the feet in the default pose", apart, 0.1613, 1e-3);
    rig.def.crossing_limit = apart + 1e-3;
    expect_cause("nearer than the limit", step_from(&state, 10), 1, TASK_END_crossing);
    rig.def.crossing_limit = apart - 1e-3;
    expect_alive("further than the limit", step_from(&state, 10));
    rig.def.crossing_limit = 0;
    state.qpos[7 + HIP_ROLL] = -0.2;
    state.qpos[7 + LEG_JOINTS + HIP_ROLL] = 0.2;
    kit_load(rig.sim, &state, rig.env);
    assert_true(oracle_of(rig.sim).foot_distance < -0.05);
    expect_fall("crossed", step_from(&state, 10));
    rig.def.crossing_limit = -0.9;
    expect_alive("allowed to cross", step_from(&state, 10));
}

/* Beyond either end of its range by more than the margin, each joint alone. */
TEST_WITH(broken_joint, open_limp, close_rig) {
    rig.def.crossing_limit = -1;
    for (int k = 0; k < 4 * SA01_JOINTS; k++) {
        const int joint = k / 4, high = k / 2 % 2, past = k % 2;
        const double *limit = high ? robot_joint_high(robot) : robot_joint_low(robot);
        const double sign = high ? 1 : -1;
        RobotState state = kit_state(2);
        TaskStep step;
        /* the limit pushes back during the step: as far out as ends it where it must */
        double out = TASK_JOINT_BROKEN + (past ? 0.0 : -0.02);
        do {
            out += past ? 0.02 : 0;
            state.qpos[7 + joint] = limit[joint] + sign * out;
            step = step_from(&state, 10);
        } while (past && out < 2 &&
                 sign * (rig.env->robot.qpos[7 + joint] - limit[joint]) < TASK_JOINT_BROKEN);
        expect_cause(robot_joint_name(robot, joint), step, past, TASK_END_joint);
    }
}

/* 24 s are 2400 steps. A fall at the last step is a fall. */
TEST(timeout) {
    open_limp(NULL);
    RobotState state = kit_state(2);
    assert_int_equal(rig.env->step_limit, 2400);
    expect_alive("step 2399", step_from(&state, 2398));
    expect_end("step 2400", step_from(&state, 2399), 1, 1);
    kit_turn(state.qpos, 0, 1.2, 0);
    expect_fall("fallen at the last step", step_from(&state, 2399));
    rig_close(&rig);
    TaskDef def = kit_quiet_def();
    def.episode = 0.5;
    rig_open(&rig, &def, 3, 0);
    rig_start(&rig, 0, 0, 0);
    rig.def.assist = 0;
    int steps = 0;
    TaskStep step;
    do {
        step = rig_step(&rig, NULL);
        steps++;
    } while (!step.done);
    assert_int_equal(steps, 50);
    assert_true(step.timeout && step.cause == TASK_END_time);
    assert_int_equal(step.length, 50);
    rig_close(&rig);
}

/* What the learner must not learn from: no reward, no weight, not a time-out. The next observation
 * is that of a new episode. */
TEST(bad_numbers) {
    const double bad[] = {NAN, INFINITY, 2000};
    for (int i = 0; i < 3; i++) {
        rig_open_quiet(&rig, 0.5);
        const float action[SA01_JOINTS] = {0};
        rig.env->robot.qvel[8] = bad[i];
        rig.env->step = rig.env->step_limit - 1;
        TaskStep step =
            task_env_step(rig.env, &rig.def, robot, rig.sim, action, 1, &rig.view, NULL);
        assert_true(step.done && !step.valid && !step.timeout && step.reward == 0);
        assert_int_equal(step.cause, TASK_END_not_finite);
        assert_int_equal(rig.env->step, 0);
        for (int k = 0; k < SA01_HISTORY; k++) {
            assert_true(isfinite(rig.history[k]));
        }
        for (int k = 0; k < SA01_CRITIC; k++) {
            assert_true(isfinite(rig.critic[k]));
        }
        step = task_env_step(rig.env, &rig.def, robot, rig.sim, action, 1, &rig.view, NULL);
        assert_true(step.valid && !step.done);
        rig_close(&rig);
    }
}

/* Numbers that only the reward sees. */
TEST(bad_reward) {
    rig_open_quiet(&rig, 0.5);
    rig.env->smooth_velocity[0] = NAN;
    TaskStep step = rig_step(&rig, NULL);
    assert_true(step.done && !step.valid && !step.timeout && step.reward == 0);
    expect_near("sum", rig.env->reward_sum, 0, 0);
    rig_close(&rig);
}

/* Sums of the episode that ended, and a new one begun. */
TEST(report_of_an_episode) {
    rig_open_quiet(&rig, 0.5);
    rig.env->command_frozen = 0;
    const float action[SA01_JOINTS] = {0};
    double reward = 0, error = 0, terms[TASK_REWARD_COUNT] = {0}, before[TASK_REWARD_COUNT] = {0};
    rig.env->step_limit = 5;
    for (int t = 1; t <= 5; t++) {
        TaskStep step =
            task_env_step(rig.env, &rig.def, robot, rig.sim, action, t == 5, &rig.view, NULL);
        reward += (double)step.reward;
        if (t < 5) {
            error += hypot(rig.env->smooth_velocity[0] - 0.5, rig.env->smooth_velocity[1]);
            expect_near("running sum", rig.env->reward_sum, reward, 1e-9);
            expect_near("running error", rig.env->speed_error_sum, error, 1e-9);
            memcpy(before, terms, sizeof before);
            memcpy(terms, rig.env->term_sum, sizeof terms);
            assert_false(step.done);
            double sum = 0;
            for (int i = 0; i < TASK_REWARD_COUNT; i++) {
                sum += terms[i] - before[i];
            }
            expect_near("terms of a step", sum, (double)step.reward, 1e-7);
        } else {
            assert_true(step.done && step.timeout);
            assert_int_equal(step.length, 5);
            expect_near("reward", (double)step.episode_reward, reward, 1e-6);
            assert_true((double)step.episode_speed_error > 0.8 * error / 4);
            assert_true((double)step.episode_speed_error < 1.2 * error / 4);
            double sum = 0;
            for (int i = 0; i < TASK_REWARD_COUNT; i++) {
                sum += (double)step.episode_terms[i];
            }
            expect_near("terms", sum, reward, 1e-5);
            assert_int_equal(rig.env->step, 0);
            expect_near("the next episode's sum", rig.env->reward_sum, 0, 0);
            expect_near("the next episode's error", rig.env->speed_error_sum, 0, 0);
            expect_near("the next episode's terms", rig.env->term_sum[REWARD_orientation], 0, 0);
        }
    }
    assert_int_equal(rig.env->tick, 5);
    rig_close(&rig);
}

TEST_MAIN(kit_setup, kit_teardown)
