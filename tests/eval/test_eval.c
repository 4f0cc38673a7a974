/* Scenes by name, the heading hold, and trials: who falls, who does not, which random numbers. */
#include "eval_kit.h"

/* Errors say what is known, and a course has its bounds. */
TEST(courses_have_bounds) {
    Scene scene;
    MildError error = {0};
    char name[64], text[SCENE_NAME_SIZE + 80] = "rubber";
    assert_int_equal(scene_make(&scene, "rigid", 2, &error), MILD_OK);
    assert_true(scene.rigid);
    assert_int_equal(scene_make(&scene, "foam45+rigid+rubber", 2, &error), MILD_OK);
    assert_false(scene.rigid);
    assert_string_equal(scene_ground_at(&scene, 3, 0, name, sizeof name), "rigid");
    const MildMaterial *hard = &scene.terrain.materials[1], *rubber = &scene.terrain.materials[2];
    assert_int_equal(mild_material_check(hard, &error), MILD_OK); /* what stands in for rigid */
    assert_true(hard->k_pen > 50 * rubber->k_pen && hard->k_drift > 5 * rubber->k_drift);
    assert_refused(scene_make(&scene, "rubber+foam54", 2, &error), MILD_ERROR_ARGUMENT, &error,
                   "foam54 foam45");
    assert_int_not_equal(scene_make(&scene, "", 2, &error), MILD_OK);
    assert_int_not_equal(scene_make(&scene, "rubber+", 2, &error), MILD_OK);
    assert_int_not_equal(scene_make(&scene, "sand", 2, &error), MILD_OK);
    for (int i = 0; i < mild_material_preset_count(); i++) {
        assert_names(error.text, mild_material_preset_name(i));
    }
    for (int m = 0; m < MILD_MODELS; m++) {
        const char *const *presets = mild_model_info((MildModel)m)->presets;
        for (int k = 0; k < MILD_MODEL_PRESETS && presets[k]; k++) {
            assert_names(error.text, presets[k]);
        }
    }
    assert_error(&error, MILD_ERROR_ARGUMENT, "sand rigid");
    for (int i = 1; i < MILD_MATERIALS_MAX; i++) {
        strcat(text, "+grass");
    }
    assert_int_equal(scene_make(&scene, text, 1.5, &error), MILD_OK);
    assert_int_equal(scene.terrain.material_count, MILD_MATERIALS_MAX);
    assert_false(scene.rigid);
    assert_string_equal(scene.name, text);
    assert_string_equal(scene_ground_at(&scene, 1.6, 500, name, sizeof name), "grass");
    assert_string_equal(scene_ground_at(&scene, 1.6, -500, name, sizeof name), "grass");
    assert_string_equal(scene_ground_at(&scene, 1.4, -500, name, sizeof name), "rubber");
    assert_int_equal(mild_terrain_material_at(&scene.terrain, 2.9, 0), 1);
    assert_int_equal(mild_terrain_material_at(&scene.terrain, 3.1, 0), 2);
    assert_int_equal(scene_make(&scene, text, -1.5, &error), MILD_OK); /* backward */
    assert_int_equal(mild_terrain_material_at(&scene.terrain, -2.9, 0), 1);
    assert_int_equal(mild_terrain_material_at(&scene.terrain, -3.1, 0), 2);
    assert_int_equal(mild_terrain_material_at(&scene.terrain, -900, 0), MILD_MATERIALS_MAX - 1);
    assert_int_equal(mild_terrain_material_at(&scene.terrain, -1.4, 0), 0);
    assert_int_equal(mild_terrain_material_at(&scene.terrain, 900, 0), 0);
    strcat(text, "+grass");
    assert_refused(scene_make(&scene, text, 2, &error), MILD_ERROR_ARGUMENT, &error, "12");
    memset(text, 'x', sizeof text);
    text[sizeof scene.name] = 0;
    assert_refused(scene_make(&scene, text, 2, &error), MILD_ERROR_ARGUMENT, &error, "ground");
    text[sizeof scene.name - 1] = 0;
    assert_refused(scene_make(&scene, text, 2, &error), MILD_ERROR_ARGUMENT, &error,
                   "ground rigid");
}

