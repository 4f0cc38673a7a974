/* The rows that a bench measured; the command prints and saves them. */
#ifndef BENCH_REPORT_H
#define BENCH_REPORT_H

enum { BENCH_ROWS_MAX = 128 };

typedef struct {
    const char *bench, *unit;
    char name[40]; /* the case */
    double value;
} BenchRow;

typedef struct {
    BenchRow rows[BENCH_ROWS_MAX];
    int count;
} BenchReport;

void bench_add(BenchReport *report, const char *bench, const char *name, double value,
               const char *unit);

#endif
