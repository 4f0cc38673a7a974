/* The dialect of functions that a CPU and a GPU run: the common subset of C17 and CUDA C++. They
 * are functions of small structs, allocate nothing, and need only what CUDA has of libm. What
 * depends on the compiler depends on it here and nowhere else.
 *
 *     MILD_HD     one thread has it to itself; always inlined
 *     MILD_HD_FN  the same, where the compiler decides about inlining; or a tile has it (below)
 *     WARP_FN     the lanes of a warp work on it together (below)
 *     TEAM_FN     the warps of a block do (at the end)
 *
 * Numbers are Real: double on a CPU, which runs an element a vector lane; float on a GPU, and where
 * MILD_REAL_FLOAT is defined before the first include. */
#ifndef MILD_HD_H
#define MILD_HD_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __CUDACC__
extern "C++" { /* kernel.cu includes this under "C" */
#include <cuda_fp16.h>
}
#endif

#ifdef MILD_REAL_FLOAT
typedef float Real;
#define REAL_SQRT sqrtf
#define REAL_ABS fabsf
#define REAL_LEAST 1e-30f   /* added to a divisor so that 0/0 becomes 0 */
#define REAL_ROUNDING 1e-6f /* a relative change that is rounding */
#else
typedef double Real;
#define REAL_SQRT sqrt
#define REAL_ABS fabs
#define REAL_LEAST 1e-300
#define REAL_ROUNDING 1e-13
#endif

/* A constant in the scalar type. Integers need no conversion: write x / 2 or 2 * x. */
#define REAL(number) ((Real)(number))

#ifdef __CUDACC__
#define MILD_BOTH __host__ __device__
#define MILD_HD static MILD_BOTH __forceinline__
#else
#define MILD_BOTH
#define MILD_HD static inline __attribute__((always_inline))
#endif
#define MILD_HD_FN static inline MILD_BOTH

/* One of two texts: where a GPU runs, else. */
#ifdef __CUDA_ARCH__
#define ON_GPU(gpu, cpu) gpu
#else
#define ON_GPU(gpu, cpu) cpu
#endif

/* REAL_FORGETS: defined by a file in which the limit of a number and NaN may be the number, also
 * where b is NaN. A GPU has an instruction for that, and two for the other. */
#ifdef REAL_FORGETS
#define REAL_LIMIT(gpu, cpu) ON_GPU(gpu, cpu)
#else
#define REAL_LIMIT(gpu, cpu) cpu
#endif

MILD_HD Real real_max(Real a, Real b) {
    return REAL_LIMIT(fmaxf(a, b), a > b ? a : b);
}

MILD_HD Real real_min(Real a, Real b) {
    return REAL_LIMIT(fminf(a, b), a < b ? a : b);
}

/* ---- numbers that a GPU computes in its own way ---- */

/* a/b, right to 2 units in the last place. b: at most 2^126, for a GPU multiplies by its inverse:
 * two instructions in place of six. */
MILD_HD Real real_over(Real a, Real b) {
    return ON_GPU(__fdividef(a, b), a / b);
}

/* x, at most 1. x >= 0: a GPU, whose product with this limit is one instruction, returns 0 below
 * it. */
MILD_HD Real real_to_one(Real x) {
    return ON_GPU(__saturatef(x), real_min(x, 1));
}

/* __powf: powf has hundreds of instructions. rsqrtf: one instruction, right to 2 units in the last
 * place. */
#ifdef MILD_REAL_FLOAT
#define REAL_POW ON_GPU(__powf, powf)
#define REAL_INVERSE_SQRT(x) ON_GPU(rsqrtf(x), (1 / REAL_SQRT(x)))
#else
#define REAL_POW pow
#define REAL_INVERSE_SQRT(x) (1 / REAL_SQRT(x))
#endif

