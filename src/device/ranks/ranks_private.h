/* What a rank knows, and what the launcher's environment says. */
#ifndef MILD_RANKS_PRIVATE_H
#define MILD_RANKS_PRIVATE_H

#include "device/ranks/ranks.h"

#define RANKS_BLOCK 65536 /* [bytes] that a sum sends at a time */

struct RanksDevice; /* ranks/ranks.h */

struct Ranks {
    int number, count;
    int local, locals;          /* number and count among the ranks of this machine */
    struct RanksDevice *device; /* NULL: none */
    double block[RANKS_BLOCK / sizeof(double)]; /* of the partner in a sum */
};

/* Bool: a launcher of MPI has started this process. *count: processes, or 0 if it does not say. */
int ranks_launched(int *count);

#endif
