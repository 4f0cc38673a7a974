/* What is drawn per episode: every quantity's range, mean, variance and independence of the others
 * over 10^4 episodes, shares within their binomial bounds; the sinkage limit; model matching; the
 * start; commands. */
#include "sa01.h"
#include "task_kit.h"

enum { DRAWS = 10000, COLUMNS_MAX = 160 };

static TaskDef def;
static TaskEnv *env;

static void open_env(void) {
    def = task_def_default();
    def.randomize.slip_share = 0;
    env = aligned_alloc(64, task_env_bytes(&def, robot));
    task_env_init(env, &def, robot, 11, 4);
}

/* The next episode's draw; 97: any number, so that ticks are not all multiples of 2. */
static void draw_next(void) {
    env->tick += 97;
    task_env_draw(env, &def, robot);
}

/* ---- a table of draws: column by quantity ---- */

typedef struct {
    char name[32];
    double low, high;
    double x[DRAWS];
    int count;
} Column;

static Column columns[COLUMNS_MAX];
static int column_count;

static void note(const char *name, int i, double low, double high, double x) {
    char full[32];
    snprintf(full, sizeof full, i < 0 ? "%s" : "%s[%d]", name, i);
    int c = 0;
    while (c < column_count && strcmp(columns[c].name, full) != 0) {
        c++;
    }
    assert_true(c < COLUMNS_MAX);
    if (c == column_count) {
        column_count++;
        memcpy(columns[c].name, full, sizeof full);
        columns[c].low = low;
        columns[c].high = high;
        columns[c].count = 0;
    }
    columns[c].x[columns[c].count++] = x;
}

static void clear_columns(void) {
    column_count = 0;
}

/* Uniform over [low, high]: ends reached within 6/n of the width, none beyond, mean and variance
 * within 5 standard deviations (of the variance: sqrt(4/(5 n))). */
static void expect_uniform(const Column *c) {
    double low = INFINITY, high = -INFINITY, sum = 0, square = 0, width = c->high - c->low;
    double middle = 0.5 * (c->low + c->high);
    for (int i = 0; i < c->count; i++) {
        low = fmin(low, c->x[i]);
        high = fmax(high, c->x[i]);
        sum += c->x[i] - middle;
        square += (c->x[i] - middle) * (c->x[i] - middle);
    }
    double n = c->count, end = 12 * width / n, variance = width * width / 12;
    if (!(low >= c->low && low <= c->low + end && high <= c->high && high >= c->high - end)) {
        fail_msg("%s: drawn %g .. %g of %g .. %g", c->name, low, high, c->low, c->high);
    }
    expect_near(c->name, sum / n, 0, 5 * sqrt(variance / n));
    expect_near(c->name, square / n, variance, 5 * sqrt(0.8 / n) * variance);
}

/* No two columns follow each other: correlation below 5.5 standard deviations of 1/sqrt(n). */
static void expect_independent(void) {
    static double unit[COLUMNS_MAX][DRAWS];
    for (int c = 0; c < column_count; c++) {
        double width = columns[c].high - columns[c].low;
        for (int i = 0; i < columns[c].count; i++) {
            unit[c][i] = (columns[c].x[i] - columns[c].low) / width - 0.5;
        }
    }
    for (int a = 0; a < column_count; a++) {
        for (int b = 0; b < a; b++) {
            int n = columns[a].count;
            assert_int_equal(n, columns[b].count);
            double sum = 0;
            for (int i = 0; i < n; i++) {
                sum += unit[a][i] * unit[b][i];
            }
            double correlation = 12 * sum / n;
            if (!(fabs(correlation) < 5.5 / sqrt(n))) {
                fail_msg("%s follows %s: correlation %.3f", columns[a].name, columns[b].name,
                         correlation);
            }
        }
    }
}

static void expect_columns(void) {
    for (int c = 0; c < column_count; c++) {
        expect_uniform(&columns[c]);
    }
    expect_independent();
}

