/* The learner's elementwise passes on the GPU; cuBLAS computes the products. Each pass is the
 * loop of the same name in src/learn (mlp.c, network.c, loss.c) over device arrays, row-major
 * [rows][width]. It only enqueues work on the stream, so errors show at the next call of the
 * runtime. Every sum has one fixed tree, so no result depends on the order in which blocks run. */
#ifndef MILD_GPU_KERNELS_H
#define MILD_GPU_KERNELS_H

#include <cuda_runtime_api.h>
#include <stdint.h>

#define GPU_ACTIONS_MAX 64
#define GPU_SUM_SLICES 128 /* a column sum adds up this many partial sums */

/* Sums over samples, as in LossSums. Every block of a pass adds to its own row of sums
 * [blocks][GPU_SUMS]. */
enum {
    GPU_SUM_SURROGATE,
    GPU_SUM_KL,
    GPU_SUM_CLIPPED,
    GPU_SUM_RECONSTRUCTION,
    GPU_SUM_VAE_KL,
    GPU_SUM_ESTIMATE,
    GPU_SUM_MIRROR = GPU_SUM_ESTIMATE + 3,
    GPU_SUM_VALUE,
    GPU_SUMS
};

#ifdef __cplusplus
extern "C" {
#endif

int gpu_blocks(int rows); /* rows of `sums` that passes over this many rows need */

/* to[r] = from[index[r]], rows of `width`. */
void gpu_gather(cudaStream_t stream, int rows, int width, const int *index, const float *from,
                float *to);
/* Row m of `to` is the mirror image of row which[m] - first of history, frame by frame. */
typedef struct {
    int images, frames, observation, first;
    const int *which, *index; /* [images], [observation] */
    const float *sign;        /* [observation] */
} GpuImages;
void gpu_mirror_history(cudaStream_t stream, GpuImages images, const float *history, float *to);
/* noise [rows][latent]: numbers row[r] * latent .. of the stream `key` (noise.h). */
void gpu_latent_noise(cudaStream_t stream, int rows, int latent, uint64_t key, const int *row,
                      float *noise);

void gpu_add_bias(cudaStream_t stream, int rows, int width, int elu, const float *bias, float *y);
/* d *= slope(y) unless y is NULL; d_bias = beta d_bias + column sums of d. partial:
 * [GPU_SUM_SLICES][width]. */
void gpu_bias_backward(cudaStream_t stream, int rows, int width, const float *y, float *d,
                       float *partial, float beta, float *d_bias);

/* Widths of the rows between the networks. */
typedef struct {
    int history, observation, estimates, latent, per_dimension, feet_offset, feet_count, actions;
} GpuWidths;

void gpu_actor_input(cudaStream_t stream, GpuWidths w, int rows, const float *history,
                     const float *heads, const float *theta, float *input);
void gpu_sample_latent(cudaStream_t stream, GpuWidths w, int rows, const float *heads,
                       const float *noise, float *spread, float *input);

typedef struct {
    int actions;
    float constant[GPU_ACTIONS_MAX + 2]; /* loss_surrogate_constants */
    float clip, weight;                  /* weight: of a sample in the joint loss */
    float entropy;                       /* of a sample in the gradient of log std */
    const float *action, *old_mean, *old_log_prob, *advantage, *mean;
    float *d_mean, *d_log_std; /* [rows][actions] both */
} GpuSurrogate;
void gpu_surrogate(cudaStream_t stream, GpuSurrogate s, int rows, double *sums);

typedef struct {
    int actions, first;
    const int *which, *index; /* [images], [actions] */
    const float *sign;        /* [actions] */
    float weight;
    const float *mean, *image; /* [rows][actions], [images][actions] */
    float *d_mean, *d_image;
} GpuMirror;
void gpu_mirror_loss(cudaStream_t stream, GpuMirror m, int images, double *sums);

void gpu_reconstruction(cudaStream_t stream, int rows, int width, float weight,
                        const float *decoded, const float *target, float *d, double *sums);
void gpu_modulation_backward(cudaStream_t stream, GpuWidths w, int rows, const float *heads,
                             const float *theta, const float *d_input, float *d_heads,
                             float *d_theta);

/* Adds the gradient of the regression for the first `rows` of `all`, and that of the modulation
 * through the feet velocities for all. */
typedef struct {
    float estimate_weight, latent_weight; /* of a sample */
    const float *heads, *estimate, *spread, *noise, *d_feet, *d_decoder_input;
    float *d_heads;
} GpuHeads;
void gpu_heads_backward(cudaStream_t stream, GpuWidths w, GpuHeads h, int rows, int all,
                        double *sums);

void gpu_value_loss(cudaStream_t stream, int rows, int clip_value, float clip, float weight,
                    const float *value, const float *returns, const float *old_value, float *d,
                    double *sums);

#ifdef __cplusplus
}
#endif

#endif
