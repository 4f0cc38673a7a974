/* Passes of the learner around the networks: sampling of actions, advantages, order of the samples,
 * optimiser and counters. They are ppo.c and ppo_returns.c on the device; both share ppo_step.h,
 * ppo_batch.h, order.h and optimiser.h. Decisions are made on the device, so that an update needs
 * no answer from the CPU. */
#ifndef MILD_GPU_UPDATE_H
#define MILD_GPU_UPDATE_H

#include <cuda_runtime_api.h>

#include "learn/cuda/kernels.h"
#include "learn/optimiser.h"
#include "learn/order.h"
#include "learn/ppo_batch.h"
#include "learn/ppo_def.h"

#define GPU_PARTS 256 /* most partial sums of the moments and of the gradient's norm */
#define GPU_MOMENTS 8 /* sums of a moment: see gpu_add_moments */

/* The learner's numbers, on the device. */
typedef struct {
    uint64_t seed;
    int64_t iteration;
    int64_t adam_steps;
    double learning_rate;
    PpoReport report; /* of this update */
    int taken;        /* minibatches of this update with a step */
    int starved;      /* bool: see Ppo */
    double moment[3]; /* means of advantage, returns and value over the usable samples */
    double advantage_std;
    float old_std[GPU_ACTIONS_MAX]; /* in the rollout */
    float ceiling, average;         /* step_noise_ceiling, step_average */
    /* of the present minibatch */
    uint64_t latent_key;
    float std[GPU_ACTIONS_MAX], constant[GPU_ACTIONS_MAX + 2];
    int go; /* bool: its step is taken */
    AdamStep step;
    double hash; /* gpu_hash */
} GpuProgress;

#ifdef __cplusplus
extern "C" {
#endif

/* ---- acting ---- */

/* Samples the actions of environments first .. first + rows - 1 at time t around mean [rows][pitch]
 * into the rollout. number: of its environment 0 among those of all processes. */
typedef struct {
    int t, first, number, rows, actions, pitch;
    const float *log_std, *mean;
} GpuActions;
void gpu_sample_actions(cudaStream_t stream, GpuActions a, PpoBatch batch,
                        const GpuProgress *progress);

/* noise [rows + images][latent] of z with ppo.sample_latent: of samples order[0 .. rows - 1], or
 * first .. first + rows - 1 of the rollout with order NULL; then that of the images' samples,
 * which[] - at of these. number: as in GpuActions. */
typedef struct {
    int rows, images, latent, envs, number, first, at;
    const int *order, *which;
} GpuSampled;
void gpu_sampled_noise(cudaStream_t stream, GpuSampled s, const GpuProgress *progress,
                       float *noise);

/* ---- before the minibatches ---- */

void gpu_begin_update(cudaStream_t stream, PpoDef def, int actions, const float *log_std,
                      GpuProgress *progress);
/* The decoder's frames [width] into batch.frame. stride: width of the critic's input. */
void gpu_write_frames(cudaStream_t stream, PpoDef def, PpoBatch batch, int width, int stride);
/* Fills value from the critic's output [rows][pitch] of samples first .. first + rows - 1. */
void gpu_take_values(cudaStream_t stream, int rows, int pitch, const float *output, float *value);
/* As ppo_returns, up to the moments. */
void gpu_returns(cudaStream_t stream, PpoDef def, PpoBatch batch, OrderPart part, int *substitute,
                 GpuProgress *progress);
/* Sums over the usable samples into the rows of partial [GPU_PARTS][GPU_MOMENTS]: their number, the
 * gaps of advantage, returns and value from progress->moment, the squares of the gaps, and whether
 * a stratum is starved. Returns the number of rows. */
int gpu_add_moments(cudaStream_t stream, PpoBatch batch, const GpuProgress *progress,
                    double *partial);
/* Means (last = 0), then deviations (last = 1), from so many rows. */
void gpu_finish_moments(cudaStream_t stream, int last, int rows, const double *partial,
                        GpuProgress *progress);
void gpu_normalise(cudaStream_t stream, PpoBatch batch, const GpuProgress *progress);

/* ---- several processes ---- */

/* Row 0 of x [rows][width] becomes the sum of the rows. */
void gpu_add_rows(cudaStream_t stream, int rows, int width, double *x);
/* Hash of the parameters [count] into progress->hash. partial: [GPU_PARTS]. */
void gpu_hash(cudaStream_t stream, int64_t count, const float *parameters, double *partial,
              GpuProgress *progress);

/* ---- a minibatch ---- */

typedef struct {
    int steps, minibatches, m, epoch;
    OrderPart part;
    int cut[PPO_SHARDS_MAX + 1]; /* order_own_cuts */
} GpuOrder;
void gpu_order(cudaStream_t stream, GpuOrder o, const int *substitute, const GpuProgress *progress,
               int *order);
/* draw: number of the minibatch in this update. */
void gpu_begin_minibatch(cudaStream_t stream, uint32_t draw, int actions, const float *log_std,
                         GpuProgress *progress);
/* From the sums [blocks][GPU_SUMS] and the gradient [count]: report, learning rate, and whether and
 * how a step is taken. partial: [GPU_PARTS]. */
typedef struct {
    PpoDef def;
    int actions, samples, images, blocks;
    int64_t count;
    const double *sums;
    const float *gradient;
} GpuDecision;
void gpu_decide(cudaStream_t stream, GpuDecision d, double *partial, GpuProgress *progress);
/* What Muon moves, in arrays of one shape: [side][width] for each matrix, transposed where it has
 * more rows than columns, and zero beyond it. */
typedef struct {
    MuonMatrices list; /* as padded, but for the scale; count 0: Adam moves all */
    int side, width;
    float *x, *next;      /* [count][side][width] */
    float *gram, *square; /* [count][side][side] X X^T, and its square or the polynomial */
} GpuMuon;
/* The optimiser's arrays, [count] each; log std is at log_std .. log_std + actions - 1. */
typedef struct {
    int64_t count, log_std;
    int actions;
    float floor; /* of log std */
    const float *gradient;
    float *parameters, *first, *second;
    float *mean; /* running mean of the parameters; NULL: none */
    GpuMuon muon;
} GpuOptimiser;
/* Adam's step, and Muon's direction into muon.x. */
void gpu_optimise(cudaStream_t stream, GpuOptimiser o, const GpuProgress *progress);
/* The polynomial of an iteration in the place of the square. is_first: bool, of the iteration that
 * takes X to length 1. */
void gpu_muon_polynomial(cudaStream_t stream, GpuMuon muon, int is_first);
/* Muon's step, along x. */
void gpu_muon_apply(cudaStream_t stream, GpuOptimiser o, const float *x,
                    const GpuProgress *progress);

/* ---- after the minibatches ---- */

/* Bounds the noise, averages the weights, finishes the report, increments the iteration. */
void gpu_finish_update(cudaStream_t stream, GpuOptimiser o, GpuProgress *progress);

#ifdef __cplusplus
}
#endif

#endif
