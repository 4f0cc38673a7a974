/* What the tests of benches share. */
#ifndef BENCH_KIT_H
#define BENCH_KIT_H

#include "bench/bench.h"
#include "kit.h"

/* The value of a row; fails where there is none. */
static inline double value_of(const BenchReport *report, const char *name) {
    for (int i = 0; i < report->count; i++) {
        if (strcmp(report->rows[i].name, name) == 0) {
            return report->rows[i].value;
        }
    }
    fail_msg("no row %s", name);
    return NAN;
}

#endif
