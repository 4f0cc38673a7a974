/* What batch.c and batch_fork.c share: environments of the batch engine, and the table of their
 * arrays. */
#ifndef ENVS_BATCH_INSIDE_H
#define ENVS_BATCH_INSIDE_H

#include "device/device.h"
#include "env/backend.h"
#include "env/kernels.h"
#include "ground/batch/bodies_batch.h"

typedef struct {
    Envs base;
    EnvsArrays arrays; /* their memory is the device's */
    MildBatch *ground;
    BatchBodies bodies; /* with shells that stand; all 0: none */
    DeviceFork *fork;   /* streams of all slices but the first, on a GPU; else NULL */
    int slices;         /* of the robots */
    TaskShape shape;
    size_t labels;              /* of the map, 1 without */
    const EnvsKernels *kernels; /* NULL: on the host */
    void *block;                /* where the arrays are, but for task and model */
    EnvsGround *drawn;          /* of the device: the grounds of EnvsTask */
    void *trials;               /* where those of trials are */
    Pool *pool;                 /* of the host */
    int device;
    size_t robot;  /* [B] of EnvRobot */
    size_t shells; /* [B] of EnvShells */
    size_t bytes;  /* of the device, without the ground */
} Batch;

static inline Batch *own(Envs *envs) {
    return (Batch *)(void *)envs;
}

static inline const Batch *own_const(const Envs *envs) {
    return (const Batch *)(const void *)envs;
}

static inline MildStatus checked(const char *why, MildError *error) {
    return why ? mild_fail(error, MILD_ERROR_IO, "GPU: robots: %s", why) : MILD_OK;
}

/* One call, for the threads of the host. */
typedef struct {
    const EnvsArrays *arrays;
    const EnvsStep *step;
    int part;
    const EnvsFork *fork;
    const EnvsMotion *motion;
} Call;

/* What a fork does with an array. */
typedef enum {
    ROW_STATE,  /* it is copied */
    ROW_PRINTS, /* it is copied, and where the array is NULL all 0 */
    ROW_GROUND, /* it is copied, unless environments keep their own ground */
    ROW_WORK    /* it is left: nothing in it outlasts a policy step */
} RowKind;

/* An array with a row for each environment. */
typedef struct {
    void *at;     /* pointer to the array's pointer */
    size_t bytes; /* of a row; 0: there is no such array */
    RowKind kind;
} Row;

/* The arrays that take_arrays allocates, state first, and behind them those of the ground. Whatever
 * an environment has between two policy steps is here: slices, saves and forks follow this table.
 */
enum { ROWS_TAKEN = 19, ROWS = ROWS_TAKEN + 3 };
_Static_assert((int)ROWS <= (int)ENVS_ROWS_MAX, "room for every row");
void batch_list_rows(const Batch *b, EnvsArrays *all, BatchArrays *ground, Row rows[ROWS]);

/* Of the backend, batch_fork.c: see envs.h. */
size_t batch_block_bytes(const Envs *envs, int own_ground);
MildStatus batch_save(Envs *envs, int first, int count, void *blocks, MildStream stream,
                      MildError *error);
MildStatus batch_fork(Envs *envs, const void *blocks, int count, size_t stride, int own_ground,
                      MildStream stream, MildError *error);
MildStatus batch_read(Envs *envs, const EnvsMotion *motion, MildStream stream, MildError *error);

#endif