/* A share within 4.5 standard deviations. */
static void expect_share(const char *what, int hits, int of, double share) {
    expect_near(what, (double)hits / of, share, 4.5 * sqrt(share * (1 - share) / of) + 1e-12);
}

/* ---- robot and sensors ---- */

TEST(robot_and_sensors) {
    open_env();
    clear_columns();
    draw_next();
    assert_true(env->variation.rigid_time == 0);
    def.randomize.rigid_time[0] = 0.02;
    def.randomize.rigid_time[1] = 0.4;
    int lags[3][6] = {{0}}, same[3] = {0};
    for (int t = 0; t < DRAWS; t++) {
        draw_next();
        const TaskVariation *v = &env->variation;
        note("base_mass_add", -1, -4, 4, v->base_mass_add);
        note("armature_scale", -1, 0.7, 1.3, v->armature_scale);
        note("rigid_friction", -1, 0.2, 1.3, v->rigid_friction);
        note("rigid_time", -1, 0.02, 0.4, v->rigid_time);
        note("assist_draw", -1, 0.5, 1, env->assist_draw);
        note("strength", -1, 0.9, 1.1, env->strength);
        for (int i = 0; i < 3; i++) {
            note("com_offset", i, -0.006, 0.006, v->com_offset[i]);
        }
        for (int i = 0; i <= SA01_JOINTS; i++) {
            note("link_mass", i, 0.9, 1.1, v->link_mass_scale[i]);
        }
        for (int i = 0; i < SA01_JOINTS; i++) {
            note("kp_scale", i, 0.9, 1.1, env->kp_scale[i]);
            note("kd_scale", i, 0.9, 1.1, env->kd_scale[i]);
            note("motor_offset", i, -0.035, 0.035, env->motor_offset[i]);
        }
        const int lag[3] = {env->lag_command, env->lag_motor, env->lag_imu};
        for (int i = 0; i < 3; i++) {
            assert_in_range(lag[i], 0, 4);
            lags[i][lag[i]]++;
            same[i] += lag[i] == lag[(i + 1) % 3];
        }
    }
    expect_columns();
    /* 1 .. 10 ms rounded to steps of 2.5 ms: below 1.25 ms, then 2.5 ms each, above 8.75 ms */
    const double share[5] = {0.25 / 9, 2.5 / 9, 2.5 / 9, 2.5 / 9, 1.25 / 9};
    double equal = 0;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 5; k++) {
            char what[32];
            snprintf(what, sizeof what, "latency %d of %d steps", i, k);
            expect_share(what, lags[i][k], DRAWS, share[k]);
            equal += share[k] * share[k] / 3;
        }
    }
    for (int i = 0; i < 3; i++) {
        expect_share("two equal latencies", same[i], DRAWS, equal);
    }
    free(env);
}

/* Same (seed, environment, tick): same episode; another of any of them: another. */
TEST(draws_are_a_function) {
    open_env();
    task_env_draw(env, &def, robot);
    double first = env->motor_offset[3], command;
    task_draw_command(env, &def);
    command = env->command[0];
    for (int k = 0; k < 4; k++) {
        env->seed += k == 1;
        env->index += k == 2;
        env->tick += k == 3;
        task_env_draw(env, &def, robot);
        task_draw_command(env, &def);
        assert_int_equal(env->motor_offset[3] == first, k == 0);
        assert_int_equal(env->command[0] == command && command != 0, k == 0);
        env->seed -= k == 1;
        env->index -= k == 2;
        env->tick -= k == 3;
    }
    free(env);
}

/* ---- ground ---- */

