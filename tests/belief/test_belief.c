/* The recursion of a belief on frames made by hand: which footsteps count, that left and right are
 * one, that standing and an alarm begin anew, quantiles by their definition, and that a step
 * allocates nothing. */
#include "kit.h"

#include "base/random.h"
#include "identify/belief/file.h"

#define SHIPPED MILD_SOURCE_DIR "/" BELIEF_SHIPPED
#define TWO_PI 6.283185307179586

enum { STEP = 50 /* frames */ };

static int allocations; /* the linker wraps the allocator (tests/CMakeLists.txt) */
WRAPS(malloc);
WRAPS(calloc);
WRAPS(realloc);

void *__wrap_malloc(size_t size) {
    allocations++;
    return __real_malloc(size);
}

void *__wrap_calloc(size_t count, size_t size) {
    allocations++;
    return __real_calloc(count, size);
}

void *__wrap_realloc(void *block, size_t size) {
    allocations++;
    return __real_realloc(block, size);
}

static BeliefNet *net;

static int setup(void **state) {
    MildError error = {0};
    (void)state;
    net = belief_read(SHIPPED, &error);
    return net ? 0 : (print_error("%s\n", error.text), -1);
}

static int teardown(void **state) {
    (void)state;
    free(net);
    return 0;
}

/* A walk that no robot walks: each channel has its own waves, and noise. mirrored: seen in a
 * mirror, where it begins with the other foot. */
static void make_frame(int t, double loud, int mirrored, float frame[BELIEF_FRAME]) {
    static const int legs[12] = {6, 7, 8, 9, 10, 11, 0, 1, 2, 3, 4, 5};
    static const double sign[6] = {-1, -1, 1, 1, 1, -1},
                        first[9] = {-1, 1, -1, 1, -1, -1, 1, -1, 1};
    const double phase = (t + 0.5) / (2 * STEP);
    Random r = random_at(7, (uint32_t)t, 0);
    float plain[BELIEF_FRAME];
    for (int i = 0; i < BELIEF_FRAME - 2; i++) {
        plain[i] = (float)(0.3 * sin(TWO_PI * phase + i) + loud * (random_unit(&r) - 0.5));
    }
    plain[3] = 1, plain[4] = plain[5] = 0;
    for (int i = 0; i < BELIEF_FRAME - 2; i++) {
        const int kind = (i - 9) / 12, at = (i - 9) % 12;
        frame[i] = !mirrored ? plain[i]
                   : i < 9   ? (float)first[i] * plain[i]
                             : (float)sign[at % 6] * plain[9 + 12 * kind + legs[at]];
    }
    frame[45] = (float)((mirrored ? -1 : 1) * sin(TWO_PI * phase));
    frame[46] = (float)((mirrored ? -1 : 1) * cos(TWO_PI * phase));
}

static int follow(Belief *belief, int from, int frames, double loud, int mirrored) {
    float frame[BELIEF_FRAME];
    int footsteps = 0;
    for (int t = from; t < from + frames; t++) {
        make_frame(t, loud, mirrored, frame);
        footsteps += (belief_step(belief, net, frame) & BELIEF_FOOTSTEP) != 0;
    }
    return footsteps;
}

/* The first footstep's beginning is not seen, the next two are not looked at. A footstep is known
 * when the next one begins. */
TEST(test_footsteps_that_count) {
    Belief belief;
    net->alarm = INFINITY;
    belief_reset(&belief);
    assert_int_equal(follow(&belief, 10, 4 * STEP - 10, 0.1, 0), 0);
    expect_near("the prior", (double)belief.spread[0], 1, 0);
    assert_int_equal(follow(&belief, 4 * STEP, 1, 0.1, 0), 1);
    assert_int_equal(belief.footsteps, 1);
    assert_true(belief.spread[0] != 1);
    assert_int_equal(follow(&belief, 4 * STEP + 1, 5 * STEP, 0.1, 0), 5);
}

TEST(test_standing_begins_anew) {
    Belief belief;
    float still[BELIEF_FRAME] = {0};
    belief_reset(&belief);
    follow(&belief, 0, 6 * STEP + 1, 0.1, 0);
    const int before = belief.footsteps;
    assert_int_equal(belief_step(&belief, net, still), 0);
    assert_int_equal(follow(&belief, 6 * STEP + 20, 4 * STEP - 20, 0.1, 0), 0);
    assert_int_equal(belief.footsteps, before); /* what was known stays */
    assert_int_equal(follow(&belief, 10 * STEP, 1, 0.1, 0), 1);
}

/* A footstep of another length than a robot makes, as after a lost second, does not count. */
TEST(test_long_footsteps_do_not_count) {
    Belief belief;
    float frame[BELIEF_FRAME];
    belief_reset(&belief);
    follow(&belief, 0, 5 * STEP + 1, 0.1, 0);
    const int before = belief.footsteps;
    make_frame(5 * STEP + 10, 0.1, 0, frame);
    for (int i = 0; i < 2 * STEP; i++) {
        belief_step(&belief, net, frame);
    }
    assert_int_equal(follow(&belief, 6 * STEP, 1, 0.1, 0), 0);
    assert_int_equal(belief.footsteps, before);
}

