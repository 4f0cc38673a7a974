/* Environments of the batch engine to blocks and back, by the table of their arrays. */
#define MILD_REAL_FLOAT
#include "env/batch_inside.h"

#include <string.h>

/* [B] of a saved block and of each of its rows. */
enum { BLOCK_ALIGN = 16 };

static void fork_piece(void *context, int piece, int thread) {
    const Call *call = context;
    (void)thread;
    envs_host_fork(call->arrays, call->fork, piece);
}

static void read_piece(void *context, int piece, int thread) {
    const Call *call = context;
    (void)thread;
    envs_host_read(call->arrays, call->motion, piece);
}

static size_t whole(size_t bytes) {
    return (bytes + BLOCK_ALIGN - 1) / BLOCK_ALIGN * BLOCK_ALIGN;
}

/* The rows of a block in the order of RowKind, so that a fork with own_ground reads its beginning.
 * The memory of the feet is last there: on a map it has more numbers, behind the others. Returns
 * its bytes. */
static size_t fork_rows(const Batch *b, int own_ground, EnvsFork *fork) {
    EnvsArrays all = b->arrays;
    BatchArrays ground = b->ground->arrays;
    Row rows[ROWS];
    size_t place = 0;
    batch_list_rows(b, &all, &ground, rows);
    *fork = (EnvsFork){
        .own_ground = own_ground, .group = 1, .shape = b->ground->shape, .ground = ground};
    for (int kind = ROW_STATE; kind <= (own_ground ? ROW_PRINTS : ROW_GROUND); kind++) {
        if (kind == ROW_PRINTS) {
            fork->rest = place;
            place += whole((1 + batch_worn_numbers(&fork->shape)) * sizeof(float));
        }
        for (int i = 0; i < ROWS; i++) {
            if ((int)rows[i].kind != kind || rows[i].bytes == 0) {
                continue;
            }
            memcpy(&fork->row[fork->count].at, rows[i].at, sizeof(char *));
            fork->row[fork->count].bytes = rows[i].bytes;
            fork->row[fork->count].place = place;
            fork->count++;
            place += whole(rows[i].bytes);
        }
    }
    return place;
}

size_t batch_block_bytes(const Envs *envs, int own_ground) {
    EnvsFork fork;
    return fork_rows(own_const(envs), own_ground, &fork);
}

MildStatus batch_save(Envs *envs, int first, int count, void *blocks, MildStream stream,
                      MildError *error) {
    const Batch *b = own(envs);
    EnvsFork fork;
    const size_t stride = fork_rows(b, 0, &fork);
    if (first < 0 || count < 1 || first > b->arrays.envs - count) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "save: %d environments from %d on, of %d",
                         count, first, b->arrays.envs);
    }
    if ((uintptr_t)blocks % BLOCK_ALIGN) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "save: blocks must begin at a multiple of %d",
                         BLOCK_ALIGN);
    }
    fork.stride = stride;
    fork.block = blocks;
    fork.first = first;
    if (b->kernels) {
        return checked(b->kernels->save(&b->arrays, &fork, count, stream), error);
    }
    for (int i = 0; i < count; i++) {
        envs_host_save(&b->arrays, &fork, first + i);
    }
    return MILD_OK;
}

MildStatus batch_fork(Envs *envs, const void *blocks, int count, size_t stride, int own_ground,
                      MildStream stream, MildError *error) {
    const Batch *b = own(envs);
    EnvsFork fork;
    Call call = {.arrays = &b->arrays, .fork = &fork};
    const size_t least = fork_rows(b, own_ground, &fork);
    if (count < 1 || b->arrays.envs % count != 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "fork: %d environments are not a multiple of %d blocks", b->arrays.envs,
                         count);
    }
    if (own_ground ? stride < least : stride != least) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "fork: a block of %zu bytes, but these environments' has %zu", stride,
                         least);
    }
    if (own_ground && b->ground->shape.map) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "fork: own_ground is for level ground of one material; "
                         "randomize.patch_share and terrain.kind ask for another");
    }
    if ((uintptr_t)blocks % BLOCK_ALIGN || stride % BLOCK_ALIGN) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "fork: blocks must begin at multiples of %d",
                         BLOCK_ALIGN);
    }
    fork.block = (char *)(uintptr_t)blocks; /* which are read */
    fork.stride = stride;
    fork.group = b->arrays.envs / count;
    const MildStatus status =
        own_ground ? mild_batch_reset(b->ground, NULL, stream, error) : MILD_OK;
    if (status == MILD_OK && b->kernels) {
        return checked(b->kernels->fork(&b->arrays, &fork, stream), error);
    }
    if (status == MILD_OK) {
        pool_run(b->pool, b->arrays.envs, fork_piece, &call);
    }
    return status;
}

MildStatus batch_read(Envs *envs, const EnvsMotion *motion, MildStream stream, MildError *error) {
    const Batch *b = own(envs);
    Call call = {.arrays = &b->arrays, .motion = motion};
    if (b->kernels) {
        return checked(b->kernels->read(&b->arrays, motion, stream), error);
    }
    pool_run(b->pool, b->arrays.envs, read_piece, &call);
    return MILD_OK;
}
