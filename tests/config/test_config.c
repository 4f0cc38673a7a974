/* Config files: layering, round trip, and one clear line for every mistake. */
#include "files.h"

#include "robots.h"
#include "run/config/experiment_keys.h"
#include "run/train/trainer.h"
#include "sa01.h"

typedef struct {
    double stiffness, pair[2];
    int count, on;
    uint64_t seed;
    char name[8];
} Sample;

static const MildField sample_fields[] = {
    MILD_FIELD(Sample, stiffness, MILD_FIELD_DOUBLE, 1, 0, 100, "[N/m] of a spring"),
    MILD_FIELD(Sample, pair, MILD_FIELD_DOUBLE, 2, -1, 1, "[m] low and high"),
    MILD_FIELD(Sample, count, MILD_FIELD_INT, 1, 1, 10, "[-] how many"),
    MILD_FIELD(Sample, on, MILD_FIELD_BOOL, 1, 0, 1, "[bool] switch"),
    MILD_FIELD(Sample, seed, MILD_FIELD_UINT64, 1, 0, 18446744073709551616.0, "[-] seed"),
    MILD_FIELD(Sample, name, MILD_FIELD_TEXT, 8, 0, 0, "[-] name"),
};
enum { SAMPLE_FIELDS = sizeof sample_fields / sizeof *sample_fields };

typedef struct {
    Sample sample;
    MildMaterial material;
    ConfigSection sections[2];
    MildError error;
} Fixture;

static Fixture fixture(void) {
    return (Fixture){.sample = {.stiffness = 1, .count = 2, .name = "a"},
                     .material = mild_material_default()};
}

static void bind(Fixture *f) {
    f->sections[0] = (ConfigSection){"sample", sample_fields, SAMPLE_FIELDS, &f->sample};
    f->sections[1] = ground_section(&f->material);
}

TEST(test_reads_every_type) {
    Fixture f = fixture();
    bind(&f);
    const char *text =
        "\xef\xbb\xbf; remark\n# remark, longer than any line inih takes: "
        "0123456789012345678901234567890123456789012345678901234"
        "567890123456789012345678901234567890123456789012345678901234567890123456789012345678901234"
        "56789012345678\n"
        "[sample]\n  stiffness = 2.5 ; remark\n\tpair: -0.5, 0.5 # remark\r\n"
        "count=7\r\r  on = true\rseed = 18446744073709551615\nname = sand\n[ground]\nk_pen=500";
    assert_int_equal(config_read_text(f.sections, 2, text, "x.ini", 0, &f.error), MILD_OK);
    assert_true(f.sample.stiffness == 2.5 && f.sample.pair[0] == -0.5 && f.sample.pair[1] == 0.5);
    assert_true(f.sample.count == 7 && f.sample.on == 1 && f.sample.seed == UINT64_MAX);
    assert_string_equal(f.sample.name, "sand");
    assert_true(f.material.k_pen == 500);
}