/* Turns back to world x by 1 rad/s per radian, at most 0.5 rad/s, and not while standing. */
TEST(heading_is_held) {
    static const double yaw[5] = {0, 0.2, -0.3, 1, -3}, wz[5] = {0, -0.2, 0.3, -0.5, 0.5};
    static TaskEnv env;
    for (int i = 0; i < 5; i++) {
        for (int tilted = 0; tilted < 2; tilted++) { /* pitch does not change the heading */
            double pitch = tilted ? 0.4 : 0, *q = env.robot.qpos + 3;
            q[0] = cos(0.5 * yaw[i]) * cos(0.5 * pitch);
            q[1] = -sin(0.5 * yaw[i]) * sin(0.5 * pitch);
            q[2] = cos(0.5 * yaw[i]) * sin(0.5 * pitch);
            q[3] = sin(0.5 * yaw[i]) * cos(0.5 * pitch);
            env.command_frozen = 0;
            env.command[1] = 3;
            eval_command(&env, -0.7, 0);
            assert_int_equal(env.command_frozen, 1);
            assert_true(env.command[0] == -0.7 && env.command[1] == 0);
            assert_true(fabs(env.command[2] - wz[i]) < 1e-12);
            eval_command(&env, 0, 0.2);
            assert_true(env.command[0] == 0 && env.command[1] == 0.2);
            assert_true(fabs(env.command[2] - wz[i]) < 1e-12);
            eval_command(&env, 0, 0);
            assert_true(env.command[0] == 0 && env.command[1] == 0 && env.command[2] == 0);
        }
    }
}

/* The paper's gains do not balance (docs/task.md section 3): a policy of zeros must fall, and be
 * counted as fallen. What it was asked is written down. */
typedef struct {
    int calls, rows, moving; /* moving: calls that command row 0 to move */
    double command[3];       /* of row 0 at the last call */
    double most_turn;        /* largest |wz| asked of any row */
} Zero;

static void zero_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    Zero *zero = self;
    zero->calls++;
    zero->rows = rows;
    memcpy(zero->command, envs[0]->command, sizeof zero->command);
    zero->moving += envs[0]->command[0] != 0 && envs[0]->command[1] != 0;
    for (int i = 0; i < rows; i++) {
        zero->most_turn = fmax(zero->most_turn, fabs(envs[i]->command[2]));
    }
    memset(actions, 0, sizeof *actions * (size_t)rows * SA01_JOINTS);
}

static EvalRow run(Zero *zero, const char *ground, EvalDef eval, int threads) {
    MildError error = {0};
    *zero = (Zero){0};
    Controller controller = {.self = zero, .name = "zero", .act = zero_act};
    Pool *pool = pool_create(threads);
    Scene scene;
    EvalRow row;
    memset(&row, 0xff, sizeof row);
    assert_int_equal(scene_make(&scene, ground, 2, &error), MILD_OK);
    assert_int_equal(kit_run(&def, pool, &controller, &scene, &eval, &row, &error), MILD_OK);
    pool_destroy(pool);
    return row;
}

TEST(zero_action_falls_and_is_counted) {
    Zero zero;
    EvalDef eval = {.speed = 0.3, .trials = 4, .seconds = 6, .seed = 1};
    EvalRow first = run(&zero, "foam28", eval, 1), again = run(&zero, "foam28", eval, 2);
    char line[256];
    eval_print_row(&first, line, sizeof line);
    printf("%s\n", line);
    assert_int_equal(zero.calls, 600);
    assert_int_equal(zero.rows, 4);
    assert_true(zero.command[0] == 0.3 && zero.command[1] == 0);
    assert_true(zero.most_turn > 0 && zero.most_turn <= 0.5);
    assert_string_equal(first.ground, "foam28");
    assert_true(first.speed == 0.3 && first.trials == 4);
    assert_int_equal(first.success, 0);
    assert_true(first.seconds > 0.2 && first.seconds < 6);
    assert_true(first.torque_max > 0 && first.torque_max <= 0.85 * 140 + 1e-9);
    assert_memory_equal(&first, &again, sizeof first);
}