/* [-] Sine and cosine of x [rad], a few turns at most. */
MILD_HD void real_sine_cosine(Real x, Real *sine, Real *cosine) {
#if defined(__CUDA_ARCH__) && defined(MILD_REAL_FLOAT)
    /* sincosf has a path for large x that keeps its work in local memory */
    sincospif(x * REAL(0.31830988618379067), sine, cosine);
#elif defined(MILD_REAL_FLOAT)
    *sine = sinf(x);
    *cosine = cosf(x);
#else
    *sine = sin(x);
    *cosine = cos(x);
#endif
}

/* Four numbers from and to memory, at multiples of 16 bytes: a GPU takes one instruction. */
MILD_HD void load4(const Real *memory, Real *x) {
#if defined(__CUDA_ARCH__) && defined(MILD_REAL_FLOAT)
    const float4 four = *(const float4 *)memory;
    x[0] = four.x;
    x[1] = four.y;
    x[2] = four.z;
    x[3] = four.w;
#else
    for (int k = 0; k < 4; k++) {
        x[k] = memory[k];
    }
#endif
}

MILD_HD void store4(const Real *x, Real *memory) {
#if defined(__CUDA_ARCH__) && defined(MILD_REAL_FLOAT)
    *(float4 *)memory = make_float4(x[0], x[1], x[2], x[3]);
#else
    for (int k = 0; k < 4; k++) {
        memory[k] = x[k];
    }
#endif
}

/* A number of 16 bits, as in IEEE 754, at most 65504. Scaled by 2^-112 a float has the exponent of
 * the short one. */
MILD_HD_FN uint16_t half_pack(float x) {
#ifdef __CUDA_ARCH__
    return __half_as_ushort(__float2half_rn(fminf(fmaxf(x, -65504.0f), 65504.0f)));
#else
    const float size = fminf(fabsf(x), 65504) * 0x1p-112f;
    uint32_t bits;
    memcpy(&bits, &size, sizeof bits);
    return (uint16_t)(((bits + 0xfff + (bits >> 13 & 1)) >> 13) | (x < 0 ? 0x8000 : 0));
#endif
}

MILD_HD_FN float half_unpack(uint16_t half) {
#ifdef __CUDA_ARCH__
    return __half2float(__ushort_as_half(half));
#else
    const uint32_t bits = (uint32_t)(half & 0x7fff) << 13 | (uint32_t)(half & 0x8000) << 16;
    float size;
    memcpy(&size, &bits, sizeof size);
    return size * 0x1p112f;
#endif
}

/* Two numbers within [-1, 1] in the bits of one Real, each as a whole number of half the bits: the
 * rounding error is 2^-16, in double 2^-32. PAIR_ADD moves whole numbers into the low bits of the
 * mantissa, so that x may also be no number. */
#ifdef MILD_REAL_FLOAT
typedef uint32_t PairBits;
typedef int32_t PairWhole;
#define PAIR_ADD 0x1.8p23f
#else
typedef uint64_t PairBits;
typedef int64_t PairWhole;
#define PAIR_ADD 0x1.8p52
#endif
enum { PAIR_HALF = 4 * sizeof(Real) };                           /* bits of a number */
#define PAIR_ONE ((Real)(((PairWhole)1 << (PAIR_HALF - 1)) - 1)) /* 1 as a whole number */

MILD_HD PairBits pair_bits(Real x) {
    const Real moved = x * PAIR_ONE + PAIR_ADD;
    PairBits bits;
    memcpy(&bits, &moved, sizeof bits);
    return bits;
}

MILD_HD Real pair_pack(Real x, Real y) {
    const PairBits bits = pair_bits(x) << PAIR_HALF | (pair_bits(y) << PAIR_HALF >> PAIR_HALF);
    Real pair;
    memcpy(&pair, &bits, sizeof pair);
    return pair;
}