TEST(test_mistakes) {
    const struct {
        const char *text;
        MildStatus status;
        const char *names;
    } cases[] = {
        {"[sample]\nstifness = 2", MILD_ERROR_FORMAT, "x.ini:2 sample.stifness sample.stiffness"},
        {"[sample]\nk_pen = 2", MILD_ERROR_FORMAT, "x.ini:2 sample.k_pen ground.k_pen"},
        {"\n[sampel]\n", MILD_ERROR_FORMAT, "x.ini:2 sampel sample"},
        {"[sample]\ncount = 11", MILD_ERROR_RANGE, "x.ini:2 sample.count 11 1 10"},
        {"\r[sample] count = 1\r", MILD_ERROR_FORMAT, "x.ini:2 count = 1 [section]"},
        {"[sample]\ncount = 1.5", MILD_ERROR_ARGUMENT, "x.ini:2 sample.count 1.5"},
        {"[sample]\ncount =", MILD_ERROR_ARGUMENT, "x.ini:2 sample.count"},
        {"[sample]\nstiffness = nan", MILD_ERROR_ARGUMENT, "x.ini:2 sample.stiffness nan"},
        {"[sample]\nstiffness = 1e999", MILD_ERROR_RANGE, "x.ini:2 sample.stiffness inf"},
        {"[sample]\npair = 1", MILD_ERROR_ARGUMENT, "x.ini:2 sample.pair 1 2"},
        {"[sample]\nseed = -1", MILD_ERROR_ARGUMENT, "x.ini:2 sample.seed -1"},
        {"[sample]\nname = much too long", MILD_ERROR_RANGE, "x.ini:2 sample.name"},
        {"[sample]\ncount\n", MILD_ERROR_FORMAT, "x.ini:2"},
        {"[sample]\ncount\ncuont=1\n", MILD_ERROR_FORMAT, "x.ini:2"},
        {"[sample\ncount=1\n", MILD_ERROR_FORMAT, "x.ini:1 [section]"},
        {"count = 1\n", MILD_ERROR_FORMAT, "x.ini:1 [section]"},
        {"[sample]\ncount = 1\ncount = 1\n", MILD_ERROR_FORMAT, "x.ini:3 sample.count 2"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Fixture f = fixture();
        bind(&f);
        assert_refused(config_read_text(f.sections, 2, cases[i].text, "x.ini", 0, &f.error),
                       cases[i].status, &f.error, cases[i].names);
    }
}

TEST(test_long_line) {
    Fixture f = fixture();
    bind(&f);
    char text[400] = "[sample]\nname = ";
    memset(text + strlen(text), 'x', 300);
    assert_refused(config_read_text(f.sections, 2, text, "x.ini", 0, &f.error), MILD_ERROR_FORMAT,
                   &f.error, "x.ini:2");
}

TEST(test_missing_key_of_complete_file) {
    Fixture f = fixture();
    bind(&f);
    const char *text = "[sample]\nstiffness=1\npair=0 1\ncount=1\non=0\nseed=1\n";
    assert_refused(config_read_text(f.sections, 2, text, "x.ini", 1, &f.error), MILD_ERROR_FORMAT,
                   &f.error, "x.ini sample.name");
}

TEST(test_overrides) {
    Fixture f = fixture();
    bind(&f);
    const char *const good[] = {"sample.count=3", "ground.k_pen=600", "sample.count=4"};
    assert_int_equal(config_overrides(f.sections, 2, good, 3, &f.error), MILD_OK);
    assert_true(f.sample.count == 4 && f.material.k_pen == 600);
    const char *const bad[] = {"sample.count=99", "sample.cuont=1", "smaple.count=1",
                               "sample.=1",       ".count=1",       "sample.count"};
    const MildStatus status[] = {MILD_ERROR_RANGE,  MILD_ERROR_FORMAT, MILD_ERROR_FORMAT,
                                 MILD_ERROR_FORMAT, MILD_ERROR_FORMAT, MILD_ERROR_FORMAT};
    const char *const names[] = {
        "sample.count 1 10",   "sample.count",        "sample",
        "--section.key=value", "--section.key=value", "--section.key=value"};
    for (int i = 0; i < 6; i++) {
        char wanted[64];
        assert_int_equal(config_overrides(f.sections, 2, &bad[i], 1, &f.error), status[i]);
        snprintf(wanted, sizeof wanted, "--%s %s", bad[i], names[i]);
        assert_error(&f.error, status[i], wanted);
    }
    assert_int_equal(f.sample.count, 4);
}

TEST(test_round_trip) {
    Fixture f = fixture(), g = fixture();
    bind(&f);
    f.sample = (Sample){.stiffness = 0.1 + 0.2,
                        .pair = {-1.0 / 3, 1e-17},
                        .count = 9,
                        .on = 1,
                        .seed = UINT64_MAX,
                        .name = "sand"};
    f.material.sigma_cone = 123456.789012345678;
    for (int comments = 0; comments < 2; comments++) {
        char *text = config_text(f.sections, 2, comments);
        assert_non_null(text);
        bind(&g);
        assert_int_equal(config_read_text(g.sections, 2, text, "x.ini", 1, &g.error), MILD_OK);
        free(text);
        assert_memory_equal(&f.sample, &g.sample, sizeof f.sample);
        assert_memory_equal(&f.material, &g.material, sizeof f.material);
    }
}

/* The file is what the program prints: keys in order, their help with ranges, and the defaults, to
 * the letter. */
TEST(test_default_ini) {
    ExperimentDef def = experiment_def_default();
    ConfigSection sections[EXPERIMENT_SECTIONS];
    MildError error = {0};
    experiment_sections(&def, sections);
    char *ours = config_text(sections, EXPERIMENT_SECTIONS, 1);
    char *theirs = kit_read(MILD_SOURCE_DIR "/configs/default.ini", NULL);
    const char *below = strstr(theirs, "\n["); /* of the remarks at its head */
    if (!below || strcmp(ours, below + 1) != 0) {
        fail_msg("configs/default.ini differs from the defaults; regenerate with: build/mild info "
                 "config > configs/default.ini");
    }
    free(ours);
    free(theirs);
    assert_int_equal(experiment_check(&def, &error), MILD_OK);
}

TEST(test_keys_are_unique) {
    ExperimentDef def = experiment_def_default();
    ConfigSection sections[EXPERIMENT_SECTIONS];
    experiment_sections(&def, sections);
    for (int s = 0; s < EXPERIMENT_SECTIONS; s++) {
        for (int i = 0; i < sections[s].count; i++) {
            const MildField *first = mild_field_find(sections[s].fields, sections[s].count,
                                                     sections[s].fields[i].name, NULL);
            if (first != &sections[s].fields[i]) {
                fail_msg("key %s.%s stands twice", sections[s].name, first->name);
            }
        }
    }
}

TEST(test_layers) {
    char path[] = "/tmp/mild_test_XXXXXX";
    int file = mkstemp(path);
    assert_true(file >= 0);
    FILE *stream = fdopen(file, "w");
    fputs("[train]\nenvs = 8\nseed = 5\n[reward]\nslip = -0.5\n", stream);
    fclose(stream);
    ExperimentDef def = experiment_def_default();
    MildError error = {0};
    const char *const overrides[] = {"train.seed=6"};
    assert_int_equal(experiment_read(&def, path, overrides, 1, &error), MILD_OK);
    assert_true(def.train.envs == 8 && def.train.seed == 6 &&
                def.task.reward.weight[REWARD_slip] == -0.5);
    assert_int_equal(def.train.keep_checkpoints, train_def_default().keep_checkpoints);
    const char *const crossed[] = {"ppo.learning_rate_min=0.1", "ppo.learning_rate_max=0.01"};
    assert_refused(experiment_read(&def, path, crossed, 2, &error), MILD_ERROR_RANGE, &error,
                   "ppo.learning_rate_min");
    const char *const no_clock[] = {"policy.modulation_input=feet_phase", "task.clock=false"};
    assert_refused(experiment_read(&def, path, no_clock, 2, &error), MILD_ERROR_ARGUMENT, &error,
                   "policy.modulation_input task.clock");
    assert_int_equal(experiment_read(&def, path, no_clock, 1, &error), MILD_OK);
    assert_int_equal(def.policy.modulation_input, POLICY_INPUT_FEET_PHASE);
    remove(path);
}

/* configs/paper.ini against the paper: every number of its tables of rewards and of randomised
 * parameters, its implementation details, and nothing else but what is off. It trains, too. */

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
