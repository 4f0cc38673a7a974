/* Functions that the processor and the GPU both compile: one text, one result. */
#ifndef MILD_DEVICE_H
#define MILD_DEVICE_H

#ifdef __CUDACC__
#define MILD_HD __host__ __device__
#else
#define MILD_HD
#endif

#endif