/* Which preset it was, and by what factors its 7 numbers were off; -1 when it is none. */
static int preset_of(const MildMaterial *m, double factor[7]) {
    for (int p = 0; p < mild_material_preset_count(); p++) {
        MildMaterial preset = mild_material_default();
        mild_material_preset(mild_material_preset_name(p), &preset);
        if (preset.alpha != m->alpha || preset.nu != m->nu || preset.phi != m->phi ||
            preset.rho != m->rho || preset.recovery != m->recovery ||
            preset.bed_depth != m->bed_depth) {
            continue;
        }
        const double of[7] = {m->k_pen / preset.k_pen,    m->sigma_cone / preset.sigma_cone,
                              m->mu / preset.mu,          m->c_d / preset.c_d,
                              m->c_g / preset.c_g,        m->k_drift / preset.k_drift,
                              m->b_drift / preset.b_drift};
        int within = 1;
        for (int i = 0; i < 7; i++) {
            factor[i] = of[i];
            within &= isnan(of[i]) || fabs(of[i] - 1) <= 0.02 + 1e-12;
        }
        if (within) {
            return p;
        }
    }
    return -1;
}

/* 10 % rigid, 50 % presets, stripes on 30 %. At a jitter of 2 % no preset can be taken for
 * another. */
TEST(shares_of_grounds) {
    open_env();
    clear_columns();
    def.randomize.preset_jitter = 0.02;
    int rigid = 0, presets = 0, striped = 0, by_preset[32] = {0};
    for (int t = 0; t < DRAWS; t++) {
        draw_next();
        rigid += env->variation.rigid;
        striped += task_env_rest(env)->terrain.patch_count > 0;
        double factor[7];
        const MildMaterial *m = &task_env_rest(env)->terrain.materials[0];
        const int is = preset_of(m, factor), p = env->variation.rigid ? -1 : is;
        if (p >= 0) {
            presets++;
            by_preset[p]++;
            for (int i = 0; i < 7; i++) {
                if (!isnan(factor[i])) {
                    note("jitter", i, 0.98, 1.02, factor[i]);
                }
            }
        }
        MildMaterial own = *m;
        own.model = m->recovery <= 0.2 ? MILD_MODEL_MILD_MERGED : MILD_MODEL_MILD;
        if (is >= 0) {
            mild_material_preset(mild_material_preset_name(is), &own);
        }
        assert_int_equal(m->model, own.model);
    }
    expect_share("rigid", rigid, DRAWS, 0.1);
    expect_share("presets", presets, DRAWS, 0.5);
    expect_share("striped", striped, DRAWS, 0.3);
    int kinds = mild_material_preset_count();
    for (int p = 0; p < kinds; p++) {
        expect_share(mild_material_preset_name(p), by_preset[p], presets, 1.0 / kinds);
    }
    for (int c = 0; c < column_count; c++) {
        expect_uniform(&columns[c]);
    }
    def.randomize.rigid_share = 0.5;
    rigid = presets = 0;
    for (int t = 0; t < DRAWS / 4; t++) {
        draw_next();
        double factor[7];
        rigid += env->variation.rigid;
        presets += !env->variation.rigid &&
                   preset_of(&task_env_rest(env)->terrain.materials[0], factor) >= 0;
    }
    expect_share("half rigid", rigid, DRAWS / 4, 0.5);
    expect_share("the other half presets", presets, DRAWS / 4, 0.5);
    free(env);
}

