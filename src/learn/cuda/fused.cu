#include "learn/cuda/fused.h"

#include <cutlass/cutlass.h>
#include <cutlass/epilogue/collective/collective_builder.hpp>
#include <cutlass/epilogue/fusion/sm90_callbacks_tma_warpspecialized.hpp>
#include <cutlass/gemm/collective/collective_builder.hpp>
#include <cutlass/gemm/device/gemm_universal_adapter.h>
#include <cutlass/gemm/kernel/gemm_universal.hpp>

namespace {

using namespace cute;
namespace fusion = cutlass::epilogue::fusion;
using Bf16 = cutlass::bfloat16_t;
using Cooperative = cutlass::epilogue::TmaWarpSpecializedCooperative;

/* ---- ends, of the numbers that a thread has ---- */

template <class> struct Elu;
template <int N> struct Elu<cutlass::Array<float, N>> {
    CUTLASS_DEVICE cutlass::Array<float, N> operator()(cutlass::Array<float, N> x) const {
        CUTLASS_PRAGMA_UNROLL
        for (int i = 0; i < N; i++) {
            x[i] = x[i] > 0.0f ? x[i] : __expf(x[i]) - 1.0f;
        }
        return x;
    }
};

/* elu' = 1 or exp(..) = y + 1. */
template <class> struct TimesSlope;
template <int N> struct TimesSlope<cutlass::Array<float, N>> {
    CUTLASS_DEVICE cutlass::Array<float, N> operator()(cutlass::Array<float, N> d,
                                                       const cutlass::Array<float, N> &y) const {
        CUTLASS_PRAGMA_UNROLL
        for (int i = 0; i < N; i++) {
            d[i] *= y[i] > 0.0f ? 1.0f : y[i] + 1.0f;
        }
        return d;
    }
};

template <template <class> class Function, class To, class... From>
using End = fusion::Sm90EVT<
    fusion::Sm90Compute<Function, To, float, cutlass::FloatRoundStyle::round_to_nearest>, From...>;
using Product = fusion::Sm90AccFetch;

template <class Tile>
using Forward =
    End<Elu, Bf16, End<cutlass::plus, float, Product, fusion::Sm90RowBroadcast<0, Tile, float>>>;

/* Sums over a tile's rows are stored, not added up; rows beyond the last are zero. */
template <class Tile>
using ColumnSums =
    fusion::Sm90RowReduction<cutlass::plus, cutlass::plus, cutlass::plus, 0, Tile, float, float,
                             cutlass::FloatRoundStyle::round_to_nearest, Stride<_0, _1, _0>, 4,
                             /* may be NULL */ false, /* final */ false, /* checked */ false>;
template <class Tile>
using Backward = End<
    cutlass::epilogue::thread::Identity, Bf16,
    fusion::Sm90EVT<ColumnSums<Tile>, End<TimesSlope, float, Product, fusion::Sm90SrcFetch<Bf16>>>>;

/* ---- kernels ---- */

/* Tile of ROWS x COLUMNS numbers by 64 terms; CLUSTER tiles below each other share the weights.
 * Read: the type of what the end reads, Order: of the weights. */
template <int ROWS, int COLUMNS, int CLUSTER> struct Shapes {
    using Tile = Shape<Int<ROWS>, Int<COLUMNS>, _64>;
    using Cluster = Shape<Int<CLUSTER>, _1, _1>;
};

template <class Shapes, template <class> class Tail, class Read, class Order> struct Fused {
    using Row = cutlass::layout::RowMajor;
    using Tile = typename Shapes::Tile;
    using Cluster = typename Shapes::Cluster;
    using Epilogue = typename cutlass::epilogue::collective::CollectiveBuilder<
        cutlass::arch::Sm90, cutlass::arch::OpClassTensorOp, Tile, Cluster,
        cutlass::epilogue::collective::EpilogueTileAuto, float, float, Read, Row, 8, Bf16, Row, 8,
        Cooperative, Tail<Tile>>::CollectiveOp;
    using Mainloop = typename cutlass::gemm::collective::CollectiveBuilder<
        cutlass::arch::Sm90, cutlass::arch::OpClassTensorOp, Bf16, Row, 8, Bf16, Order, 8, float,
        Tile, Cluster,
        cutlass::gemm::collective::StageCountAutoCarveout<static_cast<int>(
            sizeof(typename Epilogue::SharedStorage))>,
        cutlass::gemm::KernelTmaWarpSpecializedCooperative>::CollectiveOp;
    using Kernel =
        cutlass::gemm::kernel::GemmUniversal<Shape<int, int, int, int>, Mainloop, Epilogue>;
    using Gemm = cutlass::gemm::device::GemmUniversalAdapter<Kernel>;
};

/* [rows][width] = a [rows][terms] times the weights. */
struct Job {
    cudaStream_t stream;
    int processors, rows, width, terms;
    const Bf16 *a, *weight;
};

template <class F>
int launch(const Job &job, typename F::Kernel::StrideB order,
           const typename F::Kernel::EpilogueArguments &epilogue) {
    typename F::Gemm::Arguments arguments{cutlass::gemm::GemmUniversalMode::kGemm,
                                          {job.rows, job.width, job.terms, 1},
                                          {job.a, {job.terms, _1{}, 0}, job.weight, order},
                                          epilogue};
    arguments.hw_info.sm_count = job.processors;
    typename F::Gemm gemm;
    return gemm.run(arguments, nullptr, job.stream) == cutlass::Status::kSuccess;
}

/* The weights lie [width][terms]. */
template <class Shapes> int forward(const Job &job, const float *bias, Bf16 *y) {
    using F = Fused<Shapes, Forward, void, cutlass::layout::ColumnMajor>;
    return launch<F>(job, {job.terms, _1{}, 0},
                     {{{{}, {bias}, {}}, {}}, nullptr, {}, y, {job.width, _1{}, 0}});
}

/* The weights lie [terms][width]. */
template <class Shapes> int backward(const Job &job, const Bf16 *y, Bf16 *to, float *partial) {
    using F = Fused<Shapes, Backward, Bf16, cutlass::layout::RowMajor>;
    return launch<F>(
        job, {_1{}, job.width, 0},
        {{{{{}, {}, {}}, {partial}}, {}}, y, {job.width, _1{}, 0}, to, {job.width, _1{}, 0}});
}

/* The fastest of those tried on an H100 (docs/log.md). Sums over tiles of 128 columns are
 * slow: CUTLASS keeps them in the thread's local memory. */
using ForwardWide = Shapes<128, 256, 2>;
using ForwardMiddle = Shapes<128, 128, 1>;
using ForwardNarrow = Shapes<256, 64, 1>;
using BackwardWide = Shapes<128, 256, 1>;
using BackwardNarrow = Shapes<256, 64, 1>;

bool is_wide(int width) {
    return width % 256 == 0;
}

template <class Shapes> GpuSlices slices_of(int rows, int width) {
    constexpr int ROWS = size<0>(typename Shapes::Tile{}),
                  COLUMNS = size<1>(typename Shapes::Tile{});
    return {(rows + ROWS - 1) / ROWS, (width + COLUMNS - 1) / COLUMNS * COLUMNS};
}

} // namespace

