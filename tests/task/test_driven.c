/* Joints that something else moves, on robots/g1_29 (docs/task.md section 10): their goals and
 * speeds, which joint an action moves, what a policy sees and is paid for, the mirror image. */
#include "env/task/step.h"
#include "task_kit.h"

enum {
    JOINTS = 29,
    ACTIONS = 15,
    FRAME = 9 + 2 * JOINTS + ACTIONS + 2,
    LAST_ACTION = 9 + 2 * JOINTS
};
#define RANGE 0.6  /* [-] */
#define SPEED 1.5  /* [rad/s] */
#define SECONDS 60 /* of motion */

static int setup(void **unused) {
    (void)unused;
    MildError error = {0};
    robot = robot_create(MILD_SOURCE_DIR "/robots/g1_29", &error);
    expect_good(robot != NULL, &error);
    return 0;
}

static TaskDef moving_def(void) {
    TaskDef def = kit_quiet_def();
    def.driven_share = 1;
    def.driven_range = RANGE;
    def.driven_speed[0] = 0.5;
    def.driven_speed[1] = SPEED;
    return def;
}

/* [rad] Target of a joint. */
static double target_of(const Rig *rig, int joint) {
    const TaskGains gains = task_env_rest(rig->env)->gains;
    return task_motor(rig->env, &rig->def, robot_table(robot), &gains, joint).target[0];
}

/* A policy step's begin, without an action. */
static void move(Rig *rig) {
    static const float none[ACTIONS];
    task_begin_step(rig->env, &rig->def, robot_table(robot), none);
    rig->env->tick++;
}

TEST(widths) {
    const TaskDef def = moving_def();
    const TaskShape shape = task_shape(&def, robot);
    assert_true(robot_joints(robot) == JOINTS && robot_actions(robot) == ACTIONS);
    assert_true(shape.joints == JOINTS && shape.actions == ACTIONS && shape.observation == FRAME);
}

/* Targets stay in their share of the range, at most as fast as the highest speed, without jerks,
 * and come near goals all over it; after 3 s at the latest they go elsewhere. */
TEST(targets_move_within_bounds) {
    const TaskDef def = moving_def();
    const double *pose = robot_default_pose(robot);
    const double *low = robot_joint_low(robot), *high = robot_joint_high(robot);
    double before[JOINTS], speed[JOINTS] = {0}, least[JOINTS], most[JOINTS], fastest = 0;
    int still[JOINTS] = {0};
    Rig rig;
    rig_open(&rig, &def, 3, 0);
    rig_start(&rig, 0, 0, 0);
    for (int i = ACTIONS; i < JOINTS; i++) {
        before[i] = least[i] = most[i] = target_of(&rig, i);
        expect_near("begins there", rig.env->robot.qpos[7 + i], before[i], 1e-6);
    }
    for (int t = 0; t < SECONDS * 100; t++) {
        move(&rig);
        for (int i = ACTIONS; i < JOINTS; i++) {
            const double now = target_of(&rig, i), v = (now - before[i]) / TASK_PERIOD;
            assert_true(now > pose[i] + RANGE * (low[i] - pose[i]) - 1e-5);
            assert_true(now < pose[i] + RANGE * (high[i] - pose[i]) + 1e-5);
            assert_true(fabs(v) < SPEED + 1e-3);
            assert_true(fabs(v - speed[i]) < 2 * SPEED * TASK_PERIOD / DRIVEN_QUICKNESS + 1e-2);
            still[i] = fabs(v) < 1e-3 ? still[i] + 1 : 0;
            assert_true(still[i] <= 300);
            least[i] = fmin(least[i], now);
            most[i] = fmax(most[i], now);
            fastest = fmax(fastest, fabs(v));
            before[i] = now;
            speed[i] = v;
        }
    }
    assert_true(fastest > 0.95 * SPEED);
    for (int i = ACTIONS; i < JOINTS; i++) {
        assert_true(most[i] - least[i] > 0.6 * RANGE * (high[i] - low[i]));
    }
    rig_close(&rig);
}

/* Episodes in which they move are the share of the key; in the others they hold the pose. */
TEST(a_share_of_episodes_moves) {
    enum { EPISODES = 400 };
    TaskDef def = moving_def();
    int moving = 0;
    def.driven_share = 0.3;
    Rig rig;
    rig_open(&rig, &def, 3, 0);
    for (int n = 0; n < EPISODES; n++) {
        rig.env->tick = (uint32_t)n;
        rig_start(&rig, 0, 0, 0);
        int moves = 0;
        for (int t = 0; t < 320; t++) {
            move(&rig);
        }
        for (int i = ACTIONS; i < JOINTS; i++) {
            moves += target_of(&rig, i) != robot_default_pose(robot)[i];
        }
        assert_true(moves == 0 || moves == JOINTS - ACTIONS);
        moving += moves > 0;
    }
    expect_near("share", (double)moving / EPISODES, 0.3, 0.08);
    rig_close(&rig);
}

