/* The rivals `clock` and `ht2` against PyTorch (make_rivals.py), over two episodes, and files that
 * are not theirs. */
#include <unistd.h>

#include "control/controller.h"
#include "learn/safetensors.h"

enum { ENVS = 3, STEPS = 13, SECOND = 8, TENSORS_MAX = 64 };

#include "control/control_kit.h"

#define FOLDER MILD_SOURCE_DIR "/lab/paper/tests/"
#define PATH "build_test_rivals.safetensors"

static const char *const kinds[2] = {"clock", "ht2"};

static const char *reference(const char *kind, char path[256]) {
    snprintf(path, 256, FOLDER "%s.safetensors", kind);
    return path;
}

static MildStatus make(const char *kind, const char *path, Pool *pool, Controller *controller,
                       MildError *error) {
    const ControllerDef wanted = {path, &task, robot, pool, ENVS};
    return controller_make(kind, &wanted, controller, error);
}

/* ---- the numbers ---- */

typedef struct {
    float frames[STEPS][SA01_OBSERVATION];
    float actions[STEPS][SA01_JOINTS];
} Reference;

static void read_reference(const char *path, Reference *to) {
    MildError error = {0};
    Safetensors *file = safetensors_read(path, &error);
    expect_good(file != NULL, &error);
    const Safetensor *frames = safetensors_find(file, "train.frames"),
                     *actions = safetensors_find(file, "train.actions");
    assert_true(frames && frames->bytes == sizeof to->frames);
    assert_true(actions && actions->bytes == sizeof to->actions);
    memcpy(to->frames, frames->data, frames->bytes);
    memcpy(to->actions, actions->data, actions->bytes);
    safetensors_destroy(file);
}

/* The environment at step t of the reference; older frames of its history are of no use. */
static void show(TaskEnv *env, const Reference *r, int t) {
    float *history = task_env_history(env);
    for (int i = 0; i < SA01_HISTORY; i++) {
        history[i] = NAN;
    }
    memcpy(history + (TASK_FRAMES - 1) * SA01_OBSERVATION, r->frames[t], sizeof r->frames[t]);
    env->step_first = t < SECOND ? 71 : 0; /* an episode of training may begin anywhere */
    env->step = env->step_first + (uint32_t)(t < SECOND ? t : t - SECOND);
    if (env->step == env->step_first) {
        memset(env->action, 0, sizeof env->action);
    }
}

/* Rows begin one step after each other, so that their contexts differ. */
static double run(Controller *controller, const Reference *r) {
    double worst = 0;
    for (int now = 0; now < STEPS + ENVS - 1; now++) {
        float actions[ENVS * SA01_JOINTS + 1];
        actions[ENVS * SA01_JOINTS] = 42;
        for (int e = 0; e < ENVS; e++) {
            const int t = now < e ? 0 : now - e;
            show(made[e], r, t < STEPS ? t : STEPS - 1);
        }
        controller->act(controller->self, ENVS, made, actions);
        assert_true(actions[ENVS * SA01_JOINTS] == 42);
        for (int e = 0; e < ENVS; e++) {
            const int t = now < e ? 0 : now - e;
            const float *action = actions + e * SA01_JOINTS;
            for (int j = 0; t < STEPS && j < SA01_JOINTS; j++) {
                assert_true(isfinite(action[j]));
                worst = fmax(worst, fabs((double)action[j] - (double)r->actions[t][j]));
            }
            memcpy(made[e]->action[0], action, SA01_JOINTS * sizeof *action);
        }
    }
    return worst;
}

/* Also a second time, after the first has filled every context. */
TEST(as_pytorch) {
    static Reference r;
    for (int k = 0; k < 2; k++) {
        char path[256];
        read_reference(reference(kinds[k], path), &r);
        for (int threads = 0; threads <= 2; threads += 2) {
            MildError error = {0};
            Pool *pool = threads ? pool_create(threads) : NULL;
            Controller controller = {0};
            expect_good(make(kinds[k], path, pool, &controller, &error) == MILD_OK, &error);
            assert_string_equal(controller.name, kinds[k]);
            for (int again = 0; again < 2; again++) {
                const double worst = run(&controller, &r);
                print_message("%s, %d threads: worst against PyTorch %.1e\n", kinds[k], threads,
                              worst);
                assert_true(worst < 1e-5);
            }
            controller_destroy(&controller);
            assert_null(controller.self);
            pool_destroy(pool);
        }
    }
}

/* ---- files ---- */

/* What is changed in a copy of a reference; NULL: nothing. */
typedef struct {
    const char *kind, *key, *value; /* a text */
    const char *drop, *spoil;       /* tensors that are left out, or get a NaN */
    const char *cut, *turn;         /* that lose a row, or whose rows are columns */
    const char *names;              /* by the error */
} Change;

