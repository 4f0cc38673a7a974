/* Multilayer perceptron with ELU, or softsign, after every layer but the last: y = W x + b,
 * W [out][in] as PyTorch keeps it. Parameters live in a flat array that the caller owns; a layer
 * knows its offsets. */
#ifndef MILD_MLP_H
#define MILD_MLP_H

#include <stddef.h>
#include <stdint.h>

#include "learn/policy_def.h"

#define MLP_LAYERS_MAX (POLICY_LAYERS_MAX + 1)

typedef struct {
    int in, out;
    int64_t weight, bias; /* offsets into the parameters */
} MlpLayer;

typedef enum { MLP_ELU, MLP_SOFTSIGN } MlpActivation;

typedef struct {
    int layers;
    MlpActivation activation; /* of the hidden layers; on a GPU always ELU */
    MlpLayer layer[MLP_LAYERS_MAX];
} Mlp;

/* Outputs of every layer for some rows, after the activation: y[l] is [rows][layer[l].out]. */
typedef struct {
    float *y[MLP_LAYERS_MAX];
} MlpOutputs;

/* Gradient with respect to the input's columns first .. first+count-1, written to x [rows][count].
 * count 0: not computed. */
typedef struct {
    float *x;
    int first, count;
} MlpInputGradient;

/* With ELU. hidden: zero-terminated or POLICY_LAYERS_MAX widths. Parameters start at `offset`;
 * returns the offset after them. */
int64_t mlp_layout(Mlp *mlp, int in, const int *hidden, int out, int64_t offset);
int mlp_widest(const Mlp *mlp); /* the widest layer output */

/* Weights normal with variance 1/in (times last_scale^2 in the last layer), biases zero. */
void mlp_initialise(const Mlp *mlp, float *parameters, uint64_t seed, uint32_t stream,
                    double last_scale);

/* Takes `count` floats, aligned to 64 bytes, from a block. With a NULL block it only counts. */
float *mlp_carve(float *block, size_t *used, size_t count);
void mlp_carve_outputs(const Mlp *mlp, int rows, float *block, size_t *used, MlpOutputs *outputs);

/* x [rows][ldx] -> outputs; returns the last layer's output. */
float *mlp_forward(const Mlp *mlp, const float *parameters, int rows, const float *x, int ldx,
                   const MlpOutputs *outputs);

/* d_last [rows][out]: gradient with respect to the last output. work: two areas of rows *
 * mlp_widest floats. gradient (laid out as the parameters) becomes beta * gradient + this one, beta
 * 0 or 1. */
void mlp_backward(const Mlp *mlp, const float *parameters, int rows, const float *x, int ldx,
                  const MlpOutputs *outputs, const float *d_last, float *const work[2],
                  float *gradient, float beta, MlpInputGradient input);

#endif
