/* Scalar type and qualifier of the element's law and step. power.h, law.h, element.h, begin.h,
 * impulse.h, friction.h, remember.h, plate.h, shear.h, motion.h, surface.h and map_view.h are
 * written in the common subset of C17 and CUDA C++. They are functions of small structs, allocate
 * nothing, and need only what CUDA has of libm. The CPU runs them in double, one element per
 * vector lane. A GPU runs them in float, one element per thread: define MILD_REAL_FLOAT before
 * including the first of these headers. */
#ifndef MILD_GROUND_REAL_H
#define MILD_GROUND_REAL_H

#include <math.h>

#ifdef MILD_REAL_FLOAT
typedef float Real;
#define REAL_SQRT sqrtf
#define REAL_ABS fabsf
#define REAL_LEAST 1e-30f /* added to a divisor so that 0/0 becomes 0 */
#else
typedef double Real;
#define REAL_SQRT sqrt
#define REAL_ABS fabs
#define REAL_LEAST 1e-300
#endif

/* A constant in the scalar type. Integers need no conversion: write x / 2 or 2 * x. */
#define REAL(number) ((Real)(number))

#ifdef __CUDACC__
#define MILD_HD static __host__ __device__ __forceinline__
#else
#define MILD_HD static inline __attribute__((always_inline))
#endif

MILD_HD Real real_max(Real a, Real b) {
    return a > b ? a : b;
}

MILD_HD Real real_min(Real a, Real b) {
    return a < b ? a : b;
}

#endif
