/* Pinned numbers: tests/pins.txt holds what this tree computed when it was last right, and this
 * reads it. A hash holds on one platform, to the last bit; a plain number holds on every platform,
 * within a tolerance. */
#ifndef TEST_PINS_H
#define TEST_PINS_H

#include <gnu/libc-version.h>
#include <math.h>
#include <mujoco/mujoco.h>
#include <oneapi/dnnl/dnnl.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What else than compiler and processor the last bit depends on. */
enum { PIN_ON_MUJOCO = 1, PIN_ON_ONEDNN = 2 };

#define PIN_FILE MILD_SOURCE_DIR "/tests/pins.txt"
#define PIN_RENEW "if that is meant: scripts/pin.sh \"reason\""

enum { PLATFORM_SIZE = 256 };

static int compared, missing, wrong;
static double worst; /* difference of pin_near as a share of its tolerance */
static char worst_name[128];
static FILE *rows;

#if defined(__clang__)
#define COMPILER "clang-" __clang_version__
#else
#define COMPILER "gcc-" __VERSION__
#endif

#if defined(__AVX512F__)
#define VECTORS "avx512"
#elif defined(__AVX2__)
#define VECTORS "avx2"
#elif defined(__ARM_NEON)
#define VECTORS "neon"
#else
#define VECTORS "128"
#endif

#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
#define FUSED "+fma"
#else
#define FUSED ""
#endif

#if defined(__OPTIMIZE__)
#define UNUSUAL ""
#else
#define UNUSUAL "/unoptimised" /* sums stay in order there */
#endif

/* Compiler, processor that it compiles for, vectors, mathematical library; then the others. The
 * MuJoCo and oneDNN that are loaded, not those compiled against. */
static void platform_name(unsigned depends_on, char name[PLATFORM_SIZE]) {
    int used = snprintf(name, PLATFORM_SIZE, "%s", COMPILER);
    name[strcspn(name, " ")] = '\0'; /* "14.0.6 (vendor ...)" */
    used = (int)strlen(name);
    used +=
        snprintf(name + used, (size_t)(PLATFORM_SIZE - used),
                 "/%s/" VECTORS FUSED UNUSUAL "/glibc-%s", PIN_PROCESSOR, gnu_get_libc_version());
    if (depends_on & PIN_ON_MUJOCO) {
        used +=
            snprintf(name + used, (size_t)(PLATFORM_SIZE - used), "/mujoco-%s", mj_versionString());
    }
    if (depends_on & PIN_ON_ONEDNN) {
        const dnnl_version_t *version = dnnl_version();
        snprintf(name + used, (size_t)(PLATFORM_SIZE - used), "/onednn-%d.%d.%d-isa%x",
                 version->major, version->minor, version->patch,
                 (unsigned)dnnl_get_effective_cpu_isa());
    }
}

/* FNV-1a (Fowler, Noll and Vo) of `size` bytes, continued from `hash`. */
#define PIN_HASH_START 0xcbf29ce484222325u
static uint64_t pin_hash(uint64_t hash, const void *data, size_t size) {
    const unsigned char *bytes = data;
    for (size_t i = 0; i < size; i++) {
        hash = (hash ^ bytes[i]) * 0x100000001b3u;
    }
    return hash;
}

/* Writes the row when rows are asked for. */
static int row_written(const char *platform, const char *name, const char *value) {
    const char *path = getenv("PIN_ROWS");
    if (!path) {
        return 0;
    }
    rows = rows ? rows : fopen(path, "w");
    if (!rows) {
        fprintf(stderr, "PIN_ROWS=%s cannot be written\n", path);
        exit(2);
    }
    fprintf(rows, "%s %s %s\n", platform, name, value);
    return 1;
}

/* The value of a row, or 0. */
static int row_find(const char *platform, const char *name, char value[64]) {
    FILE *file = fopen(PIN_FILE, "r");
    char line[512], row_platform[PLATFORM_SIZE], row_name[128];
    int found = 0;
    while (file && !found && fgets(line, sizeof line, file)) {
        found = line[0] != '#' &&
                sscanf(line, "%255s %127s %63s", row_platform, row_name, value) == 3 &&
                strcmp(row_platform, platform) == 0 && strcmp(row_name, name) == 0;
    }
    if (file) {
        fclose(file);
    }
    return found;
}

/* Compares with the row of this platform. Nothing fails when the platform has no row; pin_finish
 * says so. */
static void pin_exact(const char *name, unsigned depends_on, uint64_t hash) {
    char platform[PLATFORM_SIZE], value[64], pinned[64];
    platform_name(depends_on, platform);
    snprintf(value, sizeof value, "%016llx", (unsigned long long)hash);
    if (row_written(platform, name, value)) {
        return;
    }
    if (!row_find(platform, name, pinned)) {
        missing++;
    } else if (strcmp(value, pinned) != 0) {
        wrong++;
        printf("%s: %s, pinned is %s; " PIN_RENEW "\n", name, value, pinned);
    } else {
        compared++;
    }
}

/* Compares with the row that holds everywhere: |value - pinned| <= tolerance |pinned|. */
static void pin_near(const char *name, double value, double tolerance) {
    char text[64], pinned[64];
    snprintf(text, sizeof text, "%.12g", value);
    const int found = row_find("any", name, pinned);
    const double wanted = found ? atof(pinned) : NAN;
    const double share = fabs(value - wanted) / (tolerance * fabs(wanted));
    const int holds = share <= 1; /* not when it is NaN */
    if (row_written("any", name, holds ? pinned : text)) {
        return; /* what holds stays, or every compiler would write its own last digit */
    }
    if (!found) {
        printf("%s: %s is pinned nowhere; " PIN_RENEW "\n", name, text);
    } else if (!holds) {
        printf("%s: %s, pinned is %s within %g of it; " PIN_RENEW "\n", name, text, pinned,
               tolerance);
    } else if (share >= worst) {
        worst = share;
        snprintf(worst_name, sizeof worst_name, "%s", name);
    }
    compared += holds;
    wrong += !holds;
}

/* The platform's names and how many numbers are pinned here, on standard output; the number of
 * pins that differ. With PIN_ROWS=FILE in the environment nothing is compared: all rows are written
 * to FILE, for scripts/pin.sh. */
static int pin_finish(void) {
    char platform[PLATFORM_SIZE];
    platform_name(PIN_ON_MUJOCO | PIN_ON_ONEDNN, platform);
    printf("%s: %d pins hold, %d differ; plain numbers differ by at most %.2g of their tolerance "
           "(%s)\n",
           platform, compared, wrong, worst, worst_name);
    if (missing) {
        printf("nothing is pinned on this platform for %d hashes, so they are not compared; "
               "scripts/pin.sh \"reason\" pins them\n",
               missing);
    }
    if (rows && fclose(rows) != 0) {
        fprintf(stderr, "rows cannot be written\n");
        wrong++;
    }
    return wrong;
}

#endif
