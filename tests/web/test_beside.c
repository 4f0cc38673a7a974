/* The core of the page, compiled for this machine, beside what it stands for: the batch engine on
 * the CPU, MuJoCo's robots on mild_ground_solve, and the policies on oneDNN. */
#include "page.h"

#include "ground/soil/soil.h"
#include "learn/network.h"

/* Weights of 16 bits are within 2^-11 of those of the file. */
static void policy_of(int which) {
    float worst = 0, largest = 0;
    choose(which);
    start(preset("sand_loose"), WEB_LEVEL, 0);
    for (int t = 0; t < 2 * SECOND; t++) {
        float mine[SA01_JOINTS], theirs[SA01_JOINTS];
        web_act(web_history(), mine);
        policy_act(policy, NULL, 1, web_history(), theirs, NULL, NULL);
        for (int i = 0; i < SA01_JOINTS; i++) {
            worst = fmaxf(worst, fabsf(mine[i] - theirs[i]));
            largest = fmaxf(largest, fabsf(theirs[i]));
        }
        assert_false(web_step(0.6f, 0, 0, 0));
    }
    printf("  %s: actions up to %.2f, apart by at most %.5f (bound 0.01)\n", pages[which].name,
           (double)largest, (double)worst);
    assert_true(worst < 0.01f && worst > 0);
}

TEST(test_policy) {
    for (int i = ROBOTS - 1; i >= 0; i--) {
        policy_of(i);
    }
}

/* Twins of the policy and of its file whose modulation reads the feet's heights and the clock too,
 * with this weight. */
static const float phase_weight = 1;
static const uint16_t phase_half = 0x3c00;

static Policy *phase_policy(const MlpLayer *narrow, const MlpLayer *wide, int64_t count,
                            const PolicyDef *def) {
    Policy *other = policy_create(def, 1, NULL);
    assert_non_null(other);
    const float *from = policy_parameters(policy);
    float *to = policy_parameters(other);
    memcpy(to, from, (size_t)narrow->weight * sizeof *to);
    memcpy(to + wide->bias, from + narrow->bias, (size_t)(count - narrow->bias) * sizeof *to);
    for (int j = 0; j < wide->out; j++) {
        for (int i = 0; i < wide->in; i++) {
            to[wide->weight + j * wide->in + i] =
                i < narrow->in ? from[narrow->weight + j * narrow->in + i] : phase_weight;
        }
    }
    return other;
}

static size_t phase_file(const Mlp *encoder, const MlpLayer *narrow, int in, WebModel *file) {
    const int more = (in - narrow->in) * narrow->out;
    const MlpLayer *last = &encoder->layer[encoder->layers - 1];
    const int64_t before = last->bias + last->out + (int64_t)narrow->in * narrow->out;
    const uint16_t *from = (const uint16_t *)(const void *)(model + 1);
    uint16_t *to = (uint16_t *)(void *)(file + 1);
    *file = *model;
    file->policy.modulation.width[0] = in;
    file->weights += more;
    memcpy(to, from, (size_t)before * sizeof *to);
    for (int i = 0; i < more; i++) {
        to[before + i] = phase_half;
    }
    memcpy(to + before + more, from + before, (size_t)(model->weights - before) * sizeof *to);
    return sizeof *file + (size_t)file->weights * sizeof *to;
}