/* The ranges themselves, without the limit of sinkage. */
TEST(ranges_of_grounds) {
    open_env();
    clear_columns();
    def.randomize.rigid_share = def.randomize.preset_share = 0;
    def.randomize.sinkage_max = 1;
    def.randomize.model = MILD_MODEL_MILD;
    def.randomize.rho[0] = 800;
    int drift = 0;
    const MildMaterial sand = mild_material_default();
    for (int t = 0; t < DRAWS; t++) {
        draw_next();
        const MildMaterial *m = &task_env_rest(env)->terrain.materials[0];
        note("k_pen", -1, 8, 1400, m->k_pen);
        note("sigma_cone", -1, 0.01e6, 0.24e6, m->sigma_cone);
        note("alpha", -1, 0.698, 1.310, m->alpha);
        note("nu", -1, 0.8, 2.4, m->nu);
        note("c_g", -1, -1.4, 4.6, m->c_g);
        note("c_d", -1, -6, 28, m->c_d);
        note("phi", -1, 0.5, 0.64, m->phi);
        note("mu", -1, 0.2, 1.3, m->mu);
        note("rho", -1, 800, 1000, m->rho);
        note("recovery", -1, 0, 1, m->recovery);
        note("bed_depth", -1, 0.10, 0.15, m->bed_depth);
        drift += m->k_drift == sand.k_drift && m->b_drift == sand.b_drift && m->passive;
    }
    expect_columns();
    assert_int_equal(drift, DRAWS);
    free(env);
}

/* The ground of the same episode with other keys. */
static MildMaterial drawn_with(const TaskDef *with) {
    task_env_draw(env, with, robot);
    return task_env_rest(env)->terrain.materials[0];
}

/* k_D and b_D from ranges, and slip that costs support on the share that was asked for of the
 * grounds that stay dented, move no other draw; passive = false leaves c_g and c_d as drawn, those
 * of presets too. */
TEST(drift_energy_and_slip) {
    open_env();
    clear_columns();
    def.randomize.rigid_share = 0;
    def.randomize.preset_jitter = 0.02;
    TaskDef wide = def, slips = def;
    const double k_drift[2] = {50, 900}, b_drift[2] = {0.02, 0.2};
    const double length[2] = {0.002, 0.003}, grip[2] = {0.1, 0.15};
    memcpy(wide.randomize.k_drift, k_drift, sizeof k_drift);
    memcpy(wide.randomize.b_drift, b_drift, sizeof b_drift);
    wide.randomize.passive = 0;
    slips.randomize.preset_share = 0;
    slips.randomize.slip_share = 0.4;
    memcpy(slips.randomize.slip_length, length, sizeof length);
    memcpy(slips.randomize.grip, grip, sizeof grip);
    int drawn = 0, dented = 0, slipping = 0;
    for (int t = 0; t < DRAWS; t++) {
        draw_next();
        MildMaterial plain = task_env_rest(env)->terrain.materials[0], m = drawn_with(&wide);
        double factor[7];
        assert_true(plain.passive && !m.passive);
        if (preset_of(&plain, factor) < 0) {
            note("k_drift", -1, 50, 900, m.k_drift);
            note("b_drift", -1, 0.02, 0.2, m.b_drift);
            m.k_drift = plain.k_drift;
            m.b_drift = plain.b_drift;
            drawn++;
        }
        m.passive = 1;
        assert_memory_equal(&m, &plain, sizeof m);
    }
    expect_columns();
    assert_true(drawn > DRAWS / 3);
    clear_columns();
    def.randomize.preset_share = 0;
    for (int t = 0; t < DRAWS; t++) {
        draw_next();
        MildMaterial plain = task_env_rest(env)->terrain.materials[0], m = drawn_with(&slips);
        assert_true(plain.slip_length == 0 && plain.grip == 0);
        dented += m.recovery <= 0.2;
        if (m.slip_length > 0) {
            assert_true(m.recovery <= 0.2);
            note("slip_length", -1, 0.002, 0.003, m.slip_length);
            note("grip", -1, 0.1, 0.15, m.grip);
            m.slip_length = m.grip = 0;
            slipping++;
        }
        assert_memory_equal(&m, &plain, sizeof m);
    }
    expect_columns();
    assert_true(dented > DRAWS / 6);
    expect_share("slip", slipping, dented, 0.4);
    free(env);
}

