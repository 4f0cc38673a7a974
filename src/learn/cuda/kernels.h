/* Passes of the learner's networks and losses on the GPU; cuBLAS computes the products. Each pass
 * is the loop of the same name in src/learn (mlp.c, network.c, loss.c) over device arrays,
 * row-major with rows of `pitch` floats. The columns after a row's width are zero (cuda/network.h).
 * A pass only enqueues work on the stream, so errors show at the next call of the runtime. Every
 * sum has one fixed tree, so no result depends on the order in which blocks run. */
#ifndef MILD_GPU_KERNELS_H
#define MILD_GPU_KERNELS_H

#include <cuda_runtime_api.h>
#include <stddef.h>
#include <stdint.h>

#include "learn/network.h"

/* Numbers on their way through the networks: float or, with ppo.matmul = bf16, bfloat16, the upper
 * half of a float. */

typedef struct {
    void *at;
    int bf16; /* bool */
} GpuArray;

static inline size_t gpu_array_bytes(int bf16, size_t count) {
    return count * (bf16 ? sizeof(uint16_t) : sizeof(float));
}

/* The array from one of its numbers on. */
static inline GpuArray gpu_array_from(GpuArray array, size_t number) {
    array.at = (char *)array.at + gpu_array_bytes(array.bf16, number);
    return array;
}

static inline GpuArray gpu_array_float(float *at) {
    const GpuArray array = {at, 0};
    return array;
}

#define GPU_ACTIONS_MAX 64
#define GPU_SUM_SLICES 256 /* a column sum adds up at most this many partial sums */

/* Sums over samples: the members of LossSums. Every block of a pass adds to its own row of sums
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

/* ---- rows ---- */

/* Row r of `to` is row index[r] of `from`, or row r with index NULL. width: floats from row to row
 * of `from`. The columns of `to` from width on become 0. */
void gpu_gather(cudaStream_t stream, int rows, int width, int pitch, const int *index,
                const float *from, GpuArray to);
/* Row m of `to` is the mirror image of row order[which[m] - first] of the rollout's history, frame
 * by frame; the scan goes with the last. */
typedef struct {
    int images, frames, observation, scan, pitch, first;
    const int *order;         /* samples of the chunk */
    const int *which, *index; /* [images], [observation + scan] */
    const float *sign;        /* [observation + scan] */
} GpuImages;
void gpu_mirror_history(cudaStream_t stream, GpuImages images, const float *history, GpuArray to);
/* noise [rows][latent]: numbers row[r] * latent .. of the stream *key (noise.h). */
void gpu_latent_noise(cudaStream_t stream, int rows, int latent, const uint64_t *key,
                      const int *row, float *noise);

/* ---- layers; widths are pitches, multiples of 8 ---- */

void gpu_add_bias(cudaStream_t stream, int rows, int width, int elu, const float *bias, GpuArray y);
/* to = d slope(y), of a layer without ELU (y.at NULL) to = d. Returns the number of slices of rows
 * whose column sums of `to` it writes, partial [slices][width], at most GPU_SUM_SLICES. to.at NULL:
 * only the sums. `to` may be d. */
int gpu_bias_backward(cudaStream_t stream, int rows, int width, GpuArray y, GpuArray d, GpuArray to,
                      float *partial);
/* Column sums of all layers, and of log std. */
typedef struct {
    int width, slices, pitch;
    int64_t partial; /* where its [slices][pitch] begin in the partial sums */
    int64_t to;      /* where its [width] sums begin in the gradient */
} GpuColumnSum;
typedef struct {
    int count;
    GpuColumnSum sum[NETWORK_MLPS * MLP_LAYERS_MAX + 1];
} GpuColumns;
/* gradient = beta gradient + sums over the slices, where the list says. */
void gpu_add_columns(cudaStream_t stream, GpuColumns list, const float *partial, float beta,
                     float *gradient);
/* Rounds to bfloat16. */
void gpu_round(cudaStream_t stream, int64_t count, const float *from, GpuArray to);

/* ---- rows between the networks ---- */

