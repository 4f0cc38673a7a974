/* ranks/ranks.h by MPI. */
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "device/ranks/ranks.h"
#include "device/ranks/ranks_private.h"

enum { TAG_SUM, TAG_SIZE, TAG_PART };

/* MPI counts in int. */
static const size_t message_bytes = 1 << 30;

static int message(size_t bytes) {
    return (int)(bytes < message_bytes ? bytes : message_bytes);
}

/* ---- joining and leaving ---- */

static MildStatus check_count(const Ranks *ranks, MildError *error) {
    if (ranks->count > RANKS_MAX || (ranks->count & (ranks->count - 1)) != 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%d processes: 1, 2, 4, 8, 16, 32 or 64 can train together; change "
                         "mpirun -n",
                         ranks->count);
    }
    return MILD_OK;
}

static void count_locals(Ranks *ranks) {
    MPI_Comm machine;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, ranks->number, MPI_INFO_NULL,
                        &machine);
    MPI_Comm_rank(machine, &ranks->local);
    MPI_Comm_size(machine, &ranks->locals);
    MPI_Comm_free(&machine);
}

MildStatus ranks_open(Ranks **ranks, MildError *error) {
    int provided;
    *ranks = NULL;
    if (!ranks_launched(&(int){0})) {
        return MILD_OK;
    }
    Ranks *made = calloc(1, sizeof *made);
    if (!made) { /* the launcher ends the others when it sees this process end without MPI */
        return mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    }
    MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &provided);
    MPI_Comm_size(MPI_COMM_WORLD, &made->count);
    MPI_Comm_rank(MPI_COMM_WORLD, &made->number);
    count_locals(made);
    *ranks = made;
    return check_count(made, error);
}

void ranks_close(Ranks *ranks) {
    if (ranks) {
        ranks_close_device(ranks);
        MPI_Finalize();
        free(ranks);
    }
}

void ranks_abort(const MildError *error) {
    fprintf(stderr, "mild: %s\n", error->text);
    fflush(NULL);
    MPI_Abort(MPI_COMM_WORLD, 2);
    exit(2);
}

/* ---- sums ---- */

/* Recursive doubling: after the exchange at distance d every rank holds the sum over the aligned
 * run of 2 d ranks that it is in. x + y = y + x to the last bit, so partners hold the same. */
static void exchange(Ranks *ranks, int distance, const void *mine, size_t bytes) {
    const int partner = ranks->number ^ distance;
    MPI_Sendrecv(mine, (int)bytes, MPI_BYTE, partner, TAG_SUM, ranks->block, (int)bytes, MPI_BYTE,
                 partner, TAG_SUM, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
}

static void sum_block(Ranks *ranks, float *x, int64_t count) {
    const float *theirs = (const float *)(const void *)ranks->block;
    for (int distance = 1; distance < ranks->count; distance *= 2) {
        exchange(ranks, distance, x, (size_t)count * sizeof *x);
        for (int64_t i = 0; i < count; i++) {
            x[i] += theirs[i];
        }
    }
}

static void sum_block_double(Ranks *ranks, double *x, int64_t count) {
    for (int distance = 1; distance < ranks->count; distance *= 2) {
        exchange(ranks, distance, x, (size_t)count * sizeof *x);
        for (int64_t i = 0; i < count; i++) {
            x[i] += ranks->block[i];
        }
    }
}

void ranks_sum(Ranks *ranks, float *x, int64_t count) {
    const int64_t most = RANKS_BLOCK / sizeof *x;
    for (int64_t at = 0; ranks && at < count; at += most) {
        sum_block(ranks, x + at, count - at < most ? count - at : most);
    }
}

void ranks_sum_double(Ranks *ranks, double *x, int64_t count) {
    const int64_t most = RANKS_BLOCK / sizeof *x;
    for (int64_t at = 0; ranks && at < count; at += most) {
        sum_block_double(ranks, x + at, count - at < most ? count - at : most);
    }
}

/* ---- bytes ---- */

static void broadcast_from(const Ranks *ranks, int root, void *data, size_t bytes) {
    char *at = data;
    for (size_t left = ranks ? bytes : 0; left > 0; left -= (size_t)message(left)) {
        MPI_Bcast(at + (bytes - left), message(left), MPI_BYTE, root, MPI_COMM_WORLD);
    }
}

void ranks_broadcast(Ranks *ranks, void *data, size_t bytes) {
    broadcast_from(ranks, 0, data, bytes);
}

static void send_part(const char *part, size_t bytes) {
    uint64_t size = bytes;
    MPI_Send(&size, sizeof size, MPI_BYTE, 0, TAG_SIZE, MPI_COMM_WORLD);
    for (size_t left = bytes; left > 0; left -= (size_t)message(left)) {
        MPI_Send(part + (bytes - left), message(left), MPI_BYTE, 0, TAG_PART, MPI_COMM_WORLD);
    }
}

/* Returns its bytes. */
static size_t receive_part(int from, char *part) {
    uint64_t size;
    MPI_Recv(&size, sizeof size, MPI_BYTE, from, TAG_SIZE, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    for (size_t left = size; left > 0; left -= (size_t)message(left)) {
        MPI_Recv(part + (size - left), message(left), MPI_BYTE, from, TAG_PART, MPI_COMM_WORLD,
                 MPI_STATUS_IGNORE);
    }
    return size;
}

void ranks_gather(Ranks *ranks, const void *part, size_t bytes, void *whole) {
    if (ranks_number(ranks) > 0) {
        send_part(part, bytes);
        return;
    }
    memcpy(whole, part, bytes);
    for (int from = 1; from < ranks_count(ranks); from++) {
        bytes += receive_part(from, (char *)whole + bytes);
    }
}

/* ---- agreement ---- */

int ranks_any(Ranks *ranks, int flag) {
    int any = flag;
    if (ranks) {
        MPI_Allreduce(&flag, &any, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    }
    return any;
}

MildStatus ranks_agree(Ranks *ranks, MildStatus status, MildError *error) {
    if (!ranks) {
        return status;
    }
    const int mine = status == MILD_OK ? ranks->count : ranks->number;
    int first;
    MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
    if (first == ranks->count) {
        return MILD_OK;
    }
    MildError cause = {.status = status};
    if (error && first == ranks->number) {
        cause = *error;
    }
    broadcast_from(ranks, first, &cause, sizeof cause);
    return first == 0 ? mild_fail(error, cause.status, "%s", cause.text)
                      : mild_fail(error, cause.status, "process %d of %d: %.350s", first + 1,
                                  ranks->count, cause.text);
}

void ranks_wait(Ranks *ranks) {
    if (ranks) {
        MPI_Barrier(MPI_COMM_WORLD);
    }
}
