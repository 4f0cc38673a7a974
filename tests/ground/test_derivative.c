/* mild_ground_derivative against differences of whole solves, and what a derivative of the ground
 * must be: symmetric and dissipative at rest. `ground_test_derivative COUNT [FIRST]` takes more
 * problems. */
#include "derivative_kit.h"

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

/* Bool: an element of foot 0, pressed, leaves faster than it came, after the free motion alone was
 * to take it into virgin ground, faster. */
static int is_thrown(const Kit *kit) {
    const FootScratch *foot = &kit->scratch->foot[0];
    int thrown = 0;
    for (int slot = 0; slot < foot->active; slot++) {
        const Slots *s = slot_block(foot, slot);
        const int i = slot % SLOT_LANES;
        thrown |= s->iz[i] > 0.0 && s->entry_speed[i] > -kit->input.velocity[0][2] + 1e-6 &&
                  s->entry_speed[i] < kit->result.velocity[2];
    }
    return thrown;
}

/* A foot that has pressed elastic sand and comes down again is thrown up within the step by the
 * other, to which it is coupled and which strikes the ground: the sand's lag, which depends on the
 * speed at which the foot comes, follows the free motion. */
TEST(derivatives_where_a_foot_is_thrown_up) {
    const int count = kit_draws(60);
    MildMaterial m = kit_preset("sand_dense");
    Score scores[SCORES] = {{0}};
    int thrown = 0;
    uint64_t random = 5;
    m.recovery = 0.9;
    for (int n = 0; n < count; n++) {
        Kit kit;
        kit_open(&kit, 2, soles[5], soles[6], &m, 2e-3);
        for (int s = 0; s < 4; s++) { /* down, and a little up */
            kit.input.free_velocity[2] = s < 3 ? -0.5 : kit_uniform(&random, 0.02, 0.1);
            kit.input.free_velocity[8] = -0.5;
            kit_solve(&kit);
            kit_advance(&kit);
        }
        kit.mass[0] = kit.mass[1] = 1.0;
        kit_inverse_inertia(&kit);
        for (int i = 0; i < 6; i++) {
            kit.A[12 * i + 6 + i] = kit.A[12 * (6 + i) + i] = 0.9 * kit.A[13 * i];
        }
        kit.input.velocity[0][2] = kit_uniform(&random, -0.6, -0.3);
        kit.input.velocity[1][2] = kit_uniform(&random, -4.0, -1.0);
        kit_free(&kit, NULL);
        kit_solve(&kit);
        if (is_thrown(&kit) && kit.result.converged) {
            thrown++;
            compare(&kit, n, scores);
        }
        kit_close(&kit);
    }
    print_message("%d of %d\n", thrown, count);
    expect_scores("thrown up", scores, count / 4, (Score[SCORES]){{0}});
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
    kit.input.feet = 0; /* which no solve reads, but differences move so many feet */
    assert_refused(DERIVE(), MILD_ERROR_ARGUMENT, &error, "input.feet 0 1");
    kit.input.feet = MILD_FEET_MAX + 1;
    assert_refused(DERIVE(), MILD_ERROR_ARGUMENT, &error, "input.feet 17 1");
    kit.input.feet = 1;
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