/* In as many episodes as asked for; it moves no other draw. */
TEST(shells_stand_in_a_share) {
    open_env();
    TaskDef some = def;
    some.randomize.shells_share = 0.3;
    int stand = 0, rigid = 0;
    for (int t = 0; t < DRAWS; t++) {
        draw_next();
        assert_int_equal(env->variation.shells_stand, 1);
        const TaskEnv plain = *env;
        task_env_draw(env, &some, robot);
        stand += env->variation.shells_stand;
        rigid += env->variation.shells_stand && env->variation.rigid;
        env->variation.shells_stand = 1;
        assert_memory_equal(env, &plain, sizeof plain);
    }
    expect_share("shells", stand, DRAWS, 0.3);
    expect_share("of those on rigid ground", rigid, stand, 0.1);
    some.randomize.shells_share = 0;
    for (int t = 0; t < 50; t++) {
        env->tick += 97;
        task_env_draw(env, &some, robot);
        assert_int_equal(env->variation.shells_stand, 0);
    }
    free(env);
}

/* Whatever is drawn, one foot under the whole weight rests no deeper than 0.07 m; what rests higher
 * is left alone; what was stiffened rests at 0.07 m. k_pen and sigma_cone grow by one factor. */
TEST(limit_of_sinkage) {
    open_env();
    def.randomize.rigid_share = def.randomize.preset_share = def.randomize.patch_share = 0;
    def.randomize.model = MILD_MODEL_MILD;
    const MildSole *sole = robot_rasters(robot)[0];
    double weight = 2 * robot_foot_load(robot);
    int stiffened = 0, draws = 1000;
    for (int t = 0; t < draws; t++) {
        def.randomize.sinkage_max = 1;
        draw_next();
        MildMaterial as_drawn = task_env_rest(env)->terrain.materials[0];
        def.randomize.sinkage_max = 0.07;
        task_env_draw(env, &def, robot);
        MildMaterial limited = task_env_rest(env)->terrain.materials[0];
        as_drawn.bed_depth = 10;
        double before = mild_sole_sinkage(sole, &as_drawn, weight);
        double factor = limited.k_pen / as_drawn.k_pen;
        expect_near("one factor", limited.sigma_cone / as_drawn.sigma_cone, factor, 1e-9 * factor);
        limited.bed_depth = 10;
        double after = mild_sole_sinkage(sole, &limited, weight);
        if (before > 0.0701) {
            expect_near("stiffened", after, 0.07, 2e-4);
            stiffened++;
        } else if (before < 0.0699) {
            expect_near("left alone", factor, 1, 0);
        }
    }
    assert_true(stiffened > draws / 20 && stiffened < draws / 2);
    free(env);
}

/* Three materials, 16 stripes across x of 1 to 3 m without a gap, the start in the middle. */
TEST(stripes) {
    open_env();
    clear_columns();
    def.randomize.patch_share = 1;
    def.randomize.rigid_share = 0;
    int of[3] = {0}, different = 0;
    for (int t = 0; t < DRAWS / 4; t++) {
        draw_next();
        const MildTerrain *terrain = task_env_terrain(env);
        assert_int_equal(terrain->material_count, 3);
        assert_int_equal(terrain->patch_count, MILD_PATCHES_MAX);
        expect_near("first edge", terrain->patches[0].x_min, -16, 1e-12);
        for (int i = 0; i < MILD_PATCHES_MAX; i++) {
            const MildPatch *p = &terrain->patches[i];
            note("length", i, 1, 3, p->x_max - p->x_min);
            assert_true(p->y_min == -1000 && p->y_max == 1000);
            assert_in_range(p->material, 0, 2);
            of[p->material]++;
            assert_true(i == 0 || p->x_min == terrain->patches[i - 1].x_max);
        }
        different +=
            memcmp(&terrain->materials[0], &terrain->materials[1], sizeof(MildMaterial)) != 0 &&
            memcmp(&terrain->materials[1], &terrain->materials[2], sizeof(MildMaterial)) != 0;
    }
    expect_columns();
    for (int i = 0; i < 3; i++) {
        expect_share("material of a stripe", of[i], DRAWS / 4 * MILD_PATCHES_MAX, 1.0 / 3);
    }
    assert_int_equal(different, DRAWS / 4);
    free(env);
}

