/* mild_ground_derivative against differences of whole solves, and what a derivative of the ground
 * must be: symmetric and dissipative at rest. `ground_test_derivative COUNT [FIRST]` takes more
 * problems. */
#include "problems.h"

#include "ground/step/scratch.h"

#define LEVER 0.1      /* [m] makes twists, poses and wrenches comparable */
#define TOLERANCE 1e-6 /* [-] of the largest number of a derivative */
/* Of what is differenced a few are off by more than TOLERANCE, and none by more than ROUGH: where an
 * element is at a kink, and under shells on mild_merged, whose rim rounds. */
#define ROUGH 1e-5
#define FEW 0.01    /* [-] of the problems */
#define BESIDE 1e-2 /* [-] what a derivative is compared to is at least so much of dW/dV_free */
#define NEAR 12     /* rows of two feet */

static int first_problem = 0, problem_count = 0;

/* [-] 1, or the lever for an angular row or column. */
static double length_of(int row) {
    return row % 6 < 3 ? 1.0 : LEVER;
}

/* ---- differences of solves ---- */

/* Moves coordinate `column` of a problem by h in units of its length. */
typedef void Move(Kit *kit, int column, double h);

static void move_free(Kit *kit, int column, double h) {
    kit->input.free_velocity[column] += h / length_of(column);
}

static void move_twist(Kit *kit, int column, double h) {
    kit->input.velocity[column / 6][column % 6] += h / length_of(column);
}

static void move_pose(Kit *kit, int column, double h) {
    double turn[3] = {0.0};
    if (column % 6 < 3) {
        kit->input.position[column / 6][column % 6] += h;
        return;
    }
    turn[column % 6 - 3] = h / LEVER;
    kit_rotate(kit->input.rotation[column / 6], turn);
}

/* A field of material 0, by a share of its value, or of 1. */
static void move_field(Kit *kit, int index, double h) {
    const MildField *field = &mild_material_fields[index];
    double value;
    char *at = (char *)&kit->terrain.materials[0] + field->offset;
    memcpy(&value, at, sizeof value);
    value += h * (value == 0.0 ? 1.0 : value);
    memcpy(at, &value, sizeof value);
}

/* Numbers of a derivative, in units of the lengths. */
typedef struct {
    double at[NEAR][NEAR];
    double most;   /* the largest */
    double unsure; /* by how much one of them still changed */
} Slopes;

/* What a derivative is compared with. */
typedef struct {
    int rows, columns;
    Slopes wrench, twist;
    int solved; /* bool: all of the solves converged */
} Differences;

/* Wrench and twist of the problem moved by h, in units of the lengths. */
static int solve_moved(Kit *kit, Move *move, int column, double h, double wrench[NEAR],
                       double twist[NEAR]) {
    const MildContactInput input = kit->input;
    const MildTerrain terrain = kit->terrain;
    move(kit, column, h);
    kit_solve(kit);
    kit->input = input;
    kit->terrain = terrain;
    for (int i = 0; i < 6 * kit->feet; i++) {
        const MildFootResult *foot = &kit->result.foot[i / 6];
        wrench[i] = (i % 6 < 3 ? foot->force[i % 6] : foot->torque[i % 6 - 3]) / length_of(i);
        twist[i] = kit->result.velocity[i] * length_of(i);
    }
    return kit->result.converged;
}

/* A slope from values over -h, -h/2, -h/4, 0 and so on, by Richardson's extrapolation of central
 * differences. It is unsure by its last change, and by what the second difference leaves of a kink:
 * without one that falls with the step. */
static void slope_of(double values[7][NEAR], int i, double h, int column, Slopes *slopes) {
    double slope[3], bend[3];
    for (int k = 0; k < 3; k++) {
        const double width = h / (1 << k);
        slope[k] = (values[6 - k][i] - values[k][i]) / (2.0 * width);
        bend[k] = (values[6 - k][i] + values[k][i] - 2.0 * values[3][i]) / width;
    }
    const double wide = (4.0 * slope[1] - slope[0]) / 3.0, own = (4.0 * slope[2] - slope[1]) / 3.0;
    slopes->at[i][column] = own;
    slopes->most = fmax(slopes->most, fabs(own));
    slopes->unsure = fmax(slopes->unsure, fmax(fabs(own - wide), fabs(2.0 * bend[2] - bend[1])));
}

static void difference_column(Kit *kit, Move *move, int of, double h, int column,
                              Differences *all) {
    static const double at[7] = {-1.0, -0.5, -0.25, 0.0, 0.25, 0.5, 1.0};
    double wrench[7][NEAR], twist[7][NEAR];
    for (int k = 0; k < 7; k++) {
        all->solved &= solve_moved(kit, move, of, at[k] * h, wrench[k], twist[k]);
    }
    for (int i = 0; i < all->rows; i++) {
        slope_of(wrench, i, h, column, &all->wrench);
        slope_of(twist, i, h, column, &all->twist);
    }
}