TEST(test_mirror) {
    Belief left, right;
    belief_reset(&left);
    belief_reset(&right);
    follow(&left, 0, 9 * STEP + 1, 0.1, 0);
    follow(&right, 0, 9 * STEP + 1, 0.1, 1);
    assert_int_equal(left.footsteps, right.footsteps);
    assert_true(isfinite(left.log_odds));
    expect_near("log odds", (double)right.log_odds, (double)left.log_odds, 1e-4);
    for (int i = 0; i < BELIEF_PARAMETERS; i++) {
        expect_entry("center", i, (double)right.center[i], (double)left.center[i], 1e-6);
        expect_entry("spread", i, (double)right.spread[i], (double)left.spread[i], 1e-6);
    }
}

/* Two footsteps are left after an alarm, and what was before has no part in the posterior. */
TEST(test_alarm_forgets) {
    Belief belief, other;
    float frame[BELIEF_FRAME];
    int event = 0;
    net->alarm = INFINITY;
    belief_reset(&belief);
    belief_reset(&other);
    follow(&belief, 0, 12 * STEP, 0.1, 0);
    follow(&other, 2 * STEP, 4 * STEP, 0.5, 0);
    follow(&other, 6 * STEP, 6 * STEP, 0.1, 0);
    net->alarm = -INFINITY;
    make_frame(12 * STEP, 0.1, 0, frame);
    event = belief_step(&belief, net, frame);
    belief_step(&other, net, frame);
    assert_int_equal(event, BELIEF_FOOTSTEP | BELIEF_ALARM);
    assert_int_equal(belief.alarms, 1);
    assert_int_equal(belief.footsteps, 2);
    for (int i = 0; i < BELIEF_PARAMETERS; i++) {
        expect_entry("center", i, (double)belief.center[i], (double)other.center[i], 1e-6);
    }
    net->alarm = INFINITY;
}

TEST(test_quantiles) {
    Belief belief;
    belief_reset(&belief);
    for (int i = 0; i < BELIEF_PARAMETERS; i++) {
        const BeliefParameter p = (BeliefParameter)i;
        double before = 0;
        for (int k = 1; k < 100; k++) {
            const double value = belief_quantile(&belief, net, p, 0.01 * k);
            const double place = belief_place(net, p, value);
            assert_true(value > before);
            before = value;
            expect_near("share below", 0.5 * erfc(-place / sqrt(2)), 0.01 * k, 1e-6);
        }
        belief.center[i] = 0.5f, belief.spread[i] = 0.25f;
        expect_near("median", belief_place(net, p, belief_quantile(&belief, net, p, 0.5)), 0.5,
                    1e-6);
        expect_near("95 %", belief_place(net, p, belief_quantile(&belief, net, p, 0.95)),
                    0.5 + 0.25 * 1.6448536, 1e-6);
        belief.spread[i] = 1e-3f;
        expect_near("mean of a narrow one", belief_log_mean(&belief, net, p),
                    log(belief_quantile(&belief, net, p, 0.5)), 1e-3);
    }
}

TEST(test_no_allocation) {
    Belief belief;
    belief_reset(&belief);
    const int before = allocations;
    assert_true(follow(&belief, 0, 40 * STEP, 0.1, 0) > 30);
    assert_int_equal(allocations, before);
}

static void refuse_log(const char *path, const char *behind) {
    BeliefLog log;
    MildError error = {0};
    char names[64];
    snprintf(names, sizeof names, "%s%s", path, behind);
    assert_refused(belief_log_read(path, 0, &log, &error), MILD_ERROR_FORMAT, &error, names);
}

/* What a log cannot be says its line; a log that was written is read back. */
TEST(test_log) {
    char path[] = "/tmp/belief_XXXXXX";
    BeliefLog log;
    MildError error = {0};
    float frame[BELIEF_FRAME];
    const int descriptor = mkstemp(path);
    assert_true(descriptor >= 0);
    FILE *file = fdopen(descriptor, "w");
    belief_log_print_header(file);
    for (int t = 0; t < 7; t++) {
        make_frame(t, 0.1, 0, frame);
        belief_log_print(file, 0.01 * t, frame);
    }
    fclose(file);
    assert_true(belief_log_is(path));
    assert_int_equal(belief_log_read(path, 0, &log, &error), MILD_OK);
    assert_int_equal(log.count, 7);
    assert_memory_equal(log.frame[6], frame, sizeof frame);
    free(log.frame);
    file = fopen(path, "a");
    belief_log_print(file, 0.08, frame);
    fclose(file);
    refuse_log(path, ":9 time_s 0.08");
    file = fopen(path, "w");
    belief_log_print_header(file);
    fprintf(file, "0,1,2,nan\n");
    fclose(file);
    refuse_log(path, ":2 column 4");
    file = fopen(path, "w");
    fprintf(file, "depth_m,force_n\n1,2\n");
    fclose(file);
    assert_false(belief_log_is(path));
    refuse_log(path, "");
    remove(path);
}

TEST(test_files_that_are_none) {
    MildError error = {0};
    assert_null(belief_read(MILD_SOURCE_DIR "/policies/mild.safetensors", &error));
    assert_error(&error, MILD_ERROR_FORMAT, MILD_SOURCE_DIR "/policies/mild.safetensors");
    assert_null(belief_read(MILD_SOURCE_DIR "/policies/none.safetensors", &error));
    BeliefNet *none = net;
    assert_int_equal(belief_open("go1", &none, &error), MILD_OK);
    assert_null(none);
}

TEST_MAIN(setup, teardown)