/* A rival's material is the match of mild's draw: one foot under half the weight sinks as deep. */
TEST(models_are_matched) {
    open_env();
    def.randomize.rigid_share = def.randomize.patch_share = 0;
    double load = robot_foot_load(robot);
    for (int model = 0; model < MILD_MODELS; model++) {
        for (int t = 0; t < 20; t++) {
            env->tick = (uint32_t)(1000 + t);
            def.randomize.model = MILD_MODEL_MILD;
            robot_set_model(robot, MILD_MODEL_MILD);
            task_env_draw(env, &def, robot);
            MildMaterial mild = task_env_rest(env)->terrain.materials[0];
            double wanted = mild_sole_sinkage(robot_soles(robot)[0], &mild, load);
            def.randomize.model = model;
            robot_set_model(robot, (MildModel)model);
            MildMaterial rival;
            if (model != MILD_MODEL_RIGID &&
                robot_match_model(robot, (MildModel)model, &mild, &rival, NULL) != MILD_OK) {
                continue; /* a floor is out of its range: another is drawn */
            }
            task_env_draw(env, &def, robot);
            const MildMaterial *m = &task_env_rest(env)->terrain.materials[0];
            assert_int_equal(env->variation.rigid, model == MILD_MODEL_RIGID);
            if (model == MILD_MODEL_RIGID) {
                continue;
            }
            assert_int_equal(m->model, model);
            double got = mild_sole_sinkage(robot_soles(robot)[0], m, load);
            expect_near(mild_model_names[model], got, wanted, 1e-4);
            /* resistive force theory has tangential forces of its own */
            int quasi = model == MILD_MODEL_ECC_QUASI || model == MILD_MODEL_ECC_QUASI_3D;
            expect_near("friction", m->mu, quasi ? 0 : mild.mu, 0);
        }
    }
    robot_set_model(robot, MILD_MODEL_MILD);
    free(env);
}

/* Somewhere on the map, uniformly; the patterns' materials are drawn apart. */
TEST(placed_on_a_map) {
    MildError error = {0};
    MildMapDef shape = mild_map_def_default();
    shape.kind = MILD_MAP_ROUGH;
    shape.amplitude = 0.03;
    shape.patches = MILD_PATTERN_CHECKER;
    MildMap *map = mild_map_create(&shape, &error);
    assert_non_null(map);
    double x, y;
    mild_map_extent(map, &x, &y);
    open_env();
    clear_columns();
    def.map = map;
    for (int t = 0; t < DRAWS / 4; t++) {
        draw_next();
        note("map_x", -1, -x / 2, x / 2, task_env_rest(env)->terrain.map_x);
        note("map_y", -1, -y / 2, y / 2, task_env_rest(env)->terrain.map_y);
        assert_int_equal(task_env_rest(env)->terrain.material_count, mild_map_label_count(map));
        assert_int_equal(task_env_rest(env)->terrain.patch_count, 0);
        assert_memory_not_equal(&task_env_rest(env)->terrain.materials[0],
                                &task_env_rest(env)->terrain.materials[1], sizeof(MildMaterial));
    }
    expect_columns();
    mild_map_destroy(map);
    free(env);
}

/* ---- commands ---- */