static Differences differences_over(Kit *kit, Move *move, double h) {
    Differences all = {.rows = 6 * kit->feet, .columns = 6 * kit->feet, .solved = 1};
    for (int c = 0; c < all.columns; c++) {
        difference_column(kit, move, c, h, c, &all);
    }
    return all;
}

/* Over h, or a tenth of it where a branch changes within h. */
static Differences differences(Kit *kit, Move *move, double h) {
    const Differences all = differences_over(kit, move, h);
    if (all.wrench.unsure <= TOLERANCE * all.wrench.most) {
        return all;
    }
    const Differences fine = differences_over(kit, move, 0.1 * h);
    return fine.wrench.unsure < all.wrench.unsure ? fine : all;
}

/* How well a kind of derivative agrees, over problems. */
typedef struct {
    int compared, skipped;
    int beyond; /* TOLERANCE */
    double worst;
    int at; /* number of the worst problem */
} Score;

/* [-] Largest difference of a derivative by coordinates of feet, over `size`. by: power of the
 * length in the unit of a row, -1 of a wrench, 1 of a twist. */
static double apart(const Differences *all, const Slopes *slopes, const double *got, int by,
                    double size) {
    double off = 0.0;
    for (int i = 0; i < all->rows; i++) {
        for (int c = 0; c < all->columns; c++) {
            const double unit = by > 0 ? length_of(i) : 1.0 / length_of(i);
            const double own = got[i * all->columns + c] * unit / length_of(c);
            off = fmax(off, fabs(own - slopes->at[i][c]));
        }
    }
    return off / size;
}

/* Adds a problem to a score unless its differences are no derivative. off: [-] */
static void score_add(Score *score, const Differences *all, const Slopes *slopes, double size,
                      double off, int number) {
    if (!all->solved || slopes->unsure > TOLERANCE * size) {
        score->skipped++;
        return;
    }
    score->compared++;
    score->beyond += !(off <= TOLERANCE);
    if (!(off <= score->worst)) {
        score->worst = off;
        score->at = number;
    }
}

/* ---- problems ---- */

typedef struct {
    MildContactDerivative asked;
    double law[6 * NEAR], wrench[NEAR * NEAR], velocity[NEAR * NEAR];
    double pose[NEAR * NEAR], twist[NEAR * NEAR];
} Derived;

static void derive(Kit *kit, MildScratch *work, Derived *derived) {
    MildError error = {0};
    derived->asked = (MildContactDerivative){.law = derived->law,
                                             .wrench_by_free = derived->wrench,
                                             .velocity_by_free = derived->velocity,
                                             .wrench_by_pose = derived->pose,
                                             .wrench_by_velocity = derived->twist,
                                             .work = work};
    expect_good(mild_ground_derivative(kit->ground, &kit->terrain, &kit->input, kit->scratch,
                                       &kit->result, &derived->asked, &error) == MILD_OK,
                &error);
}

/* What elements do in the problems that were compared. */
typedef struct {
    int sticks, slides, unloads, yields, lifted; /* problems with such an element */
} Seen;

static void see(const Kit *kit, Seen *seen) {
    int stick = 0, slide = 0, unload = 0, yield = 0, lift = 0;
    for (int f = 0; f < kit->feet; f++) {
        const MildElements e = mild_scratch_elements(kit->scratch, f);
        for (int i = 0; i < mild_sole_elements(kit->soles[f]); i++) {
            const int loaded = e.state[i] != MILD_ELEMENT_FREE;
            stick += loaded && !e.slip[i];
            slide += e.slip[i];
            unload += e.state[i] == MILD_ELEMENT_UNLOADING;
            yield += e.state[i] == MILD_ELEMENT_VIRGIN;
            lift += !loaded && mild_ground_depth_max(kit->ground, f)[i] > 0.0;
        }
    }
    seen->sticks += stick > 0;
    seen->slides += slide > 0;
    seen->unloads += unload > 0;
    seen->yields += yield > 0;
    seen->lifted += lift > 0;
}

/* Scores by V_free, by the twists that follow from it, by the present twist and by pose. */
enum { BY_FREE, TWISTS, BY_TWIST, BY_POSE, SCORES };

