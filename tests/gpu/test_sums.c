/* Sums on the device against plain loops: over the rows of columns, and over the blocks of losses.
 * On a device with MILD_CUDA, skipped (77) where there is none; else on the stand-in. */
#include "gpu_check.h"

#include "learn/loss_sample.h"

static void *device_memory(size_t bytes) {
    void *memory = NULL;
    assert_int_equal(cudaMalloc(&memory, bytes), cudaSuccess);
    return memory;
}

static void copy_to(void *device, const void *from, size_t bytes) {
    cudaMemcpyAsync(device, from, bytes, cudaMemcpyHostToDevice, NULL);
}

static void copy_from(void *to, const void *device, size_t bytes) {
    cudaMemcpyAsync(to, device, bytes, cudaMemcpyDeviceToHost, NULL);
    assert_int_equal(cudaStreamSynchronize(NULL), cudaSuccess);
}

/* Twice the sums of some rows of layers with widths that fill a block's columns or do not. Slices
 * are a row a thread, or many. */
static void check_columns(GpuQueue *q, int rows, const float *host, float *numbers,
                          float *gradient) {
    static const int widths[] = {8, 48, 16, 200, 64};
    enum { LAYERS = 5, ALL = 336 };
    const GpuArray none = {0}, d = gpu_array_float(numbers);
    float sums[ALL];
    q->columns.count = 0;
    for (int l = 0, at = ALL; l < LAYERS; l++) { /* from the end of the gradient on */
        at -= widths[l];
        const int slices =
            gpu_bias_backward(NULL, rows, widths[l], none, d, none, gpu_columns_next(q));
        gpu_columns_add(q, widths[l], slices, widths[l], at);
    }
    gpu_add_columns(NULL, q->columns, q->partial, 0.0f, gradient);
    gpu_add_columns(NULL, q->columns, q->partial, 1.0f, gradient);
    copy_from(sums, gradient, sizeof sums);
    for (int l = 0, at = ALL; l < LAYERS; l++) {
        at -= widths[l];
        for (int column = 0; column < widths[l]; column++) {
            double sum = 0.0;
            for (int r = 0; r < rows; r++) {
                sum += 2.0 * (double)host[r * widths[l] + column];
            }
            assert_true(fabs((double)sums[at + column] - sum) < 1e-6 * rows);
        }
    }
}

TEST(columns_are_added_up) {
    enum { ROWS = 20011, WIDEST = 200, ALL = 336, NUMBERS = ROWS * WIDEST };
    float *host = malloc(NUMBERS * sizeof *host);
    assert_non_null(host);
    GpuQueue q = {.partial = device_memory((size_t)GPU_SUM_SLICES * ALL * sizeof(float))};
    float *numbers = device_memory(NUMBERS * sizeof(float)),
          *gradient = device_memory(ALL * sizeof(float));
    Random random = random_at(9, 9, 9);
    fill_normal(host, NUMBERS, 1.0, &random);
    copy_to(numbers, host, NUMBERS * sizeof(float));
    check_columns(&q, 1, host, numbers, gradient);
    check_columns(&q, 700, host, numbers, gradient);
    check_columns(&q, ROWS, host, numbers, gradient);
    cudaFree(gradient);
    cudaFree(numbers);
    cudaFree(q.partial);
    free(host);
}

/* More blocks than a block has threads; block b's sum k is 10 b + k. */
TEST(losses_are_added_up) {
    enum { BLOCKS = 1000, NUMBERS = BLOCKS * GPU_SUMS };
    const double bs = BLOCKS * (BLOCKS - 1) / 2 * 10.0;
    static double sums[NUMBERS];
    static const float gradient[2] = {3.0f, 4.0f};
    for (int i = 0; i < NUMBERS; i++) {
        sums[i] = i / GPU_SUMS * 10 + i % GPU_SUMS;
    }
    GpuProgress progress = {.learning_rate = 1.0, .std = {1.0f}};
    void *on_device[] = {device_memory(sizeof sums), device_memory(sizeof gradient),
                         device_memory(GPU_PARTS * sizeof(double)), device_memory(sizeof progress)};
    copy_to(on_device[0], sums, sizeof sums);
    copy_to(on_device[1], gradient, sizeof gradient);
    copy_to(on_device[3], &progress, sizeof progress);
    const GpuDecision d = {.def = ppo_def_default(),
                           .actions = 1,
                           .samples = 1,
                           .images = 1,
                           .blocks = BLOCKS,
                           .count = 2,
                           .sums = on_device[0],
                           .gradient = on_device[1]};
    gpu_decide(NULL, d, on_device[2], on_device[3]);
    copy_from(&progress, on_device[3], sizeof progress);
    const PpoReport *r = &progress.report;
    const double found[] = {r->surrogate,        r->kl,
                            r->clip_share,       r->vae_reconstruction,
                            r->vae_kl,           r->estimate_loss[0],
                            r->estimate_loss[1], r->estimate_loss[2],
                            r->mirror,           r->value_loss};
    for (int k = 0; k < GPU_SUMS; k++) {
        assert_true(found[k] == bs + k * BLOCKS);
    }
    assert_true(progress.go && r->gradient_norm == 5.0);
    for (int i = 0; i < 4; i++) {
        cudaFree(on_device[i]);
    }
}

