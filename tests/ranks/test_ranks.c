/* Every call of ranks.h, alone and, started by mpirun (app/test_ranks.sh), among 2 and 16
 * processes: each computes what all should get by itself, and compares. */
#include <float.h>

#include "base/random.h"
#include "device/ranks/ranks.h"
#include "kit.h"

enum { SHARDS = 32, COUNT = 40001 }; /* more than one block, and no multiple of one */
enum { GRADIENT = 650000 };          /* numbers of that of the default networks */

static Ranks *ranks;

/* Number i of shard s: of any size, so that the order of a sum shows in its last bits. */
static double number(int s, int i) {
    Random random = random_at(7, (uint32_t)s, (uint32_t)i);
    return random_normal(&random) * exp(3 * random_normal(&random));
}

static float tree(int first, int count, int i) {
    return count == 1 ? (float)number(first, i)
                      : tree(first, count / 2, i) + tree(first + count / 2, count / 2, i);
}

static double tree_double(int first, int count, int i) {
    return count == 1
               ? number(first, i)
               : tree_double(first, count / 2, i) + tree_double(first + count / 2, count / 2, i);
}

TEST(sums_are_one_tree) {
    const int own = SHARDS / ranks_count(ranks), first = own * ranks_number(ranks);
    static float x[COUNT];
    static double y[COUNT];
    int ordered = 0;
    for (int i = 0; i < COUNT; i++) {
        x[i] = tree(first, own, i);
        y[i] = tree_double(first, own, i);
    }
    ranks_sum(ranks, x, COUNT);
    ranks_sum_double(ranks, y, COUNT);
    for (int i = 0; i < COUNT; i++) {
        float plain = 0;
        for (int s = 0; s < SHARDS; s++) {
            plain += (float)number(s, i);
        }
        assert_true(x[i] == tree(0, SHARDS, i));
        assert_true(y[i] == tree_double(0, SHARDS, i));
        ordered += x[i] != plain;
    }
    assert_true(ordered > COUNT / 10); /* another order would have shown */
    ranks_sum(ranks, x, 0);
    ranks_sum_double(ranks, y, 0);
}

TEST(bytes_arrive) {
    const int me = ranks_number(ranks), count = ranks_count(ranks);
    char data[1000], part[SHARDS], whole[SHARDS * SHARDS] = {0};
    memset(data, me == 0 ? 'x' : 'y', sizeof data);
    ranks_broadcast(ranks, data, sizeof data - 1);
    assert_true(data[0] == 'x' && data[998] == 'x');
    assert_true(data[999] == (me == 0 ? 'x' : 'y'));
    ranks_broadcast(ranks, NULL, 0);
    /* rank r gives r bytes; rank 0 none */
    memset(part, '0' + me, sizeof part);
    ranks_gather(ranks, part, (size_t)me, whole);
    int at = 0;
    for (int r = 0; r < count && me == 0; r++) {
        for (int i = 0; i < r; i++) {
            assert_int_equal(whole[at++], '0' + r);
        }
    }
    assert_int_equal(whole[at], 0);
    ranks_wait(ranks);
}

TEST(all_agree) {
    const int me = ranks_number(ranks), count = ranks_count(ranks);
    assert_int_equal(ranks_any(ranks, 0), 0);
    MildError error = {0};
    assert_int_equal(ranks_agree(ranks, MILD_OK, &error), MILD_OK);
    assert_int_equal(error.text[0], 0);
    for (int one = 0; one < count; one++) {
        assert_int_equal(ranks_any(ranks, me == one), 1);
        /* `one` and all after it fail, each in its own way */
        char expected[sizeof error.text];
        MildStatus status = MILD_OK;
        memset(&error, 0, sizeof error);
        if (me >= one) {
            status = mild_fail(&error, me == one ? MILD_ERROR_IO : MILD_ERROR_RANGE, "no %d", me);
        }
        assert_int_equal(ranks_agree(ranks, status, &error), MILD_ERROR_IO);
        assert_int_equal(error.status, MILD_ERROR_IO);
        if (one == 0) {
            snprintf(expected, sizeof expected, "no 0");
        } else {
            snprintf(expected, sizeof expected, "process %d %d no %d", one + 1, count, one);
        }
        const MildError agreed = error;
        assert_error(&error, MILD_ERROR_IO, expected);
        /* an agreed failure is agreed on once more without a second name in front */
        error = agreed;
        assert_int_equal(ranks_agree(ranks, MILD_ERROR_IO, &error), MILD_ERROR_IO);
        assert_memory_equal(&error, &agreed, sizeof error);
        assert_int_equal(ranks_agree(ranks, status, NULL), MILD_ERROR_IO);
    }
}

#ifdef MILD_NCCL

#include <cuda_runtime.h>

static void expect_done(cudaError_t result) {
    if (result != cudaSuccess) {
        fail_msg("%s", cudaGetErrorString(result));
    }
}

