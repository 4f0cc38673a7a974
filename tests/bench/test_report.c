/* A report takes as many rows as all benches have together, and more. */
#include "bench_kit.h"

TEST(a_report_takes_every_row) {
    enum { ROWS = 1000 };
    BenchReport report = {0};
    char name[16];
    for (int i = 0; i < ROWS; i++) {
        snprintf(name, sizeof name, "row_%d", i);
        bench_add(&report, "all", name, i, "-");
    }
    assert_true(report.count == ROWS && !report.is_short);
    for (int i = 0; i < ROWS; i++) {
        snprintf(name, sizeof name, "row_%d", i);
        assert_true(value_of(&report, name) == i && report.rows[i].value == i);
    }
    bench_report_free(&report);
}

TEST_MAIN(NULL, NULL)