TEST(commands) {
    open_env();
    clear_columns();
    int standing = 0, backward = 0, straight = 0, walking = 0;
    for (int t = 0; t < DRAWS; t++) {
        env->tick++;
        task_draw_command(env, &def);
        const double *c = env->command;
        if (c[0] == 0 && c[1] == 0 && c[2] == 0) {
            standing++;
            continue;
        }
        walking++;
        backward += c[0] < 0;
        note(c[0] < 0 ? "backward" : "forward", -1, c[0] < 0 ? -0.6 : 0, c[0] < 0 ? 0 : 1.2, c[0]);
        assert_int_equal(c[1] == 0, c[2] == 0);
        straight += c[1] == 0;
        if (c[1] != 0) {
            note("vy", -1, -0.3, 0.3, c[1]);
            note("wz", -1, -1.5, 1.5, c[2]);
        }
    }
    expect_share("standing", standing, DRAWS, 0.05);
    expect_share("backward", backward, DRAWS, 0.10);
    expect_share("straight", straight, walking, 0.4);
    for (int c = 0; c < column_count; c++) {
        expect_uniform(&columns[c]);
    }
    free(env);
}

/* ---- start ---- */

/* Yaw anywhere, joints +-0.05 rad, base velocities +-0.1, joints at rest, clock at 0 or 0.5, first
 * episodes anywhere in the first 0.9 of their time, later ones at its start. */
TEST(start) {
    enum { STARTS = 3000 };
    TaskDef start_def = task_def_default();
    start_def.randomize.patch_share = 0;
    Rig rig;
    rig_open(&rig, &start_def, 11, 0);
    clear_columns();
    const EnvsView none = {0};
    const double *pose = robot_default_pose(robot);
    int half = 0;
    for (int t = 0; t < STARTS; t++) {
        int first = t % 2 == 0;
        rig.env->tick = first ? 0 : (uint32_t)(100 + t);
        rig.env->index = (uint32_t)t;
        task_env_reset(rig.env, &rig.def, robot, rig.sim, &none);
        const TaskPose *s = &rig.env->robot;
        note("yaw", -1, -KIT_PI, KIT_PI, 2 * atan2(s->qpos[6], s->qpos[3]));
        assert_true(s->qpos[0] == 0 && s->qpos[1] == 0 && s->qpos[4] == 0 && s->qpos[5] == 0);
        for (int i = 0; i < SA01_JOINTS; i++) {
            note("joint", i, -0.05, 0.05, s->qpos[7 + i] - pose[i]);
            assert_true(s->qvel[6 + i] == 0);
        }
        for (int i = 0; i < 6; i++) {
            note("twist", i, -0.1, 0.1, s->qvel[i]);
            expect_entry("base_twist", i, rig.env->base_twist[i], s->qvel[i], 0);
        }
        const MildMaterial *m = &task_env_rest(rig.env)->terrain.materials[0];
        double depth = rig.env->variation.rigid
                           ? 0
                           : mild_sole_sinkage(robot_soles(robot)[0], m, robot_foot_load(robot));
        expect_near("height", s->qpos[2], 0.8369 - depth + 0.002, 1e-4);
        assert_true(rig.env->phase == 0 || rig.env->phase == 0.5);
        half += rig.env->phase == 0.5;
        if (first) {
            note("step", -1, -0.5, 2159.5, rig.env->step);
        } else {
            assert_int_equal(rig.env->step, 0);
        }
        assert_int_equal(rig.env->step_first, rig.env->step);
    }
    expect_share("half a period", half, STARTS, 0.5);
    for (int c = 0; c < column_count; c++) {
        expect_uniform(&columns[c]);
    }
    rig_close(&rig);
}

/* A robot begins with slow commands; the highest grows where one near it is followed when the next
 * is drawn. */
