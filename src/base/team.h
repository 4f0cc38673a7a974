/* The dialect of hd.h for a team: the warps of a block, which work together on what is in shared
 * memory. On the CPU, and where a block has one warp, it is that warp.
 *
 * TEAM lanes have the numbers TEAM_LANE(l), and team_sync is their lanes_sync. Sums are those of a
 * warp: each warp makes them anew, or for a part of its own. */
#ifndef MILD_TEAM_H
#define MILD_TEAM_H

#include "base/hd.h"

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

TEAM_FN void team_sync(void) {
#ifdef __CUDACC__
    __syncthreads();
#endif
}

#endif
