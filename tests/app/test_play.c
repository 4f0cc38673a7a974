/* A walk in a window, with a window of the test's own: what the keys ask for is what the policy is
 * commanded and what the picture shows, by sign, size and bounds. The clock goes with the frames.
 */
#include "app/play.h"
#include "base/clock.h"
#include "robots.h"
#include "sa01.h"

#define RATE 50.0 /* [1/s] frames: two policy steps each */
enum { FRAMES_MAX = 60 };

static WindowInput script[FRAMES_MAX]; /* what the window says after each frame */
static int frames, resets;
static double gain = -1; /* [-] task.speed_hold of the shipped policy; below 0: nobody walks */
static double now;       /* [s] */
static double shown[FRAMES_MAX + 1][3]; /* commands that the picture shows */
static double acted[FRAMES_MAX + 1][3]; /* commands that the policy last saw before a frame */
static double walked[FRAMES_MAX + 1];   /* [s] that the picture shows */
static double latest[3];
static View *const no_view = (View *)(void *)latest; /* never looked into */

WRAPS(clock_seconds);
double __wrap_clock_seconds(void) {
    return now;
}

WRAPS(view_observe);
void __wrap_view_observe(View *view, const RobotSim *sim) {
    assert_true(view == no_view && sim);
}

WRAPS(view_reset);
MildStatus __wrap_view_reset(View *view, const MildTerrain *terrain, MildError *error) {
    (void)error;
    assert_true(view == no_view && terrain);
    resets++;
    return MILD_OK;
}

WRAPS(view_frame);
void __wrap_view_frame(View *view, const RobotSim *sim, const ViewInfo *info) {
    assert_true(view == no_view && sim && frames <= FRAMES_MAX);
    memcpy(shown[frames], info->command, sizeof shown[0]);
    memcpy(acted[frames], latest, sizeof latest);
    walked[frames] = info->time;
}

WRAPS(view_show);
void __wrap_view_show(View *view, WindowInput *input) {
    assert_true(view == no_view);
    *input = script[frames++];
    input->time_scale = input->time_scale == 0 ? 1 : input->time_scale;
    now += 1 / RATE + 1e-9;
}

static void hold(void *self, int rows, TaskEnv *const *envs, float *actions) {
    assert_int_equal(rows, 1);
    memcpy(latest, envs[0]->command, sizeof latest);
    memset(actions, 0, sizeof *actions * (size_t) * (const int *)self);
}

static Controller policy;
static void walk_on(void *self, int rows, TaskEnv *const *envs, float *actions) {
    (void)self;
    memcpy(latest, envs[0]->command, sizeof latest);
    policy.act(policy.self, rows, envs, actions);
}

static const float *walk_estimates(void *self, int row) {
    (void)self;
    return policy.estimates(policy.self, row);
}

/* Plays the script's first `count` frames. */
static void play(int count) {
    MildError error = {0};
    TaskDef task = task_def_default();
    Scene scene;
    task_def_make_nominal(&task);
    task.speed_hold = fmax(gain, 0);
    Robot *robot = kit_robot(SA01);
    int joints = robot_joints(robot);
    Controller controller = {.self = &joints,
                             .name = "hold",
                             .act = gain < 0 ? hold : walk_on,
                             .estimates = gain < 0 ? NULL : walk_estimates};
    assert_int_equal(scene_make(&scene, "grass", 2, &error), MILD_OK);
    Play walk = {.task = &task,
                 .robot = robot,
                 .scene = &scene,
                 .controller = &controller,
                 .view = no_view,
                 .rate = RATE,
                 .seed = 1,
                 .window = 1};
    script[count - 1].quit = 1;
    frames = resets = 0;
    assert_int_equal(play_run(&walk, &error), MILD_OK);
    assert_int_equal(frames, count);
    robot_destroy(robot);
}

static void clear(void) {
    memset(script, 0, sizeof script);
}

/* NaN: any. */
static void expect_command(int frame, double forward, double left, double turn) {
    const double wanted[3] = {forward, left, turn};
    for (int c = 0; c < 3; c++) {
        const double off =
            fmax(fabs(shown[frame][c] - wanted[c]), fabs(acted[frame][c] - wanted[c]));
        if (off > 1e-9) {
            fail_msg("frame %d, part %d: the picture shows %g, the policy saw %g, asked was %g",
                     frame, c, shown[frame][c], acted[frame][c], wanted[c]);
        }
    }
}