/* Compares all derivatives of the problem that was solved. */
static void compare(Kit *kit, int number, Score scores[SCORES]) {
    MildError error = {0};
    MildScratch *work = mild_scratch_create(kit->soles, kit->feet, &error);
    expect_good(work != NULL, &error);
    Derived derived;
    kit->input.tolerance = 1e-12;
    kit_solve(kit);
    derive(kit, work, &derived);
    const Differences free = differences(kit, move_free, 1e-6);
    const Differences twist = differences_over(kit, move_twist, 1e-5);
    const Differences pose = differences(kit, move_pose, 1e-7);
    const double most = free.wrench.most, moved = fmax(free.twist.most, 1.0);
    const double by_twist = fmax(twist.wrench.most, BESIDE * most);
    const double by_pose = fmax(pose.wrench.most, BESIDE * most);
    const double off[SCORES] = {apart(&free, &free.wrench, derived.wrench, -1, most),
                                apart(&free, &free.twist, derived.velocity, 1, moved),
                                apart(&twist, &twist.wrench, derived.twist, -1, by_twist),
                                apart(&pose, &pose.wrench, derived.pose, -1, by_pose)};
    score_add(&scores[BY_FREE], &free, &free.wrench, most, off[BY_FREE], number);
    score_add(&scores[TWISTS], &free, &free.twist, moved, off[TWISTS], number);
    score_add(&scores[BY_TWIST], &twist, &twist.wrench, by_twist, off[BY_TWIST], number);
    score_add(&scores[BY_POSE], &pose, &pose.wrench, by_pose, off[BY_POSE], number);
    mild_scratch_destroy(work);
}

static const char *const by[SCORES] = {"dW/dV_free", "dV/dV_free", "dW/d(twist)", "dW/d(pose)"};

/* Prints scores, asserts them, and adds them to those of all grounds. */
static void expect_scores(const char *name, const Score scores[SCORES], int least,
                          Score all[SCORES]) {
    print_message("%-24s", name);
    for (int k = 0; k < SCORES; k++) {
        print_message(" %s %.0e (%d; %d of %d skipped)", by[k], scores[k].worst, scores[k].at,
                      scores[k].skipped, scores[k].skipped + scores[k].compared);
        all[k].skipped += scores[k].skipped;
        all[k].compared += scores[k].compared;
        all[k].beyond += scores[k].beyond;
    }
    print_message("\n");
    for (int k = 0; k < SCORES; k++) {
        assert_true(scores[k].compared >= least);
        if (k < BY_TWIST && !(scores[k].worst <= TOLERANCE)) {
            fail_msg("%s: %s is off by %.1e in problem %d", name, by[k], scores[k].worst,
                     scores[k].at);
        }
    }
}

/* Asserts which share `most` of the problems had differences that are no derivative, and that few are
 * beyond TOLERANCE. */
static void expect_skips(const Score all[SCORES], const double most[SCORES]) {
    for (int k = 0; k < SCORES; k++) {
        const int problems = all[k].skipped + all[k].compared;
        print_message("%s: %d problems, %d of them beyond %.0e, %d more skipped\n", by[k],
                      all[k].compared, all[k].beyond, TOLERANCE, all[k].skipped);
        assert_true(all[k].beyond <= FEW * all[k].compared);
        assert_true(all[k].skipped <= 2 + most[k] * problems); /* 2: of a small sample */
    }
}

/* A ground of the test: a preset, by its own model or another. */
typedef struct {
    const char *preset;
    MildModel model;
} Under;

static MildMaterial material_under(const Under *under) {
    MildMaterial own, rival;
    MildError error = {0};
    assert_true(mild_material_preset(under->preset, &own));
    if (under->model == (MildModel)own.model) {
        return own;
    }
    assert_true(own.model == MILD_MODEL_MILD || own.model == MILD_MODEL_MILD_MERGED);
    expect_good(mild_model_match(under->model, &own, soles[0], 160.0, &rival, &error) == MILD_OK,
                &error);
    return rival;
}

/* One or two feet in a random state on the ground, on soles of 77 elements or on shells. */
static int problem_under(Kit *kit, const MildMaterial *material, int shell, int number) {
    static const double steps[3] = {1e-3, 2.5e-3, 5e-3};
    uint64_t random = (uint64_t)number * 1000003u + 31 + (uint64_t)shell;
    problem_open(kit, &random, shell ? covered : soles, shell ? SOLES - 2 : 0, material,
                 steps[kit_index(&random, 3)]);
    return problem_solve(kit, &random) && kit->result.converged;
}