/* Nobody falls within 0.3 s: all trials succeed and last as long as asked; another seed, another
 * ground and one trial less give other numbers. */
TEST(short_trials_succeed) {
    Zero zero;
    EvalDef eval = {.speed = 0, .trials = 2, .seconds = 0.3, .seed = 1}, other = eval, one = eval;
    EvalRow row = run(&zero, "rubber", eval, 1);
    assert_int_equal(zero.calls, 30);
    assert_int_equal(row.success, 2);
    assert_true(fabs(row.seconds - 0.3) < 1e-9 && row.measured == 0 && row.torque_deviation > 0);
    const double unmeasured[] = {
        row.velocity,          row.velocity_low,  row.velocity_high, row.velocity_deviation,
        row.velocity_sideways, row.velocity_turn, row.cot,           row.cot_deviation,
        row.base_oscillation};
    for (size_t i = 0; i < sizeof unmeasured / sizeof *unmeasured; i++) {
        assert_true(isnan(unmeasured[i]));
    }
    char line[256];
    eval_print_row(&row, line, sizeof line);
    assert_non_null(strstr(line, "- +-     -     -")); /* no speed, no cost */
    assert_true(row.energy > 0 && row.penetration > 1e-4 && row.drift > 0);
    other.seed = 2;
    one.trials = 1;
    assert_true(run(&zero, "rubber", other, 1).energy != row.energy);
    const EvalRow alone = run(&zero, "rubber", one, 1);
    assert_true(alone.energy != row.energy && isnan(alone.torque_deviation));
    EvalRow hard = run(&zero, "rigid", eval, 1);
    assert_true(hard.penetration == 0 && hard.success == 2 && hard.energy > 0);
    assert_true(run(&zero, "sand_loose", eval, 1).penetration > 2 * row.penetration);
}

/* From `stop` on nothing is commanded. */
TEST(stopped_trials_get_the_command_to_stand) {
    Zero zero;
    EvalDef eval = {.speed = 0.3, .sideways = 0.1, .trials = 1, .seconds = 0.3, .seed = 1};
    run(&zero, "rubber", eval, 1);
    assert_true(zero.command[0] == 0.3 && zero.command[1] == 0.1 && zero.moving == 30);
    eval.stop = 0.2;
    run(&zero, "rubber", eval, 1);
    assert_true(zero.command[0] == 0 && zero.command[1] == 0 && zero.command[2] == 0);
    assert_int_equal(zero.moving, 20);
}

/* Told to turn, a robot is neither held on its heading nor asked to stand. */
TEST(turning_is_asked_for) {
    Zero zero;
    EvalDef eval = {.speed = 0.3, .turn = 0.4, .trials = 3, .seconds = 0.3, .seed = 1};
    EvalRow row = run(&zero, "rubber", eval, 1);
    assert_true(zero.command[0] == 0.3 && zero.command[2] == 0.4 && zero.most_turn == 0.4);
    assert_true(row.turn == 0.4);
    eval.speed = 0;
    run(&zero, "rubber", eval, 1);
    assert_true(zero.command[0] == 0 && zero.command[2] == 0.4);
    eval.stop = 0.2;
    run(&zero, "rubber", eval, 1);
    assert_true(zero.command[2] == 0);
}

