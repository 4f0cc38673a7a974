/* One source for a GPU (nvcc) and a CPU (any C++17 compiler, OpenMP): functions of one grain, run
 * for all grains by `each`, and memory where they run. */
#ifndef GRAINS_DEVICE_H
#define GRAINS_DEVICE_H

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#ifdef __CUDACC__
#define DEVICE __device__ inline
#define BOTH __host__ __device__ inline
#else
#define DEVICE inline
#define BOTH inline
#endif

[[noreturn]] inline void stop(const char *text, const char *word = "") {
    fprintf(stderr, "grains: %s%s\n", text, word);
    exit(2);
}

#ifdef __CUDACC__

inline void check(cudaError_t error) {
    if (error != cudaSuccess) {
        stop("CUDA: ", cudaGetErrorString(error));
    }
}

template <class System, void (*act)(int, const System &)>
__global__ void each_kernel(int count, const System system) {
    const int i = (int)(blockIdx.x * blockDim.x + threadIdx.x);
    if (i < count) {
        act(i, system);
    }
}

/* act(i, system) for i from 0 to count - 1, in any order. */
template <class System, void (*act)(int, const System &)>
void each(int count, const System &system) {
    each_kernel<System, act><<<(unsigned)(count + 127) / 128, 128>>>(count, system);
    check(cudaGetLastError());
}

template <class T> void copy(T *to, const T *from, size_t count) {
    check(cudaMemcpy(to, from, count * sizeof(T), cudaMemcpyDefault));
}

template <class T> void clear(T *data, size_t count) {
    check(cudaMemset(data, 0, count * sizeof(T)));
}

template <class T> T *allocate(size_t count) {
    T *data = nullptr;
    check(cudaMalloc(&data, count * sizeof(T)));
    clear(data, count);
    return data;
}

inline void release(void *data) {
    check(cudaFree(data));
}

DEVICE int take_one(int *counter) {
    return atomicAdd(counter, 1);
}

DEVICE void add_to(long long *sum, long long value) {
    atomicAdd(reinterpret_cast<unsigned long long *>(sum), (unsigned long long)value);
}

#else

template <class System, void (*act)(int, const System &)>
void each(int count, const System &system) {
#pragma omp parallel for schedule(static) if (count > 4000)
    for (int i = 0; i < count; i++) {
        act(i, system);
    }
}

template <class T> void copy(T *to, const T *from, size_t count) {
    if (count > 0) { /* of an empty vector there is no address */
        memcpy(static_cast<void *>(to), from, count * sizeof(T));
    }
}

template <class T> void clear(T *data, size_t count) {
    memset(static_cast<void *>(data), 0, count * sizeof(T));
}

template <class T> T *allocate(size_t count) {
    const size_t bytes = (count * sizeof(T) + 63) / 64 * 64;
    void *data = aligned_alloc(64, bytes);
    if (!data) {
        stop("out of memory");
    }
    memset(data, 0, bytes);
    return static_cast<T *>(data);
}

inline void release(void *data) {
    free(data);
}

DEVICE int take_one(int *counter) {
    return __atomic_fetch_add(counter, 1, __ATOMIC_RELAXED);
}

DEVICE void add_to(long long *sum, long long value) {
    __atomic_fetch_add(sum, value, __ATOMIC_RELAXED);
}

#endif

/* Three numbers; the fourth only makes it one load of 16 bytes. */
struct alignas(16) Vec3 {
    float x, y, z, unused;
};

BOTH Vec3 vec(float x, float y, float z) {
    return Vec3{x, y, z, 0.0f};
}

BOTH Vec3 operator+(Vec3 a, Vec3 b) {
    return vec(a.x + b.x, a.y + b.y, a.z + b.z);
}

BOTH Vec3 operator-(Vec3 a, Vec3 b) {
    return vec(a.x - b.x, a.y - b.y, a.z - b.z);
}

BOTH Vec3 operator*(float s, Vec3 a) {
    return vec(s * a.x, s * a.y, s * a.z);
}

BOTH float dot(Vec3 a, Vec3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

BOTH Vec3 cross(Vec3 a, Vec3 b) {
    return vec(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

BOTH float length(Vec3 a) {
    return sqrtf(dot(a, a));
}

#endif