TEST(test_policy_with_the_phase) {
    Network tight, phase;
    PolicyDef def = *policy_def(policy);
    WebModel *file = aligned_alloc(64, 2 << 20);
    float worst = 0, matters = 0;
    assert_non_null(file);
    assert_int_equal(network_layout(&tight, &def, NULL), MILD_OK);
    def.modulation_input = POLICY_INPUT_FEET_PHASE;
    assert_int_equal(network_layout(&phase, &def, NULL), MILD_OK);
    const MlpLayer *narrow = &tight.modulation.layer[0], *wide = &phase.modulation.layer[0];
    assert_int_equal(wide->in, 8 + 2);
    Policy *other = phase_policy(narrow, wide, tight.count, &def);
    assert_non_null(web_open(file, phase_file(&tight.encoder, narrow, 9, file)));
    assert_null(web_open(file, phase_file(&tight.encoder, narrow, wide->in, file)));
    assert_null(web_start(preset("sand_loose"), WEB_LEVEL, 0));
    for (int t = 0; t < SECOND / 4; t++) {
        float mine[SA01_JOINTS], theirs[SA01_JOINTS], usual[SA01_JOINTS];
        web_act(web_history(), mine);
        policy_act(other, NULL, 1, web_history(), theirs, NULL, NULL);
        policy_act(policy, NULL, 1, web_history(), usual, NULL, NULL);
        for (int i = 0; i < SA01_JOINTS; i++) {
            worst = fmaxf(worst, fabsf(mine[i] - theirs[i]));
            matters = fmaxf(matters, fabsf(usual[i] - theirs[i]));
        }
        web_step(0.6f, 0, 0, 0);
    }
    printf(
        "  with heights and clock: actions apart by at most %.1e (bound 1e-4), by %.2f without\n",
        (double)worst, (double)matters);
    assert_true(worst < 1e-4f && worst > 0 && matters > 0.1f);
    policy_destroy(other);
    free(file);
}

/* With the same actions the two see the same; the grounds' solvers differ by their tolerance, and
 * what differs grows with the gait. Under the Go1's round feet the batch's Newton steps end early
 * at some step, as mild/batch.h says; test_same_loads is about it. */
static void same_steps_of(int which) {
    static const float walk[TASK_COMMANDS] = {0.6f};
    const int grounds[] = {preset("sand_loose"), preset("foam45"), preset("grass"), WEB_RIGID};
    choose(which);
    for (size_t g = 0; g < sizeof grounds / sizeof *grounds; g++) {
        Rival rival = {0};
        double first = 0, worst = 0;
        start(grounds[g], WEB_LEVEL, 0);
        rival_start(&rival, grounds[g], 1, 0.6);
        for (int t = 0; t < 60; t++) {
            float action[SA01_JOINTS];
            web_act(rival.history, action);
            rival_step(&rival, action);
            assert_false(web_move(action, walk));
            const double now = apart(web_history(), rival.history);
            first = t == 0 ? now : first;
            worst = fmax(worst, now);
        }
        printf("  %s, ground %d: after a step %.1e apart (bound 2e-4), in 60 steps %.1e (bound "
               "0.02)\n",
               pages[which].name, grounds[g], first, worst);
        assert_true(first < 2e-4 && worst < 0.02);
        envs_destroy(rival.envs);
    }
}

TEST(test_same_steps) {
    same_steps_of(ON_G1);
    same_steps_of(ON_SA01);
}

/* The same beside MuJoCo's robot on mild_ground_solve: what feet and shells carry. The Go1's knees
 * stand in loose sand. */
static void same_loads_of(int which) {
    static const float walk[TASK_COMMANDS] = {0.6f};
    const int grounds[] = {preset("sand_loose"), preset("foam45"), preset("grass"), WEB_RIGID};
    choose(which);
    const double weight = 9.81 * robot_total_mass(robot);
    for (size_t g = 0; g < sizeof grounds / sizeof *grounds; g++) {
        Rival rival = {0};
        EnvsSample sample[16];
        double apart = 0, shells = 0;
        start(grounds[g], WEB_LEVEL, 0);
        rival_start_on(&rival, 0, grounds[g], 1, 0.6);
        envs_set_samples(rival.envs, sample);
        const EnvsSample *last = &sample[envs_physics_steps(rival.envs) - 1];
        for (int t = 0; t < 40; t++) {
            float action[SA01_JOINTS];
            web_act(rival.history, action);
            rival_step(&rival, action);
            assert_false(web_move(action, walk));
            web_show();
            for (int f = 0; f < web_view()->feet; f++) {
                const double load = (double)web_view()->load[f];
                apart = fmax(apart, fabs(load - last->foot[f].load) / weight);
            }
            const double load = (double)web_view()->shell_load;
            apart = fmax(apart, fabs(load - last->shell_load) / weight);
            shells = fmax(shells, load / weight);
        }
        printf(
            "  %s, ground %d: in 40 steps loads are %.1e of the weight apart (bound 0.01); shells "
            "carry up to %.2f of it\n",
            pages[which].name, grounds[g], apart, shells);
        assert_true(apart < 0.01);
        assert_true(shells > 0.1 || which != ON_GO1 || g > 0);
        envs_destroy(rival.envs);
    }
}

