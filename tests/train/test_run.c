/* The log of a run: each column has the number that its name says, of the report of that
 * iteration. */
#include "kit.h"
#include "run/train/run.h"

enum { ITERATIONS = 3, ENVS = 12, STEPS = 30, COLUMNS_MAX = 80 };
#define FOLDER "build_test_run"

static TrainReport reports[ITERATIONS];

static void keep(void *self, int64_t iteration, const TrainReport *report, double share) {
    (void)self;
    assert_true(iteration >= 1 && iteration <= ITERATIONS);
    assert_true(fabs(share - (double)iteration / ITERATIONS) < 1e-12);
    reports[iteration - 1] = *report;
}

/* The number of a name; written down here a second time, by its meaning. */
static double number_of(const char *name, const TrainReport *r, int iteration) {
    const struct {
        const char *name;
        double value;
    } known[] = {{"iteration", iteration},
                 {"episode/reward", r->episodes.reward},
                 {"episode/length_s", r->episodes.length},
                 {"episode/speed_error", r->episodes.speed_error},
                 {"episode/falls", r->episodes.falls},
                 {"episode/ended", r->episodes.episodes},
                 {"episode/diverged", r->episodes.diverged},
                 {"episode/assist", r->episodes.assist},
                 {"loss/surrogate", r->ppo.surrogate},
                 {"loss/value", r->ppo.value_loss},
                 {"loss/entropy", r->ppo.entropy},
                 {"loss/kl", r->ppo.kl},
                 {"loss/clip_share", r->ppo.clip_share},
                 {"loss/mirror", r->ppo.mirror},
                 {"loss/reconstruction", r->ppo.vae_reconstruction},
                 {"loss/vae_kl", r->ppo.vae_kl},
                 {"loss/base_velocity", r->ppo.estimate_loss[0]},
                 {"loss/feet_velocity", r->ppo.estimate_loss[1]},
                 {"loss/feet_height", r->ppo.estimate_loss[2]},
                 {"ppo/learning_rate", r->ppo.learning_rate},
                 {"ppo/gradient", r->ppo.gradient_norm},
                 {"ppo/action_std", r->ppo.action_std},
                 {"ppo/explained", r->ppo.explained_variance},
                 {"ppo/skipped", r->ppo.skipped},
                 {"rate/steps_per_s", r->steps_per_s},
                 {"rate/steps", (double)iteration * ENVS * STEPS}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        if (strcmp(known[i].name, name) == 0) {
            return known[i].value;
        }
    }
    for (int t = 0; t < TASK_REWARD_COUNT; t++) {
        if (strncmp(name, "reward/", 7) == 0 && strcmp(task_reward_names[t], name + 7) == 0) {
            return r->episodes.terms[t];
        }
    }
    fail_msg("what is %s?", name);
    return NAN;
}

static void run(const ExperimentDef *def) {
    MildError error = {0};
    const TrainRunDef of = {.folder = FOLDER,
                            .def = def,
                            .config = "[train]\nrobot = sa01\n",
                            .version = "0",
                            .note = "test"};
    const TrainCallbacks callbacks = {.iterated = keep};
    TrainRun *run = train_run_open(&of, &callbacks, &error);
    expect_good(run != NULL, &error);
    assert_int_equal(train_run_loop(run, &error), MILD_OK);
    train_run_close(run);
}

TEST(a_column_is_what_it_names) {
    char header[4096], line[4096], *names[COLUMNS_MAX], *more;
    ExperimentDef def = experiment_def_default();
    int columns = 0, rows = 0, ended = 0;
    def.train.envs = ENVS;
    def.train.threads = 2;
    def.train.iterations = ITERATIONS;
    def.train.minutes = 0;
    def.ppo.steps = STEPS;
    def.ppo.minibatches = 2;
    def.task.episode = 0.5;
    run(&def);
    FILE *csv = fopen(FOLDER "/log.csv", "r");
    assert_non_null(csv);
    assert_non_null(fgets(header, sizeof header, csv));
    for (char *word = strtok_r(header, ",\n", &more); word; word = strtok_r(NULL, ",\n", &more)) {
        assert_true(columns < COLUMNS_MAX);
        names[columns++] = word;
    }
    assert_int_equal(columns, 26 + TASK_REWARD_COUNT);
    for (; fgets(line, sizeof line, csv); rows++) {
        char *at = line;
        assert_true(rows < ITERATIONS);
        ended += reports[rows].episodes.episodes;
        for (int c = 0; c < columns; c++, at++) {
            const double is = strtod(at, &at),
                         wanted = number_of(names[c], &reports[rows], rows + 1);
            if (!(fabs(is - wanted) <= 1e-8 * fabs(wanted)) && !(isnan(is) && isnan(wanted))) {
                fail_msg("%s of iteration %d: %g, not %g", names[c], rows + 1, is, wanted);
            }
        }
    }
    fclose(csv);
    print_message("%d columns, %d rows, %d episodes ended\n", columns, rows, ended);
    assert_int_equal(rows, ITERATIONS);
    assert_true(ended > 0);
}

static int remove_folder(void **state) {
    (void)state;
    return system("rm -rf " FOLDER);
}

TEST_MAIN(remove_folder, remove_folder)
