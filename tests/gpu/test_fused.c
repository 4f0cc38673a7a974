/* Products of bfloat16 with their ends against sums in double. With MILD_CUDA on the device,
 * skipped (77) where there is none of compute capability 9.0; else on the stand-in. */
#include "gpu_check.h"

#include "learn/cuda/fused.h"

static float of_bf16(uint16_t x) {
    const uint32_t bits = (uint32_t)x << 16;
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Standard normal numbers, cut to bfloat16. Returns the next array on the device. */
static uint16_t *put_bf16(uint16_t *host, int64_t count, uint16_t *device, Random *random) {
    float x;
    for (int64_t i = 0; i < count; i++) {
        fill_normal(&x, 1, 1.0, random);
        memcpy(&host[i], (const char *)&x + 2, sizeof host[i]);
    }
    cudaMemcpyAsync(device, host, (size_t)count * sizeof *host, cudaMemcpyHostToDevice, NULL);
    return device + (count + 7) / 8 * 8;
}

/* Both passes of a layer against sums in double. d and to share x and y: a layer's backward pass
 * has them the other way round. */
static void compare_fused(int processors, int rows, int out, int in) {
    enum { MOST = 1 << 20 };
    uint16_t *x = malloc(4 * MOST * sizeof *x), *y = x + MOST, *w = y + MOST, *read = w + MOST;
    float *sums = malloc(MOST * sizeof *sums), bias[1024];
    void *device = NULL;
    assert_non_null(x);
    assert_non_null(sums);
    assert_int_equal(cudaMalloc(&device, 16 * MOST), cudaSuccess);
    uint16_t *dx = device, *dw, *dy, *to;
    float *partial = (float *)((char *)device + 8 * MOST), *d_bias = partial + MOST;
    Random random = random_at(7, 7, (uint32_t)rows);
    dw = put_bf16(x, (int64_t)rows * in, dx, &random);
    dy = put_bf16(w, (int64_t)out * in, dw, &random);
    to = put_bf16(y, (int64_t)rows * out, dy, &random);
    fill_normal(bias, out, 1.0, &random);
    cudaMemcpyAsync(d_bias, bias, (size_t)out * sizeof *bias, cudaMemcpyHostToDevice, NULL);
    double worst = 0.0;
    assert_true(gpu_fused_forward(NULL, processors, rows, out, in, dx, dw, d_bias, to));
    cudaMemcpyAsync(read, to, (size_t)rows * (size_t)out * sizeof *read, cudaMemcpyDeviceToHost,
                    NULL);
    assert_int_equal(cudaStreamSynchronize(NULL), cudaSuccess);
    for (int64_t r = 0; r < rows; r++) {
        for (int64_t j = 0; j < out; j++) {
            double sum = (double)bias[j];
            for (int64_t k = 0; k < in; k++) {
                sum += (double)of_bf16(x[r * in + k]) * (double)of_bf16(w[j * in + k]);
            }
            sum = sum > 0.0 ? sum : expm1(sum);
            worse(&worst, fabs((double)of_bf16(read[r * out + j]) - sum) / (0.01 + fabs(sum)));
        }
    }
    const GpuSlices s = gpu_fused_slices(rows, in);
    const int64_t partials = (int64_t)s.slices * s.pitch;
    assert_true(s.pitch >= in && partials <= MOST);
    assert_true(gpu_fused_backward(NULL, processors, rows, out, in, dy, dw, dx, to, partial));
    cudaMemcpyAsync(read, to, (size_t)rows * (size_t)in * sizeof *read, cudaMemcpyDeviceToHost,
                    NULL);
    cudaMemcpyAsync(sums, partial, (size_t)partials * sizeof *sums, cudaMemcpyDeviceToHost, NULL);
    assert_int_equal(cudaStreamSynchronize(NULL), cudaSuccess);
    for (int64_t j = 0; j < in; j++) {
        double column = 0.0;
        for (int64_t r = 0; r < rows; r++) {
            const double own = (double)of_bf16(x[r * in + j]);
            double sum = 0.0;
            for (int64_t k = 0; k < out; k++) {
                sum += (double)of_bf16(y[r * out + k]) * (double)of_bf16(w[k * in + j]);
            }
            sum *= own > 0.0 ? 1.0 : own + 1.0;
            column += sum;
            worse(&worst, fabs((double)of_bf16(read[r * in + j]) - sum) / (0.01 + fabs(sum)));
        }
        for (int slice = 0; slice < s.slices; slice++) {
            column -= (double)sums[slice * s.pitch + j];
        }
        worse(&worst, fabs(column) / (double)(rows * out));
    }
    print_message("%d x %d x %d: worst %.1e\n", rows, out, in, worst);
    assert_true(worst < 5e-3); /* half of bfloat16's last bit: 2^-8 */
    cudaFree(device);
    free(sums);
    free(x);
}

TEST(fused_products) {
    static const int shapes[][3] = {{1, 8, 8},      {300, 32, 16}, {513, 128, 48}, {777, 768, 120},
                                    {400, 64, 256}, {257, 264, 8}, {129, 8, 512},  {96, 40, 40}};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        compare_fused(gpu_fused_processors(0), shapes[i][0], shapes[i][1], shapes[i][2]);
    }
}

int main(void) {
    char device[512];
    if (!gpu_device(device, sizeof device) || gpu_fused_processors(0) == 0) {
        printf("skipped: %s\n", device);
        return 77;
    }
    return run_cases(NULL, NULL);
}