TEST(test_same_loads) {
    for (int i = ROBOTS - 1; i >= 0; i--) {
        same_loads_of(i);
    }
}

/* ---- a soil of another law ---- */

/* The merged law as grains of 5 mm have it, whose support slip takes away (lab/grains). */
static const char merged_soil[] =
    "[ground]\nmodel = mild_merged\nk_pen = 525\nsigma_cone = 224e3\nalpha = 0.3\n"
    "nu = 3.37\nc_g = 29.1\nc_d = 1\nphi = 0.59\nrho = 2500\nmu = 0.5\nk_drift = 400\n"
    "b_drift = 0.1\nrecovery = 0\nbed_depth = 1\npassive = true\nslip_length = 0.0014\n"
    "regain_length = 0.00039\ngrip = 0.125\nslip_growth = 0.07\nrefill = 0.22\n";

/* What the page and an engine differ by on a walk with the same actions. */
typedef struct {
    double first, worst; /* of the histories, after a step and in 60 */
    double load;         /* [-] of the feet's loads by the weight, in 40 */
} Beside;

/* The page on its own soil, an engine on a material. batch: as of rival_start_material. */
static Beside beside_soil(int batch, const MildMaterial *material) {
    static const float walk[TASK_COMMANDS] = {0.6f};
    const double weight = 9.81 * robot_total_mass(robot);
    Rival rival = {0};
    EnvsSample sample[16];
    Beside found = {0};
    start(WEB_OWN, WEB_LEVEL, 0);
    rival_start_material(&rival, batch, material, 0.6);
    envs_set_samples(rival.envs, sample);
    const EnvsSample *last = &sample[envs_physics_steps(rival.envs) - 1];
    for (int t = 0; t < 60; t++) {
        float action[SA01_JOINTS];
        web_act(rival.history, action);
        rival_step(&rival, action);
        assert_false(web_move(action, walk));
        web_show();
        const double now = apart(web_history(), rival.history);
        found.first = t == 0 ? now : found.first;
        found.worst = fmax(found.worst, now);
        for (int f = 0; f < web_view()->feet && t < 40; f++) {
            const double load = (double)web_view()->load[f];
            found.load = fmax(found.load, fabs(load - last->foot[f].load) / weight);
        }
    }
    envs_destroy(rival.envs);
    return found;
}

TEST(test_merged_soil_with_slip) {
    MildMaterial material;
    MildError error = {0};
    assert_int_equal(soil_parse(merged_soil, "soil.ini", &material, &error), MILD_OK);
    assert_int_equal(material.model, MILD_MODEL_MILD_MERGED);
    MildMaterial still = material, usual = material;
    still.slip_length = still.grip = 0;
    usual.model = MILD_MODEL_MILD;
    assert_int_equal(mild_material_check(&still, &error), MILD_OK);
    choose(ON_SA01);
    strcpy(web_text(), merged_soil);
    assert_null(web_open(model, model_bytes));
    assert_null(web_soil());
    const Beside batch = beside_soil(1, &material), mujoco = beside_soil(0, &material);
    const Beside slip = beside_soil(1, &still), law = beside_soil(1, &usual);
    printf("  the batch engine: after a step %.1e apart (bound 2e-4), in 60 steps %.1e (bound "
           "0.005); without slip %.2f, as mild %.2f\n",
           batch.first, batch.worst, slip.worst, law.worst);
    printf("  mild_ground_solve: in 40 steps loads are %.1e of the weight apart (bound 0.005); the "
           "batch engine without slip %.2f, as mild %.2f\n",
           mujoco.load, slip.load, law.load);
    assert_true(batch.first < 2e-4 && batch.worst < 0.005 && mujoco.load < 0.005);
    assert_true(fmin(slip.worst, law.worst) > 0.1 && fmin(slip.load, law.load) > 0.05);
}