TEST(derivatives_are_those_of_the_solve) {
    static const Under unders[] = {
        {"rubber", MILD_MODEL_MILD},          {"foam45", MILD_MODEL_MILD},
        {"running_track", MILD_MODEL_MILD},   {"sand_loose", MILD_MODEL_MILD_MERGED},
        {"foam45", MILD_MODEL_HUNT_CROSSLEY}, {"sand_loose", MILD_MODEL_BEKKER}};
    const int count = problem_count ? problem_count : kit_draws(25);
    Seen seen = {0};
    Score all[SCORES] = {{0}};
    for (size_t u = 0; u < 2 * sizeof unders / sizeof *unders; u++) {
        const MildMaterial material = material_under(&unders[u / 2]);
        const int shell = u % 2;
        Score scores[SCORES] = {{0}};
        for (int n = first_problem; n < first_problem + count; n++) {
            Kit kit;
            if (problem_under(&kit, &material, shell, n)) {
                see(&kit, &seen);
                compare(&kit, n, scores);
            }
            kit_close(&kit);
        }
        char name[64];
        snprintf(name, sizeof name, "%s%s, %s", unders[u / 2].preset, shell ? " shells" : "",
                 mild_model_names[material.model]);
        expect_scores(name, scores, count / 16, all);
    }
    print_message("problems with elements that stick %d, slide %d, unload %d, yield %d, that have "
                  "lifted off %d\n",
                  seen.sticks, seen.slides, seen.unloads, seen.yields, seen.lifted);
    assert_true(seen.sticks > count && seen.slides > count && seen.unloads > count);
    assert_true(seen.yields > count && seen.lifted > count / 4);
    expect_skips(all, (const double[SCORES]){0.02, 0.04, 0.06, 0.03});
}

/* Maps, mixtures, imprints, all models, ground that creates energy, feet turned by hand. */
TEST(derivatives_of_any_ground) {
    const int count = problem_count ? problem_count : kit_draws(20);
    Score all[SCORES] = {{0}};
    for (int kind = 0; kind < KINDS; kind++) {
        Score scores[SCORES] = {{0}};
        for (int n = first_problem; n < first_problem + count; n++) {
            Kit kit;
            MildMap *map;
            if (kind_problem(&kit, &map, (Kind)kind, n) && kit.result.converged) {
                compare(&kit, n, scores);
            }
            kit_close(&kit);
            mild_map_destroy(map);
        }
        expect_scores(kind_names[kind], scores, count / 4, all);
    }
    expect_skips(all, (const double[SCORES]){0.02, 0.02, 0.06, 0.02});
}

/* Light bodies on long levers that strike the ground and turn round within a step: friction opposes
 * another velocity (energy.c). */
TEST(derivatives_where_friction_turned) {
    const int count = problem_count ? problem_count : kit_draws(600);
    const MildMaterial m = kit_preset("foam45");
    Score scores[SCORES] = {{0}};
    uint64_t random = 77;
    for (int n = 0; n < count; n++) {
        Kit kit;
        problem_open(&kit, &random, soles, SOLES - 2, &m, 5e-3);
        for (int f = 0; f < kit.feet; f++) {
            kit.mass[f] = kit_spread(&random, 0.02, 1.0);
            kit.inertia[f] = kit.mass[f] * kit_spread(&random, 1e-4, 1e-2);
            for (int k = 0; k < 3; k++) {
                kit.center[f][k] = kit_uniform(&random, -0.2, 0.2);
            }
            kit.input.velocity[f][0] = kit_uniform(&random, -2.0, 2.0);
            kit.input.velocity[f][2] = kit_uniform(&random, -1.0, 0.0);
        }
        kit_inverse_inertia(&kit);
        kit_free(&kit, NULL);
        kit_solve(&kit);
        int turned = 0;
        for (int f = 0; f < kit.feet; f++) {
            turned += kit.scratch->foot[f].turned && kit.result.foot[f].contacts > 0;
        }
        if (turned && kit.result.converged) {
            compare(&kit, n, scores);
        }
        kit_close(&kit);
    }
    expect_scores("turned round", scores, count / 200, (Score[SCORES]){{0}});
}

/* Ground of negative added mass (passive = false) pushes feet that were about to leave it and are
 * pushed back, mostly by its explicit impulse, which follows their free motion alone. */
TEST(derivatives_of_an_explicit_impulse) {
    Score scores[SCORES] = {{0}};
    for (int n = 0; n < 10; n++) {
        MildMaterial m = mild_material_default();
        Kit kit;
        uint64_t random = (uint64_t)n;
        m.passive = 0;
        m.c_g = -1.4;
        kit_open(&kit, 1 + n % 2, soles[0], soles[1], &m, 5e-3);
        for (int f = 0; f < kit.feet; f++) {
            kit.input.position[f][2] = -KIT_SOLE_Z - 2e-3;
            for (int k = 0; k < 6; k++) {
                kit.input.velocity[f][k] = kit_uniform(&random, -0.2, 0.2);
            }
            kit.input.velocity[f][2] += 1.0;
        }
        kit_inverse_inertia(&kit);
        kit_free(&kit, NULL);
        for (int f = 0; f < kit.feet; f++) {
            kit.input.free_velocity[6 * f + 2] = -0.1;
        }
        kit_solve(&kit);
        const Slots *s = kit.scratch->foot[0].slot;
        assert_true(s->iz[0] > 0.0 && s->explicit_impulse[0] > 0.5 * s->iz[0]);
        compare(&kit, n, scores);
        kit_close(&kit);
    }
    expect_scores("explicit impulse", scores, 5, (Score[SCORES]){{0}});
}

