/* Weights of a controller that was trained elsewhere: tensors of a safetensors file (safetensors.h)
 * whose texts name its kind, version and robot. The first failure is kept, so that a controller
 * takes all its tensors and asks once. */
#ifndef CONTROL_WEIGHTS_H
#define CONTROL_WEIGHTS_H

#include "mild/error.h"

typedef struct Weights Weights;

/* y = W x + b. */
typedef struct {
    int in, out;
    const float *weight; /* [out][in] */
    const float *bias;   /* [out] */
} Linear;

/* Reads the file. kind: that its text `kind` must have; script: what writes such files. Returns
 * NULL with one line in *error. */
Weights *weights_read(const char *path, const char *kind, const char *script, const char *robot,
                      MildError *error);
void weights_destroy(Weights *weights); /* may be NULL */

/* Length of a tensor along a dimension, 0 or 1; 0 when there is none. */
int weights_length(const Weights *weights, const char *name, int dimension);
/* A number that is a text of the file, 1 .. 1000. 0 after a failure, as what follows. */
int weights_number(Weights *weights, const char *key);
/* A tensor [rows][columns], or with columns = 0 a vector [rows]. It lasts as long as `weights`.
 * NULL after a failure. */
const float *weights_take(Weights *weights, const char *name, int rows, int columns);
/* NAME.weight and NAME.bias. */
Linear weights_take_linear(Weights *weights, const char *name, int in, int out);
/* Whether everything was there. */
MildStatus weights_status(const Weights *weights, MildError *error);

/* y [rows][out] of x [rows][in], on the calling thread; between product_enter and
 * product_leave (product.h). */
void linear_apply(const Linear *linear, int rows, const float *x, float *y);

#endif