/* ---- surrogate ---- */

enum { SAMPLES = 40000, ACTIONS = 12, PITCH = 16 };

typedef struct {
    float action[SAMPLES * ACTIONS], old_mean[SAMPLES * ACTIONS];
    float old_log_prob[SAMPLES], advantage[SAMPLES];
    float mean[SAMPLES * PITCH], d_mean[SAMPLES * PITCH];
    float constant[ACTIONS + 2], gradient[PITCH];
    int order[SAMPLES];
    double sums[SAMPLES * GPU_SUMS];
} Actions;

/* Sample r against loss_surrogate; adds to the sums. */
static void check_surrogate(const Actions *a, const GpuSurrogate *s, int r, double *sums,
                            double *d_log_std) {
    const int i = a->order[r];
    const float *action = a->action + i * ACTIONS, *mean = a->mean + r * PITCH;
    const LossSurrogate sample =
        loss_surrogate(ACTIONS, a->constant, s->clip, action, mean, a->old_mean + i * ACTIONS,
                       a->old_log_prob[i], a->advantage[i]);
    const float d_log_prob = sample.d_log_prob * s->weight;
    for (int j = 0; j < ACTIONS; j++) {
        const float t = loss_standard(action[j], mean[j], a->constant[j]),
                    d = loss_mean_gradient(d_log_prob, t, a->constant[j]);
        assert_true(fabsf(a->d_mean[r * PITCH + j] - d) <= 1e-5f * (1.0f + fabsf(d)));
        d_log_std[j] += (double)(loss_log_std_gradient(d_log_prob, t) - s->entropy);
    }
    sums[GPU_SUM_SURROGATE] += (double)sample.loss;
    sums[GPU_SUM_KL] += (double)sample.kl;
    sums[GPU_SUM_CLIPPED] += sample.clipped;
}

/* More samples of a slice than a block takes at once. */
TEST(surrogates_of_many_samples) {
    Actions *a = calloc(1, sizeof *a), *device = device_memory(sizeof *a);
    GpuQueue q = {.partial = device_memory((size_t)GPU_SUM_SLICES * PITCH * sizeof(float))};
    Random random = random_at(9, 9, 10);
    assert_non_null(a);
    fill_normal(a->action, SAMPLES * ACTIONS, 1.0, &random);
    fill_normal(a->old_mean, SAMPLES * ACTIONS, 1.0, &random);
    fill_normal(a->advantage, SAMPLES, 1.0, &random);
    fill_normal(a->mean, SAMPLES * PITCH, 0.1, &random);
    for (int j = 0; j < ACTIONS; j++) {
        a->constant[j] = 0.1f + 0.05f * (float)j;
    }
    for (int r = 0; r < SAMPLES; r++) {
        a->order[r] = SAMPLES - 1 - r;
        a->old_log_prob[r] = -2.0f;
    }
    copy_to(device, a, sizeof *a);
    const GpuSurrogate s = {ACTIONS,
                            PITCH,
                            device->constant,
                            0.2f,
                            0.5f,
                            0.01f,
                            device->order,
                            device->action,
                            device->old_mean,
                            device->old_log_prob,
                            device->advantage,
                            device->mean,
                            device->d_mean};
    const int slices = gpu_surrogate(NULL, s, SAMPLES, device->sums, gpu_columns_next(&q));
    gpu_columns_add(&q, PITCH, slices, PITCH, 0);
    gpu_add_columns(NULL, q.columns, q.partial, 0.0f, device->gradient);
    copy_from(a, device, sizeof *a);
    double expected[GPU_SUMS] = {0.0}, d_log_std[PITCH] = {0.0}, sums[GPU_SUMS] = {0.0};
    for (int r = 0; r < SAMPLES; r++) {
        check_surrogate(a, &s, r, expected, d_log_std);
    }
    for (int i = 0; i < SAMPLES * GPU_SUMS; i++) {
        sums[i % GPU_SUMS] += a->sums[i];
    }
    for (int k = 0; k < GPU_SUMS; k++) {
        assert_true(fabs(sums[k] - expected[k]) <= 1e-6 * (SAMPLES + fabs(expected[k])));
    }
    for (int j = 0; j < PITCH; j++) { /* the columns beyond the actions' are zero */
        assert_true(fabs((double)a->gradient[j] - d_log_std[j]) <=
                    1e-5 * (100.0 + fabs(d_log_std[j])));
    }
    assert_true(sums[GPU_SUM_CLIPPED] > 0.0 && sums[GPU_SUM_CLIPPED] < SAMPLES);
    cudaFree(q.partial);
    cudaFree(device);
    free(a);
}

int main(void) {
    char device[512];
    if (!gpu_device(device, sizeof device)) {
        printf("skipped: %s\n", device);
        return 77;
    }
    return run_cases(NULL, NULL);
}