/* ---- numbers of the material ---- */

/* Indices into mild_material_fields of the numbers that a model reads. */
static int fields_of(const MildMaterial *m, int *field) {
    const MildModelInfo *info = mild_model_info((MildModel)m->model);
    int count = 0;
    for (int k = 0; k < MILD_MODEL_FIELDS && info->fields[k]; k++) {
        const MildField *at =
            mild_field_find(mild_material_fields, mild_material_field_count, info->fields[k], NULL);
        if (at->type == MILD_FIELD_DOUBLE) {
            field[count++] = (int)(at - mild_material_fields);
        }
    }
    return count;
}

static double field_value(const MildMaterial *m, int index) {
    double value;
    memcpy(&value, (const char *)m + mild_material_fields[index].offset, sizeof value);
    return value;
}

/* Compares dW/d(fields) of a problem, each times its value. */
static void compare_fields(Kit *kit, int number, Score scores[MILD_MODEL_FIELDS]) {
    int field[MILD_MODEL_FIELDS];
    double got[NEAR * MILD_MODEL_FIELDS];
    MildError error = {0};
    kit->input.tolerance = 1e-12;
    kit_solve(kit);
    MildContactDerivative asked = {.wrench_by_material = got,
                                   .field_count = fields_of(&kit->terrain.materials[0], field),
                                   .field = field,
                                   .work = mild_scratch_create(kit->soles, kit->feet, &error)};
    const MildContactResult solved = kit->result;
    expect_good(mild_ground_derivative(kit->ground, &kit->terrain, &kit->input, kit->scratch,
                                       &kit->result, &asked, &error) == MILD_OK,
                &error);
    double weight = 0.0;
    for (int i = 0; i < 6 * kit->feet; i++) {
        weight = fmax(weight, fabs(i % 6 < 3 ? solved.foot[i / 6].force[i % 6] : 0.0));
    }
    for (int c = 0; c < asked.field_count; c++) {
        const double value = field_value(&kit->terrain.materials[0], field[c]);
        Differences all = {.rows = 6 * kit->feet, .columns = 1, .solved = 1};
        if (value == 0.0) { /* an end of a range, or off */
            continue;
        }
        difference_column(kit, move_field, field[c], 1e-5, 0, &all);
        double off = 0.0;
        const double size = fmax(all.wrench.most, BESIDE * weight);
        for (int i = 0; i < all.rows; i++) {
            const double own = got[i * asked.field_count + c] * value / length_of(i);
            off = fmax(off, fabs(own - all.wrench.at[i][0]));
        }
        score_add(&scores[c], &all, &all.wrench, size, off / size, number);
    }
    mild_scratch_destroy(asked.work);
}

TEST(derivatives_by_the_material) {
    static const Under unders[] = {{"grass", MILD_MODEL_MILD},
                                   {"sand_loose", MILD_MODEL_MILD_MERGED},
                                   {"foam45", MILD_MODEL_HUNT_CROSSLEY},
                                   {"dry_sand", MILD_MODEL_BEKKER}};
    int compared = 0, skipped = 0;
    for (size_t u = 0; u < sizeof unders / sizeof *unders; u++) {
        const MildMaterial material = material_under(&unders[u]);
        Score scores[MILD_MODEL_FIELDS] = {{0}};
        int field[MILD_MODEL_FIELDS];
        for (int n = 0; n < kit_draws(20); n++) {
            Kit kit;
            if (problem_under(&kit, &material, n % 2, n)) {
                compare_fields(&kit, n, scores);
            }
            kit_close(&kit);
        }
        print_message("%s:", mild_model_names[material.model]);
        for (int c = 0; c < fields_of(&material, field); c++) {
            const char *name = mild_material_fields[field[c]].name;
            print_message(" %s %.0e (%d)", name, scores[c].worst, scores[c].compared);
            compared += scores[c].compared;
            skipped += scores[c].skipped;
            if (!(scores[c].worst <= TOLERANCE)) {
                fail_msg("%s is off by %.1e in problem %d", name, scores[c].worst, scores[c].at);
            }
        }
        print_message("\n");
    }
    print_message("%d compared, %d skipped\n", compared, skipped);
    assert_true(compared > kit_draws(400) && skipped < compared / 10);
}

