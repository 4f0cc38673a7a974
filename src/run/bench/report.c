#include "run/bench/report.h"

#include <assert.h>
#include <stdio.h>

void bench_add(BenchReport *report, const char *bench, const char *name, double value,
               const char *unit) {
    assert(report->count < BENCH_ROWS_MAX);
    BenchRow *row = &report->rows[report->count++];
    *row = (BenchRow){.bench = bench, .unit = unit, .value = value};
    snprintf(row->name, sizeof row->name, "%s", name);
}