static void rewrite(const Change *change) {
    char path[256];
    MildError error = {0};
    Safetensors *file = safetensors_read(reference(change->kind, path), &error);
    assert_non_null(file);
    Safetensor tensors[TENSORS_MAX];
    static float spoilt[8192];
    int count = 0;
    for (int i = 0; i < safetensors_count(file); i++) {
        Safetensor tensor = *safetensors_at(file, i);
        assert_true(count < TENSORS_MAX);
        if (change->spoil && strcmp(tensor.name, change->spoil) == 0) {
            assert_true(tensor.bytes <= sizeof spoilt);
            memcpy(spoilt, tensor.data, tensor.bytes);
            spoilt[tensor.bytes / sizeof(float) - 1] = NAN;
            tensor.data = spoilt;
        }
        tensor.shape[0] -= change->cut && strcmp(tensor.name, change->cut) == 0;
        if (change->turn && strcmp(tensor.name, change->turn) == 0) {
            const int64_t rows = tensor.shape[0];
            tensor.shape[0] = tensor.shape[1];
            tensor.shape[1] = rows;
        }
        if (!change->drop || strcmp(tensor.name, change->drop) != 0) {
            tensors[count++] = tensor;
        }
    }
    static const char *const keys[] = {"kind", "version", "robot", "heads", "layers"};
    SafetensorsText texts[5];
    int text_count = 0;
    for (int i = 0; i < 5; i++) {
        const int other = change->key && strcmp(change->key, keys[i]) == 0;
        const char *value = other ? change->value : safetensors_text(file, keys[i]);
        if (value) {
            texts[text_count++] = (SafetensorsText){keys[i], value};
        }
    }
    assert_int_equal(safetensors_write(PATH, tensors, count, texts, text_count, &error), MILD_OK);
    safetensors_destroy(file);
}

TEST(one_clear_line) {
    static const Change changes[] = {
        {"clock", "kind", "mild policy", .names = PATH " --policy"},
        {"ht2", "kind", NULL, .names = PATH " ht2 --policy"},
        {"clock", "version", "2", .names = PATH " version 2 1"},
        {"ht2", "robot", "go1", .names = PATH " go1 sa01 --policy"},
        {"clock", .drop = "actor.4.bias", .names = PATH " actor.4.bias"},
        {"clock", .drop = "actor.2.weight", .names = PATH " actor.2.weight"},
        {"clock", .spoil = "actor.0.bias", .names = PATH " actor.0.bias"},
        {"ht2", .spoil = "layers.1.down.weight", .names = PATH " layers.1.down.weight"},
        {"clock", .cut = "actor.4.weight", .names = PATH " actor.4.weight"},
        {"ht2", .turn = "embed_action.weight", .names = PATH " embed_action.weight"},
        {"ht2", .drop = "mask", .names = PATH " mask"},
        {"ht2", "heads", "5", .names = PATH " heads 5 24"},
        {"ht2", "heads", "many", .names = PATH " heads many 1 1000"},
        {"ht2", "layers", NULL, .names = PATH " layers"},
        {"ht2", "layers", "3", .names = PATH " layers.2.norm1.weight"},
        {"ht2", "layers", "17", .names = PATH " layers 17 16"},
    };
    for (size_t i = 0; i < sizeof changes / sizeof *changes; i++) {
        Controller controller = {0};
        MildError error = {0};
        rewrite(&changes[i]);
        assert_int_equal(make(changes[i].kind, PATH, NULL, &controller, &error), MILD_ERROR_FORMAT);
        assert_null(controller.self);
        assert_error(&error, MILD_ERROR_FORMAT, changes[i].names);
    }
    for (int k = 0; k < 2; k++) {
        Controller controller = {0};
        MildError error = {0};
        const Change none = {.kind = kinds[k]};
        rewrite(&none);
        assert_int_equal(make(kinds[k], PATH, NULL, &controller, &error), MILD_OK);
        controller_destroy(&controller);
        assert_int_equal(make(kinds[k], "no/such/file", NULL, &controller, &error), MILD_ERROR_IO);
    }
    unlink(PATH);
}

TEST(names) {
    static const char *const wanted[] = {"clock", "ht2", "passivity"};
    for (int i = 0; i < 3; i++) {
        assert_true(controller_has(wanted[i], CONTROLLER_FOLLOWS));
        assert_false(controller_has(wanted[i], CONTROLLER_POLICY));
    }
    assert_true(controller_has("passivity", CONTROLLER_OWN_GAINS));
}

TEST_MAIN(setup, teardown)