/* As many steps as come nearest to the time. */
TEST(time_is_rounded_to_steps) {
    static const double seconds[4] = {0.29, 0.2949, 0.2955, 0.3}; /* 0.29/0.01 is below 29 */
    static const int steps[4] = {29, 29, 30, 30};
    for (int i = 0; i < 4; i++) {
        Zero zero;
        EvalDef eval = {.trials = 1, .seconds = seconds[i], .seed = 1};
        run(&zero, "rubber", eval, 1);
        assert_int_equal(zero.calls, steps[i]);
    }
}

static void measure_one(void *measure, const TaskEnv *env, const RobotSim *sim,
                        const double *torque) {
    measure_step(measure, env, sim, torque);
}

/* A trial stepped here, with every number of the row: the second one, its command from the first
 * step on until the stop, up to which speed and cost count, in one episode however short the task's
 * is, weighed at 9.81 m/s^2. */
TEST(a_row_is_what_its_trials_did) {
    MildError error = {0};
    TaskDef shorter = def, longer = def;
    shorter.episode = 1;
    assert_true(def.speed_hold > 0); /* as the file of the policy says */
    shorter.speed_hold = 0;          /* as in the loop below */
    longer.episode = 3.5;
    const EvalDef eval = {
        .speed = 0.5, .sideways = 0.05, .trials = 2, .seconds = 3.5, .stop = 2.995, .seed = 7};
    Controller controller;
    assert_int_equal(controller_learned(POLICY, robot, NULL, 2, &controller, &error), MILD_OK);
    Scene scene;
    assert_int_equal(scene_make(&scene, "foam60", 2, &error), MILD_OK);
    Pool *pool = pool_create(1);
    EvalRow row, own;
    assert_int_equal(kit_run(&shorter, pool, &controller, &scene, &eval, &row, &error), MILD_OK);
    pool_destroy(pool);

    Measure measure[2];
    uint8_t over[2] = {0};
    RobotSim *sim = robot_sim_create(robot, def.physics_dt, &error);
    assert_non_null(sim);
    for (uint32_t i = 0; i < 2; i++) {
        const EnvsView none = {0};
        TaskEnv *env = aligned_alloc(64, task_env_bytes(&longer, robot));
        assert_non_null(env);
        task_env_init(env, &longer, robot, 7, i);
        eval_command(env, 0.5, 0.05);
        task_env_reset_on(env, &longer, robot, sim, &scene.terrain, 0, &none);
        measure_start(&measure[i], longer.physics_dt);
        measure[i].steady_end = eval.stop;
        for (int k = 1; k <= 350; k++) {
            float action[SA01_JOINTS];
            const TaskCallback callback = {measure_one, &measure[i], NULL};
            controller.act(controller.self, 1, &env, action);
            const TaskStep step =
                task_env_step(env, &longer, robot, sim, action, 0, &none, &callback);
            assert_false(step.done && !step.timeout);
            eval_command(env, k < 300 ? 0.5 : 0, k < 300 ? 0.05 : 0);
        }
        free(env);
    }
    robot_sim_destroy(sim);
    controller_destroy(&controller);
    eval_summarise(&own, "foam60", &eval, measure, over, robot_total_mass(robot) * 9.81, NULL);
    assert_true(row.success == 2 && row.velocity > 0.3 && row.cot > 0.1);
    assert_true(fabs(row.velocity / own.velocity - 1) < 1e-5);
    assert_true(fabs(row.velocity_sideways - own.velocity_sideways) < 1e-5);
    assert_true(fabs(row.cot / own.cot - 1) < 1e-5);
    assert_true(fabs(row.energy / own.energy - 1) < 1e-5 && row.seconds == own.seconds);
}

/* ---- pushes ---- */

enum { PUSHED = 5, PUSH_STEPS = 420, SIDES = 5 };

#define TURN 6.283185307179586

/* A controller that notes the base's speed before it acts. */
typedef struct {
    Controller inner;
    int step;
    double speed[PUSHED][PUSH_STEPS][2];
} Noting;

