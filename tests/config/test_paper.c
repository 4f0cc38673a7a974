/* configs/paper.ini against the paper: every number of its tables of rewards and of randomised
 * parameters, its implementation details, and nothing else but what is off. It trains, too. */
#include "robots.h"
#include "run/config/experiment_keys.h"
#include "run/train/trainer.h"
#include "sa01.h"

#define PAPER MILD_SOURCE_DIR "/configs/paper.ini"

/* Typed from the paper. */
static const char *const printed[] = {
    /* Table I, rewards */
    "reward.linear_velocity=1.4", "reward.tracking_sharpness=5", "reward.tracking_narrow=0",
    "reward.tracking_time=0.01", /* a policy step: not smoothed */
    "reward.yaw_rate=1.1", "reward.feet_clearance=2.4", "reward.clearance_form=error",
    "reward.gait=1.4", "reward.gait_form=sum", "task.double_support=0", "reward.slip=-0.1",
    "reward.base_acceleration=0.2", "reward.acceleration_form=linear",
    "reward.action_smoothness=-0.003",
    /* its rows that the source has as comments */
    "reward.feet_distance=0.2", "reward.default_pose=0.8", "reward.base_height=0.2",
    "reward.torque=-1e-10", "reward.joint_acceleration=-5e-9", "reward.collision=-1.0",
    /* Table II, randomised parameters; latencies in ms, the centre of mass in mm there */
    "randomize.alpha=0.698 1.310", "randomize.nu=0.8 2.4", "randomize.c_g=-1.4 4.6",
    "randomize.c_d=-6.0 28.0", "randomize.phi=0.50 0.64", "randomize.mu=0.2 1.3",
    "randomize.k_pen=8 1400", "randomize.sigma_cone=10000 240000", "randomize.base_mass=-4 4",
    "randomize.com_offset=6e-3", "randomize.latency=1e-3 10e-3", "randomize.motor_offset=0.035",
    "randomize.passive=false", "randomize.model=mild", "randomize.slip_share=0",
    /* sections II.C and III.A */
    "train.envs=4096", "train.iterations=20000", "train.minutes=0", "task.vx=0.0 1.2",
    "task.wz=-1.5 1.5", "task.kp=50 50 70 70 20 20", "task.kd=5 5 7 7 0.2 0.2",
    "task.torque_hold=true", "task.action_scale=1", "task.clock=false", "task.history_stride=1",
    "task.velocity_scale=1", "task.height_scale=1", "ppo.epsilon=0.3", "ppo.decoder_target=newest",
    "ppo.sample_latent=true",
    /* what it has not */
    "task.vy=0 0", "task.backward_share=0", "task.standing_share=0", "task.standing_below=0",
    "task.straight_share=0", "task.observe_noise=false", "task.assist=false",
    "task.action_clip=100", "task.torque_share=1", "ppo.mirror_weight=0", "ppo.mirror_share=0",
    "reward.clip_sum=false", "reward.reference_motion=0", "reward.knee_distance=0",
    "reward.orientation=0", "reward.air_time=0", "reward.base_motion=0", "reward.contact_force=0",
    "reward.joint_speed=0", "randomize.rigid_share=0", "randomize.preset_share=0",
    "randomize.patch_share=0", "randomize.sinkage_max=1", "randomize.recovery=1 1",
    "randomize.bed_depth=10 10", "randomize.link_mass=1 1", "randomize.armature=1 1",
    "randomize.gain=1 1", "randomize.strength=1 1", "randomize.push_interval=0",
    "randomize.push_linear=0", "randomize.push_angular=0", "randomize.initial_joint=0",
    "randomize.initial_velocity=0"};
enum { PRINTED = sizeof printed / sizeof *printed };

static ExperimentDef read_paper(void) {
    MildError error = {0};
    ExperimentDef def = experiment_def_default();
    expect_good(experiment_read(&def, PAPER, NULL, 0, &error) == MILD_OK, &error);
    return def;
}

