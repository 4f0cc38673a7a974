/* The rows that a bench measured; the command prints and saves them. */
#ifndef BENCH_REPORT_H
#define BENCH_REPORT_H

typedef struct {
    const char *bench, *unit;
    char name[40]; /* the case */
    double value;
} BenchRow;

/* Zeroed: empty. */
typedef struct {
    BenchRow *rows; /* owned */
    int count, room;
    int is_short; /* bool: memory ran out, and a row is missing */
} BenchReport;

/* Memory can run out: the report is short then, and whoever reads its rows must ask. */
void bench_add(BenchReport *report, const char *bench, const char *name, double value,
               const char *unit);
void bench_report_free(BenchReport *report);

#endif