static void noting_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    Noting *noting = self;
    for (int i = 0; i < rows; i++) {
        memcpy(noting->speed[i][noting->step], envs[i]->robot.qvel, 2 * sizeof(double));
    }
    noting->step++;
    noting->inner.act(noting->inner.self, rows, envs, actions);
}

static Noting noted[2];

static void walk_pushed(Noting *noting, double push, uint64_t seed) {
    MildError error = {0};
    *noting = (Noting){.step = 0};
    const EvalDef eval = {
        .speed = 0.3, .push = push, .trials = PUSHED, .seconds = PUSH_STEPS * 0.01, .seed = seed};
    Scene scene;
    EvalRow row;
    Pool *pool = pool_create(2);
    assert_int_equal(scene_make(&scene, "rubber", 2, &error), MILD_OK);
    assert_int_equal(controller_learned(POLICY, robot, pool, PUSHED, &noting->inner, &error),
                     MILD_OK);
    Controller controller = {.self = noting, .name = "noting", .act = noting_act};
    assert_int_equal(kit_run(&def, pool, &controller, &scene, &eval, &row, &error), MILD_OK);
    assert_true(row.push == push && row.success == PUSHED);
    controller_destroy(&noting->inner);
    pool_destroy(pool);
}

/* Every 4 s, each trial at another time, by the speed asked for, each in another direction, on
 * every side, and so with another seed; until then nothing changes by a bit. */
TEST(pushes_come_every_four_seconds) {
    double angle[2 * PUSHED];
    int from[SIDES] = {0};
    for (int i = 0; i < 2 * PUSHED; i++) {
        const int trial = i % PUSHED, at = trial ? 400 - 97 * trial : 400;
        if (trial == 0) {
            const uint64_t seed = i == 0 ? 1 : 2;
            walk_pushed(&noted[0], 0, seed);
            walk_pushed(&noted[1], 0.3, seed);
        }
        const double *before = noted[0].speed[trial][at], *after = noted[1].speed[trial][at];
        assert_memory_equal(noted[0].speed[trial], noted[1].speed[trial],
                            (size_t)at * sizeof noted[0].speed[trial][0]);
        assert_true(fabs(hypot(after[0] - before[0], after[1] - before[1]) - 0.3) < 1e-12);
        angle[i] = atan2(after[1] - before[1], after[0] - before[0]);
        for (int j = 0; j < i; j++) {
            assert_true(fabs(angle[i] - angle[j]) > 1e-3);
        }
        from[(int)((angle[i] < 0 ? angle[i] + TURN : angle[i]) * SIDES / TURN)]++;
    }
    for (int side = 0; side < SIDES; side++) {
        assert_true(from[side] > 0);
    }
}

/* ---- many rows at once ---- */

enum { SCENES = 3, SPEEDS = 2, OF_ROW = 3 };

static void run_rows(const Scene *scenes, int scene_count, const double *speeds, int speed_count,
                     EvalRow *rows, EvalTrial *each) {
    MildError error = {0};
    Zero zero = {0};
    Controller controller = {.self = &zero, .name = "zero", .act = zero_act};
    Pool *pool = pool_create(2);
    const EvalDef eval = {.trials = OF_ROW, .seconds = 1.5, .push = 1, .seed = 1};
    EvalRun run = kit_row(&def, pool, &controller, scenes, &eval);
    run.scene_count = scene_count;
    run.speeds = speeds;
    run.speed_count = speed_count;
    run.each = each;
    assert_int_equal(eval_run(&run, rows, &error), MILD_OK);
    pool_destroy(pool);
}

static void same_trial(const EvalTrial *a, const EvalTrial *b) {
    assert_int_equal(a->end, b->end);
    assert_true(a->seconds == b->seconds && a->shells == b->shells && a->torque == b->torque);
    assert_true(a->x == b->x && (a->legs == b->legs || (isnan(a->legs) && isnan(b->legs))));
}