int gpu_fused_processors(int device) {
    int major = 0, minor = 0, processors = 0;
    cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device);
    cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, device);
    cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device);
    return major == 9 && minor == 0 ? processors : 0;
}

int gpu_fused_forward(cudaStream_t stream, int processors, int rows, int out, int in, const void *x,
                      const void *weight, const float *bias, void *y) {
    const Job job = {stream, processors, rows, out, in, (const Bf16 *)x, (const Bf16 *)weight};
    if (is_wide(out)) {
        return forward<ForwardWide>(job, bias, (Bf16 *)y);
    }
    return out > 64 ? forward<ForwardMiddle>(job, bias, (Bf16 *)y)
                    : forward<ForwardNarrow>(job, bias, (Bf16 *)y);
}

GpuSlices gpu_fused_slices(int rows, int in) {
    return is_wide(in) ? slices_of<BackwardWide>(rows, in) : slices_of<BackwardNarrow>(rows, in);
}

int gpu_fused_backward(cudaStream_t stream, int processors, int rows, int out, int in,
                       const void *d, const void *weight, const void *y, void *to, float *partial) {
    const Job job = {stream, processors, rows, in, out, (const Bf16 *)d, (const Bf16 *)weight};
    return is_wide(in) ? backward<BackwardWide>(job, (const Bf16 *)y, (Bf16 *)to, partial)
                       : backward<BackwardNarrow>(job, (const Bf16 *)y, (Bf16 *)to, partial);
}