/* ---- shells ---- */

/* Hip pitch, knee and ankle pitch of both legs, held from the start: the robot falls onto shanks or
 * base. */
typedef struct {
    const char *ground;
    float hip, knee, ankle; /* [-] actions */
    TaskEnd end;
} Fall;

/* What came of a fall. */
typedef struct {
    int steps;    /* policy steps until the end */
    int carried;  /* of these, with a load on the shells */
    double load;  /* [N s] sum of the load over the steps, times their length */
    double first; /* largest difference of the histories until two steps after the shells first
                     carried */
} Fallen;

static void fall(const Fall *def, Fallen *mine, Fallen *theirs) {
    static const float still[TASK_COMMANDS] = {0};
    float action[SA01_JOINTS] = {0};
    Rival rival = {0};
    EnvsSample sample[16];
    int end = TASK_END_time;
    for (int leg = 0; leg < 2; leg++) {
        action[6 * leg + 2] = def->hip;
        action[6 * leg + 3] = def->knee;
        action[6 * leg + 4] = def->ankle;
    }
    start(preset(def->ground), WEB_LEVEL, 0);
    rival_start(&rival, preset(def->ground), 1, 0);
    envs_set_samples(rival.envs, sample);
    const int last = envs_physics_steps(rival.envs) - 1;
    *mine = *theirs = (Fallen){0};
    while (mine->steps < 3 * SECOND && (!end || !rival.done)) {
        if (!rival.done) {
            rival_step(&rival, action);
            theirs->steps++;
            theirs->carried += sample[last].shell_load > 0;
            theirs->load += 0.01 * sample[last].shell_load;
        }
        if (!end) {
            end = web_move(action, still);
            mine->steps++;
            mine->carried += web_view()->shell_load > 0;
            mine->load += 0.01 * (double)web_view()->shell_load;
        }
        if (!end && !rival.done && theirs->carried < 3) {
            mine->first = fmax(mine->first, apart(web_history(), rival.history));
        }
    }
    printf(
        "  %s: carried %d of %d steps, %.1f N s, ends by %s; the batch engine %d of %d, %.1f N s,"
        " %s; apart by %.1e where shells touch down (bound 0.1)\n",
        def->ground, mine->carried, mine->steps, mine->load, task_end_names[end], theirs->carried,
        theirs->steps, theirs->load, task_end_names[rival.cause], mine->first);
    assert_int_equal(end, def->end);
    assert_int_equal(rival.cause, def->end);
    envs_destroy(rival.envs);
}

/* The ground carries shanks and base as it does in the batch engine, and ends the trial by the same
 * rule. On its knees the robot leaves much of its weight to the shanks. */
TEST(test_shells) {
    static const Fall falls[] = {
        {"foam28", -0.5f, 4, -2, TASK_END_tilt},
        {"foam28", -0.5f, 3, -2, TASK_END_base},
        {"foam45", -1, 4, -1, TASK_END_tilt},
        {"sand_loose", -0.5f, 3.5f, 0, TASK_END_base},
    };
    double most = 0;
    for (size_t i = 0; i < sizeof falls / sizeof *falls; i++) {
        Fallen mine, theirs;
        fall(&falls[i], &mine, &theirs);
        assert_true(theirs.carried > 5 && mine.carried > 5 && mine.first < 0.1);
        assert_true(abs(mine.steps - theirs.steps) <= 3);
        assert_true(fabs(mine.load / theirs.load - 1) < 0.05);
        most = fmax(most, mine.load / (0.01 * mine.carried));
    }
    const double weight = 9.81 * robot_total_mass(robot);
    printf("  shells carry up to %.0f N of %.0f N, mean of a fall\n", most, weight);
    assert_true(most > 0.5 * weight);
}

TEST_MAIN(setup, teardown)