MILD_HD void pair_unpack(Real pair, Real *x, Real *y) {
    PairBits bits;
    memcpy(&bits, &pair, sizeof bits);
    *x = (Real)((PairWhole)bits >> PAIR_HALF) * (1 / PAIR_ONE);
    *y = (Real)((PairWhole)(bits << PAIR_HALF) >> PAIR_HALF) * (1 / PAIR_ONE);
}

/* ---- memory ahead of its use ---- */

/* memory, from which a GPU computes addresses as it stands, in place of each anew from what it was
 * made of: one instruction an address. real_load reads from it what a kernel does not write. */
MILD_HD const Real *real_pinned(const Real *memory) {
#ifdef __CUDA_ARCH__
    asm("" : "+l"(memory));
#endif
    return memory;
}

MILD_HD Real real_load(const Real *memory) {
    return ON_GPU(__ldg(memory), *memory);
}

/* Starts to copy a number from a GPU's global memory to its shared memory. It is there after
 * lanes_brought. */
MILD_HD void number_bring(const Real *from, Real *to) {
#if defined(__CUDA_ARCH__) && defined(MILD_REAL_FLOAT)
    asm volatile(
        "cp.async.ca.shared.global [%0], [%1], 4;" ::"r"((unsigned)__cvta_generic_to_shared(to)),
        "l"(from)
        : "memory");
#else
    *to = *from;
#endif
}

/* ---- lanes ---- */

/* LANES lanes work together on one robot. On a GPU they are the threads of a warp; on the CPU one
 * thread does the work of all. A function of this kind is marked WARP_FN and is a sequence of
 * blocks:
 *
 *     EACH_LANE(l) {
 *         x[l] = f(LANE(l), ...);      runs in every lane: at once on a GPU, in turn on the CPU
 *     }
 *     sum = lane_sum(x);               between blocks: what passes from lane to lane
 *
 * A value that differs between lanes is an array x[LANE_COPIES], used as x[l] in blocks. A GPU
 * keeps one copy, in the registers of the thread, and l is 0. The CPU keeps LANES copies. Any other
 * variable has the same value in all lanes. Branches and loops outside of blocks may depend on such
 * values only.
 *
 * Groups: the lanes are divided into groups of `size`, a power of two, such as the lanes that work
 * on one foot. Sums are taken in the same order on both sides, so that they differ only as the
 * arithmetic does. */

enum { LANES = 32 };

#ifdef __CUDACC__

#define WARP_FN static __device__ __forceinline__
#define LANE_COPIES 1
#define EACH_LANE(l) for (int l = 0; l < 1; l++)
#define LANE(l) ((int)(threadIdx.x % LANES))
#define LANE_UNROLL _Pragma("unroll")
#define LANE_ROLLED _Pragma("unroll 1")

/* Makes what each lane wrote to memory visible to the others. */
WARP_FN void lanes_sync(void) {
    __syncwarp();
}

/* Waits for what the lanes copy by number_bring, and makes it visible to the others. */
WARP_FN void lanes_brought(void) {
    asm volatile("cp.async.wait_all;" ::: "memory");
    __syncwarp();
}

/* x of lane `from`. */
WARP_FN Real lane_read(const Real *x, int from) {
    return __shfl_sync(0xffffffffu, x[0], from);
}

/* To each lane, x of lane `at` of its group. y may be x. */
WARP_FN void group_read(const Real *x, int at, int size, Real *y) {
    y[0] = __shfl_sync(0xffffffffu, x[0], at, size);
}

/* x of the lane whose number differs in the bit `step`. */
WARP_FN void lane_swap(const Real *x, int step, Real *y) {
    y[0] = __shfl_xor_sync(0xffffffffu, x[0], step);
}

#else

#define WARP_FN static inline
#define LANE_COPIES LANES
/* NOLINTNEXTLINE(bugprone-macro-parentheses): l is a name */
#define EACH_LANE(l) for (int l = 0; l < LANES; l++)
#define LANE(l) (l)
#define LANE_UNROLL
#define LANE_ROLLED

WARP_FN void lanes_sync(void) {
}

