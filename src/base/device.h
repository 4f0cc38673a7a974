/* MILD_HD marks functions that are compiled for the processor and for the GPU. */
#ifndef MILD_DEVICE_H
#define MILD_DEVICE_H

#ifdef __CUDACC__
#define MILD_HD __host__ __device__
#else
#define MILD_HD
#endif

#endif
