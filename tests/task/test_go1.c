/* The task on a robot with four round feet: widths, and the mirror image. */
#include "base/random.h"
#include "env/task/task.h"
#include "robots.h"

#define GO1 MILD_SOURCE_DIR "/robots/go1"

enum {
    FEET = 4,
    JOINTS = 12,
    OBSERVATION = 9 + 3 * JOINTS + 2,
    ESTIMATES = 3 + 4 * FEET,
    CRITIC = OBSERVATION + ESTIMATES + 6 * FEET + 34
};

static Robot *robot;
static TaskDef def;
static TaskEnv *env;
static RobotSim *sim;
static float history[TASK_FRAMES * OBSERVATION], critic[CRITIC], estimate[ESTIMATES],
    frame[OBSERVATION];
static const EnvsView view = {history, critic, estimate, frame};

/* Joints and feet change sides; hip roll turns the other way. */
static const int other_joint[JOINTS] = {3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8};
static const double joint_sign[3] = {-1, 1, 1};

static int setup(void **unused) {
    (void)unused;
    MildError error = {0};
    robot = kit_robot(GO1);
    def = task_def_default();
    task_def_make_nominal(&def);
    def.observe_noise = 0;
    def.randomize.latency[0] = def.randomize.latency[1] = 0;
    def.randomize.initial_joint = def.randomize.initial_velocity = 0;
    sim = robot_sim_create(robot, def.physics_dt, &error);
    env = aligned_alloc(64, task_env_bytes(&def, robot));
    assert_non_null(sim);
    assert_non_null(env);
    MildMaterial sand = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&sand);
    task_env_init(env, &def, robot, 3, 0);
    env->command_frozen = 1;
    task_env_reset_on(env, &def, robot, sim, &terrain, 0, &view);
    return 0;
}

static int teardown(void **unused) {
    (void)unused;
    robot_sim_destroy(sim);
    free(env);
    robot_destroy(robot);
    return 0;
}

TEST(widths) {
    TaskShape shape = task_shape(&def, robot);
    assert_int_equal(shape.observation, OBSERVATION);
    assert_int_equal(shape.estimates, ESTIMATES);
    assert_int_equal(shape.critic, CRITIC);
    assert_int_equal(shape.actions, JOINTS);
}

static RobotState moving_state(uint32_t draw) {
    Random r = random_at(9, draw, 0);
    RobotState state = {.qpos = {0, 0, 0.4, 1, 0, 0, 0}};
    double length = 1;
    for (int k = 4; k < 7; k++) {
        state.qpos[k] = random_uniform(&r, -0.2, 0.2);
        length += state.qpos[k] * state.qpos[k];
    }
    for (int k = 3; k < 7; k++) {
        state.qpos[k] /= sqrt(length);
    }
    for (int i = 0; i < JOINTS; i++) {
        state.qpos[7 + i] = robot_default_pose(robot)[i] + random_uniform(&r, -0.3, 0.3);
    }
    for (int i = 0; i < 6 + JOINTS; i++) {
        state.qvel[i] = random_uniform(&r, -1, 1);
    }
    return state;
}

/* In the x-z plane, by hand. */
static RobotState mirrored(const RobotState *state) {
    RobotState image = *state;
    static const int odd_position[] = {1, 4, 6}, odd_speed[] = {1, 3, 5};
    for (int k = 0; k < 3; k++) {
        image.qpos[odd_position[k]] *= -1;
        image.qvel[odd_speed[k]] *= -1;
    }
    for (int i = 0; i < JOINTS; i++) {
        image.qpos[7 + i] = joint_sign[i % 3] * state->qpos[7 + other_joint[i]];
        image.qvel[6 + i] = joint_sign[i % 3] * state->qvel[6 + other_joint[i]];
    }
    return image;
}