WARP_FN void lanes_brought(void) {
}

WARP_FN Real lane_read(const Real *x, int from) {
    return x[from];
}

WARP_FN void group_read(const Real *x, int at, int size, Real *y) {
    for (int begin = 0; begin < LANES; begin += size) {
        const Real value = x[begin + at];
        for (int l = begin; l < begin + size; l++) {
            y[l] = value;
        }
    }
}

WARP_FN void lane_swap(const Real *x, int step, Real *y) {
    for (int l = 0; l < LANES; l++) {
        y[l] = x[l ^ step];
    }
}

#endif

/* To each lane, the sum over its group. */
WARP_FN void group_sum(Real *x, int size) {
    LANE_UNROLL
    for (int step = size / 2; step > 0; step /= 2) {
        Real other[LANE_COPIES];
        lane_swap(x, step, other);
        EACH_LANE(l) {
            x[l] += other[l];
        }
    }
}

/* To each lane, the largest of its group. */
WARP_FN void group_max(Real *x, int size) {
    LANE_UNROLL
    for (int step = size / 2; step > 0; step /= 2) {
        Real other[LANE_COPIES];
        lane_swap(x, step, other);
        EACH_LANE(l) {
            x[l] = real_max(x[l], other[l]);
        }
    }
}

/* group_sum of x[0] to x[count - 1], to the bit, by recursive halving: at the distances size / 2,
 * size / 4, ..., 1 a lane keeps every second of its entries, the odd ones where that bit of its
 * number is set, sends the others, and adds what it gets. Then x[0], x[1], ... of a lane are the
 * entries group_entry, group_entry + size, ... The inner loop has the bound `count` too, because
 * nvcc keeps x in registers only where bounds are constants. */
WARP_FN void group_halve(Real (*x)[LANE_COPIES], int count, int size) {
    int entries = count;
    LANE_UNROLL
    for (int step = size / 2; step > 0; step /= 2) {
        LANE_UNROLL
        for (int i = 0; i < count && i < entries; i += 2) {
            Real sent[LANE_COPIES], got[LANE_COPIES];
            EACH_LANE(l) {
                const Real even = x[i][l];
                const Real odd = i + 1 < entries ? x[i + 1][l] : 0;
                x[i / 2][l] = LANE(l) & step ? odd : even;
                sent[l] = LANE(l) & step ? even : odd;
            }
            lane_swap(sent, step, got);
            EACH_LANE(l) {
                x[i / 2][l] += got[l];
            }
        }
        entries = (entries + 1) / 2;
    }
}

/* The first entry that group_halve leaves in a lane: the bits of its number in the group, in
 * reverse. So it is the lane of an entry, too. */
MILD_HD int group_entry(int lane, int size) {
    int entry = 0;
    LANE_UNROLL
    for (int bit = 1; bit < size; bit *= 2) {
        entry += lane & bit ? size / 2 / bit : 0;
    }
    return entry;
}

/* To each lane, the sums of group_halve. About 2 count values pass from lane to lane instead of
 * count log2(size). x is overwritten. */
WARP_FN void group_sums(Real (*x)[LANE_COPIES], int count, int size, Real (*sum)[LANE_COPIES]) {
    group_halve(x, count, size);
    LANE_UNROLL
    for (int i = 0; i < count; i++) {
        group_read(x[i / size], group_entry(i, size), size, sum[i]);
    }
}

/* The sum over all lanes. x is overwritten. */
WARP_FN Real lane_sum(Real *x) {
    group_sum(x, LANES);
    return x[0];
}

/* The largest of all lanes. x is overwritten. */
WARP_FN Real lane_max(Real *x) {
    group_max(x, LANES);
    return x[0];
}

/* ---- teams ---- */

/* A team: the warps of a block, which work together on what is in shared memory. On the CPU, and
 * where a block has one warp, it is that warp.
 *
 * TEAM lanes have the numbers TEAM_LANE(l), and team_sync is their lanes_sync. Sums are those of a
 * warp: each warp makes them anew, or for a part of its own. */