/* At the ends of a range and where a number is off or infinite. */
TEST(ends_of_ranges) {
    static const char *const names[] = {"c_d", "recovery", "slip_length", "bed_depth", "mu"};
    Kit kit;
    MildMaterial m = mild_material_default();
    MildError error = {0};
    int field[5];
    double at_end[30], inside[30];
    m.recovery = 1.0;
    m.bed_depth = INFINITY;
    kit_open(&kit, 1, soles[0], soles[0], &m, 1e-3);
    kit.input.position[0][2] = -KIT_SOLE_Z - 1e-3;
    for (int s = 0; s < 20; s++) {
        kit_step(&kit, NULL);
    }
    kit.input.velocity[0][2] = 0.02; /* rises, on the unloading line */
    kit_inverse_inertia(&kit);
    kit_free(&kit, NULL);
    for (int k = 0; k < 5; k++) {
        field[k] =
            (int)(mild_field_find(mild_material_fields, mild_material_field_count, names[k], NULL) -
                  mild_material_fields);
    }
    MildContactDerivative asked = {.wrench_by_material = at_end,
                                   .field_count = 5,
                                   .field = field,
                                   .work = mild_scratch_create(kit.soles, 1, &error)};
    kit_solve(&kit);
    expect_good(mild_ground_derivative(kit.ground, &kit.terrain, &kit.input, kit.scratch,
                                       &kit.result, &asked, &error) == MILD_OK,
                &error);
    kit.terrain.materials[0].recovery = 1.0 - 1e-5;
    kit_solve(&kit);
    asked.wrench_by_material = inside;
    expect_good(mild_ground_derivative(kit.ground, &kit.terrain, &kit.input, kit.scratch,
                                       &kit.result, &asked, &error) == MILD_OK,
                &error);
    for (int i = 0; i < 6; i++) {
        assert_true(at_end[5 * i + 2] == 0.0 && at_end[5 * i + 3] == 0.0);
        expect_entry("recovery", i, at_end[5 * i + 1], inside[5 * i + 1],
                     1e-3 * fabs(inside[5 * 2 + 1]));
    }
    assert_true(fabs(at_end[5 * 2 + 1]) > 1.0); /* recovery makes it softer */
    mild_scratch_destroy(asked.work);
    kit_close(&kit);
}

/* ---- what a derivative must be ---- */

/* Bool: -(B + B^T)/2 + a little is positive definite, by Cholesky's decomposition. */
static int dissipates(const double *B, double little) {
    double L[6][6];
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = -0.5 * (B[6 * i + j] + B[6 * j + i]) * length_of(i) * length_of(j) /
                             (LEVER * LEVER) +
                         (i == j ? little : 0.0);
            for (int k = 0; k < j; k++) {
                sum -= L[i][k] * L[j][k];
            }
            if (i == j && !(sum > 0.0)) {
                return 0;
            }
            L[i][j] = i == j ? sqrt(sum) : sum / L[j][j];
        }
    }
    return 1;
}

/* Bool: friction is at its bound somewhere under a foot. */
static int foot_slides(const Kit *kit, int f) {
    const MildElements e = mild_scratch_elements(kit->scratch, f);
    int slides = 0;
    for (int i = 0; i < mild_sole_elements(kit->soles[f]); i++) {
        slides += e.slip[i];
    }
    return slides;
}

/* Feet that stand still: what the ground gives back to a small twist takes its energy. Where
 * friction holds, it is as much along one axis for a twist along another as the other way round;
 * elements that slide, a few at the edge, are not symmetric, as Coulomb's law is not. */
TEST(ground_at_rest_is_symmetric_and_dissipates) {
    int held = 0;
    for (int p = 0; p < mild_material_preset_count(); p++) {
        const char *name = mild_material_preset_name(p);
        MildMaterial m;
        Kit kit;
        MildError error = {0};
        double law[72];
        assert_true(mild_material_preset(name, &m));
        kit_open(&kit, 2, soles[0], soles[1], &m, 1e-3);
        kit.center[0][1] = -0.01;
        for (int s = 0; s < 2000; s++) {
            kit_step(&kit, NULL);
        }
        memset(kit.input.velocity, 0, sizeof kit.input.velocity); /* what is left of it */
        memset(kit.input.free_velocity, 0, sizeof kit.input.free_velocity);
        memset(kit.A, 0, sizeof kit.A);
        const MildContactDerivative asked = {.law = law};
        kit_solve(&kit);
        expect_good(mild_ground_derivative(kit.ground, &kit.terrain, &kit.input, kit.scratch,
                                           &kit.result, &asked, &error) == MILD_OK,
                    &error);
        for (int f = 0; f < 2; f++) {
            const double *B = law + 36 * f;
            const int slides = foot_slides(&kit, f);
            double most = 0.0, skew = 0.0;
            for (int i = 0; i < 36; i++) {
                most = fmax(most, fabs(B[i]));
                skew = fmax(skew, fabs(B[i] - B[6 * (i % 6) + i / 6]));
            }
            if (!dissipates(B, 1e-9 * most)) {
                fail_msg("%s gives energy to foot %d", name, f);
            }
            if (!(most > 100.0 && skew <= (slides ? 1e-3 : 1e-12) * most)) {
                fail_msg("%s: dW/dV %.1e, skew %.1e of it, %d slide", name, most, skew / most,
                         slides);
            }
            held += !slides;
        }
        kit_close(&kit);
    }
    print_message("%d of %d feet stand without an element that slides\n", held,
                  2 * mild_material_preset_count());
    assert_true(held > mild_material_preset_count());
}

