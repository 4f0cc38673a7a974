/* sched_getaffinity */
#define _GNU_SOURCE
#include <sched.h>
#include <stdlib.h>
#include <unistd.h>

#include "device/ranks/ranks_private.h"

/* Open MPI; MPICH, Intel MPI and Slurm's PMI-2; Slurm's PMIx, which does not say how many. */
int ranks_launched(int *count) {
    const char *size = getenv("OMPI_COMM_WORLD_SIZE");
    size = size ? size : getenv("PMI_SIZE");
    *count = size ? (int)strtol(size, NULL, 10) : 0;
    return size || getenv("PMIX_RANK");
}

int ranks_count(const Ranks *ranks) {
    return ranks ? ranks->count : 1;
}

int ranks_number(const Ranks *ranks) {
    return ranks ? ranks->number : 0;
}

int ranks_local(const Ranks *ranks) {
    return ranks ? ranks->local : 0;
}

int ranks_threads(const Ranks *ranks) {
    if (!ranks) {
        return 0;
    }
    cpu_set_t bound;
    const int cores = (int)sysconf(_SC_NPROCESSORS_ONLN) / ranks->locals,
              allowed = sched_getaffinity(0, sizeof bound, &bound) == 0 ? CPU_COUNT(&bound) : cores;
    const int threads = allowed < cores ? allowed : cores;
    return threads > 1 ? threads : 1;
}