/* A row alone, and among others, is the same, trial by trial; and a row is its trials. */
TEST(rows_and_trials_are_their_own) {
    static const char *const names[SCENES] = {"foam25", "rigid", "sand_loose"};
    static const double speeds[SPEEDS] = {0.2, 0.6};
    static EvalTrial each[SCENES * SPEEDS * OF_ROW];
    Scene scenes[SCENES];
    EvalRow rows[SCENES * SPEEDS];
    MildError error = {0};
    for (int i = 0; i < SCENES; i++) {
        assert_int_equal(scene_make(&scenes[i], names[i], 2, &error), MILD_OK);
    }
    run_rows(scenes, SCENES, speeds, SPEEDS, rows, each);
    for (int k = 0; k < SCENES * SPEEDS; k++) {
        const EvalTrial *of = each + (ptrdiff_t)k * OF_ROW;
        EvalTrial alone[OF_ROW];
        EvalRow row;
        run_rows(&scenes[k / SPEEDS], 1, &speeds[k % SPEEDS], 1, &row, alone);
        assert_string_equal(rows[k].ground, names[k / SPEEDS]);
        assert_true(rows[k].speed == speeds[k % SPEEDS]);
        double seconds = 0, shells = 0, torque = 0, legs = INFINITY;
        for (int i = 0; i < OF_ROW; i++) {
            same_trial(&of[i], &alone[i]);
            assert_true(of[i].torque != of[(i + 1) % OF_ROW].torque); /* each another */
            seconds += of[i].seconds / OF_ROW;
            shells += of[i].shells / OF_ROW;
            torque += of[i].torque / OF_ROW;
            legs = fmin(legs, of[i].legs);
        }
        expect_near("seconds", rows[k].seconds, seconds, 1e-12);
        expect_near("shells", rows[k].shells, shells, 1e-15);
        expect_near("torque", rows[k].torque_max, torque, 1e-9);
        assert_true(rows[k].legs == legs);
    }
}

/* No ground at all, and none that answers from the given physics step on. */
typedef struct {
    int left; /* answers; below 0: any number */
} Failing;

static int fail_to_answer(void *self, const MildTerrain *terrain, MildGround *ground,
                          const MildContactInput *input, MildContactResult *result) {
    (void)terrain;
    (void)ground;
    Failing *failing = self;
    memset(result->foot, 0, sizeof *result->foot * (size_t)input->feet);
    return failing->left >= 0 && failing->left-- == 0;
}

/* A trial whose step cannot be computed has diverged: its time ends there, and it is no success. */
TEST(a_diverged_trial_has_not_succeeded) {
    MildError error = {0};
    Zero zero = {0};
    Controller controller = {.self = &zero, .name = "zero", .act = zero_act};
    Pool *pool = pool_create(1);
    Failing failing[3] = {{-1}, {10}, {-1}};
    RobotGround ground[3];
    TaskDef task = def;
    Scene scene;
    EvalTrial each[3];
    EvalRow row;
    const EvalDef eval = {.speed = 0.3, .trials = 3, .seconds = 0.1, .seed = 1};
    for (int i = 0; i < 3; i++) {
        ground[i] = (RobotGround){fail_to_answer, &failing[i]};
    }
    task.shells_stand = 0;
    assert_int_equal(scene_make(&scene, "grass", 2, &error), MILD_OK);
    EvalRun run = kit_row(&task, pool, &controller, &scene, &eval);
    run.ground = ground;
    run.each = each;
    assert_int_equal(eval_run(&run, &row, &error), MILD_OK);
    pool_destroy(pool);
    assert_int_equal(each[0].end, TASK_END_time);
    assert_int_equal(each[1].end, TASK_END_not_finite);
    assert_int_equal(each[2].end, TASK_END_time);
    expect_near("time", each[0].seconds, 0.1, 1e-12);
    expect_near("time until it diverged", each[1].seconds, 10 * task.physics_dt, 1e-12);
    assert_true(row.success == 2 && row.ends[TASK_END_not_finite] == 1);
}

TEST_MAIN(kit_setup, kit_teardown)
