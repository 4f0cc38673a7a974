/* ranks/ranks.h by NCCL. The order of NCCL's own sums depends on the ranks' connections. So NCCL
 * only brings the numbers of all ranks to each of them, and a kernel adds them in our order. */
#include <cuda_runtime.h>
#include <nccl.h>
#include <stdlib.h>

extern "C" {
#include "device/ranks/ranks.h"
#include "device/ranks/ranks_private.h"
}

struct RanksDevice {
    ncclComm_t comm;
    void *gathered; /* [count][numbers] of all ranks */
    size_t bytes;   /* largest sum */
};

static MildStatus cuda_fail(const char *what, cudaError_t result, MildError *error) {
    return mild_fail(error, MILD_ERROR_IO, "%s: %s", what, cudaGetErrorString(result));
}

static MildStatus nccl_fail(ncclResult_t result, MildError *error) {
    return mild_fail(error, MILD_ERROR_IO, "NCCL: %s; NCCL_DEBUG=WARN says more",
                     ncclGetErrorString(result));
}

/* ---- joining and leaving ---- */

static MildStatus take_device(Ranks *ranks, size_t bytes, MildError *error) {
    int devices = 0;
    cudaError_t result = cudaGetDeviceCount(&devices);
    if (result == cudaSuccess && devices < ranks->locals) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%d processes on a machine with %d GPUs; start one process per GPU",
                         ranks->locals, devices);
    }
    result = result == cudaSuccess ? cudaSetDevice(ranks->local) : result;
    if (result != cudaSuccess) {
        return cuda_fail("train.device = cuda", result, error);
    }
    ranks->device = (struct RanksDevice *)calloc(1, sizeof *ranks->device);
    if (!ranks->device) {
        return mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    }
    ranks->device->bytes = bytes;
    result = cudaMalloc(&ranks->device->gathered, (size_t)ranks->count * bytes);
    return result == cudaSuccess ? MILD_OK : cuda_fail("sums over the GPUs", result, error);
}

/* NCCL waits for all ranks here, so none may be missing. */
static MildStatus join(Ranks *ranks, MildError *error) {
    ncclUniqueId id;
    ncclResult_t result = ranks->number == 0 ? ncclGetUniqueId(&id) : ncclSuccess;
    MildStatus status = result == ncclSuccess ? MILD_OK : nccl_fail(result, error);
    status = ranks_agree(ranks, status, error);
    if (status != MILD_OK) {
        return status;
    }
    ranks_broadcast(ranks, &id, sizeof id);
    result = ncclCommInitRank(&ranks->device->comm, ranks->count, id, ranks->number);
    status = result == ncclSuccess ? MILD_OK : nccl_fail(result, error);
    return ranks_agree(ranks, status, error);
}

extern "C" MildStatus ranks_open_device(Ranks *ranks, size_t bytes, MildError *error) {
    if (ranks_count(ranks) == 1) {
        return MILD_OK;
    }
    MildStatus status = ranks_agree(ranks, take_device(ranks, bytes, error), error);
    return status == MILD_OK ? join(ranks, error) : status;
}

extern "C" void ranks_close_device(Ranks *ranks) {
    if (ranks && ranks->device) {
        if (ranks->device->comm) {
            ncclCommDestroy(ranks->device->comm);
        }
        cudaFree(ranks->device->gathered);
        free(ranks->device);
        ranks->device = NULL;
    }
}

/* ---- sums ---- */

/* sum[i] = tree over r of gathered[r][i]. */
template <typename Number, int RANKS>
__global__ void add_ranks(Number *sum, const Number *gathered, int64_t count) {
    const int64_t stride = (int64_t)gridDim.x * blockDim.x;
    for (int64_t i = (int64_t)blockIdx.x * blockDim.x + threadIdx.x; i < count; i += stride) {
        Number x[RANKS];
#pragma unroll
        for (int r = 0; r < RANKS; r++) {
            x[r] = gathered[r * count + i];
        }
#pragma unroll
        for (int distance = 1; distance < RANKS; distance *= 2) {
#pragma unroll
            for (int r = 0; r < RANKS; r += 2 * distance) {
                x[r] += x[r + distance];
            }
        }
        sum[i] = x[0];
    }
}

template <typename Number>
static MildStatus sum(Ranks *ranks, Number *x, int64_t count, ncclDataType_t type,
                      MildStream stream, MildError *error) {
    if (ranks_count(ranks) == 1) {
        return MILD_OK;
    }
    const struct RanksDevice *device = ranks->device;
    if ((size_t)count * sizeof *x > device->bytes) {
        return mild_fail(error, MILD_ERROR_RANGE, "a sum of %lld numbers over the GPUs has no room",
                         (long long)count);
    }
    Number *gathered = (Number *)device->gathered;
    const ncclResult_t result =
        ncclAllGather(x, gathered, (size_t)count, type, device->comm, stream);
    if (result != ncclSuccess) {
        return nccl_fail(result, error);
    }
    const int threads = 256, most = 1024;
    const int64_t wanted = (count + threads - 1) / threads;
    const int blocks = (int)(wanted < most ? wanted : most);
    switch (ranks->count) {
    case 2: add_ranks<Number, 2><<<blocks, threads, 0, stream>>>(x, gathered, count); break;
    case 4: add_ranks<Number, 4><<<blocks, threads, 0, stream>>>(x, gathered, count); break;
    case 8: add_ranks<Number, 8><<<blocks, threads, 0, stream>>>(x, gathered, count); break;
    case 16: add_ranks<Number, 16><<<blocks, threads, 0, stream>>>(x, gathered, count); break;
    case 32: add_ranks<Number, 32><<<blocks, threads, 0, stream>>>(x, gathered, count); break;
    default: add_ranks<Number, RANKS_MAX><<<blocks, threads, 0, stream>>>(x, gathered, count);
    }
    const cudaError_t launched = cudaGetLastError();
    return launched == cudaSuccess ? MILD_OK : cuda_fail("sums over the GPUs", launched, error);
}

extern "C" MildStatus ranks_sum_device(Ranks *ranks, float *x, int64_t count, MildStream stream,
                                       MildError *error) {
    return sum(ranks, x, count, ncclFloat, stream, error);
}

extern "C" MildStatus ranks_sum_device_double(Ranks *ranks, double *x, int64_t count,
                                              MildStream stream, MildError *error) {
    return sum(ranks, x, count, ncclDouble, stream, error);
}
