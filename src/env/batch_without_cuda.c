/* A build without CUDA has no kernels. */
#define MILD_REAL_FLOAT
#include "env/kernels.h"

const EnvsKernels *const envs_kernels[] = {NULL};
