/* A library to be preloaded (LD_PRELOAD): memory runs out for the whole program, libraries
 * included. FAIL_AT=N: the N-th allocation, from 0, fails; with FAIL_ON=1 all after it too. Without
 * FAIL_AT the count of allocations goes to standard error at the end. glibc. */
#include <errno.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *block, size_t size);
void *__libc_memalign(size_t alignment, size_t size);

static atomic_long allocations;

static int fails(void) {
    static long at = -2;
    static int on;
    if (at == -2) {
        const char *text = getenv("FAIL_AT");
        at = text ? atol(text) : -1;
        on = getenv("FAIL_ON") != NULL;
    }
    long n = atomic_fetch_add(&allocations, 1);
    int now = at >= 0 && (n == at || (on && n > at));
    if (now) {
        errno = ENOMEM;
    }
    return now;
}

void *malloc(size_t size) {
    return fails() ? NULL : __libc_malloc(size);
}

void *calloc(size_t count, size_t size) {
    return fails() ? NULL : __libc_calloc(count, size);
}

void *realloc(void *block, size_t size) {
    return fails() ? NULL : __libc_realloc(block, size);
}

void *aligned_alloc(size_t alignment, size_t size) {
    return fails() ? NULL : __libc_memalign(alignment, size);
}

__attribute__((destructor)) static void print_count(void) {
    char text[40];
    int length = snprintf(text, sizeof text, "%ld allocations\n", atomic_load(&allocations));
    if (!getenv("FAIL_AT") && write(STDERR_FILENO, text, (size_t)length) < 0) {
        _exit(1);
    }
}