/* [us] of a sum of so many zeros on the device: the least of five graphs of 100 sums. */
static double sum_us(float *zeros, int64_t count, cudaStream_t stream) {
    enum { SUMS = 100, GRAPHS = 6 }; /* the first one warms up */
    MildError error = {0};
    cudaGraph_t graph;
    cudaGraphExec_t exec;
    cudaEvent_t begin, end;
    expect_done(cudaEventCreate(&begin));
    expect_done(cudaEventCreate(&end));
    expect_done(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
    for (int i = 0; i < SUMS; i++) {
        assert_int_equal(ranks_sum_device(ranks, zeros, count, stream, &error), MILD_OK);
    }
    expect_done(cudaStreamEndCapture(stream, &graph));
    expect_done(cudaGraphInstantiate(&exec, graph, 0));
    float ms, least = FLT_MAX;
    for (int i = 0; i < GRAPHS; i++) {
        ranks_wait(ranks);
        expect_done(cudaEventRecord(begin, stream));
        expect_done(cudaGraphLaunch(exec, stream));
        expect_done(cudaEventRecord(end, stream));
        expect_done(cudaStreamSynchronize(stream));
        expect_done(cudaEventElapsedTime(&ms, begin, end));
        least = i > 0 && ms < least ? ms : least;
    }
    cudaGraphExecDestroy(exec);
    cudaGraphDestroy(graph);
    cudaEventDestroy(begin);
    cudaEventDestroy(end);
    return 1000.0 * (double)least / SUMS;
}

/* For scripts/gpus.py. */
static void say_times(void) {
    static const int64_t counts[] = {20, GRADIENT};
    float *zeros;
    cudaStream_t stream;
    expect_done(cudaStreamCreate(&stream));
    expect_done(cudaMalloc((void **)&zeros, GRADIENT * sizeof *zeros));
    expect_done(cudaMemset(zeros, 0, GRADIENT * sizeof *zeros));
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        const double us = sum_us(zeros, counts[i], stream);
        if (ranks_number(ranks) == 0) {
            print_message("a sum of %zu B by %d GPUs takes %.2f us\n",
                          (size_t)counts[i] * sizeof *zeros, ranks_count(ranks), us);
        }
    }
    cudaFree(zeros);
    cudaStreamDestroy(stream);
}

/* The sums of x and y on the device, captured in a graph. */
static void sum_in_a_graph(float *x, double *y) {
    MildError error = {0};
    cudaStream_t stream;
    cudaGraph_t graph;
    cudaGraphExec_t exec;
    float *dx;
    double *dy;
    expect_done(cudaStreamCreate(&stream));
    expect_done(cudaMalloc((void **)&dx, COUNT * sizeof *dx));
    expect_done(cudaMalloc((void **)&dy, COUNT * sizeof *dy));
    expect_done(cudaMemcpy(dx, x, COUNT * sizeof *dx, cudaMemcpyHostToDevice));
    expect_done(cudaMemcpy(dy, y, COUNT * sizeof *dy, cudaMemcpyHostToDevice));
    expect_done(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
    assert_int_equal(ranks_sum_device(ranks, dx, COUNT, stream, &error), MILD_OK);
    assert_int_equal(ranks_sum_device_double(ranks, dy, COUNT, stream, &error), MILD_OK);
    expect_done(cudaStreamEndCapture(stream, &graph));
    expect_done(cudaGraphInstantiate(&exec, graph, 0));
    expect_done(cudaGraphLaunch(exec, stream));
    expect_done(cudaStreamSynchronize(stream));
    expect_done(cudaMemcpy(x, dx, COUNT * sizeof *dx, cudaMemcpyDeviceToHost));
    expect_done(cudaMemcpy(y, dy, COUNT * sizeof *dy, cudaMemcpyDeviceToHost));
    cudaGraphExecDestroy(exec);
    cudaGraphDestroy(graph);
    cudaFree(dx);
    cudaFree(dy);
    cudaStreamDestroy(stream);
}

static void compare_with_trees(void) {
    static float x[COUNT];
    static double y[COUNT];
    const int own = SHARDS / ranks_count(ranks), first = own * ranks_number(ranks);
    MildError error = {0};
    for (int i = 0; i < COUNT; i++) {
        x[i] = tree(first, own, i);
        y[i] = tree_double(first, own, i);
    }
    sum_in_a_graph(x, y);
    for (int i = 0; i < COUNT; i++) {
        assert_true(x[i] == tree(0, SHARDS, i));
        assert_true(y[i] == tree_double(0, SHARDS, i));
    }
    assert_int_equal(ranks_sum_device(ranks, x, GRADIENT + 1, NULL, &error), MILD_ERROR_RANGE);
    print_message("the same sums on %d GPUs\n", ranks_count(ranks));
    say_times();
}

#else

static void compare_with_trees(void) {
    fail_msg("GPUs in a build without NCCL");
}

#endif

/* The same bits on GPUs, where each process has one. Otherwise a reason. */
TEST(sums_on_devices) {
    MildError error = {0};
    if (ranks_count(ranks) == 1) {
        assert_int_equal(ranks_open_device(ranks, 8, &error), MILD_OK);
        assert_int_equal(ranks_sum_device(ranks, NULL, 1, NULL, &error), MILD_OK);
        assert_int_equal(ranks_sum_device_double(ranks, NULL, 1, NULL, &error), MILD_OK);
        return;
    }
    if (ranks_open_device(ranks, GRADIENT * sizeof(float), &error) != MILD_OK) {
        print_message("%s\n", error.text);
        assert_true(error.text[0]);
        return;
    }
    compare_with_trees();
}

int main(void) {
    MildError error = {0};
    if (ranks_open(&ranks, &error) != MILD_OK) {
        fprintf(stderr, "%s\n", error.text);
        return 2;
    }
    const int failed = run_cases(NULL, NULL);
    ranks_close(ranks);
    return failed;
}