/* With A = 0 the twist is given: dW/dV_free of the step is that of the law, and dW/d(pose) is that
 * of solves with A = 0. */
TEST(given_twists) {
    const MildMaterial m = kit_preset("foam45"); /* no drag: V_free is V */
    int compared = 0;
    for (int n = 0; n < 20; n++) {
        Kit kit;
        if (problem_under(&kit, &m, 0, n)) {
            double *const A = kit.input.inverse_inertia;
            double given[36 * 4] = {0.0}, most = 0.0;
            MildError error = {0};
            MildScratch *work = mild_scratch_create(kit.soles, kit.feet, &error);
            Derived derived;
            Score scores[2] = {{0}};
            memcpy(kit.input.free_velocity, kit.result.velocity,
                   6 * (size_t)kit.feet * sizeof(double));
            kit.input.inverse_inertia = given;
            kit_solve(&kit);
            derive(&kit, work, &derived);
            for (int i = 0; i < 36 * kit.feet * kit.feet; i++) {
                const int row = i / (6 * kit.feet), column = i % (6 * kit.feet);
                const int same = row / 6 == column / 6;
                const double law =
                    same ? derived.law[36 * (row / 6) + 6 * (row % 6) + column % 6] : 0.0;
                most = fmax(most, fabs(law));
                assert_true(derived.velocity[i] == (row == column));
                expect_entry("dW/dV_free", i, derived.wrench[i], law, 1e-12 * most + 1e-12);
            }
            const Differences pose = differences(&kit, move_pose, 1e-8);
            score_add(&scores[0], &pose, &pose.wrench, pose.wrench.most,
                      apart(&pose, &pose.wrench, derived.pose, -1, pose.wrench.most), n);
            assert_true(scores[0].worst < 1e-5);
            compared += scores[0].compared;
            kit.input.inverse_inertia = A;
            mild_scratch_destroy(work);
        }
        kit_close(&kit);
    }
    print_message("%d compared\n", compared);
    assert_true(compared > 5);
}

/* Asking leaves solve and memory as they were, twice gives the same, and the sweeps' answer has the
 * derivatives of Newton's. */
TEST(asking_changes_nothing) {
    const MildMaterial m = kit_preset("sand_loose");
    for (int n = 0; n < 10; n++) {
        Kit kit;
        if (problem_under(&kit, &m, n % 2, n)) {
            MildError error = {0};
            MildScratch *work = mild_scratch_create(kit.soles, kit.feet, &error);
            MildGround *block = malloc(kit.bytes), *after = malloc(kit.bytes);
            Derived derived, again;
            memcpy(block, kit.ground, kit.bytes);
            kit_solve(&kit);
            mild_ground_advance(kit.ground, &kit.terrain, &kit.input, kit.scratch, &kit.result);
            memcpy(after, kit.ground, kit.bytes);
            memcpy(kit.ground, block, kit.bytes);
            kit_solve(&kit);
            derive(&kit, work, &derived);
            derive(&kit, work, &again);
            assert_memory_equal(derived.law, again.law, 36 * (size_t)kit.feet * sizeof(double));
            const size_t all = 36 * (size_t)(kit.feet * kit.feet) * sizeof(double);
            assert_memory_equal(derived.wrench, again.wrench, all);
            assert_memory_equal(derived.pose, again.pose, all);
            assert_memory_equal(kit.ground, block, kit.bytes);
            mild_ground_advance(kit.ground, &kit.terrain, &kit.input, kit.scratch, &kit.result);
            assert_memory_equal(kit.ground, after, kit.bytes);
            memcpy(kit.ground, block, kit.bytes);
            kit.input.solver = MILD_SOLVER_GAUSS_SEIDEL;
            kit.input.max_iterations = 100000;
            kit_solve(&kit);
            if (kit.result.converged) {
                double most = 0.0;
                derive(&kit, work, &again);
                for (size_t i = 0; i < all / sizeof(double); i++) {
                    most = fmax(most, fabs(derived.wrench[i]));
                }
                for (size_t i = 0; i < all / sizeof(double); i++) {
                    expect_entry("sweeps", (int)i, again.wrench[i], derived.wrench[i], 1e-4 * most);
                }
            }
            free(block);
            free(after);
            mild_scratch_destroy(work);
        }
        kit_close(&kit);
    }
}