/* Action i is the target of joint i. Those of the driven joints do not hang on actions. */
TEST(actions_move_their_joints) {
    const TaskDef def = moving_def();
    const double *pose = robot_default_pose(robot), scale = 0.4;
    float action[2][ACTIONS];
    Rig rig[2];
    for (int k = 0; k < 2; k++) {
        rig_open(&rig[k], &def, 3, 0);
        rig_start(&rig[k], 0, 0, 0);
        for (int t = 0; t < 30; t++) {
            for (int i = 0; i < ACTIONS; i++) {
                action[k][i] = (float)(k ? 0.01 * i - 0.02 * t : 0.02 * i);
            }
            rig_step(&rig[k], action[k]);
        }
        for (int i = 0; i < ACTIONS; i++) {
            expect_near("own", target_of(&rig[k], i), pose[i] + scale * (double)action[k][i], 1e-6);
            expect_near("seen", (double)rig[k].frame[LAST_ACTION + i], (double)action[k][i], 0);
        }
    }
    for (int i = ACTIONS; i < JOINTS; i++) {
        assert_true(target_of(&rig[0], i) == target_of(&rig[1], i));
        assert_true(target_of(&rig[0], i) != pose[i]);
    }
    /* the joints follow: a torque towards the target moves the one that is named so */
    assert_string_equal(robot_joint_name(robot, ACTIONS), "left_shoulder_pitch_joint");
    for (int i = ACTIONS; i < JOINTS; i++) {
        expect_near("follows", rig[0].env->robot.qpos[7 + i], target_of(&rig[0], i), 0.35);
        expect_near("sees", (double)rig[0].frame[9 + i], rig[0].env->robot.qpos[7 + i] - pose[i],
                    1e-6);
    }
    rig_close(&rig[0]);
    rig_close(&rig[1]);
}

/* What driven joints do is not paid for. */
TEST(rewards_are_of_own_joints) {
    TaskDef def = moving_def();
    def.reward.weight[REWARD_power] = -1;
    Real terms[2][TASK_REWARD_COUNT];
    Rig rig;
    rig_open(&rig, &def, 3, 0);
    rig_start(&rig, 0, 0, 0);
    rig_step(&rig, (float[ACTIONS]){0});
    for (int n = 0; n < 3; n++) { /* as it is; a driven joint elsewhere; one of its own */
        TaskMotion m = {.def = &rig.def, .robot = robot_table(robot), .env = rig.env};
        memcpy(m.q, rig.env->robot.qpos + 7, sizeof m.q);
        const int other = n == 1 ? JOINTS - 1 : ACTIONS - 1;
        m.q[other] += n ? 0.3 : 0;
        m.qd[other] += n ? 2 : 0;
        m.torque[other] += n ? 4 : 0;
        task_reward(&m, terms[n > 0]);
        for (int i = 0; n > 0 && i < TASK_REWARD_COUNT; i++) {
            const int sees = i == REWARD_reference_motion || i == REWARD_default_pose ||
                             i == REWARD_torque || i == REWARD_joint_speed ||
                             i == REWARD_joint_acceleration || i == REWARD_power;
            assert_int_equal(terms[1][i] != terms[0][i], n == 2 && sees);
        }
    }
    rig_close(&rig);
}

/* The whole helping hand holds a robot that does nothing, whose base is a light pelvis, without
 * ringing from step to step of the physics. */
TEST(the_helping_hand_is_steady) {
    TaskDef def = moving_def();
    def.physics_dt = 0.005;
    def.assist = 1;
    def.driven_share = 0;
    double rate = 0;
    Rig rig;
    rig_open(&rig, &def, 3, 0);
    rig_start(&rig, 0, 0, 0);
    for (int t = 0; t < 50; t++) {
        rig_step(&rig, (float[ACTIONS]){0});
        rate = fmax(rate, fabs(rig.env->robot.qvel[4]));
    }
    assert_true(rate < 2);
    rig_close(&rig);
}

/* The image of the image is what it was; each joint's numbers are those of the joint on the other
 * side. */
TEST(mirror_image) {
    const TaskDef def = moving_def();
    const TaskMirror sides = task_mirror(&def, robot);
    const int starts[] = {9, 9 + JOINTS, LAST_ACTION};
    for (int i = 0; i < FRAME; i++) {
        const int other = sides.observation_index[i];
        assert_true(other >= 0 && other < FRAME && sides.observation_index[other] == i);
        assert_true(sides.observation_sign[i] * sides.observation_sign[other] == 1);
    }
    for (int block = 0; block < 3; block++) {
        for (int i = 0; i < (block < 2 ? JOINTS : ACTIONS); i++) {
            const int other = sides.observation_index[starts[block] + i] - starts[block];
            const char *name = robot_joint_name(robot, i);
            const char *image = robot_joint_name(robot, other);
            const int middle = strncmp(name, "waist", 5) == 0;
            const int turns = strstr(name, "roll") != NULL || strstr(name, "yaw") != NULL;
            assert_string_equal(strchr(image, '_'), strchr(name, '_'));
            assert_true(middle ? other == i : name[0] != image[0]);
            expect_near("sign", (double)sides.observation_sign[starts[block] + i], turns ? -1 : 1,
                        0);
            if (block == 2) {
                assert_int_equal(sides.action_index[i], other);
                assert_true(sides.action_sign[i] == sides.observation_sign[starts[2] + i]);
            }
        }
    }
    for (int k = FRAME - 2; k < FRAME; k++) { /* the clock, at the end */
        assert_true(sides.observation_index[k] == k && sides.observation_sign[k] == -1);
    }
}

TEST_MAIN(setup, kit_teardown)
