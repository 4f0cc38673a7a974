/* MILD_BOTH marks functions that are compiled for the CPU and for a GPU. */
#ifndef MILD_BOTH_H
#define MILD_BOTH_H

#ifdef __CUDACC__
#define MILD_BOTH __host__ __device__
#else
#define MILD_BOTH
#endif

#endif