#define TEAM_FN WARP_FN

#ifdef __CUDACC__
#define TEAM ((int)blockDim.x)
#define TEAM_LANE(l) ((int)threadIdx.x)
#define TEAM_WARPS ((int)blockDim.x / LANES)
#define TEAM_WARP ((int)threadIdx.x / LANES)
#else
#define TEAM ((int)LANES)
#define TEAM_LANE(l) LANE(l)
#define TEAM_WARPS 1
#define TEAM_WARP 0
#endif

/* rank: of a lane, the number of lanes below it whose flag is not 0. Returns that of all lanes. */
WARP_FN int lanes_rank(const int *flag, int *rank) {
#ifdef __CUDACC__
    const unsigned all = __ballot_sync(0xffffffffu, flag[0]);
    rank[0] = __popc(all & ((1u << LANE(0)) - 1));
    return __popc(all);
#else
    int count = 0;
    for (int l = 0; l < LANES; l++) {
        rank[l] = count;
        count += flag[l] != 0;
    }
    return count;
#endif
}

/* Bool: the flag of some lane is not 0. */
WARP_FN int lanes_any(const int *flag) {
#ifdef __CUDACC__
    return __any_sync(0xffffffffu, flag[0]);
#else
    int any = 0;
    for (int l = 0; l < LANES; l++) {
        any |= flag[l] != 0;
    }
    return any;
#endif
}

/* The first lane whose flag is not 0; LANES if there is none. */
WARP_FN int lanes_first(const int *flag) {
#ifdef __CUDACC__
    const unsigned all = __ballot_sync(0xffffffffu, flag[0]);
    return all ? __ffs((int)all) - 1 : LANES;
#else
    int first = LANES;
    for (int l = LANES - 1; l >= 0; l--) {
        first = flag[l] ? l : first;
    }
    return first;
#endif
}

TEAM_FN void team_sync(void) {
#ifdef __CUDACC__
    __syncthreads();
#endif
}

/* ---- tiles ---- */

/* A tile: on a GPU TILE threads of a warp, which call a function together and take the same way
 * through it; on the CPU one. Each has its share of a loop
 *
 *     for (int i = tile_lane(); i < count; i += TILE)
 *
 * and lane 0 adds to what is not in such a loop; what all write is the same number. What one lane
 * writes another reads after tile_sync. */
#ifdef __CUDACC__
enum { TILE = 8 };
#define TILE_UNROLL _Pragma("unroll 8") /* lets a GPU wait for several numbers at once */
#else
enum { TILE = 1 };
#define TILE_UNROLL
#endif

MILD_HD_FN int tile_lane(void) {
    return ON_GPU((int)(threadIdx.x % TILE), 0);
}

#ifdef __CUDA_ARCH__
static inline __device__ unsigned tile_mask(void) {
    return ((1u << TILE) - 1) << (threadIdx.x % 32 / TILE * TILE);
}
#endif

/* Makes what each lane wrote visible to the others. */
MILD_HD_FN void tile_sync(void) {
#ifdef __CUDA_ARCH__
    __syncwarp(tile_mask());
#endif
}

/* Sets numbers to 0. */
MILD_HD_FN void tile_clear(void *numbers, size_t bytes) {
#ifdef __CUDA_ARCH__
    float *number = (float *)numbers;
    for (size_t i = (size_t)tile_lane(); i < bytes / sizeof *number; i += TILE) {
        number[i] = 0;
    }
#else
    memset(numbers, 0, bytes);
#endif
}

/* The sum over the lanes. */
MILD_HD_FN Real tile_sum(Real x) {
#ifdef __CUDA_ARCH__
    for (int step = TILE / 2; step > 0; step /= 2) {
        x += __shfl_xor_sync(tile_mask(), x, step);
    }
#endif
    return x;
}

#endif
