/* The networks as they lie on the device: every width is rounded up to a multiple of 8, because
 * cuBLAS needs rows aligned to 16 bytes to use the tensor cores, of numbers with 16 bits too.
 * Weights, biases and inputs are zero in the columns and rows that were added. So are their
 * gradients, and they stay zero. */
#ifndef MILD_GPU_NETWORK_H
#define MILD_GPU_NETWORK_H

#include <cublas_v2.h>

#include "learn/cuda/kernels.h"
#include "learn/network.h"

static inline int gpu_pitch(int width) {
    return (width + 7) / 8 * 8;
}

/* The same networks with rounded widths and the offsets that follow from them. */
Network gpu_network(const Network *network);
/* Between the parameters [network->count] and their padded form [padded->count]. gpu_network_pad
 * also writes the zeros. */
void gpu_network_pad(const Network *network, const Network *padded, const float *from, float *to);
void gpu_network_strip(const Network *network, const Network *padded, const float *from, float *to);

/* Networks on the GPU: mlp.c of src/learn over device arrays with padded widths
 * (cuda/network.h). */

typedef struct {
    cudaStream_t stream;
    cublasHandle_t blas;
    cublasComputeType_t arithmetic; /* of the products */
    cublasStatus_t status;          /* the first failure of a product */
    int fused;          /* gpu_fused_processors; 0: bias, ELU and slope are kernels of their own */
    GpuArray weights;   /* as products read them: parameters, or their rounded copy */
    GpuColumns columns; /* column sums that are still to be added up */
    float *partial;     /* their partial sums, gpu_mlp_partial of each network */
} GpuQueue;

/* As MlpOutputs. The last layer's are floats, which the losses read. */
typedef struct {
    GpuArray y[MLP_LAYERS_MAX];
} GpuOutputs;

/* As mlp_forward and mlp_backward, with rows of the first layer's width in x. They only enqueue.
 * Failures show in status and when the stream is waited for. The outputs' arrays are aligned to 16
 * bytes. Biases are read from the parameters. */
float *gpu_mlp_forward(GpuQueue *queue, const Mlp *mlp, const float *parameters, int rows,
                       GpuArray x, const GpuOutputs *outputs);
/* Where the next partial sums of columns go, [slices][pitch], and their entry in queue.columns:
 * `at` in the gradient. */
float *gpu_columns_next(GpuQueue *queue);
void gpu_columns_add(GpuQueue *queue, int width, int slices, int pitch, int64_t at);
/* Floats that the partial sums of a network's biases take at most. */
int64_t gpu_mlp_partial(const Mlp *mlp, int fused, int rows);
/* The gradient of a bias is an entry in queue.columns.
 * d_x: gradient with respect to the input; NULL: not computed. work: as wide as the widest layer,
 * of the type of x. */
void gpu_mlp_backward(GpuQueue *queue, const Mlp *mlp, int rows, GpuArray x,
                      const GpuOutputs *outputs, float *d_last, const GpuArray work[2],
                      float *gradient, float beta, float *d_x);

#endif