TEST(commands_that_grow) {
    static const double rows[][3] = {/* command, speed [m/s], by how much the highest grows */
                                     {0.8, 0.7, 0.2},   {0.8, 0.6, 0}, {1.2, 0.7, 0},
                                     {1.2, 0.5, -0.25}, {0.6, 0.6, 0}, {0.9, 0.1, -0.25},
                                     {0.6, 0.1, -0.2},  {0.4, 0.1, 0}};
    const float action[SA01_JOINTS] = {0};
    Rig rig;
    TaskDef start_def = task_def_default();
    rig_open(&rig, &start_def, 11, 0);
    TaskEnv *own = rig.env;
    rig.def.vx_start = own->command_most = 0.5;
    task_env_reset(own, &rig.def, robot, rig.sim, &rig.view);
    assert_true(own->command[0] <= 0.5);
    own->command_most = 1;
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        const double before = own->command_most;
        own->command[0] = rows[k][0];
        own->smooth_velocity[0] = rows[k][1];
        own->step = (uint32_t)(rig.def.command_interval / TASK_PERIOD + 0.5) - 1;
        own->step_first = 0;
        rig_step(&rig, action);
        expect_near("the highest command grows", own->command_most - before, rows[k][2], 1e-12);
        assert_true(own->command[0] <= own->command_most);
    }
    own->step_first = own->step + 1; /* an episode that has just begun says nothing */
    own->step = 2 * own->step - 1;
    own->command[0] = 1.2;
    own->smooth_velocity[0] = 0;
    own->command_most = 1;
    rig_step(&rig, action);
    expect_near("the highest command stays", own->command_most, 1, 0);
    rig_close(&rig);
}

/* What the last episode left is gone: every byte is as in an environment that has none, but for the
 * level of help and the highest command, which live on. */
TEST(nothing_is_left) {
    TaskDef start_def = task_def_default();
    const float action[SA01_JOINTS] = {1, 2, 3};
    Rig rig, fresh;
    rig_open(&rig, &start_def, 11, 0);
    rig_open(&fresh, &start_def, 11, 0);
    task_env_reset(rig.env, &rig.def, robot, rig.sim, &rig.view);
    for (int t = 0; t < 5; t++) {
        rig_step(&rig, action);
        rig.env->push[t] = rig.env->air_time[0] = rig.env->air_time[1] = 0.3;
    }
    rig.env->assist_level = fresh.env->assist_level = 0.7;
    rig.env->command_most = fresh.env->command_most = 2;
    fresh.env->tick = rig.env->tick;
    task_env_reset(rig.env, &rig.def, robot, rig.sim, &rig.view);
    task_env_reset(fresh.env, &fresh.def, robot, fresh.sim, &fresh.view);
    memset(rig.env->torque, 0, sizeof rig.env->torque); /* is written before it is read */
    rig.env->oldest = fresh.env->oldest;                /* all frames of the ring are the same */
    assert_memory_equal(rig.env, fresh.env, task_env_bytes(&rig.def, robot));
    rig_close(&rig);
    rig_close(&fresh);
}

/* eval and play: yaw 0, the command stays, the episode begins at its start. */
TEST(start_of_a_trial) {
    Rig rig;
    TaskDef start_def = task_def_default();
    start_def.randomize.rigid_time[0] = start_def.randomize.rigid_time[1] = 0.1;
    rig_open(&rig, &start_def, 11, 0);
    MildTerrain terrain = kit_sand();
    terrain.height = 0.4;
    rig_start(&rig, 0.7, 0, 0);
    assert_true(rig.env->command[0] == 0.7 && rig.env->command[1] == 0);
    assert_true(rig.env->robot.qpos[3] == 1 && rig.env->robot.qpos[6] == 0);
    assert_int_equal(rig.env->step, 0);
    double z = rig.env->robot.qpos[2];
    task_env_reset_on(rig.env, &rig.def, robot, rig.sim, &terrain, 0, &rig.view);
    expect_near("on higher ground", rig.env->robot.qpos[2], z + 0.4, 1e-12);
    expect_near("friction of rigid ground", rig.env->variation.rigid_friction, 0.8, 0);
    expect_near("its time constant", rig.env->variation.rigid_time, 0, 0);
    assert_false(rig.env->variation.rigid);
    task_env_reset_on(rig.env, &rig.def, robot, rig.sim, &terrain, 1, &rig.view);
    assert_true(rig.env->variation.rigid);
    rig_close(&rig);
}

TEST_MAIN(kit_setup, kit_teardown)