static char *text_of(ExperimentDef *def) {
    ConfigSection sections[EXPERIMENT_SECTIONS];
    experiment_sections(def, sections);
    return config_text(sections, EXPERIMENT_SECTIONS, 0);
}

/* The defaults with the paper's numbers are the file, and the file has them all. */
TEST(the_file_is_the_paper) {
    MildError error = {0};
    ExperimentDef file = read_paper(), paper = experiment_def_default();
    expect_good(experiment_read(&paper, NULL, printed, PRINTED, &error) == MILD_OK, &error);
    char *ours = text_of(&file), *theirs = text_of(&paper);
    char *ours_rest, *theirs_rest;
    const char *a = strtok_r(ours, "\n", &ours_rest), *b = strtok_r(theirs, "\n", &theirs_rest);
    int lines = 0;
    for (; a && b; lines++) {
        if (strcmp(a, b) != 0) {
            fail_msg("configs/paper.ini has %s, the paper %s", a, b);
        }
        a = strtok_r(NULL, "\n", &ours_rest);
        b = strtok_r(NULL, "\n", &theirs_rest);
    }
    assert_true(!a && !b && lines > 100);
    free(ours);
    free(theirs);
}

/* Every key that the paper prints is named in the file, not left to a default. */
TEST(the_file_names_them) {
    for (int i = 0; i < PRINTED; i++) {
        const char *key = strchr(printed[i], '.') + 1;
        char name[64], line[512];
        int found = 0;
        snprintf(name, sizeof name, "%.*s = ", (int)strcspn(key, "="), key);
        FILE *file = fopen(PAPER, "r");
        assert_non_null(file);
        while (fgets(line, sizeof line, file)) {
            found += strncmp(line, name, strlen(name)) == 0;
        }
        fclose(file);
        if (found != 1) {
            fail_msg("configs/paper.ini has '%s' %d times", name, found);
        }
    }
}

/* 154 elements of 0.0195 m; gains for the six joints of each leg. */
TEST(the_robot_is_the_papers) {
    MildError error = {0};
    const double kp[6] = {50, 50, 70, 70, 20, 20}, kd[6] = {5, 5, 7, 7, 0.2, 0.2};
    TaskGains own;
    ExperimentDef def = read_paper();
    Robot *robot = kit_robot(SA01);
    int elements = 0;
    for (int f = 0; f < robot_feet(robot); f++) {
        elements += mild_sole_elements(robot_rasters(robot)[f]);
        assert_true(mild_sole_pitch(robot_rasters(robot)[f]) == 0.0195);
    }
    assert_int_equal(elements, 154);
    assert_int_equal(task_gains(&def.task, robot, &own, &error), MILD_OK);
    assert_int_equal(robot_joints(robot), 12);
    for (int i = 0; i < 12; i++) {
        assert_true(own.kp[i] == kp[i % 6] && own.kd[i] == kd[i % 6]);
    }
    robot_destroy(robot);
}

/* Two iterations, with both kinds of robots. */
TEST(it_trains) {
    const TrainRobots kinds[] = {TRAIN_ROBOTS_MUJOCO, TRAIN_ROBOTS_BATCH};
    for (int k = 0; k < 2; k++) {
        MildError error = {0};
        ExperimentDef def = read_paper();
        def.train.envs = 16;
        def.train.threads = 2;
        def.train.grounds = 32;
        def.train.robots = (int)kinds[k];
        Trainer *trainer = train_create(&def, &error);
        expect_good(trainer != NULL, &error);
        for (int i = 0; i < 2; i++) {
            TrainReport report;
            assert_int_equal(train_iterate(trainer, &report, &error), MILD_OK);
            assert_true(report.ppo.skipped == 0 && report.episodes.steps == 16 * def.ppo.steps);
        }
        train_destroy(trainer);
    }
}

TEST_MAIN(NULL, NULL)