/* A foot in the air, and one without rows. */
TEST(feet_that_touch_nothing) {
    const MildMaterial m = kit_preset("foam45");
    Kit kit;
    Derived derived;
    MildError error = {0};
    kit_open(&kit, 2, soles[0], soles[1], &m, 1e-3);
    MildScratch *work = mild_scratch_create(kit.soles, 2, &error);
    kit.input.position[0][2] = -KIT_SOLE_Z - 2e-3;
    kit.input.position[1][2] = 1.0;
    kit_inverse_inertia(&kit);
    for (int i = 0; i < 6; i++) {
        kit.A[12 * i + 6 + i] = kit.A[12 * (6 + i) + i] = 0.02; /* what joins them */
    }
    for (int rows = 0; rows < 2; rows++) {
        double alone[36], *A = kit.A;
        for (int i = 0; i < 36; i++) {
            alone[i] = kit.A[i / 6 * 12 + i % 6];
        }
        kit.input.inverse_inertia = rows ? alone : A;
        kit.input.rows = rows ? 1 : 0;
        kit_free(&kit, NULL);
        kit_solve(&kit);
        derive(&kit, work, &derived);
        assert_true(derived.wrench[2 * 12 + 2] < -1.0 && derived.law[2 * 6 + 2] < -1.0);
        assert_true(derived.pose[2 * 12 + 2] < -1.0);
        for (int i = 0; i < 144; i++) {
            const int row = i / 12, column = i % 12;
            if (row >= 6 || column >= 6) {
                assert_true(derived.wrench[i] == 0.0 && derived.pose[i] == 0.0);
            }
            if (column >= 6) {
                assert_true(derived.velocity[i] == (row == column));
            }
        }
        for (int i = 36; i < 72; i++) {
            assert_true(derived.law[i] == 0.0);
        }
        /* the other foot moves with it through A, if that is known */
        assert_true((fabs(derived.velocity[8 * 12 + 2]) > 1e-4) == !rows);
    }
    kit.input.position[0][2] = 1.0; /* both */
    kit_solve(&kit);
    derive(&kit, work, &derived);
    for (int i = 0; i < 144; i++) {
        assert_true(derived.wrench[i] == 0.0 && derived.pose[i] == 0.0);
        assert_true(derived.velocity[i] == (i / 12 == i % 12));
    }
    mild_scratch_destroy(work);
    kit_close(&kit);
}

TEST(what_is_refused) {
    const MildMaterial m = kit_preset("foam45");
    Kit kit;
    MildError error = {0};
    double numbers[36];
    int field = 0;
    kit_open(&kit, 1, soles[0], soles[0], &m, 1e-3);
    MildScratch *work = mild_scratch_create(kit.soles, 1, &error);
    const MildSole *const other[] = {soles[2]};
    MildScratch *small = mild_scratch_create(other, 1, &error);
    kit.input.position[0][2] = -KIT_SOLE_Z - 1e-3;
    kit_inverse_inertia(&kit);
    kit_free(&kit, NULL);
    kit_solve(&kit);
    MildContactDerivative asked = {.wrench_by_pose = numbers};
#define DERIVE()                                                                                   \
    mild_ground_derivative(kit.ground, &kit.terrain, &kit.input, kit.scratch, &kit.result, &asked, \
                           &error)
    assert_refused(DERIVE(), MILD_ERROR_ARGUMENT, &error, "work");
    asked.work = kit.scratch;
    assert_refused(DERIVE(), MILD_ERROR_ARGUMENT, &error, "work");
    asked.work = small;
    assert_refused(DERIVE(), MILD_ERROR_ARGUMENT, &error, "work");
    asked = (MildContactDerivative){
        .wrench_by_material = numbers, .field = &field, .field_count = 1, .work = work};
    asked.material = 1;
    assert_refused(DERIVE(), MILD_ERROR_RANGE, &error, "material 1");
    asked.material = 0;
    for (field = 0; mild_material_fields[field].type == MILD_FIELD_DOUBLE; field++) {
    }
    assert_refused(DERIVE(), MILD_ERROR_RANGE, &error, "field");
    field = mild_material_field_count;
    assert_refused(DERIVE(), MILD_ERROR_RANGE, &error, "field");
    field = 0;
    kit.input.solver = MILD_SOLVER_EXPLICIT;
    assert_refused(DERIVE(), MILD_ERROR_ARGUMENT, &error, "explicit newton");
    kit.input.solver = MILD_SOLVER_NEWTON;
    kit.result.converged = 0;
    assert_refused(DERIVE(), MILD_ERROR_ARGUMENT, &error, "converged");
    kit.result.converged = 1;
    assert_int_equal(DERIVE(), MILD_OK);
    mild_scratch_destroy(work);
    mild_scratch_destroy(small);
    kit_close(&kit);
}

int main(int argc, char **argv) {
    problem_count = argc > 1 ? atoi(argv[1]) : 0;
    first_problem = argc > 2 ? atoi(argv[2]) : 0;
    return run_cases(open_soles, close_soles);
}