typedef struct {
    int modulation; /* bool: it learns */
    int observation, newest, estimates, latent, per_dimension, feet_offset, feet_count, actions;
    int feet_input, clock_input; /* numbers of both kinds in the modulation's input */
    int decoded_frame, ground_offset, ground_count; /* of the decoder's target */
    int critic_input;                               /* from row to row in the rollout */
    /* pitches */
    int history, heads, feet, theta, actor_input, action, decoder_input, decoded, value;
} GpuWidths;

/* Sets the columns of the gait clock in `frames` frames to 0: the last two numbers of each. weight
 * [rows][pitch]. */
void gpu_hide_clock(cudaStream_t stream, int rows, int pitch, int frames, int observation,
                    float *weight);
/* feet [rows][feet]: the modulation's input, estimates of the feet and then the clock. newest:
 * first column of the newest frame in history. */
void gpu_feet_input(cudaStream_t stream, GpuWidths w, int rows, int newest, GpuArray history,
                    const float *heads, GpuArray feet);
/* newest: as above. noise: [rows][latent] of z; NULL: z = mu. */
void gpu_actor_input(cudaStream_t stream, GpuWidths w, int rows, int newest, GpuArray history,
                     const float *heads, const float *noise, const float *theta, GpuArray input);
void gpu_sample_latent(cudaStream_t stream, GpuWidths w, int rows, const float *heads,
                       const float *noise, GpuArray input);

/* ---- losses. order: [rows] samples, whose numbers are read from the rollout ---- */

typedef struct {
    int actions, pitch;
    const float *constant; /* [actions + 2] loss_surrogate_constants */
    float clip, weight;    /* weight: of a sample in the joint loss */
    float entropy;         /* of a sample in the gradient of log std */
    const int *order;
    const float *action, *old_mean, *old_log_prob, *advantage; /* of the rollout */
    const float *mean;                                         /* [rows][pitch] */
    float *d_mean;                                             /* [rows][pitch] */
} GpuSurrogate;
/* Returns the number of slices of the gradient of log std: partial [slices][pitch], as
 * gpu_bias_backward. */
int gpu_surrogate(cudaStream_t stream, GpuSurrogate s, int rows, double *sums, float *partial);

typedef struct {
    int actions, pitch, first;
    const int *which, *index; /* [images], [actions] */
    const float *sign;        /* [actions] */
    float weight;
    const float *mean, *image; /* [rows][pitch], [images][pitch] */
    float *d_mean, *d_image;
} GpuMirror;
void gpu_mirror_loss(cudaStream_t stream, GpuMirror m, int images, double *sums);

/* weight: of a sample. frame, critic: of the rollout. */
void gpu_reconstruction(cudaStream_t stream, GpuWidths w, int rows, float weight, const int *order,
                        const float *frame, const float *critic, const float *decoded, float *d,
                        double *sums);
/* d_theta from the gradient of the actor's input. noise: as in gpu_actor_input. */
void gpu_modulation_backward(cudaStream_t stream, GpuWidths w, int rows, const float *heads,
                             const float *noise, const float *d_input, float *d_theta);

/* d_heads: through the actor's input and through the modulation's, that is the feet's estimates,
 * for all rows, and from the regression for the first `rows` of `all`. */
typedef struct {
    float estimate_weight, latent_weight; /* of a sample */
    float free_bits;
    int sampled; /* bool: the actor got the decoder's z */
    const int *order;
    const float *target; /* of the rollout */
    const float *heads, *noise, *theta, *d_input, *d_feet, *d_decoder_input;
    float *d_heads;
} GpuHeads;
void gpu_heads_backward(cudaStream_t stream, GpuWidths w, GpuHeads h, int rows, int all,
                        double *sums);

typedef struct {
    int pitch, clip_value;
    float clip, weight;
    const int *order;
    const float *returns, *old_value; /* of the rollout */
    const float *value;               /* [rows][pitch] */
    float *d;                         /* [rows][pitch] */
} GpuValue;
void gpu_value_loss(cudaStream_t stream, GpuValue v, int rows, double *sums);

#ifdef __cplusplus
}
#endif

#endif
