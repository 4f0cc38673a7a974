/* A build without CUDA has no kernels. */
#define MILD_REAL_FLOAT
#include "crowd/text.h"

const CrowdKernels *const crowd_kernels[] = {NULL};