static void look_at(const RobotState *state, double side, double phase, const float *action) {
    TaskSensors reading;
    const double command[3] = {0.6, 0.2 * side, -0.8 * side};
    task_env_set_state(env, state);
    const RobotVariation variation = task_env_variation(env);
    robot_sim_load(sim, state, &variation);
    memcpy(env->command_seen, command, sizeof command);
    memcpy(env->action[0], action, JOINTS * sizeof *action);
    env->phase = phase;
    task_read_imu(robot_sim_base_rotation(sim), robot_sim_qvel(sim), &reading);
    task_read_motors(robot_sim_qpos(sim) + 7, robot_sim_qvel(sim) + 6, &reading);
    task_env_observe(env, &def, robot, sim, &reading, 0, &view);
}

/* The frame of the mirrored robot is the mirrored frame, and the estimates' feet change sides. */
TEST(mirror_image) {
    const TaskMirror mirror = task_mirror(&def, robot);
    static const int other_foot[FEET] = {1, 0, 3, 2};
    for (uint32_t draw = 0; draw < 10; draw++) {
        RobotState state = moving_state(draw), image = mirrored(&state);
        float action[JOINTS], turned[JOINTS], first[OBSERVATION], truth[ESTIMATES];
        for (int i = 0; i < JOINTS; i++) {
            action[i] = 0.3f * (float)(i - 4);
        }
        for (int i = 0; i < JOINTS; i++) {
            turned[i] = (float)joint_sign[i % 3] * action[other_joint[i]];
            expect_entry("action", i, (double)turned[i],
                         (double)(mirror.action_sign[i] * action[mirror.action_index[i]]), 1e-5);
        }
        look_at(&state, 1, 0.2, action);
        memcpy(first, frame, sizeof first);
        memcpy(truth, estimate, sizeof truth);
        look_at(&image, -1, 0.7, turned);
        for (int i = 0; i < OBSERVATION; i++) {
            float wanted = mirror.observation_sign[i] * first[mirror.observation_index[i]];
            expect_entry("frame", i, (double)frame[i], (double)wanted, 1e-5);
        }
        for (int f = 0; f < FEET; f++) {
            for (int k = 0; k < 3; k++) {
                double wanted = (double)truth[3 + 3 * other_foot[f] + k];
                expect_entry("foot's velocity", 3 * f + k, (double)estimate[3 + 3 * f + k],
                             k == 1 ? -wanted : wanted, 1e-5);
            }
            int height = 3 + 3 * FEET;
            expect_entry("foot's height", f, (double)estimate[height + f],
                         (double)truth[height + other_foot[f]], 1e-5);
        }
    }
}

static const double ahead[TASK_COMMANDS] = {0.6}, still[TASK_COMMANDS] = {0};

static int stands_at(double phase, const double *command, int foot) {
    return task_gait_foot(&def, robot_table(robot), phase, command, foot).stance;
}

/* A trot: in each half of the gait one diagonal stands. */
TEST(diagonals_stand_together) {
    for (int half = 0; half < 2; half++) {
        for (int f = 0; f < FEET; f++) {
            int diagonal = f == 0 || f == 3; /* front left and rear right */
            assert_int_equal(stands_at(0.25 + 0.5 * half, ahead, f), diagonal == (half == 0));
            assert_true(stands_at(0.25 + 0.5 * half, still, f));
        }
    }
}

/* The reference motion shortens the swinging legs: both rear the foot towards the base. */
TEST(the_swing_lifts) {
    RobotState state = {.qpos = {0, 0, 1, 1, 0, 0, 0}};
    for (int i = 0; i < robot_joints(robot); i++) {
        state.qpos[7 + i] = task_gait_reference(&def, robot_table(robot), 0.25, ahead, i);
    }
    const RobotVariation variation = task_env_variation(env);
    robot_sim_load(sim, &state, &variation);
    for (int f = 0; f < FEET; f++) {
        double below = 1 - robot_sim_foot(sim, f)->position[2];
        int swings = !stands_at(0.25, ahead, f);
        double wanted = robot_stand_height(robot);
        print_message("foot %d %s: %.3f m below the base, %.3f m in the default pose\n", f,
                      swings ? "swings" : "stands", below, wanted);
        assert_true(swings ? below < wanted - 0.01 : fabs(below - wanted) < 1e-9);
    }
}

TEST_MAIN(setup, teardown)
