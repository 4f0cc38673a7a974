/* The state of a learner on the GPU. */
#ifndef MILD_GPU_LEARNER_PRIVATE_H
#define MILD_GPU_LEARNER_PRIVATE_H

#include "learn/cuda/network.h"
#include "learn/cuda/update.h"
#include "learn/ppo_private.h"

/* Rows of samples on their way through the networks. After the first `rows` rows come those of
 * `mirrored` images. Rows are as wide as the padded network's. */
typedef struct {
    int rows, mirrored;
    GpuArray history; /* [rows + mirrored] */
    GpuArray critic;  /* [rows] the critic's input */
    float *noise;     /* [rows + mirrored][latent] standard normal, for the sampled z */
    GpuOutputs encoder, modulation, actor, decoder, value;
    GpuArray feet;          /* [rows + mirrored] the modulation's input */
    GpuArray actor_input;   /* [rows + mirrored] */
    GpuArray decoder_input; /* [rows] */
    /* gradients with respect to the array named after d_ */
    float *d_mean;          /* [rows + mirrored] */
    float *d_heads;         /* [rows + mirrored] */
    float *d_theta;         /* [rows + mirrored] */
    float *d_actor_input;   /* [rows + mirrored] */
    float *d_feet;          /* [rows + mirrored] */
    float *d_decoded;       /* [rows] */
    float *d_decoder_input; /* [rows] */
    float *d_value;         /* [rows] */
    GpuArray work[2];       /* [rows + mirrored][widest layer] each */
} GpuChunk;

typedef struct {
    Ppo *ppo;
    int device;      /* its number */
    int wanted_rows; /* GpuLearnerDef.rows */
    GpuQueue queue;
    Network network; /* padded */
    GpuWidths widths;
    OrderPart part; /* of the rollout, that this process has */
    int envs;       /* part.width */
    int minibatch;  /* samples of the largest, of this process */
    int rows;       /* most samples of a chunk */
    int images;     /* most images of a chunk */
    int sum_blocks; /* rows of `sums` */

    /* on the device */
    void *block; /* all memory */
    size_t bytes;
    GpuProgress *progress;
    float *parameters, *gradient, *first, *second, *average; /* [network.count]; average: or NULL */
    PpoBatch batch;                                          /* the rollout */
    void *rollout;                                           /* memory of its arrays */
    GpuMuon muon;
    GpuChunk chunk;
    int *substitute;   /* [steps * envs] */
    int *order;        /* [minibatch] samples of the present minibatch */
    int *latent_row;   /* [steps * envs] ppo_latent_rows of the minibatches, one after the other */
    int *which;        /* [steps * envs] ppo_mirrored, likewise */
    int *mirror_index; /* [newest + actions] */
    float *mirror_sign;
    double *sums;          /* [sum_blocks][GPU_SUMS] */
    double *partial;       /* [GPU_PARTS][GPU_MOMENTS] */
    void *workspace;       /* of cuBLAS */
    cudaGraphExec_t graph; /* of an update; NULL: not captured */
    int updates;           /* so far: the second one is captured */
    MildError error;       /* of the sums over the processes */

    /* on the CPU */
    int *host_rows; /* [2][steps * envs] latent_row, which */
    float *padded;  /* [network.count] on its way */
    void *pinned;   /* the rollout; NULL: not pinned */
} GpuLearner;

/* A minibatch as this process sees it. */
typedef struct {
    int cut[PPO_SHARDS_MAX + 1]; /* order_own_cuts */
    int first;                   /* number of its first entry in latent_row and which */
    int samples, images;         /* of all processes */
} GpuMinibatch;

/* Places a chunk of at most `rows` samples and `mirrored` images in the block and returns its
 * bytes. NULL: only counts them. bf16: the kind of its arrays. */
size_t gpu_chunk_carve(const Network *n, const GpuWidths *w, int bf16, int rows, int mirrored,
                       char *block, GpuChunk *c);

/* The matrices that Muon moves in the padded network, and their arrays, as above. */
void gpu_muon_list(const Ppo *ppo, const Network *padded, GpuMuon *muon);
size_t gpu_muon_carve(char *block, GpuMuon *muon);

/* All of the following only enqueue. */

/* The weights as products read them, after the parameters have changed. */
void gpu_enqueue_weights(GpuLearner *g);
/* Actions of time t. */
void gpu_enqueue_act(GpuLearner *g, int t);
/* batch.value from batch.critic. */
void gpu_enqueue_values(GpuLearner *g);
/* Advantages, returns and substitutes, from batch.value. */
void gpu_enqueue_returns(GpuLearner *g);
/* This process's part of the gradient of the loss over a minibatch, whose samples are g->order,
 * into g->gradient and g->sums. */
void gpu_enqueue_gradient(GpuLearner *g, const GpuMinibatch *minibatch);
/* Muon's step, after gpu_optimise. */
void gpu_enqueue_muon(GpuLearner *g, const GpuOptimiser *optimiser);

#endif
