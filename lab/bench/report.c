#include "bench/bench.h"

#include <stdio.h>
#include <stdlib.h>

void bench_add(BenchReport *report, const char *bench, const char *name, double value,
               const char *unit) {
    if (report->count == report->room) {
        const int room = 2 * report->room + 8;
        BenchRow *more = realloc(report->rows, (size_t)room * sizeof *more);
        if (!more) {
            report->is_short = 1;
            return;
        }
        report->rows = more;
        report->room = room;
    }
    BenchRow *row = &report->rows[report->count++];
    *row = (BenchRow){.bench = bench, .unit = unit, .value = value};
    snprintf(row->name, sizeof row->name, "%s", name);
}

void bench_report_free(BenchReport *report) {
    free(report->rows);
    *report = (BenchReport){0};
}