/* Each part of the command by itself, both ways; what was asked stays, and what is asked adds up.
 * A command that came after a frame is seen by the second of its steps, so a frame later. */
TEST(keys_command) {
    clear();
    script[0].command[0] = 0.4;
    script[3].command[1] = 0.2;
    script[6].command[2] = -0.3;
    script[9].command[0] = -0.1;
    script[12].command[1] = -0.3;
    script[15].command[2] = 0.5;
    play(19);
    expect_command(3, 0.4, 0, NAN); /* the heading is held */
    expect_command(6, 0.4, 0.2, 0);
    expect_command(9, 0.4, 0.2, -0.3);
    expect_command(12, 0.3, 0.2, -0.3);
    expect_command(15, 0.3, -0.1, -0.3);
    expect_command(18, 0.3, -0.1, 0.2);
}

/* Until somebody steers, the task holds the heading, also where a key goes forward. */
TEST(the_heading_is_held_until_somebody_steers) {
    clear();
    script[0].command[0] = 0.2;
    script[10].command[2] = 0.1;
    script[13].command[2] = -0.1;
    play(16);
    double turned = 0;
    for (int f = 2; f <= 10; f++) {
        turned = fmax(turned, fabs(shown[f][2]));
        assert_true(fabs(shown[f][0] - 0.2) < 1e-9);
    }
    assert_true(turned > 1e-6); /* the start's heading is not quite ahead */
    expect_command(13, 0.2, 0, 0.1);
    expect_command(15, 0.2, 0, 0);
}

/* S stops; the bounds are the ranges that the policy was trained on. */
TEST(bounds_and_halt) {
    clear();
    for (int f = 0; f < 20; f++) {
        script[f].command[0] = 0.1, script[f].command[1] = 0.1, script[f].command[2] = 0.1;
    }
    script[22].halt = 1;
    for (int f = 26; f < 46; f++) {
        script[f].command[0] = -0.1, script[f].command[1] = -0.1, script[f].command[2] = -0.1;
    }
    play(49);
    expect_command(22, 1.3, 0.3, 0.8);
    expect_command(26, 0, 0, 0);
    expect_command(48, -1.3, -0.3, -0.8);
}

/* Space holds the time, = doubles it, R begins anew. */
TEST(time_of_the_walk) {
    clear();
    for (int f = 0; f < 30; f++) {
        script[f].paused = f >= 5 && f < 10;
        script[f].time_scale = f >= 10 && f < 15 ? 2 : f >= 15 && f < 20 ? 0.5 : 1;
    }
    script[25].reset = 1;
    play(30);
    const double frame = 1 / RATE;
    assert_true(fabs(walked[5] - 5 * frame) < 1e-6);
    assert_true(fabs(walked[10] - walked[5]) < 1e-9);
    assert_true(fabs(walked[15] - walked[10] - 10 * frame) < 1e-6);
    assert_true(fabs(walked[20] - walked[15] - 2.5 * frame) < 0.011);
    assert_int_equal(resets, 1);
    assert_true(fabs(walked[29] - 4 * frame) < 0.011);
}

/* The command that the shipped policy sees is corrected by what it has walked, by a fifth at most,
 * with task.speed_hold alone. R forgets. */
TEST(the_speed_is_held) {
    MildError error = {0};
    Robot *robot = kit_robot(SA01);
    const char *file = MILD_SOURCE_DIR "/policies/mild.safetensors";
    expect_good(controller_learned(file, robot, NULL, 1, &policy, &error) == MILD_OK, &error);
    for (int held = 0; held < 2; held++) {
        clear();
        script[0].command[0] = 0.4;
        for (int f = 0; f < 60; f++) {
            script[f].time_scale = 10;
        }
        script[55].reset = 1;
        gain = 0.1 * held;
        play(60);
        gain = -1;
        const double off = fabs(acted[55][0] - 0.4);
        assert_true(held ? off > 1e-4 && off < 0.08 : off < 1e-9);
        assert_true(fabs(acted[2][0] - 0.4) < 1e-9 && fabs(acted[58][0] - 0.4) < 1e-9);
        assert_true(fabs(shown[55][0] - acted[55][0]) < 1e-9);
    }
    controller_destroy(&policy);
    robot_destroy(robot);
}

TEST_MAIN(NULL, NULL)
